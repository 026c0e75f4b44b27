// Recorded topics of BipedalWalker's heuristic, and of a walker at rest.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "robots/bipedal_walker/heuristic.h"
#include "server/player.h"

namespace walker::test {

struct Recording {
  std::vector<State> walk;  // the heuristic's first steps
  Scene scene;              // of that walk
  State rest;               // with the legs apart, after 5 s
};

/// @param seed of an episode in which the heuristic does not fall early
inline Recording make_recording(const Server& server, std::uint64_t seed) {
  Player player(server);
  Recording recording;
  player.reset(seed);
  player.twin().environment().scene(recording.scene);
  bipedal_walker::Heuristic heuristic;
  for (int i = 0; i < 120 && !player.twin().has_ended(); ++i) {
    std::vector<double> action(4);
    heuristic.act(player.twin().observation().data(), action.data());
    player.step(action);
    if (testing::Test::HasFatalFailure()) return recording;
  }
  recording.walk = player.take_states();
  player.reset(1);
  for (int i = 0; i < 250; ++i) {
    player.step({1, 1, -1, 1});
    if (testing::Test::HasFatalFailure()) return recording;
  }
  recording.rest = player.take_states().back();
  return recording;
}

inline const Recording& recording_of(const Server& server, std::uint64_t seed) {
  static std::map<std::string, Recording> recordings;
  const auto known = recordings.find(server.id);
  if (known != recordings.end()) return known->second;
  return recordings.emplace(server.id, make_recording(server, seed)).first->second;
}

}  // namespace walker::test
