#include "episode/saved_state.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

#include "base/engine_release.h"
#include "episode/walker.h"

namespace walker {
namespace {

constexpr std::array<char, 8> kMagic{'W', 'A', 'L', 'K', 'E', 'R', 'S', 'T'};

/// Offsets in the header. Size and checksum cover the bytes from kBodyAt on.
constexpr std::size_t kSizeAt = kMagic.size() + sizeof(kStateFormat);
constexpr std::size_t kChecksumAt = kSizeAt + sizeof(std::uint64_t);
constexpr std::size_t kBodyAt = kChecksumAt + sizeof(std::uint64_t);

using Fields = std::vector<std::pair<std::string, std::string>>;

Fields fields_of(const Specification& specification) {
  Fields fields{{"id", specification.id},
                {"engine", specification.engine},
                {"engine_version", engine_release(specification.engine_version)}};
  for (const auto& [name, value] : describe_origin(specification).parameters) {
    if (name != "max_episode_steps") fields.emplace_back("parameter " + name, value);
  }
  return fields;
}

Fields read_fields(StateReader& reader) {
  constexpr std::size_t kMinBytes = 2 * sizeof(std::uint32_t);
  Fields fields(reader.count(kMinBytes));
  for (auto& [name, value] : fields) {
    name = reader.text();
    value = reader.text();
  }
  return fields;
}

[[noreturn]] void refuse(const std::string& name, const std::string& there,
                         const std::string& here) {
  throw std::invalid_argument("the state is of another environment: " + name + " = " + there +
                              " there; here it is " + here);
}

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
  state.episode_return = reader.finite_number<double>("the return");
  reader.finite_numbers(state.observation.data(), state.observation.size(), "the observation");
  reader.numbers(state.info.data(), state.info.size());
  const auto is_infinite = [](double value) { return std::isinf(value); };  // NaN: absent
  if (std::any_of(state.info.begin(), state.info.end(), is_infinite)) {
    refuse_state("the info must be finite");
  }
  state.reward = reader.finite_number<double>("the reward");
  state.terminated = reader.flag();
  state.truncated = reader.flag();
  const std::string end_reason = reader.text();
  if (state.has_ended()) {
    state.end_reason = (state.terminated ? "terminated: " : "truncated: ") + end_reason;
  }
  state.error = reader.text();
  if (phase != phase_of(state)) refuse_state("its phase contradicts its outcome");
}

World read_world(StateReader& reader) { return parse_world(reader.text(), "of the state"); }

}  // namespace

StateOrigin::StateOrigin(const Specification& specification) {
  StateWriter writer(text_);
  const Fields fields = fields_of(specification);
  writer.number(static_cast<std::uint32_t>(fields.size()));
  for (const auto& [name, value] : fields) {
    writer.text(name);
    writer.text(value);
  }
}

std::size_t StateOrigin::begin(std::vector<std::byte>& state) const {
  const std::size_t begin = state.size();
  StateWriter writer(state);
  writer.numbers(kMagic.data(), kMagic.size());
  writer.number(kStateFormat);
  writer.number(std::uint64_t{0});  // `seal` fills in size and checksum
  writer.number(std::uint64_t{0});
  writer.numbers(text_.data(), text_.size());
  return begin;
}

void StateOrigin::seal(std::vector<std::byte>& state, std::size_t begin) {
  std::byte* const header = state.data() + begin;
  const std::uint64_t size = state.size() - begin - kBodyAt;
  const std::uint64_t sum = checksum(header + kBodyAt, size);
  std::memcpy(header + kSizeAt, &size, sizeof size);
  std::memcpy(header + kChecksumAt, &sum, sizeof sum);
}

