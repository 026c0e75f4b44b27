#include "robots/level.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "base/shortest_text.h"

namespace walker {
namespace {

constexpr double kScale = 30;  // of Gymnasium's slopes [1/m]

double sign(double value) { return static_cast<double>((value > 0) - (value < 0)); }

/// Lengths in steps are compared with this tolerance, so that 4 steps can be given as 1.8666667 m.
constexpr double kTolerance = 1e-6;

std::int64_t ceiling_of(double steps) {
  return static_cast<std::int64_t>(std::ceil(steps - kTolerance));
}

/// State machine that generates the ground from left to right, section by section.
class GroundGenerator {
 public:
  GroundGenerator(Generator& generator, const GroundSize& size, bool hardcore, const Level& level)
      : generator_(generator),
        level_(level),
        size_(size),
        column_(size.column),
        pit_depth_(kPitDepth * size.column),
        // Gymnasium's slopes are metres per column of kTerrainStep.
        slope_factor_(level.ground_roughness * (size.column / kTerrainStep)),
        y_(size.start_height) {
    // The order of the kinds is that of the numbers that Gymnasium and POET draw.
    ground_.obstacles_are_gymnasiums = !level.has_obstacles();
    hardcore = hardcore && ground_.obstacles_are_gymnasiums;
    if (hardcore || level.stumps) kinds_.push_back(ObstacleKind::stump);
    if (hardcore || level.stairs) kinds_.push_back(ObstacleKind::stairs);
    if (hardcore || level.pit_gap) kinds_.push_back(ObstacleKind::pit);
  }

  Ground generate() {
    ground_.points.resize(static_cast<std::size_t>(size_.num_columns));
    for (int i = 0; i < size_.num_columns; ++i) {
      const double x = i * column_;
      setback_ = 0;
      if (entering_) {
        enter_section(x);
      } else {
        continue_section(i);
      }
      ground_.points[static_cast<std::size_t>(i)] = {x - setback_, y_};
      // Gymnasium's picture of the ground ends at 0, above which all of a level may not be.
      if (!level_.is_gymnasiums()) {
        ground_.bottom = std::min(ground_.bottom, y_ - size_.start_height);
      }
      choose_next_section();
    }
    return std::move(ground_);
  }

 private:
  void enter_section(double x) {
    if (section_ == ObstacleKind::stump) enter_stump(x);
    if (section_ == ObstacleKind::stairs) enter_stairs(x);
    if (section_ == ObstacleKind::pit) enter_pit(x);
  }

  void continue_section(int i) {
    if (!section_) {
      velocity_ = 0.8 * velocity_ + 0.01 * sign(size_.start_height - y_);
      if (i > kTerrainStartPad) velocity_ += generator_.uniform(-1, 1) / kScale;
      y_ += slope_factor_ * velocity_;
    } else if (section_ == ObstacleKind::stairs) {
      y_ = level_.stairs ? height_beside(*level_.stairs) : height_beside_gymnasiums_stairs();
    } else if (section_ == ObstacleKind::pit) {
      y_ = section_y_;
      if (remaining_ > 1) y_ -= pit_depth_;
      if (remaining_ == 1) setback_ = pit_setback_;
    }
  }

  void enter_pit(double x) {
    section_y_ = y_;
    if (level_.pit_gap) {
      // POET's parameter is the gap in steps, to which it adds the width of the first wall.
      const double to_second_wall = 1 + *level_.pit_gap / column_;
      begin_obstacle(ObstacleKind::pit, x, x + (to_second_wall + 1) * column_);
      remaining_ = ceiling_of(to_second_wall);
      pit_setback_ = (static_cast<double>(remaining_) - to_second_wall) * column_;
      add_box(x, y_ - pit_depth_, column_, pit_depth_);
      add_box(x + to_second_wall * column_, y_ - pit_depth_, column_, pit_depth_);
      remaining_ += 2;
      return;
    }
    remaining_ = generator_.integers(3, 5);
    std::array<Point, 4> wall{
        {{x, y_}, {x + column_, y_}, {x + column_, y_ - pit_depth_}, {x, y_ - pit_depth_}}};
    ground_.obstacles.push_back(wall);
    for (Point& point : wall) point.x += column_ * static_cast<double>(remaining_);
    ground_.obstacles.push_back(wall);
    remaining_ += 2;
  }

  void enter_stump(double x) {
    if (level_.stumps) {
      const auto& [width, height, clearance] = *level_.stumps;
      remaining_ = ceiling_of(width / column_);
      begin_obstacle(ObstacleKind::stump, x, x + width);
      add_box(x, y_ + clearance, width, height);
      return;
    }
    remaining_ = generator_.integers(1, 3);
    const double size = static_cast<double>(remaining_) * column_;
    add_box(x, y_, size, size);
  }

