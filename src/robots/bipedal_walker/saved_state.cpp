// Saves and loads BipedalWalker's state: its own members and the Box2D world.
#include "base/state_bytes.h"
#include "robots/bipedal_walker/bipedal_walker.h"
#include "robots/bipedal_walker/world_state.h"

namespace walker::bipedal_walker {
namespace {

void write_lidar(const LidarScan& scan, StateWriter& writer) {
  for (const RayHit& ray : scan) {
    writer.number(ray.fraction);
    writer.number(std::uint8_t{ray.hit});
  }
}

LidarScan read_lidar(StateReader& reader) {
  LidarScan scan;
  for (RayHit& ray : scan) {
    ray.fraction = reader.number<float>();
    ray.hit = reader.flag();
  }
  return scan;
}

}  // namespace

/// Terrain and clouds are not written; `load` draws them again from the generator's state.
void BipedalWalker::save(StateWriter& writer) const {
  writer.number(std::uint8_t{has_world()});
  if (!has_world()) return;
  writer.numbers(terrain_origin_.data(), terrain_origin_.size());
  const std::optional<double>& shaping = reward_.previous_shaping();
  writer.number(std::uint8_t{shaping.has_value()});
  writer.number(shaping.value_or(0));
  writer.number(velocity_before_step_.x);
  writer.number(velocity_before_step_.y);
  write_lidar(lidar_, writer);
  WorldState::save(*physics_, writer);
}

std::function<void()> BipedalWalker::load(StateReader& reader) {
  if (!reader.flag()) {  // the next reset makes a world
    return [this] {
      physics_.reset();
      world_is_broken_ = false;
    };
  }
  GeneratorState terrain_origin{};
  reader.numbers(terrain_origin.data(), terrain_origin.size());
  const bool has_shaping = reader.flag();
  const auto shaping = reader.number<double>();
  b2Vec2 velocity_before_step;
  velocity_before_step.x = reader.number<float>();
  velocity_before_step.y = reader.number<float>();
  const LidarScan lidar = read_lidar(reader);
  const bool is_same_terrain = has_world() && terrain_origin == terrain_origin_;
  Terrain terrain;
  Clouds clouds{};
  if (!is_same_terrain) {
    Generator generator(terrain_origin);
    terrain = generate_terrain(generator, options_.hardcore);
    clouds = generate_clouds(generator);
  }
  WorldState world = WorldState::read(reader, is_same_terrain ? terrain_ : terrain);
  return [this, is_same_terrain, terrain_origin, clouds, has_shaping, shaping, velocity_before_step,
          lidar, terrain = std::move(terrain), world = std::move(world)] {
    if (!is_same_terrain) {
      world_is_broken_ = true;  // until `build` has returned
      physics_.emplace();
      physics_->build(terrain, 0);
      world_is_broken_ = false;
      terrain_origin_ = terrain_origin;
      terrain_ = terrain;
      clouds_ = clouds;
    }
    world.restore(*physics_);
    reward_.set_previous_shaping(has_shaping ? std::optional<double>(shaping) : std::nullopt);
    velocity_before_step_ = velocity_before_step;
    lidar_ = lidar;
  };
}

}  // namespace walker::bipedal_walker
