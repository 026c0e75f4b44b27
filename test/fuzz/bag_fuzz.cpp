// Untrusted bags: rosbag can read every bag that the check accepts.
#include <stdexcept>

#include "fuzz/memory_file.h"
#include "fuzz/target.h"
#include "replay/bag_episodes.h"

namespace walker::fuzz {
namespace {

void run(const std::uint8_t* data, std::size_t size) {
  const MemoryFile file(data, size);
  try {
    const BagEpisodes bag({file.path()});
    for (const BagWalker& walker : bag.walkers()) {
      bag.read_transitions(walker, [](const walker_sim::Transition&) {});
    }
  } catch (const std::runtime_error& refusal) {
    accept(refusal);
  }
}

const Registered kTarget("bag", run);

}  // namespace
}  // namespace walker::fuzz
