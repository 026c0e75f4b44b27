// Saved states. The first byte selects the environment, and whether the header's size and checksum
// are corrected, which lets the fuzzer reach the code behind them.
#include <cstring>
#include <stdexcept>

#include "episode/state_header.h"
#include "fuzz/input.h"
#include "fuzz/target.h"
#include "walker_sim/registry.h"

namespace walker::fuzz {
namespace {

struct Walker {
  explicit Walker(const char* id) : environment(make(id)) {
    const Specification& specification = environment->specification();
    observation.resize(specification.observation_size());
    info.resize(specification.info_names.size());
    action.resize(specification.action_size());
    result.observation = observation.data();
    result.info = info.data();
  }

  std::unique_ptr<Environment> environment;
  std::vector<double> observation;
  std::vector<double> info;
  std::vector<double> action;
  Result result;
};

void go_on(Walker& walker) {
  constexpr int kSteps = 3;
  Sensors sensors;
  Scene scene;
  walker.environment->sense(sensors);
  walker.environment->scene(scene);
  try {
    for (int i = 0; i < kSteps; ++i) {
      walker.environment->step(walker.action.data(), walker.action.size(), walker.result);
    }
  } catch (const ResetNeeded& refusal) {
    accept(refusal);
  }
  std::vector<std::byte> state;
  walker.environment->save_state(state);
}

void run(const std::uint8_t* data, std::size_t size) {
  static Walker walkers[] = {Walker("BipedalWalker-v3"), Walker("Walker2d-v5"),
                             Walker("BipedalWalkerHardcore-v3"), Walker("Hopper-v4")};
  constexpr std::uint8_t kAsItIs = 0x80;
  Input input(data, size);
  const auto which = input.number<std::uint8_t>();
  Walker& walker = walkers[which % std::size(walkers)];
  std::vector<std::byte> state(input.size());
  if (!state.empty()) std::memcpy(state.data(), input.next(), state.size());
  constexpr std::size_t kHeaderBytes = 28;  // magic, format, size, checksum
  if ((which & kAsItIs) == 0 && state.size() >= kHeaderBytes) StateOrigin::seal(state, 0);
  try {
    if (!walker.environment->load_state(state.data(), state.size(), walker.result).has_begun)
      return;
  } catch (const std::invalid_argument&) {
    return;
  }
  go_on(walker);
}

const Registered kTarget("saved_state", run);

}  // namespace
}  // namespace walker::fuzz