  void enter_stairs(double x) {
    stair_height_ = generator_.random() > 0.5 ? +1 : -1;
    section_y_ = y_;
    if (level_.stairs) {
      const auto& [width, rise, max_treads, varies] = *level_.stairs;
      stair_steps_ = varies ? generator_.integers(0, max_treads + 1) : max_treads;
      const double length = static_cast<double>(stair_steps_) * width;
      if (stair_steps_ > 0) begin_obstacle(ObstacleKind::stairs, x, x + length);
      for (int s = 0; s < stair_steps_; ++s) {
        const double top = y_ + s * rise * static_cast<double>(stair_height_);
        add_box(x + s * width, top - rise, width, rise);
      }
      remaining_ = ceiling_of(length / column_) + 1;
      stair_columns_ = remaining_;
      return;
    }
    stair_width_ = generator_.integers(4, 5);
    stair_steps_ = generator_.integers(3, 5);
    for (std::int64_t s = 0; s < stair_steps_; ++s) {
      const double left = x + static_cast<double>(s * stair_width_) * column_;
      const double right = x + static_cast<double>((1 + s) * stair_width_) * column_;
      const double top = y_ + static_cast<double>(s * stair_height_) * column_;
      const double bottom = y_ + static_cast<double>(-1 + s * stair_height_) * column_;
      ground_.obstacles.push_back({{{left, top}, {right, top}, {right, bottom}, {left, bottom}}});
    }
    remaining_ = stair_steps_ * stair_width_;
  }

  double height_beside_gymnasiums_stairs() const {
    const auto step = static_cast<double>(stair_steps_ * stair_width_ - remaining_ - stair_height_);
    const double n = step / static_cast<double>(stair_width_);
    return section_y_ + (n * static_cast<double>(stair_height_)) * column_;
  }

  /// Returns the ground's height: the top of the tread on the way up, its lower end on the way
  /// down.
  double height_beside(const Stairs& stairs) const {
    const auto column = static_cast<double>(stair_columns_ - 1 - remaining_);
    const double tread = std::min(std::floor(column * column_ / stairs.tread_width + kTolerance),
                                  static_cast<double>(stair_steps_ - 1));
    return section_y_ + (stair_height_ > 0 ? tread : -(tread + 1)) * stairs.rise;
  }

  void begin_obstacle(ObstacleKind kind, double left, double right) {
    ground_.of_level.push_back({kind, left, right, y_, ground_.obstacles.size(), 0});
  }

  /// Adds a box to a level's obstacle.
  void add_box(double left, double bottom, double width, double height) {
    if (!ground_.obstacles_are_gymnasiums) ++ground_.of_level.back().num_boxes;
    ground_.obstacles.push_back({{{left, bottom},
                                  {left + width, bottom},
                                  {left + width, bottom + height},
                                  {left, bottom + height}}});
  }

  void choose_next_section() {
    entering_ = false;
    --remaining_;
    if (remaining_ != 0) return;
    if (level_.obstacle_spacing) {
      remaining_ = std::max(std::lround(*level_.obstacle_spacing / column_), 1L);
    } else {
      remaining_ = generator_.integers(kTerrainGrass / 2, kTerrainGrass);
    }
    if (section_ || kinds_.empty()) {
      section_.reset();
    } else {
      const auto count = static_cast<std::int64_t>(kinds_.size());
      section_ = kinds_[static_cast<std::size_t>(generator_.integers(1, 1 + count) - 1)];
    }
    entering_ = true;
  }

