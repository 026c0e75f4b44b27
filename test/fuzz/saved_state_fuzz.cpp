// Saved states. The first byte selects the environment, and whether the header's size and checksum
// are corrected, which lets the fuzzer reach the code behind them.
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "episode/saved_state.h"
#include "fuzz/input.h"
#include "fuzz/target.h"
#include "stepper.h"

namespace walker::fuzz {
namespace {

void require_finite(const Stepper& walker) {
  for (const double value : walker.observation)
    require(std::isfinite(value), "it observes numbers");
  require(std::isfinite(walker.result.reward), "its reward is a number");
}

void play(Stepper& walker) {
  constexpr int kSteps = 3;
  Sensors sensors;
  Scene scene;
  require_finite(walker);
  walker.environment->sense(sensors);
  walker.environment->scene(scene);
  const std::vector<double> action(walker.environment->specification().action_size());
  try {
    for (int i = 0; i < kSteps; ++i) {
      walker.step(action);
      require_finite(walker);
    }
  } catch (const ResetNeeded& refusal) {
    accept(refusal);
  }
  std::vector<std::byte> state;
  walker.environment->save_state(state);
}

void run(const std::uint8_t* data, std::size_t size) {
  static Stepper walkers[] = {Stepper("BipedalWalker-v3"), Stepper("Walker2d-v5"),
                              Stepper("BipedalWalkerHardcore-v3"), Stepper("Hopper-v4")};
  constexpr std::uint8_t kAsItIs = 0x80;
  Input input(data, size);
  const auto which = input.number<std::uint8_t>();
  Stepper& walker = walkers[which % std::size(walkers)];
  std::vector<std::byte> state(input.size());
  if (!state.empty()) std::memcpy(state.data(), input.next(), state.size());
  constexpr std::size_t kHeaderBytes = 28;  // magic, format, size, checksum
  if ((which & kAsItIs) == 0 && state.size() >= kHeaderBytes) StateOrigin::seal(state, 0);
  try {
    if (!walker.environment->load_state(state.data(), state.size(), walker.result).has_begun)
      return;
  } catch (const std::invalid_argument& refusal) {
    require(!is_seed, refusal.what());  // make_corpus.py writes seeds of the present format
    return;
  }
  play(walker);
}

const Registered kTarget("saved_state", run);

}  // namespace
}  // namespace walker::fuzz
