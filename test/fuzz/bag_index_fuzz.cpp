// Messages of a bag: pieces, each preceded by a byte for its type.
#include "replay/bag_index.h"

#include <stdexcept>

#include "fuzz/input.h"
#include "fuzz/target.h"
#include "ros/checked_stream.h"

namespace walker::fuzz {
namespace {

template <typename Message>
void add(const std::vector<std::uint8_t>& bytes, BagIndex& index) {
  Message message;
  try {
    read_exactly(bytes.data(), bytes.size(), "the message", message);
  } catch (const std::runtime_error&) {
    return;
  }
  index.add(message);
}

void run(const std::uint8_t* data, std::size_t size) {
  BagIndex index;
  Input input(data, size);
  while (input.size() > 0) {
    const auto type = input.number<std::uint8_t>();
    const std::vector<std::uint8_t> bytes = input.piece();
    switch (type % 4) {
      case 0:
        add<walker_sim::Transition>(bytes, index);
        break;
      case 1:
        add<walker_sim::EnvironmentSpec>(bytes, index);
        break;
      case 2:
        add<walker_sim::Episode>(bytes, index);
        break;
      default:
        add<walker_sim::EpisodeRecord>(bytes, index);
    }
  }
  for (const BagEpisode& episode : index.finish()) {
    require(episode.last_step >= episode.first_step, "steps of an episode go forward");
    require(episode.num_consecutive() <= episode.num_transitions, "each of them is in the bag");
    require(episode.first_gap_end == 0 || episode.first_gap_end > episode.last_step,
            "a gap is behind them");
    require(!episode.end || episode.end->episode == episode.number, "its end is its own");
  }
}

const Registered kTarget("bag_index", run);

}  // namespace
}  // namespace walker::fuzz
