// Users' models. MuJoCo's library is not instrumented: the target tests how we handle its results,
// and that no unexpected error escapes.
#include <stdexcept>

#include "fuzz/input.h"
#include "fuzz/target.h"
#include "stepper.h"

namespace walker::fuzz {
namespace {

void run(const std::uint8_t* data, std::size_t size) {
  const MemoryFile file(data, size);
  try {
    Stepper walker("Walker2d-v5", {{"xml_file", file.path()}});
    walker.reset(1);
    walker.step(std::vector<double>(walker.environment->specification().action_size()));
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
