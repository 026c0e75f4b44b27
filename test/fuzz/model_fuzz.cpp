// A model of a user's own. MuJoCo's library is not instrumented: what is looked at is what we make
// of its answers, and that nothing of them gets further than it should.
#include <stdexcept>

#include "fuzz/memory_file.h"
#include "fuzz/target.h"
#include "walker_sim/registry.h"

namespace walker::fuzz {
namespace {

void run(const std::uint8_t* data, std::size_t size) {
  const MemoryFile file(data, size);
  try {
    const auto environment = make("Walker2d-v5", {{"xml_file", file.path()}});
    const Specification& specification = environment->specification();
    std::vector<double> observation(specification.observation_size());
    std::vector<double> info(specification.info_names.size());
    const std::vector<double> action(specification.action_size());
    Result result;
    result.observation = observation.data();
    result.info = info.data();
    environment->reset(1, result);
    environment->step(action.data(), action.size(), result);
  } catch (const std::invalid_argument& refusal) {  // no model, or none that fits
    accept(refusal);
  } catch (const std::runtime_error& refusal) {  // the engine failed at the reset
    accept(refusal);
  } catch (const ResetNeeded& refusal) {
    accept(refusal);
  }
}

const Registered kTarget("model", run);

}  // namespace
}  // namespace walker::fuzz
