// Untrusted bags.
#include <stdexcept>

#include "fuzz/input.h"
#include "fuzz/target.h"
#include "replay/bag_reader.h"

namespace walker::fuzz {
namespace {

void run(const std::uint8_t* data, std::size_t size) {
  const MemoryFile file(data, size);
  try {
    read_episodes(file.path(), [](const BagEpisode&) {});
  } catch (const std::runtime_error& refusal) {
    accept(refusal);
  }
}

const Registered kTarget("bag", run);

}  // namespace
}  // namespace walker::fuzz
