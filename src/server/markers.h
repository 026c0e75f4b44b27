// The surroundings and the state of an episode as rviz markers.
#pragma once

#include <cstdint>
#include <string>

#include <std_msgs/Header.h>
#include <visualization_msgs/MarkerArray.h>

#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"

namespace walker {

/// What the text above the walker tells.
struct EpisodeStatus {
  std::string id;
  std::uint32_t episode = 0;
  std::uint32_t step = 0;
  double episode_return = 0;
  std::string seed;        ///< decimal; empty: the generator continued
  std::string end_reason;  ///< empty while the episode runs
};

/// Terrain, obstacles, clouds and flags, first of all a marker that deletes those of the episode
/// before. Changes only at a reset: published latched.
/// @param header odometry frame and stamp
visualization_msgs::MarkerArray scene_markers(const Scene& scene, const std_msgs::Header& header);

/// The range finder's rays and the episode's text, for every state.
/// @param header odometry frame and stamp
visualization_msgs::MarkerArray state_markers(const Specification& specification,
                                              const Sensors& sensors, const EpisodeStatus& status,
                                              const std_msgs::Header& header);

}  // namespace walker
