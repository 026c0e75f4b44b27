#include "robots/mujoco/ground_contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "robots/mujoco/ground_line.h"

namespace walker::mujoco {
namespace {

/// Collects the contacts of one limb.
class ContactFinder {
 public:
  ContactFinder(const GroundLine& line, const GroundLimb& limb, double margin,
                LimbContact* contacts)
      : line_(line), limb_(limb), margin_(margin), contacts_(contacts) {}

  int run() {
    // As the engine tests a plane.
    if (limb_.centre_z - near_.top() > margin_ + limb_.bound) return 0;
    touch_with_end(0);
    if (square_length_ == 0) return count_;
    touch_with_end(1);
    touch_corners();
    return count_;
  }

 private:
  void add(double distance, double share, const Point& on_axis, const Point& normal) {
    if (count_ == kMaxLimbContacts) return;
    const double gap = distance - limb_.radius;
    const Point point = moved(on_axis, normal, -gap / 2 - limb_.radius);
    contacts_[count_++] = {gap, share, point.x, point.y, normal.x, normal.y};
  }

  void touch_with_end(std::size_t index) {
    const Point& end = ends_[index];
    const auto share = static_cast<double>(index);
    const Point inwards = ends_[1 - index] - end;
    if (near_.has_inside(end)) return leave(end, share);
    for (const GroundPiece& piece : near_) {
      const Point way = end - piece.from;
      const double height = dot(way, piece.normal());
      if (dot(way, piece.along) < 0) {
        // The side is nearer to the corner than the end if the corner is beside the axis.
        if (dot(way, piece.before) < 0 || dot(way, inwards) < 0) continue;
        const double distance = std::sqrt(dot(way, way));
        if (distance <= reach_) add(distance, share, end, {way.x / distance, way.y / distance});
      } else if (height >= 0 && height <= reach_ && dot(end - piece.to, piece.along) < 0) {
        add(height, share, end, piece.normal());
      }
    }
  }

  /// Adds the contact of an end that is in the ground.
  void leave(const Point& end, double share) {
    const double max_depth = top_around(line_, end.x) - end.y;
    double nearest = std::numeric_limits<double>::infinity();
    Point way_out{};
    for (const GroundPiece& piece : line_.between(end.x - max_depth, end.x + max_depth)) {
      const Point way = end - piece.from;
      if (dot(way, piece.along) < 0) {
        const double distance = std::sqrt(dot(way, way));
        if (distance >= nearest || distance == 0) continue;
        nearest = distance;
        way_out = {-way.x / distance, -way.y / distance};
      } else if (dot(end - piece.to, piece.along) < 0) {
        const double distance = -dot(way, piece.normal());
        if (distance < 0 || distance >= nearest) continue;
        nearest = distance;
        way_out = piece.normal();
      }
    }
    if (nearest < std::numeric_limits<double>::infinity()) add(-nearest, share, end, way_out);
  }

  /// Adds the contacts of the side with the corners below it.
  void touch_corners() {
    constexpr double kLean = 0.1;        // sine
    constexpr double kStraight = -1e-9;  // sine of the turn to the right at a corner
    const double length = std::sqrt(square_length_);
    const Point across{-axis_.y / length, axis_.x / length};
    for (const GroundPiece& piece : near_) {
      const double turn = piece.before.x * piece.along.y - piece.before.y * piece.along.x;
      if (turn > kStraight) continue;
      const Point& corner = piece.from;
      const double along_axis = dot(corner - ends_[1], axis_);
      if (!(0 < along_axis && along_axis < square_length_)) continue;
      const Point out{-piece.before.y - piece.along.y, piece.before.x + piece.along.x};
      const double side = dot(across, out) < 0 ? -1 : 1;
      const Point normal{side * across.x, side * across.y};
      if (dot(normal, piece.before) < -kLean || dot(normal, piece.along) > kLean) continue;
      const double distance = dot(ends_[1] - corner, normal);
      const double part = along_axis / square_length_;
      const Point on_axis = moved(ends_[1], axis_, part);
      if (distance > reach_ || (distance < 0 && !near_.has_inside(on_axis))) continue;
      add(distance, 1 - part, on_axis, normal);
    }
  }

  const GroundLine& line_;
  const GroundLimb& limb_;
  double margin_;
  LimbContact* contacts_;
  int count_ = 0;
  double reach_ = margin_ + limb_.radius;  // distance of an axis that touches [m]
  std::array<Point, 2> ends_{{{limb_.end_x[0], limb_.end_z[0]}, {limb_.end_x[1], limb_.end_z[1]}}};
  Point axis_ = ends_[0] - ends_[1];  // from the second end to the first
  double square_length_ = dot(axis_, axis_);
  GroundLine::Range near_ = line_.between(std::min(ends_[0].x, ends_[1].x) - reach_,
                                          std::max(ends_[0].x, ends_[1].x) + reach_);
};

}  // namespace

int find_contacts(const GroundLine& line, const GroundLimb& limb, double margin,
                  LimbContact* contacts) {
  return ContactFinder(line, limb, margin, contacts).run();
}

}  // namespace walker::mujoco
