#include "robots/bipedal_walker/terrain.h"

#include <algorithm>
#include <cmath>

namespace walker::bipedal_walker {
namespace {

enum class Section { grass, stump, stairs, pit };

constexpr double kPitDepth = 4 * kTerrainStep;  // [m]

double sign(double value) { return static_cast<double>((value > 0) - (value < 0)); }

/// Lengths in steps are compared with this tolerance, so that 4 steps can be given as 1.8666667 m.
constexpr double kTolerance = 1e-6;

double floor_of(double steps) { return std::floor(steps + kTolerance); }

std::int64_t ceiling_of(double steps) {
  return static_cast<std::int64_t>(std::ceil(steps - kTolerance));
}

/// State machine that generates the ground from left to right, section by section.
class TerrainGenerator {
 public:
  TerrainGenerator(Generator& generator, bool hardcore, const Level& level)
      : generator_(generator), level_(level) {
    // The order of the kinds is that of the numbers that Gymnasium and POET draw.
    terrain_.obstacles_are_gymnasiums = !level.has_obstacles();
    hardcore = hardcore && terrain_.obstacles_are_gymnasiums;
    if (hardcore || level.stumps) add_kind(Section::stump);
    if (hardcore || level.stairs) add_kind(Section::stairs);
    if (hardcore || level.pit_gap) add_kind(Section::pit);
  }

  Terrain generate() {
    for (int i = 0; i < kTerrainLength; ++i) {
      const double x = i * kTerrainStep;
      setback_ = 0;
      if (entering_) {
        enter_section(x);
      } else {
        continue_section(i);
      }
      terrain_.ground[static_cast<std::size_t>(i)] = {x - setback_, y_};
      choose_next_section();
    }
    if (!level_.is_gymnasiums()) set_bottom();
    return std::move(terrain_);
  }

 private:
  void add_kind(Section kind) { kinds_[static_cast<std::size_t>(num_kinds_++)] = kind; }

  void enter_section(double x) {
    switch (section_) {
      case Section::grass:
        return;
      case Section::stump:
        return enter_stump(x);
      case Section::stairs:
        return enter_stairs(x);
      case Section::pit:
        return enter_pit(x);
    }
  }

  void continue_section(int i) {
    switch (section_) {
      case Section::grass:
        velocity_ = 0.8 * velocity_ + 0.01 * sign(kTerrainHeight - y_);
        if (i > kTerrainStartPad) velocity_ += generator_.uniform(-1, 1) / kScale;
        y_ += level_.ground_roughness * velocity_;
        break;
      case Section::stump:
        break;
      case Section::stairs:
        y_ = level_.stairs ? height_beside(*level_.stairs) : height_beside_gymnasiums_stairs();
        break;
      case Section::pit:
        y_ = section_y_;
        if (remaining_ > 1) y_ -= kPitDepth;
        if (remaining_ == 1) setback_ = pit_setback_;
        break;
    }
  }

  void enter_pit(double x) {
    section_y_ = y_;
    if (level_.pit_gap) {
      // POET's parameter is the gap in steps, to which it adds the width of the first wall.
      const double to_second_wall = 1 + *level_.pit_gap / kTerrainStep;
      remaining_ = ceiling_of(to_second_wall);
      pit_setback_ = (static_cast<double>(remaining_) - to_second_wall) * kTerrainStep;
      add_box(x, y_ - kPitDepth, kTerrainStep, kPitDepth);
      add_box(x + to_second_wall * kTerrainStep, y_ - kPitDepth, kTerrainStep, kPitDepth);
      remaining_ += 2;
      return;
    }
    remaining_ = generator_.integers(3, 5);
    std::array<Point, 4> wall{
        {{x, y_}, {x + kTerrainStep, y_}, {x + kTerrainStep, y_ - kPitDepth}, {x, y_ - kPitDepth}}};
    terrain_.obstacles.push_back(wall);
    for (Point& point : wall) point.x += kTerrainStep * static_cast<double>(remaining_);
    terrain_.obstacles.push_back(wall);
    remaining_ += 2;
  }

  void enter_stump(double x) {
    if (level_.stumps) {
      const auto& [width, height, clearance] = *level_.stumps;
      remaining_ = ceiling_of(width / kTerrainStep);
      add_box(x, y_ + clearance, width, height);
      return;
    }
    remaining_ = generator_.integers(1, 3);
    const double size = static_cast<double>(remaining_) * kTerrainStep;
    add_box(x, y_, size, size);
  }

