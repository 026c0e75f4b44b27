#include "robots/bipedal_walker/terrain.h"

#include <cmath>

namespace walker::bipedal_walker {
namespace {

// Numbers that Gymnasium draws.
enum class Section { grass = 0, stump = 1, stairs = 2, pit = 3 };
constexpr std::int64_t kFirstObstacle = 1;
constexpr std::int64_t kSectionCount = 4;

double sign(double value) { return static_cast<double>((value > 0) - (value < 0)); }

/// State machine that generates the ground from left to right, section by section.
class TerrainGenerator {
 public:
  TerrainGenerator(Generator& generator, bool hardcore)
      : generator_(generator), hardcore_(hardcore) {}

  Terrain generate() {
    for (int i = 0; i < kTerrainLength; ++i) {
      const double x = i * kTerrainStep;
      if (entering_) {
        enter_section(x);
      } else {
        continue_section(i);
      }
      terrain_.ground[static_cast<std::size_t>(i)] = {x, y_};
      choose_next_section();
    }
    return std::move(terrain_);
  }

 private:
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
        y_ += velocity_;
        break;
      case Section::stump:
        break;
      case Section::stairs: {
        const auto step =
            static_cast<double>(stair_steps_ * stair_width_ - remaining_ - stair_height_);
        const double n = step / static_cast<double>(stair_width_);
        y_ = section_y_ + (n * static_cast<double>(stair_height_)) * kTerrainStep;
        break;
      }
      case Section::pit:
        y_ = section_y_;
        if (remaining_ > 1) y_ -= 4 * kTerrainStep;
        break;
    }
  }

  void enter_pit(double x) {
    remaining_ = generator_.integers(3, 5);
    std::array<Point, 4> wall{{{x, y_},
                               {x + kTerrainStep, y_},
                               {x + kTerrainStep, y_ - 4 * kTerrainStep},
                               {x, y_ - 4 * kTerrainStep}}};
    terrain_.obstacles.push_back(wall);
    for (Point& point : wall) point.x += kTerrainStep * static_cast<double>(remaining_);
    terrain_.obstacles.push_back(wall);
    remaining_ += 2;
    section_y_ = y_;
  }

  void enter_stump(double x) {
    remaining_ = generator_.integers(1, 3);
    const double size = static_cast<double>(remaining_) * kTerrainStep;
    terrain_.obstacles.push_back(
        {{{x, y_}, {x + size, y_}, {x + size, y_ + size}, {x, y_ + size}}});
  }

  void enter_stairs(double x) {
    stair_height_ = generator_.random() > 0.5 ? +1 : -1;
    stair_width_ = generator_.integers(4, 5);
    stair_steps_ = generator_.integers(3, 5);
    section_y_ = y_;
    for (std::int64_t s = 0; s < stair_steps_; ++s) {
      const double left = x + static_cast<double>(s * stair_width_) * kTerrainStep;
      const double right = x + static_cast<double>((1 + s) * stair_width_) * kTerrainStep;
      const double top = y_ + static_cast<double>(s * stair_height_) * kTerrainStep;
      const double bottom = y_ + static_cast<double>(-1 + s * stair_height_) * kTerrainStep;
      terrain_.obstacles.push_back({{{left, top}, {right, top}, {right, bottom}, {left, bottom}}});
    }
    remaining_ = stair_steps_ * stair_width_;
  }

  void choose_next_section() {
    entering_ = false;
    --remaining_;
    if (remaining_ != 0) return;
    remaining_ = generator_.integers(kTerrainGrass / 2, kTerrainGrass);
    const bool obstacle_next = section_ == Section::grass && hardcore_;
    section_ = obstacle_next
                   ? static_cast<Section>(generator_.integers(kFirstObstacle, kSectionCount))
                   : Section::grass;
    entering_ = true;
  }

  Generator& generator_;
  bool hardcore_;
  Terrain terrain_;
  Section section_ = Section::grass;
  bool entering_ = false;                      // this step is the first of its section
  std::int64_t remaining_ = kTerrainStartPad;  // remaining steps of the section
  double y_ = kTerrainHeight;
  double velocity_ = 0;   // slope of the grass, metres per step
  double section_y_ = 0;  // ground height at the start of the obstacle [m]
  std::int64_t stair_steps_ = 0;
  std::int64_t stair_width_ = 0;
  std::int64_t stair_height_ = 0;  // +1 up, -1 down
};

}  // namespace

Terrain generate_terrain(Generator& generator, bool hardcore) {
  return TerrainGenerator(generator, hardcore).generate();
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
