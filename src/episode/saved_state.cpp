// Saved states of an episode: phase and last outcome, generator, robot's state.
#include <stdexcept>
#include <utility>

#include "base/state_bytes.h"
#include "episode/episode.h"

namespace walker {
namespace {

/// The values are part of the state format.
enum class Phase : std::uint8_t { before_reset, running, ended, failed };

Phase phase_of(const EpisodeState& state) {
  if (!state.has_begun()) return Phase::before_reset;
  if (!state.has_ended()) return Phase::running;
  return state.error.empty() ? Phase::ended : Phase::failed;
}

void write(const EpisodeState& state, StateWriter& writer) {
  writer.number(phase_of(state));
  if (!state.has_begun()) return;
  writer.number(state.step);
  writer.number(state.episode_return);
  writer.numbers(state.observation.data(), state.observation.size());
  writer.numbers(state.info.data(), state.info.size());
  writer.number(state.reward);
  writer.number(std::uint8_t{state.terminated});
  writer.number(std::uint8_t{state.truncated});
  writer.text(state.end_reason_detail());
  writer.text(state.error);
}

/// @param state its vectors have the right sizes; `episode` becomes 1, or stays 0 before a reset
void read(StateReader& reader, EpisodeState& state) {
  const auto number = reader.number<std::uint8_t>();
  if (number > static_cast<std::uint8_t>(Phase::failed)) {
    refuse_state("its phase is " + std::to_string(number));
  }
  const Phase phase{number};
  if (phase == Phase::before_reset) return;
  state.episode = 1;
  state.step = reader.number<std::uint32_t>();
  state.episode_return = reader.number<double>();
  reader.numbers(state.observation.data(), state.observation.size());
  reader.numbers(state.info.data(), state.info.size());
  state.reward = reader.number<double>();
  state.terminated = reader.flag();
  state.truncated = reader.flag();
  const std::string end_reason = reader.text();
  if (state.has_ended()) {
    state.end_reason = (state.terminated ? "terminated: " : "truncated: ") + end_reason;
  }
  state.error = reader.text();
  if (phase != phase_of(state)) refuse_state("its phase is not that of its outcome");
}

}  // namespace

const StateOrigin& Episode::origin() const {
  if (!origin_) origin_.emplace(specification());
  return *origin_;
}

void Episode::save_state(std::vector<std::byte>& state) const {
  const std::size_t begin = origin().begin(state);
  StateWriter writer(state);
  write(state_, writer);
  writer.number(std::uint8_t{generator_.has_value()});
  if (generator_) writer.numbers(generator_->state().data(), std::tuple_size_v<GeneratorState>);
  robot_->save(writer);
  StateOrigin::seal(state, begin);
}

std::function<void()> Episode::read_state(const std::byte* state, std::size_t size) {
  StateReader reader = origin().open(state, size);
  EpisodeState read_state;
  read_state.observation.resize(state_.observation.size());
  read_state.info.resize(state_.info.size());
  read(reader, read_state);
  std::optional<Generator> generator;
  if (reader.flag()) {
    GeneratorState generator_state{};
    reader.numbers(generator_state.data(), generator_state.size());
    generator.emplace(generator_state);
  }
  std::function<void()> load_robot = robot_->load(reader);
  reader.finish();
  return [this, read_state = std::move(read_state), generator, load_robot = std::move(load_robot)] {
    load_robot();
    generator_ = generator;
    const std::uint32_t next_episode = state_.episode + 1;
    const std::uint32_t environment = state_.environment;
    state_ = read_state;  // copies in place: step_.info points to the buffer of state_.info
    state_.environment = environment;
    if (state_.has_begun()) state_.episode = next_episode;
    actions_.clear();
    was_loaded_ = state_.has_begun();
    sensors_are_fresh_ = false;
  };
}

Progress Episode::load_state(const std::byte* state, std::size_t size, Result& result) {
  load_state(state, size);
  if (state_.has_begun()) copy_to(result);
  return {state_.has_begun(), state_.step, state_.episode_return};
}

}  // namespace walker
