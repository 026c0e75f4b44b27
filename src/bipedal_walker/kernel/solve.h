// The kernel's face, of one width: problems of any number of worlds, W at a time.
#pragma once

#include <algorithm>

#include "bipedal_walker/kernel/impact.h"
#include "bipedal_walker/kernel/island.h"
#include "bipedal_walker/kernel/rotation.h"

namespace walker::bipedal_walker::kernel {
inline namespace WALKER_SIM_INSTRUCTION_SET {

/// How many of `count` the lanes from `first` on hold.
template <int W>
int lanes_of(std::size_t first, std::size_t count) {
  return static_cast<int>(std::min<std::size_t>(W, count - first));
}

/// Positions of most worlds are near enough after this many iterations; the others', mostly, never.
constexpr int kFewIterations = 6;

template <int W>
void solve_islands(Island* const* islands, std::size_t count, const Model& model) {
  std::array<Island*, kMostIslands> far_off;
  std::size_t num_far_off = 0;
  const int few = std::min(kFewIterations, model.position_iterations);
  for (std::size_t i = 0; i < count; i += W) {
    const int num_lanes = lanes_of<W>(i, count);
    IslandLanes<W> lanes(islands + i, num_lanes, model);
    lanes.solve();
    lanes.correct(few);
    std::copy_if(islands + i, islands + i + num_lanes, far_off.begin() + num_far_off,
                 [](const Island* island) { return island->position_is_solved == 0; });
    num_far_off += static_cast<std::size_t>(
        std::count_if(islands + i, islands + i + num_lanes,
                      [](const Island* island) { return island->position_is_solved == 0; }));
  }
  for (std::size_t i = 0; i < num_far_off; i += W) {
    IslandLanes<W>(far_off.data() + i, lanes_of<W>(i, num_far_off), model)
        .correct(model.position_iterations - few);
  }
}

template <int W>
void solve_impacts(Impact* const* impacts, std::size_t count, const Model& model) {
  for (std::size_t i = 0; i < count; i += W) {
    ImpactLanes<W>(impacts + i, lanes_of<W>(i, count), model).solve();
  }
}

template <int W>
void rotate_all(const float* angles, std::size_t count, Rotation<float>* rotations) {
  for (std::size_t i = 0; i < count; i += W) {
    const int num_lanes = lanes_of<W>(i, count);
    Number<W> angle(0);
    for (int lane = 0; lane < num_lanes; ++lane) angle.set(lane, angles[i + lane]);
    const Rotation<Number<W>> rotation = rotation_of<W>(angle);
    for (int lane = 0; lane < num_lanes; ++lane) {
      rotations[i + lane] = {rotation.sine[lane], rotation.cosine[lane]};
    }
  }
}

template <int W>
constexpr Kernel make_kernel(const char* instruction_set) {
  return {instruction_set, W, solve_islands<W>, solve_impacts<W>, rotate_all<W>};
}

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::bipedal_walker::kernel
