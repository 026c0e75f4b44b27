// Episode records, as ~restore and the replay read them.
#include "episode/walker.h"

#include <stdexcept>

#include "fuzz/target.h"
#include "ros/checked_message.h"
#include "ros/message_conversions.h"
#include "walker_sim/registry.h"

namespace walker::fuzz {
namespace {

void run(const std::uint8_t* data, std::size_t size) {
  static const auto kEnvironment = make("BipedalWalker-v3");
  const Specification& specification = kEnvironment->specification();
  try {
    walker_sim::EpisodeRecord message;
    read_exactly(data, size, "the record", message);
    const EpisodeRecord record = to_record(message);
    complete_parameters(
        parameter_descriptions(record.id),
        parameters_of(record.id, message.spec.parameter_names, message.spec.parameter_values));
    check_repeatable(record, specification);
    require(record.actions.size() == record.num_steps * specification.action_size(),
            "a record that can be repeated has an action for each step");
    kEnvironment->set_generator_state(record.generator_state);
  } catch (const std::runtime_error& refusal) {
    accept(refusal);
  } catch (const std::invalid_argument& refusal) {
    accept(refusal);
  }
}

const Registered kTarget("episode_record", run);

}  // namespace
}  // namespace walker::fuzz
