// The state of a BipedalWalker as bytes: what it remembers itself, and its world.
#include "robots/bipedal_walker/bipedal_walker.h"
#include "robots/bipedal_walker/world_state.h"
#include "base/generator_bytes.h"
#include "base/state_bytes.h"

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

bool BipedalWalker::can_save_state() const { return WorldState::can_be_saved(); }

/// Terrain and clouds are drawn again, from where they were drawn.
void BipedalWalker::save_state(const Result& last, std::vector<std::byte>& state) const {
  if (!can_save_state()) return Environment::save_state(last, state);  // throws
  StateWriter writer(state);
  write_generator(generator_, writer);
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

Progress BipedalWalker::load_state(const std::byte* state, std::size_t size, Result* last) {
  if (!can_save_state()) return Environment::load_state(state, size, last);  // throws
  StateReader reader(state, size);
  const std::optional<Generator> generator = read_generator(reader);
  if (!reader.flag()) {  // the next reset makes a world
    reader.finish();
    if (last == nullptr) return {};
    generator_ = generator;
    physics_.reset();
    world_is_broken_ = false;
    return {};
  }
  const GeneratorState terrain_origin = read_generator_state(reader);
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
    Generator drawn(terrain_origin);
    terrain = generate_terrain(drawn, options_.hardcore);
    clouds = generate_clouds(drawn);
  }
  const WorldState world = WorldState::read(reader, is_same_terrain ? terrain_ : terrain);
  reader.finish();
  if (last == nullptr) return {};
  // From here on nothing fails but for want of memory.
  if (!is_same_terrain) {
    world_is_broken_ = true;  // until it stands
    physics_.emplace();
    physics_->build(terrain, 0);
    world_is_broken_ = false;
    terrain_origin_ = terrain_origin;
    terrain_ = std::move(terrain);
    clouds_ = clouds;
  }
  world.put_into(*physics_);
  generator_ = generator;
  reward_.set_previous_shaping(has_shaping ? std::optional<double>(shaping) : std::nullopt);
  velocity_before_step_ = velocity_before_step;
  lidar_ = lidar;
  return {};
}

}  // namespace walker::bipedal_walker