  void enter_stairs(double x) {
    stair_height_ = generator_.random() > 0.5 ? +1 : -1;
    section_y_ = y_;
    if (level_.stairs) {
      const auto& [width, rise, num_treads] = *level_.stairs;
      for (int s = 0; s < num_treads; ++s) {
        const double top = y_ + s * rise * static_cast<double>(stair_height_);
        add_box(x + s * width, top - rise, width, rise);
      }
      remaining_ = ceiling_of(num_treads * width / kTerrainStep) + 1;
      stair_columns_ = remaining_;
      return;
    }
    stair_width_ = generator_.integers(4, 5);
    stair_steps_ = generator_.integers(3, 5);
    for (std::int64_t s = 0; s < stair_steps_; ++s) {
      const double left = x + static_cast<double>(s * stair_width_) * kTerrainStep;
      const double right = x + static_cast<double>((1 + s) * stair_width_) * kTerrainStep;
      const double top = y_ + static_cast<double>(s * stair_height_) * kTerrainStep;
      const double bottom = y_ + static_cast<double>(-1 + s * stair_height_) * kTerrainStep;
      terrain_.obstacles.push_back({{{left, top}, {right, top}, {right, bottom}, {left, bottom}}});
    }
    remaining_ = stair_steps_ * stair_width_;
  }

  double height_beside_gymnasiums_stairs() const {
    const auto step = static_cast<double>(stair_steps_ * stair_width_ - remaining_ - stair_height_);
    const double n = step / static_cast<double>(stair_width_);
    return section_y_ + (n * static_cast<double>(stair_height_)) * kTerrainStep;
  }

  /// Returns the ground's height: the top of the tread on the way up, its lower end on the way
  /// down.
  double height_beside(const Stairs& stairs) const {
    const auto column = static_cast<double>(stair_columns_ - 1 - remaining_);
    const double tread = std::min(floor_of(column * kTerrainStep / stairs.tread_width),
                                  static_cast<double>(stairs.num_treads - 1));
    return section_y_ + (stair_height_ > 0 ? tread : -(tread + 1)) * stairs.rise;
  }

  void add_box(double left, double bottom, double width, double height) {
    terrain_.obstacles.push_back({{{left, bottom},
                                   {left + width, bottom},
                                   {left + width, bottom + height},
                                   {left, bottom + height}}});
  }

  /// Gymnasium's picture of the ground ends at 0, above which all of a level may not be.
  void set_bottom() {
    for (const Point& point : terrain_.ground) {
      terrain_.bottom = std::min(terrain_.bottom, point.y - kTerrainHeight);
    }
  }

  void choose_next_section() {
    entering_ = false;
    --remaining_;
    if (remaining_ != 0) return;
    if (level_.obstacle_spacing) {
      remaining_ = std::max(std::lround(*level_.obstacle_spacing / kTerrainStep), 1L);
    } else {
      remaining_ = generator_.integers(kTerrainGrass / 2, kTerrainGrass);
    }
    const bool obstacle_next = section_ == Section::grass && num_kinds_ != 0;
    section_ = Section::grass;
    if (obstacle_next) {
      section_ = kinds_[static_cast<std::size_t>(generator_.integers(1, 1 + num_kinds_) - 1)];
    }
    entering_ = true;
  }

  Generator& generator_;
  const Level& level_;
  std::array<Section, 3> kinds_{};  // of obstacles
  std::int64_t num_kinds_ = 0;
  Terrain terrain_;
  Section section_ = Section::grass;
  bool entering_ = false;                      // this step is the first of its section
  std::int64_t remaining_ = kTerrainStartPad;  // remaining steps of the section
  double y_ = kTerrainHeight;
  double velocity_ = 0;     // slope of the grass, metres per step
  double section_y_ = 0;    // ground height at the start of the obstacle [m]
  double setback_ = 0;      // distance of the ground's point from its column, to the left [m]
  double pit_setback_ = 0;  // of the point behind the pit [m]
  std::int64_t stair_columns_ = 0;  // of a level's stairs
  std::int64_t stair_steps_ = 0;
  std::int64_t stair_width_ = 0;
  std::int64_t stair_height_ = 0;  // +1 up, -1 down
};

}  // namespace

Terrain generate_terrain(Generator& generator, bool hardcore, const Level& level) {
  return TerrainGenerator(generator, hardcore, level).generate();
}

Clouds generate_clouds(Generator& generator) {
  Clouds clouds{};
  const double y = kViewportHeight / kScale * 3 / 4;
  for (Cloud& cloud : clouds) {
    const double x = generator.uniform(0, kTerrainLength) * kTerrainStep;
    for (std::size_t a = 0; a < cloud.size(); ++a) {
      const double angle = 3.14 * 2 * static_cast<double>(a) / 5;
      const double left = x + 15 * kTerrainStep * std::sin(angle);
      cloud[a].x = left + generator.uniform(0, 5 * kTerrainStep);
      const double low = y + 5 * kTerrainStep * std::cos(angle);
      cloud[a].y = low + generator.uniform(0, 5 * kTerrainStep);
    }
  }
  return clouds;
}

}  // namespace walker::bipedal_walker