  Generator& generator_;
  const Level& level_;
  const GroundSize& size_;
  double column_;        // width [m]
  double pit_depth_;     // [m]
  double slope_factor_;  // of Gymnasium's slopes
  std::vector<ObstacleKind> kinds_;
  Ground ground_;
  std::optional<ObstacleKind> section_;        // empty: grass
  bool entering_ = false;                      // this step is the first of its section
  std::int64_t remaining_ = kTerrainStartPad;  // remaining steps of the section
  double y_;
  double velocity_ = 0;     // slope of the grass, metres per step
  double section_y_ = 0;    // ground height at the start of the obstacle [m]
  double setback_ = 0;      // distance of the ground's point from its column, to the left [m]
  double pit_setback_ = 0;  // of the point behind the pit [m]
  std::int64_t stair_columns_ = 0;  // of a level's stairs
  std::int64_t stair_steps_ = 0;
  std::int64_t stair_width_ = 0;
  std::int64_t stair_height_ = 0;  // +1 up, -1 down
};

/// Whether a world names a size of this kind of obstacle, such as stump_width for "stump_". No
/// other parameter begins with such a prefix.
template <typename Values>
bool has_size_of(const Values& values, const std::string& kind) {
  const auto first = values.lower_bound(kind);
  return first != values.end() && first->first.rfind(kind, 0) == 0;
}

}  // namespace

Ground draw_ground(Generator& generator, const GroundSize& size, bool hardcore,
                   const Level& level) {
  return GroundGenerator(generator, size, hardcore, level).generate();
}

Level level_of(const WorldValues& values, const GroundSize& size, double roughness) {
  Level level;
  level.ground_roughness = value_or(values, "ground_roughness", roughness);
  const auto optional = [&](const char* name) {
    return values.count(name) != 0 ? std::optional<double>(values.at(name)) : std::nullopt;
  };
  level.obstacle_spacing = optional("obstacle_spacing");
  level.pit_gap = optional("pit_gap");
  if (has_size_of(values, "stump_")) {
    level.stumps = {value_or(values, "stump_width", size.stumps.width),
                    value_or(values, "stump_height", size.stumps.height),
                    value_or(values, "stump_float", size.stumps.clearance)};
  }
  if (has_size_of(values, "stair_")) {
    level.stairs = {value_or(values, "stair_width", size.stairs.tread_width),
                    value_or(values, "stair_height", size.stairs.rise),
                    static_cast<int>(value_or(values, "stair_steps", size.stairs.num_treads)),
                    value_or(values, "stair_steps_vary", 0) != 0};
  }
  return level;
}

std::vector<WorldParameter> level_parameters(const LevelLimits& limits, const LevelTexts& texts) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const std::string pits = "Pits" + texts.instead + ": ";
  const std::string stumps = "Stumps" + texts.instead + ": ";
  const std::string stairs = "Stairs, up or down" + texts.instead + ": ";
  const std::string column = ", " + texts.column + " if only other sizes are named.";
  return {
      {"ground_roughness", "", texts.roughness, limits.roughness, 0, limits.max_roughness},
      {"pit_gap", "m", pits + "distance between the two walls.", kNone, 0, limits.max_gap},
      {"stump_width", "m", stumps + "width" + column, kNone, limits.stump_width.low,
       limits.stump_width.high},
      {"stump_height", "m", stumps + "height" + column, kNone, limits.stump_height.low,
       limits.stump_height.high},
      {"stump_float", "m", stumps + "height above the ground, 0 if only other sizes are named.",
       kNone, 0, limits.max_float},
      {"stair_width", "m",
       stairs + "width of a step, " + texts.tread + " if only other sizes are named.", kNone,
       limits.tread_width.low, limits.tread_width.high},
      {"stair_height", "m", stairs + "height of a step" + column, kNone, limits.rise.low,
       limits.rise.high},
      {"stair_steps", "",
       stairs + "number of steps, the first level with the ground if they go up; 3 if only other "
                "sizes are named.",
       kNone, 1, 10, true},
      {"stair_steps_vary", "",
       stairs +
           "1: each flight draws its own number of steps, from 0 to stair_steps; 0 or not set: "
           "all flights of an episode have stair_steps.",
       kNone, 0, 1, true},
      {"obstacle_spacing", "m", texts.spacing, kNone, limits.spacing.low, limits.spacing.high},
  };
}

void check_level(const World& world, const GroundSize& size, bool hardcore,
                 const std::string& advice) {
  if (has_size_of(world, "stair_")) {
    const double width = range_or(world, "stair_width", size.stairs.tread_width).high;
    const double steps = range_or(world, "stair_steps", size.stairs.num_treads).high;
    if (steps * width > size.obstacle_length()) {
      throw std::invalid_argument(
          "stair_steps = " + shortest_text(steps) + " of stair_width = " + shortest_text(width) +
          " m: the stairs would be " + shortest_text(steps * width) + " m long; must be at most " +
          shortest_text(size.obstacle_length()) + " m, the length of the course");
    }
  }
  const bool has_obstacles = hardcore || has_size_of(world, "stump_") ||
                             has_size_of(world, "stair_") || has_size_of(world, "pit_gap");
  const auto spacing = world.find("obstacle_spacing");
  if (spacing != world.end() && !has_obstacles) {
    throw std::invalid_argument("obstacle_spacing = " + shortest_text(spacing->second.high) +
                                " m: has no effect without obstacles; name also sizes of pits, "
                                "stumps or stairs" +
                                advice);
  }
}

}  // namespace walker