StateReader StateOrigin::open(const std::byte* state, std::size_t size) const {
  if (size < kMagic.size() || std::memcmp(state, kMagic.data(), kMagic.size()) != 0) {
    throw std::invalid_argument("these " + std::to_string(size) +
                                " bytes are no saved state; one begins with " +
                                std::string(kMagic.data(), kMagic.size()));
  }
  StateReader reader(state + kMagic.size(), size - kMagic.size());
  const auto format = reader.number<std::uint32_t>();
  if (format != kStateFormat) {
    throw std::invalid_argument("the state has format version " + std::to_string(format) +
                                "; must be " + std::to_string(kStateFormat));
  }
  const auto body_size = reader.number<std::uint64_t>();
  const auto sum = reader.number<std::uint64_t>();
  if (body_size != reader.size()) {
    refuse_state("after its header it has " + std::to_string(reader.size()) + " bytes; must have " +
                 std::to_string(body_size));
  }
  if (sum != checksum(reader.next(), reader.size())) {
    refuse_state("its checksum does not match");
  }
  if (reader.size() < text_.size() || std::memcmp(reader.next(), text_.data(), text_.size()) != 0) {
    throw_difference(reader);
  }
  return {reader.next() + text_.size(), reader.size() - text_.size()};
}

/// Throws the error for the first difference, in the order of this environment's fields.
void StateOrigin::throw_difference(StateReader reader) const {
  const std::string absent = "(absent)";
  StateReader own_reader(text_.data(), text_.size());
  const Fields own = read_fields(own_reader);
  std::map<std::string, std::string> there;
  for (auto& [name, value] : read_fields(reader)) there[name] = value;
  for (const auto& [name, value] : own) {
    const auto found = there.find(name);
    if (found == there.end()) refuse(name, absent, value);
    if (found->second != value) refuse(name, found->second, value);
    there.erase(found);
  }
  for (const auto& [name, value] : there) refuse(name, value, absent);
  refuse_state("it names its origin in another order");
}

const StateOrigin& Walker::origin() const {
  if (!origin_) origin_.emplace(specification());
  return *origin_;
}

void Walker::save_state(std::vector<std::byte>& state) const {
  const std::size_t begin = origin().begin(state);
  StateWriter writer(state);
  write(state_, writer);
  writer.number(std::uint8_t{generator_.has_value()});
  if (generator_) writer.numbers(generator_->state().data(), std::tuple_size_v<GeneratorState>);
  writer.text(to_string(world()));
  writer.text(to_string(drawn_world()));
  writer.numbers(state_.generator_state.data(), state_.generator_state.size());
  if (values_) values_->save(writer);
  if (disturbances_) disturbances_->save(writer);
  robot_->save(writer);
  StateOrigin::seal(state, begin);
}

std::function<void()> Walker::read_state(const std::byte* state, std::size_t size) {
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
  const auto world = CheckedWorld::share(specification(), read_world(reader));
  const World drawn = read_world(reader);
  check_drawn_world(specification(), drawn);
  reader.numbers(read_state.generator_state.data(), read_state.generator_state.size());
  std::optional<EpisodeValues> values;
  std::shared_ptr<Disturbances> disturbances;  // std::function needs a copyable one
  if (!drawn.empty()) {
    read_state.world = std::make_shared<const World>(drawn);
    values.emplace(drawn, specification().dt, read_state.generator_state);
    values->load(reader);
    if (Disturbances::has_any(values->present())) {
      disturbances = std::make_shared<Disturbances>(values->present(), specification(),
                                                    read_state.generator_state);
      disturbances->load(reader);
    }
  }
  const bool is_alive =
      read_state.has_begun() && (!read_state.has_ended() || read_state.error.empty());
  std::function<void()> load_robot =
      robot_->load(reader, values ? values->present() : WorldValues{}, is_alive);
  reader.finish();
  return [this, read_state = std::move(read_state), generator, world, values, disturbances,
          load_robot = std::move(load_robot)] {
    load_robot();
    generator_ = generator;
    world_ = world;
    disturbances_ = disturbances ? std::make_unique<Disturbances>(*disturbances) : nullptr;
    values_ = values;
    step_.push = {};
    step_.forces = nullptr;
    step_.wrenches.clear();
    const std::uint32_t next_episode = state_.episode + 1;
    const std::uint32_t environment = state_.environment;
    state_ = read_state;  // copies in place: step_.info points to the buffer of state_.info
    state_.environment = environment;
    if (state_.has_begun()) state_.episode = next_episode;
    actions_.clear();
    pushes_.clear();
    coordinates_.clear();
    was_loaded_ = state_.has_begun();
    forget_sensors();
  };
}

Progress Walker::load_state(const std::byte* state, std::size_t size, Result& result) {
  load_state(state, size);
  if (state_.has_begun()) copy_to(result);
  return {state_.has_begun(), state_.step, state_.episode_return};
}

}  // namespace walker
