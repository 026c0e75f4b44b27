// Plays BipedalWalker in varied ways and writes all that can be seen of it to the standard output,
// or, with the argument `time`, how many steps it makes in a second of processor time.
//
// One program for each shortcut, and shortcuts_test compares what they write.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <exception>
#include <iostream>

#include "robots/bipedal_walker/player.h"
#include "robots/bipedal_walker/shortcut_rows.h"

namespace walker::bipedal_walker {
namespace {

/// An environment that is played again and again.
class Walk {
 public:
  Walk(bool hardcore, bool reuse_world) : walker_(options(hardcore, reuse_world)) {
    result_.observation = observation_.data();
  }

  /// At most `most_steps` steps; `write` is called with the row of the reset and of each step.
  template <class Write>
  void play(std::optional<std::uint64_t> seed, Actions actions, std::size_t most_steps,
            const Write& write) {
    walker_.reset(seed, result_);
    write(row());
    std::vector<double> action;
    for (std::size_t i = 0; i < most_steps && !result_.terminated; ++i) {
      actions.draw(observation_, action);
      walker_.step(action.data(), action.size(), result_);
      write(row());
    }
  }

 private:
  static Options options(bool hardcore, bool reuse_world) {
    Options options;
    options.id = "BipedalWalker-v3";
    options.hardcore = hardcore;
    options.reuse_world = reuse_world;
    return options;
  }

  const ShortcutRow& row() {
    walker_.sense(sensors_);
    double* next = row_.data();
    const auto add = [&next](const auto& numbers) {
      next = std::copy(numbers.begin(), numbers.end(), next);
    };
    add(observation_);
    *next++ = result_.reward;
    *next++ = result_.terminated ? 1 : 0;
    for (const Pose& pose : sensors_.link_poses) {
      add(pose.position);
      add(pose.orientation);
    }
    add(sensors_.joint_position);
    add(sensors_.joint_velocity);
    add(sensors_.joint_effort);
    add(sensors_.linear_velocity);
    add(sensors_.linear_acceleration);
    add(sensors_.angular_velocity);
    return row_;
  }

  BipedalWalker walker_;
  std::vector<double> observation_ = std::vector<double>(kObservationSize);
  Result result_;
  Sensors sensors_;
  ShortcutRow row_{};
};

/// Plain and hardcore, new worlds and one that is used again, and each kind of actions.
template <class Write>
void play_all(const Write& write) {
  constexpr std::size_t kMostSteps = 1200;
  std::uint64_t seed = 0;
  for (int round = 0; round < kShortcutRounds; ++round) {
    for (const bool hardcore : {false, true}) {
      Walk walk(hardcore, round % 2 == 1);
      walk.play(seed, Actions("random", seed), kMostSteps, write);
      for (const char* kind : {"heuristic", "saturated", "noisy", "outside", "zero", "heuristic"}) {
        walk.play(std::nullopt, Actions(kind, ++seed), kMostSteps, write);
      }
      ++seed;
    }
  }
}

void print_speed() {
  std::size_t rows = 0;
  const std::clock_t start = std::clock();
  play_all([&rows](const ShortcutRow& /*row*/) { ++rows; });
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  std::cout << static_cast<double>(rows) / seconds << '\n';
}

void write_rows() {
  play_all(
      [](const ShortcutRow& row) { std::fwrite(row.data(), sizeof(double), row.size(), stdout); });
}

}  // namespace
}  // namespace walker::bipedal_walker

int main(int argc, char** argv) {
  try {
    if (argc > 1 && std::strcmp(argv[1], "time") == 0) {
      walker::bipedal_walker::print_speed();
    } else {
      walker::bipedal_walker::write_rows();
    }
    return EXIT_SUCCESS;
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return EXIT_FAILURE;
  }
}
