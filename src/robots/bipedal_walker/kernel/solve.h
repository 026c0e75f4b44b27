// Entry points of the kernel, which solve the problems of many worlds, W at a time.
#pragma once

#include <algorithm>
#include <new>
#include <type_traits>

#include "base/limits.h"
#include "robots/bipedal_walker/kernel/island.h"
#include "robots/bipedal_walker/kernel/rotation.h"
#include "robots/bipedal_walker/kernel/toi.h"
#include "simd/workspace.h"

namespace walker::bipedal_walker::kernel {
inline namespace WALKER_SIM_INSTRUCTION_SET {

/// Position iterations after which most worlds have converged; most of the others never do.
constexpr int kFirstIterations = 6;

constexpr int kMinLanes = 4;

/// Calls solve(first, lanes, W) for up to W problems at a time. If half of the lanes suffice for
/// the remainder, solves it with half of W.
template <int W, typename Solve>
void in_groups(std::size_t first, std::size_t count, const Solve& solve) {
  constexpr std::size_t kFew = W > kMinLanes ? W / 2 : 0;
  for (; first < count && count - first > kFew; first += W) {
    solve(first, static_cast<int>(std::min<std::size_t>(W, count - first)),
          std::integral_constant<int, W>{});
  }
  if constexpr (kFew != 0) {
    if (first < count) in_groups<W / 2>(first, count, solve);
  }
}

template <typename Lanes, typename Problem>
Lanes& new_lanes(void* memory, Problem* const* problems, int count, const Model& model) {
  static_assert(sizeof(Lanes) <= simd::Workspace::kLanesSize);
  static_assert(alignof(Lanes) <= simd::Workspace::kAlignment);
  static_assert(std::is_trivially_destructible_v<Lanes>);
  return *new (memory) Lanes(problems, count, model);
}

template <int W>
void solve_islands(Island* const* islands, std::size_t count, const Model& model) {
  std::array<Island*, kMaxGroupSize> unsolved;
  std::size_t num_unsolved = 0;
  void* const memory = simd::workspace().lanes;
  const int first_iterations = std::min(kFirstIterations, model.position_iterations);
  in_groups<W>(0, count, [&](std::size_t first, int num_lanes, auto width) {
    auto& lanes = new_lanes<IslandLanes<width>>(memory, islands + first, num_lanes, model);
    lanes.solve();
    lanes.correct(first_iterations);
    for (std::size_t i = first; i < first + static_cast<std::size_t>(num_lanes); ++i) {
      if (islands[i]->position_is_solved == 0) unsolved[num_unsolved++] = islands[i];
    }
  });
  in_groups<W>(0, num_unsolved, [&](std::size_t first, int num_lanes, auto width) {
    new_lanes<IslandLanes<width>>(memory, unsolved.data() + first, num_lanes, model)
        .correct(model.position_iterations - first_iterations);
  });
}

template <int W>
void solve_toi(ToiIsland* const* islands, std::size_t count, const Model& model) {
  void* const memory = simd::workspace().lanes;
  in_groups<W>(0, count, [&](std::size_t first, int num_lanes, auto width) {
    new_lanes<ToiLanes<width>>(memory, islands + first, num_lanes, model).solve();
  });
}

template <int W>
void rotate_all(const float* angles, std::size_t count, Rotation<float>* rotations) {
  in_groups<W>(0, count, [&](std::size_t first, int num_lanes, auto width) {
    Number<width> angle(0);
    for (int lane = 0; lane < num_lanes; ++lane) angle.set(lane, angles[first + lane]);
    const Rotation<Number<width>> rotation = rotation_of<width>(angle);
    for (int lane = 0; lane < num_lanes; ++lane) {
      rotations[first + lane] = {rotation.sine[lane], rotation.cosine[lane]};
    }
  });
}

template <int W>
constexpr Kernel make_kernel(const char* instruction_set) {
  return {instruction_set, W, solve_islands<W>, solve_toi<W>, rotate_all<W>};
}

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::bipedal_walker::kernel
