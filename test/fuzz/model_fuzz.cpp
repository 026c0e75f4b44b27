// Users' models. MuJoCo's library is not instrumented: the target tests how we handle its results,
// and that no unexpected error escapes.
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
  } catch (const std::invalid_argument& refusal) {  // not a model, or an unsuitable one
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
