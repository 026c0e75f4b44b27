#include "bipedal_walker/together.h"

#include <algorithm>
#include <array>

#include "bipedal_walker/box2d_pinned/world_step.h"
#include "bipedal_walker/physics.h"

namespace walker::bipedal_walker {
namespace {

/// What is asked to be solved, those that have the most in common beside each other.
template <typename Problem>
class Queue {
 public:
  void add(Problem& problem) { problems_[count_++] = &problem; }

  template <typename Solve>
  void solve(const Solve& solve, const Model& model) {
    std::sort(problems_.begin(), problems_.begin() + count_,
              [](const Problem* a, const Problem* b) { return a->pattern < b->pattern; });
    if (count_ != 0) solve(problems_.data(), count_, model);
    count_ = 0;
  }

 private:
  std::array<Problem*, kMostTogether> problems_;
  std::ptrdiff_t count_ = 0;
};

class Group {
 public:
  Group(const Kernel& kernel, WorldCall* calls, std::size_t count)
      : kernel_(kernel), calls_(calls), count_(count), model_(model_of(calls[0].physics->parts())) {}

  void step() {
    Queue<Island> islands;
    for (std::size_t i = 0; i < count_; ++i) {
      steps_[i].start(calls_[i].physics->parts(), model_);
      is_waiting_[i] = false;
      try_to(i, [&](WorldStep& step) { is_waiting_[i] = step.begin(); });
      if (is_waiting_[i]) islands.add(steps_[i].island());
    }
    islands.solve(kernel_.solve, model_);
    for_waiting([](WorldStep& step) { step.finish_island(); });

    for (std::size_t i = 0; i < count_; ++i) is_waiting_[i] = true;
    for (;;) {
      Queue<Impact> impacts;
      bool is_any = false;
      for (std::size_t i = 0; i < count_; ++i) {
        if (!is_waiting_[i] || calls_[i].failure) continue;
        is_waiting_[i] = false;
        try_to(i, [&](WorldStep& step) { is_waiting_[i] = step.find_impact(); });
        if (is_waiting_[i]) impacts.add(steps_[i].impact());
        is_any = is_any || is_waiting_[i];
      }
      if (!is_any) break;
      impacts.solve(kernel_.solve_impacts, model_);
      for_waiting([](WorldStep& step) { step.finish_impact(); });
    }
    for (std::size_t i = 0; i < count_; ++i) {
      if (!calls_[i].failure) steps_[i].end();
    }
  }

 private:
  template <typename Function>
  void try_to(std::size_t i, const Function& function) {
    try {
      function(steps_[i]);
    } catch (...) {
      calls_[i].failure = std::current_exception();
    }
  }

  template <typename Function>
  void for_waiting(const Function& function) {
    for (std::size_t i = 0; i < count_; ++i) {
      if (is_waiting_[i] && !calls_[i].failure) try_to(i, function);
    }
  }

  const Kernel& kernel_;
  WorldCall* calls_;
  std::size_t count_;
  Model model_;
  std::array<WorldStep, kMostTogether> steps_;
  std::array<bool, kMostTogether> is_waiting_;
};

}  // namespace

void step_together(const Kernel& kernel, WorldCall* calls, std::size_t count) noexcept {
  if (count == 0) return;
  Group group(kernel, calls, count);
  group.step();
}

}  // namespace walker::bipedal_walker
