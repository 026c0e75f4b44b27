// Entry points of the kernel, which solve the problems of many instances, W at a time, and the
// solution of impacts.
//
// Restates formulas of Box2D 2.3, Copyright (c) 2006-2011 Erin Catto http://www.box2d.org, in code
// of our own, which is not the original software. lanes.h has the terms.
#pragma once

#include <algorithm>
#include <new>
#include <type_traits>

#include "base/limits.h"
#include "robots/bipedal_walker/kernel/island.h"
#include "simd/lane_memory.h"

namespace walker::bipedal_walker::kernel {
inline namespace WALKER_SIM_INSTRUCTION_SET {

constexpr int kToiPositionIterations = 20;
constexpr float kToiBaumgarte = 0.75F;  ///< b2_toiBaugarte

/// b2Island::SolveTOI for one body of a walker per lane, at its time of impact with the ground.
/// Corrects its position, solves its velocity, and integrates it over the rest of the step.
///
/// At the time of impact t, a fraction of the step dt, with the body's c, a, v, w as in island.h:
///
///   correction  at most 20 times, each contact by kToiBaumgarte of its penetration beyond
///               b2_linearSlop, until all separations are at least -1.5 b2_linearSlop
///   safe        = (c, a): the beginning of the body's next sweep
///   velocities  180 times each contact, from impulses of 0, with the manifolds at (c, a)
///   integrate   c += (1 - t) dt v,   a += (1 - t) dt w, with the limits of island.h
///
/// The impulses are discarded, so that the next step's warm start does not see them; joints do not
/// take part. Inputs: the manifolds and (1 - t) dt. State: c, a, v, w.
///
/// Source: Box2D (box2d-py 2.3.8), Dynamics/b2Island.cpp, b2Island::SolveTOI.
template <int W>
class ToiLanes {
 public:
  /// @param islands `count` islands, at most W
  ToiLanes(ToiIsland* const* islands, int count, const Model& model)
      : model_(model), count_(count) {
    for (int lane = 0; lane < W; ++lane) islands_[lane] = islands[lane < count ? lane : 0];
    for (const ToiIsland* island : islands_)
      num_slots_ = std::max(num_slots_, island->num_contacts);
    load();
  }

  void solve() {
    correct();
    prepare_velocities();
    for (int i = 0; i < model_.velocity_iterations; ++i) {
      // After an iteration that changes nothing, later ones change nothing either.
      constexpr int kComparisonPeriod = 8;
      if (i % kComparisonPeriod != 0) {
        iterate();
      } else if (iterate_and_compare()) {
        break;
      }
    }
    integrate_position();
  }

 private:
  void load() {
    std::array<const BodyState<float>*, W> states;
    for (int lane = 0; lane < W; ++lane) {
      const ToiIsland& island = *islands_[lane];
      const Model::Body& body = model_.bodies[island.body];
      states[lane] = &island.state;
      dt_.set(lane, island.dt);
      mass_.inverse_mass.set(lane, island.inverse_mass.mass);
      mass_.inverse_inertia.set(lane, island.inverse_mass.inertia);
      mass_.center.x.set(lane, body.center_x);
      mass_.center.y.set(lane, body.center_y);
    }
    gather<W>(body_, states.data());
    static const ContactManifold<float, int> kNone{};
    for (int i = 0; i < num_slots_; ++i) {
      std::array<const ContactManifold<float, int>*, W> manifolds;
      for (int lane = 0; lane < W; ++lane) {
        const ToiIsland& island = *islands_[lane];
        manifolds[lane] = i < island.num_contacts ? &island.contacts[i] : &kNone;
      }
      gather<W>(manifolds_[i], manifolds.data());
    }
  }

  /// Runs position iterations until the penetration of each body is within tolerance.
  void correct() {
    std::array<PositionLanes<W>, 1> position{{{{body_.x, body_.y}, body_.angle}}};
    correct_positions(position, kToiPositionIterations, count_, [&]() WALKER_SIM_INLINE {
      Number<W> separation(0);
      for (int i = 0; i < num_slots_; ++i) {
        solve_position(manifolds_[i], any(manifolds_[i].has_two_points), mass_, kToiBaumgarte,
                       position[0], separation);
      }
      return separation >= Number<W>(-1.5F * kLinearSlop);
    });
    body_.x = position[0].center.x;
    body_.y = position[0].center.y;
    body_.angle = position[0].angle;
    for (int lane = 0; lane < count_; ++lane) {
      islands_[lane]->safe_x = body_.x[lane];
      islands_[lane]->safe_y = body_.y[lane];
      islands_[lane]->safe_angle = body_.angle[lane];
    }
  }

  void prepare_velocities() {
    velocity_ = {{body_.velocity_x, body_.velocity_y}, body_.angular_velocity};
    const Rotation<Number<W>> rotation = rotation_of<W>(body_.angle);
    const Vec2<W> center{body_.x, body_.y};
    const Transform<W> transform{rotation, center - rotate(rotation, mass_.center)};
    for (int i = 0; i < num_slots_; ++i) {
      prepare(manifolds_[i], mass_, center, transform, contacts_[i]);
      for (PointLanes<W>& point : contacts_[i].points) {
        point.normal_impulse = Number<W>(0);
        point.tangent_impulse = Number<W>(0);
      }
    }
  }

  WALKER_SIM_INLINE void iterate() {
    for (int i = 0; i < num_slots_; ++i) kernel::solve(contacts_[i], velocity_);
  }

  /// @return whether the iteration changed no bit of any instance
  bool iterate_and_compare() {
    Truth<W> is_changed = Truth<W>::none();
    const auto compare = [&is_changed](Number<W> before, Number<W> after) WALKER_SIM_INLINE {
      is_changed = is_changed | ~simd::is_same(before, after);
    };
    const BodyLanes<W> before = velocity_;
    for (int i = 0; i < num_slots_; ++i) {
      ContactLanes<W>& contact = contacts_[i];
      const PointLanes<W> before_1 = contact.points[0];
      const PointLanes<W> before_2 = contact.points[1];
      kernel::solve(contact, velocity_);
      compare(before_1.normal_impulse, contact.points[0].normal_impulse);
      compare(before_1.tangent_impulse, contact.points[0].tangent_impulse);
      if (!contact.any_two) continue;
      compare(before_2.normal_impulse, contact.points[1].normal_impulse);
      compare(before_2.tangent_impulse, contact.points[1].tangent_impulse);
    }
    compare(before.velocity.x, velocity_.velocity.x);
    compare(before.velocity.y, velocity_.velocity.y);
    compare(before.angular_velocity, velocity_.angular_velocity);
    return !any(is_changed);
  }

  void integrate_position() {
    body_.velocity_x = velocity_.velocity.x;
    body_.velocity_y = velocity_.velocity.y;
    body_.angular_velocity = velocity_.angular_velocity;
    integrate<W>(dt_, body_);
    std::array<BodyState<float>*, W> states;
    for (int lane = 0; lane < W; ++lane) states[lane] = &islands_[lane]->state;
    scatter<W>(body_, states.data(), count_);
  }

  Number<W> dt_;
  MassLanes<W> mass_;
  BodyState<Number<W>> body_;
  BodyLanes<W> velocity_;
  std::array<ManifoldLanes<W>, kMaxContactsOfBody> manifolds_;
  std::array<ContactLanes<W>, kMaxContactsOfBody> contacts_;
  const Model& model_;
  std::array<ToiIsland*, W> islands_;
  int count_;
  int num_slots_ = 0;
};

/// Position iterations after which most instances have converged; most of the others never do.
constexpr int kFirstIterations = 6;

constexpr int kMinLanes = 4;  ///< of several instances

/// Calls solve(first, lanes, W) for up to W problems at a time. If half of the lanes suffice for
/// the remainder, solves it with half of W. Solves a single problem with one lane.
template <int W, typename Solve>
void in_groups(std::size_t first, std::size_t count, const Solve& solve) {
  constexpr int kFewerLanes = W > kMinLanes ? W / 2 : 1;
  constexpr std::size_t kFew = W > 1 ? kFewerLanes : 0;
  for (; first < count && count - first > kFew; first += W) {
    solve(first, static_cast<int>(std::min<std::size_t>(W, count - first)),
          std::integral_constant<int, W>{});
  }
  if constexpr (kFew != 0) {
    if (first < count) in_groups<kFewerLanes>(first, count, solve);
  }
}

template <typename Lanes, typename Problem>
Lanes& new_lanes(void* memory, Problem* const* problems, int count, const Model& model) {
  static_assert(sizeof(Lanes) <= simd::LaneMemory::kLanesSize);
  static_assert(alignof(Lanes) <= simd::LaneMemory::kAlignment);
  static_assert(std::is_trivially_destructible_v<Lanes>);
  return *new (memory) Lanes(problems, count, model);
}

template <int W>
void solve_islands(Island* const* islands, std::size_t count, const Model& model) {
  std::array<Island*, kMaxGroupSize> unsolved;
  std::size_t num_unsolved = 0;
  void* const memory = simd::lane_memory().lanes;
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
  void* const memory = simd::lane_memory().lanes;
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
