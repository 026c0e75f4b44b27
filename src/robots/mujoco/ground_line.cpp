#include "robots/mujoco/ground_line.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "robots/mujoco/ground_contact.h"

namespace walker::mujoco {
namespace {

constexpr double kCell = 0.2;  // of the index of pieces [m]
constexpr double kReach = 2;   // of a robot [m]
constexpr std::size_t kCellsPerTop = 10;

}  // namespace

GroundLine::GroundLine(std::vector<Point> points, std::vector<std::vector<Point>> outlines)
    : first_(points.front().x) {
  const double end = points.back().x;
  points.insert(points.begin(), {first_ - kFarEnd, points.front().y});
  points.push_back({end + kFarEnd, points.back().y});
  pieces_.reserve(points.size() + 4 * outlines.size());
  add(std::move(points), false);
  for (std::vector<Point>& outline : outlines) add(std::move(outline), true);
  const auto by_left = [](const GroundPiece& a, const GroundPiece& b) {
    return a.left() < b.left();
  };
  if (!outlines.empty()) std::stable_sort(pieces_.begin(), pieces_.end(), by_left);
  const auto count = static_cast<std::size_t>(std::ceil((end - first_) / kCell)) + 1;
  in_cells_.reserve(count);
  const GroundPiece* piece = pieces_.data();
  for (std::size_t cell = 0; cell < count; ++cell) {
    const double left = first_ + static_cast<double>(cell) * kCell;
    while (piece->right() < left) ++piece;
    in_cells_.push_back(static_cast<std::int32_t>(piece - pieces_.data()));
    if (cell % kCellsPerTop != 0) continue;
    const double right = left + kCellsPerTop * kCell;
    tops_.push_back(between(left - kReach - kCell, right + kReach + kCell).top());
  }
}

void GroundLine::add(std::vector<Point> corners, bool is_closed) {
  std::size_t size = 0;
  for (const Point point : corners) {
    if (size > 0 && corners[size - 1].x == point.x && corners[size - 1].y == point.y) continue;
    const bool is_level =
        size > 1 && corners[size - 2].y == corners[size - 1].y && corners[size - 1].y == point.y;
    corners[is_level ? size - 1 : size++] = point;
  }
  corners.resize(size);
  if (is_closed) corners.push_back(corners.front());
  const std::size_t first = pieces_.size();
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    const Point way = corners[i + 1] - corners[i];
    const double length = std::sqrt(dot(way, way));
    const Point along{way.x / length, way.y / length};
    const Point before = i == 0 ? along : pieces_.back().along;
    pieces_.push_back({corners[i], corners[i + 1], along, before});
  }
  if (is_closed) pieces_[first].before = pieces_.back().along;
}

std::size_t GroundLine::cell_of(double x) const {
  const double cell = (x - first_) * (1 / kCell);
  const auto last = static_cast<double>(in_cells_.size() - 1);
  return cell > 0 ? static_cast<std::size_t>(std::min(cell, last)) : 0;
}

double top_around(const GroundLine& line, double x) {
  return line.tops_[line.cell_of(x) / kCellsPerTop];
}

GroundLine::Range GroundLine::between(double left, double right) const {
  const GroundPiece* const end = pieces_.data() + pieces_.size();
  // A cell further left, against rounding.
  const GroundPiece* first = pieces_.data() + in_cells_[cell_of(left - kCell)];
  while (first != end && first->right() < left) ++first;
  const GroundPiece* last = first;
  while (last != end && last->left() <= right) ++last;
  return {first, last};
}

double GroundLine::cast(const Point& origin, const Point& direction, double range) const {
  constexpr double kTolerance = 1e-9;  // so that no ray passes between two pieces [m]
  const double end = origin.x + direction.x * range;
  double nearest = std::numeric_limits<double>::infinity();
  for (const GroundPiece& piece : between(std::min(origin.x, end), std::max(origin.x, end))) {
    const Point normal = piece.normal();
    const double speed = dot(direction, normal);
    if (!(speed < 0)) continue;
    const double distance = -dot(origin - piece.from, normal) / speed;
    const Point hit = moved(origin, direction, distance);
    const bool is_on_piece = dot(hit - piece.from, piece.along) >= -kTolerance &&
                             dot(hit - piece.to, piece.along) <= kTolerance;
    if (0 <= distance && distance <= range && is_on_piece) nearest = std::min(nearest, distance);
  }
  return nearest;
}

}  // namespace walker::mujoco
