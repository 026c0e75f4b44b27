// A server's answers, as the client reads them; the first byte selects the kind of answer.
#include <stdexcept>

#include "client/messages.h"
#include "fuzz/input.h"
#include "fuzz/target.h"

namespace walker::fuzz {
namespace {

constexpr std::size_t kEnvironments = 3;
constexpr std::size_t kObservations = 4;
constexpr std::uint32_t kActions = 2;
constexpr std::uint32_t kSteps = 7;

ServerSpecification small_server() {
  ServerSpecification server;
  server.num_envs = kEnvironments;
  server.observation_size = kObservations;
  server.action_size = kActions;
  server.info_names = {"x_position"};
  return server;
}

void check(const Transition& transition) {
  require(transition.observation.size() == kObservations, "an observation has its size");
  require(transition.environment < kEnvironments, "the environment is one of the server's");
}

void read_specification(Reader& reader) {
  ServerSpecification told;
  read(reader, told);
  require(told.num_envs > 0, "a server has environments");
  require(told.action_low.size() == told.action_size, "bounds have the action's size");
  require(told.parameter_names.size() == told.parameter_values.size(), "a value for each name");
}

void read_transition(Reader& reader) {
  Transition transition;
  read(reader, small_server(), transition);
  check(transition);
}

void read_repeated(Reader& reader) {
  RepeatedStep repeated;
  read(reader, small_server(), kSteps, repeated);
  check(repeated.transition);
  require(repeated.steps >= 1 && repeated.steps <= kSteps, "as many steps as asked for, or fewer");
}

void read_batch(Reader& reader) {
  BatchTransition batch;
  read(reader, small_server(), batch);
  require(batch.observations.size() == kEnvironments * kObservations, "a row per environment");
  require(batch.final_observations.size() == batch.final_environments.size() * kObservations,
          "a row per end");
  for (const std::uint32_t index : batch.final_environments) {
    require(index < kEnvironments, "ends are of the server's environments");
  }
}

void read_reset(Reader& reader) {
  BatchReset reset;
  read(reader, small_server(), 2, reset);
  require(reset.observations.size() == 2 * kObservations, "a row per reset");
}

void read_snapshot(Reader& reader) {
  std::vector<std::uint8_t> record;
  read_record(reader, record);
}

void read_picture(Reader& reader, const char* encoding) {
  Image image;
  image.width = 1;
  image.rgb = {1, 2, 3};
  try {
    read(reader, encoding, {{"width", std::int64_t{2}}}, image);
  } catch (const std::runtime_error&) {
    require(image.width == 1 && image.rgb.size() == 3, "what is refused leaves the picture");
    throw;
  }
  const std::size_t pixels = std::size_t{image.width} * image.height;
  require(image.width == 2, "a picture is as wide as asked for");
  require(image.rgb.size() + image.depth.size() == (image.depth.empty() ? 3 * pixels : pixels),
          "its pixels are there");
}

void run(const std::uint8_t* data, std::size_t size) {
  Input input(data, size);
  const auto which = input.number<std::uint8_t>();
  Reader reader(input.next(), input.size());
  try {
    switch (which % 8) {
      case 0:
        return read_specification(reader);
      case 1:
        return read_transition(reader);
      case 2:
        return read_repeated(reader);
      case 3:
        return read_batch(reader);
      case 4:
        return read_reset(reader);
      case 5:
        return read_snapshot(reader);
      case 6:
        return read_picture(reader, "rgb8");
      default:
        return read_picture(reader, "32FC1");
    }
  } catch (const std::runtime_error& refusal) {
    accept(refusal);
  }
}

const Registered kTarget("answers", run);

}  // namespace
}  // namespace walker::fuzz
