// Sequential reader of the episode records in a bag.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "walker_sim/EpisodeRecord.h"

namespace walker {

struct BagEpisode {
  std::string publisher;   ///< node that published the record; if not recorded, the topic
  std::uint64_t time = 0;  ///< when it was recorded, in an order that is that of time
  std::size_t hash = 0;    ///< of the serialized record: equal for a record that is in two bags
  walker_sim::EpisodeRecord record;
};

/// Calls `visit` with each message of type walker_sim/EpisodeRecord, whatever its topic, in the
/// order of the file. Uses no index, so the bag of a recorder that has crashed is read up to the
/// last complete chunk.
/// @return false if the bag was not closed, so that its last messages may be missing
/// @throws std::runtime_error naming a file that cannot be read or is damaged, or a message of
///         another version of walker_sim
bool read_episodes(const std::string& path, const std::function<void(const BagEpisode&)>& visit);

}  // namespace walker
