#include "robots/bipedal_walker/together.h"

#include <algorithm>
#include <array>
#include <exception>
#include <new>
#include <type_traits>

#include "base/limits.h"
#include "robots/bipedal_walker/box2d_pinned/world_step.h"
#include "robots/bipedal_walker/box2d_pinned/world_toi.h"
#include "robots/bipedal_walker/physics.h"
#include "simd/workspace.h"

namespace walker::bipedal_walker {
namespace {

/// Problems to solve, sorted so that similar ones share a vector.
template <typename Problem>
class Queue {
 public:
  void add(Problem& problem) { problems_[count_++] = &problem; }
  bool is_empty() const { return count_ == 0; }

  template <typename Solve>
  void solve(const Solve& solve, const Model& model) {
    std::sort(problems_.begin(), problems_.begin() + count_,
              [](const Problem* a, const Problem* b) { return a->pattern < b->pattern; });
    solve(problems_.data(), static_cast<std::size_t>(count_), model);
    count_ = 0;
  }

 private:
  std::array<Problem*, kMaxGroupSize> problems_;
  std::ptrdiff_t count_ = 0;
};

class Group {
 public:
  Group(const Kernel& kernel, WorldCall* calls, std::size_t count)
      : kernel_(kernel),
        calls_(calls),
        count_(count),
        model_(model_of(calls[0].physics->parts())) {}

  void step() {
    solve_islands();
    solve_toi();
    for_each([this](std::size_t i) { steps_[i].end(); });
  }

 private:
  void solve_islands() {
    Queue<Island> islands;
    std::array<bool, kMaxGroupSize> is_waiting{};
    for_each([&](std::size_t i) {
      is_waiting[i] = steps_[i].begin(calls_[i].physics->parts(), model_);
      if (is_waiting[i]) islands.add(steps_[i].island());
    });
    islands.solve(kernel_.solve, model_);
    for_each([&](std::size_t i) {
      if (is_waiting[i]) steps_[i].finish_island();
    });
  }

  /// Solves one impact of each world at a time, until no world has another one.
  void solve_toi() {
    Queue<ToiIsland> islands;
    std::array<bool, kMaxGroupSize> is_waiting{};
    for_each([&](std::size_t i) {
      tois_[i].begin(calls_[i].physics->parts(), model_);
      is_waiting[i] = true;
    });
    for (;;) {
      for_each([&](std::size_t i) {
        is_waiting[i] = is_waiting[i] && tois_[i].find();
        if (is_waiting[i]) islands.add(tois_[i].island());
      });
      if (islands.is_empty()) return;
      islands.solve(kernel_.solve_toi, model_);
      for_each([&](std::size_t i) {
        if (is_waiting[i]) tois_[i].finish();
      });
    }
  }

  /// Calls function(i) for each world that has not failed, and records exceptions.
  template <typename Function>
  void for_each(const Function& function) {
    for (std::size_t i = 0; i < count_; ++i) {
      if (calls_[i].failure) continue;
      try {
        function(i);
      } catch (...) {
        calls_[i].failure = std::current_exception();
      }
    }
  }

  const Kernel& kernel_;
  WorldCall* calls_;
  std::size_t count_;
  Model model_;
  std::array<WorldStep, kMaxGroupSize> steps_;
  std::array<WorldToi, kMaxGroupSize> tois_;
};

}  // namespace

void step_together(const Kernel& kernel, WorldCall* calls, std::size_t count) noexcept {
  if (count == 0) return;
  static_assert(sizeof(Group) <= simd::Workspace::kGroupSize);
  static_assert(std::is_trivially_destructible_v<Group>);
  try {
    auto* const group = new (simd::workspace().group) Group(kernel, calls, count);
    group->step();
  } catch (...) {  // out of memory
    std::for_each(calls, calls + count,
                  [](WorldCall& call) { call.failure = std::current_exception(); });
  }
}

}  // namespace walker::bipedal_walker
