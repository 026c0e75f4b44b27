#include "episode/walker.h"

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>
#include <typeinfo>
#include <utility>

#include "base/checks.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

/// Returns the exception's message, never empty.
std::string message_of(const std::exception_ptr& thrown) {
  std::string message;
  try {
    std::rethrow_exception(thrown);
  } catch (const std::exception& exception) {
    message = exception.what();
  } catch (...) {
    message = "the exception is not a std::exception";
  }
  return message.empty() ? "the exception has no message" : message;
}

}  // namespace

std::string EpisodeState::step_refusal() const {
  if (has_ended() && !error.empty()) return kStepFailed;
  return step_refusal(AutoresetMode::disabled);
}

std::string EpisodeState::step_refusal(AutoresetMode mode) const {
  if (!has_begun()) return "there is no episode yet";
  if (!has_ended() || mode != AutoresetMode::disabled) return "";
  if (failed_at_reset()) return kResetFailed;
  return "the episode ended after " + std::to_string(step) + " steps";
}

const World& EpisodeState::drawn_world() const {
  static const World kNone;
  return world ? *world : kNone;
}

const char* EpisodeState::end_reason_detail() const {
  const std::size_t colon = end_reason.find(": ");
  return colon == std::string::npos ? "" : &end_reason[colon + 2];
}

Walker::Walker(std::unique_ptr<Robot> robot) : robot_(std::move(robot)) {
  state_.action.reserve(specification().action_size());
  state_.observation.resize(specification().observation_size());
  state_.info.resize(specification().info_names.size());
  state_.end_reason.reserve(kMaxEndReason);
  step_.robot = robot_.get();
  step_.info = state_.info.data();
}

void Walker::configure(const WalkerOptions& options) {
  options_ = options;
  if (!options.records_actions) return;
  const std::size_t steps = std::min(specification().max_episode_steps, kMaxRecordedSteps);
  actions_.reserve(steps * specification().action_size());
  checksums_.reserve(steps + 1);
}

void Walker::reset(std::optional<std::uint64_t> seed) {
  take_seed(seed);
  begin_episode(seed);
}

void Walker::take_seed(std::optional<std::uint64_t>& seed) {
  if (!seed && !state_.has_begun()) seed = options_.first_seed;
  if (seed) generator_.emplace(*seed);
}

/// @param recorded what the world has drawn, which the episode's own does not draw; null: it does
void Walker::begin_episode(std::optional<std::uint64_t> seed,
                           const std::shared_ptr<const World>& recorded) {
  if (!prepare_reset(seed, recorded)) return;
  RobotStep* const reset = &step_;
  robot_->step_group(&reset, 1);
  conclude_reset();
}

/// @return whether there are a generator and a world; if not, the reset has failed and is concluded
bool Walker::prepare_reset(std::optional<std::uint64_t> seed,
                           const std::shared_ptr<const World>& recorded) {
  ++state_.episode;
  state_.step = 0;
  state_.action.clear();
  state_.reward = 0;
  state_.episode_return = 0;
  state_.terminated = false;
  state_.truncated = false;
  state_.end_reason.clear();
  state_.error.clear();
  state_.seed = seed;
  step_.wrenches.clear();
  actions_.clear();
  pushes_.clear();
  coordinates_.clear();
  checksums_.clear();
  was_loaded_ = false;
  forget_sensors();
  state_.generator_state = {};
  try {
    if (!generator_) generator_.emplace(draw_seed());
    state_.generator_state = generator_->state();
    if (world_ || recorded || state_.world) prepare_world(recorded);
  } catch (...) {
    step_.failure = std::current_exception();
    conclude_reset();
    return false;
  }
  step_.generator = &*generator_;
  return true;
}

/// Applies the world of the episode that begins.
/// @param drawn null: as the world draws it; empty: Gymnasium's
void Walker::prepare_world(std::shared_ptr<const World> drawn) {
  const GeneratorState& episode = state_.generator_state;
  if (!drawn && world_) drawn = std::make_shared<const World>(world_->draw(episode));
  if (drawn && drawn->empty()) drawn = nullptr;
  std::optional<EpisodeValues> values;
  if (drawn) values.emplace(*drawn, specification().dt, episode);
  // This may throw, so it comes first: nothing else has changed then.
  robot_->set_world(values ? values->present() : WorldValues{});
  disturbances_.reset();
  step_.push = {};
  step_.forces = nullptr;
  state_.world = std::move(drawn);
  values_ = std::move(values);
  if (values_ && Disturbances::has_any(values_->present())) {
    disturbances_ = std::make_unique<Disturbances>(values_->present(), specification(), episode);
  }
}

void Walker::observe() {
  if (disturbances_) {
    disturbances_->observe(*robot_, state_.step, state_.observation.data());
  } else {
    robot_->observe(state_.observation.data());
  }
}

void Walker::conclude_reset() {
  step_.generator = nullptr;
  if (step_.failure) {
    // The outcome must not depend on the episode before.
    std::fill(state_.observation.begin(), state_.observation.end(), 0);
    fail(kResetFailed, std::exchange(step_.failure, nullptr));
  } else {
    observe();
  }
  if (options_.records_actions) record_checksum();
}

void Walker::step(const double* action, std::size_t size) {
  const std::string refusal = state_.step_refusal();
  if (!refusal.empty()) throw ResetNeeded("step: " + refusal + "; reset first");
  check_action(specification(), action, size);
  if (prepare(action)) {
    try {
      robot_->step(step_);
    } catch (...) {
      step_.failure = std::current_exception();
    }
  }
  conclude();
}

void Walker::push(const LinkWrench& wrench) {
  const std::string refusal = state_.step_refusal();
  if (!refusal.empty()) throw ResetNeeded("push: " + refusal + "; reset first");
  check_wrench(wrench, specification());
  if (wrench.force_x != 0 || wrench.force_z != 0 || wrench.torque_y != 0) {
    add_wrench(wrench);
    return;
  }
  std::vector<LinkWrench>& wrenches = step_.wrenches;
  const auto is_on_link = [&](const LinkWrench& each) { return each.link == wrench.link; };
  wrenches.erase(std::remove_if(wrenches.begin(), wrenches.end(), is_on_link), wrenches.end());
}

void Walker::add_wrench(const LinkWrench& wrench) {
  std::vector<LinkWrench>& wrenches = step_.wrenches;
  const auto place =
      std::lower_bound(wrenches.begin(), wrenches.end(), wrench,
                       [](const LinkWrench& a, const LinkWrench& b) { return a.link < b.link; });
  if (place != wrenches.end() && place->link == wrench.link) {
    *place = wrench;
    return;
  }
  if (pushes_.size() + wrenches.size() >= kMaxRecordedPushes) {
    throw std::logic_error("the episode has " + std::to_string(kMaxRecordedPushes) +
                           " pushes, as many as its record can have");
  }
  wrenches.insert(place, wrench);
}

bool Walker::can_step_together(const Walker& other) const {
  const Specification& a = specification();
  const Specification& b = other.specification();
  const Robot& robot = *robot_;
  const Robot& other_robot = *other.robot_;
  return typeid(robot) == typeid(other_robot) && a.id == b.id && a.parameters == b.parameters &&
         a.observation_size() == b.observation_size() && a.action_size() == b.action_size() &&
         a.info_names == b.info_names;
}

std::size_t Walker::group_size() const {
  return std::clamp<std::size_t>(robot_->group_size(), 1, kMaxGroupSize);
}

void Walker::step_group(const GroupStep* steps, std::size_t count) noexcept {
  if (count == 0) return;
  std::array<RobotStep*, kMaxGroupSize> robot_steps;
  std::array<Walker*, kMaxGroupSize> walkers;
  std::size_t num_robots = 0;
  for (const GroupStep* step = steps; step != steps + count; ++step) {
    Walker& walker = *step->walker;
    if (step->action != nullptr) {
      if (!walker.prepare(step->action)) {
        walker.conclude();
        continue;
      }
    } else {
      std::optional<std::uint64_t> seed = step->seed;
      walker.take_seed(seed);
      if (!walker.prepare_reset(seed)) continue;
    }
    robot_steps[num_robots] = &walker.step_;
    walkers[num_robots++] = &walker;
  }
  if (num_robots != 0) steps[0].walker->robot_->step_group(robot_steps.data(), num_robots);
  for (std::size_t i = 0; i < num_robots; ++i) {
    if (walkers[i]->step_.generator != nullptr) {
      walkers[i]->conclude_reset();
    } else {
      walkers[i]->conclude();
    }
  }
}

/// @return whether the robot can step; if not, the step has failed
bool Walker::prepare(const double* action) {
  const std::size_t size = specification().action_size();
  state_.action.assign(action, action + size);
  step_.action = action;
  if (values_ && values_->begin_step(state_.step + 1)) change_physics();
  if (disturbances_) disturbances_->begin_step(action, state_.step + 1, step_);
  step_.terminated = false;
  step_.end_reason = "";
  if (options_.records_actions && !was_loaded_ && state_.step < kMaxRecordedSteps) {
    actions_.insert(actions_.end(), action, action + size);
    for (const LinkWrench& wrench : step_.wrenches) pushes_.push_back({state_.step + 1, wrench});
  } else if (!actions_.empty()) {
    actions_ = {};
    pushes_ = {};
    coordinates_ = {};
    checksums_ = {};
  }
  return !step_.failure;
}

void Walker::change_physics() {
  try {
    robot_->change_physics(values_->present());
    if (disturbances_) disturbances_->set_forces(values_->present());
  } catch (...) {
    step_.failure = std::current_exception();
  }
}

void Walker::conclude() {
  ++state_.step;
  step_.wrenches.clear();
  forget_sensors();
  if (step_.failure) {
    fail(kStepFailed, std::exchange(step_.failure, nullptr));
  } else {
    take_outcome();
  }
  if (!actions_.empty()) record_checksum();
}

void Walker::take_outcome() {
  observe();
  state_.reward = step_.reward;
  state_.episode_return += step_.reward;
  state_.terminated = step_.terminated;
  const std::uint32_t limit = specification().max_episode_steps;
  state_.truncated = limit != 0 && state_.step >= limit;
  if (state_.terminated) {
    end(step_.end_reason);
  } else if (state_.truncated) {
    end((std::to_string(limit) + " steps").c_str());
  }
}

void Walker::end(const char* reason) {
  state_.end_reason.assign(state_.terminated ? "terminated: " : "truncated: ");
  state_.end_reason.append(reason);
}

/// Ends the episode with reward 0 and NaN info; the observation is unchanged.
void Walker::fail(const char* reason, const std::exception_ptr& thrown) {
  std::fill(state_.info.begin(), state_.info.end(), std::numeric_limits<double>::quiet_NaN());
  state_.reward = 0;
  state_.terminated = true;
  state_.truncated = false;
  state_.error = message_of(thrown);
  end(reason);
}

const Sensors& Walker::sensors() {
  if (!sensors_are_fresh_) {
    require_state("sense");
    robot_->sense(sensors_);
    sensors_are_fresh_ = true;
  }
  return sensors_;
}

const Sensors& Walker::measurements() {
  if (!disturbances_) {
    measured_step_ = state_.step;
    return sensors();
  }
  if (!measurements_are_fresh_) {
    require_state("sense");
    measured_step_ = disturbances_->measure(*robot_, measurements_);
    measurements_are_fresh_ = true;
  }
  return measurements_;
}

void Walker::forget_sensors() {
  sensors_are_fresh_ = false;
  measurements_are_fresh_ = false;
}

const Scene& Walker::scene() {
  scene(scene_);
  return scene_;
}

void Walker::take_over(Walker& other) {
  other.state_.episode = other.state_.has_begun() ? state_.episode + 1 : 0;
  other.state_.environment = state_.environment;
  std::swap(robot_, other.robot_);
  std::swap(state_, other.state_);
  std::swap(step_, other.step_);
  std::swap(generator_, other.generator_);
  std::swap(actions_, other.actions_);
  std::swap(pushes_, other.pushes_);
  std::swap(coordinates_, other.coordinates_);
  std::swap(checksums_, other.checksums_);
  std::swap(was_loaded_, other.was_loaded_);
  std::swap(values_, other.values_);
  std::swap(disturbances_, other.disturbances_);
  forget_sensors();
  other.forget_sensors();
}

void Walker::set_world(const World& world) { world_ = CheckedWorld::share(specification(), world); }

void Walker::reset(std::optional<std::uint64_t> seed, Result& result) {
  reset(seed);
  if (state_.failed_at_reset()) throw std::runtime_error(state_.error);
  copy_to(result);
}

void Walker::step(const double* action, std::size_t size, Result& result) {
  step(action, size);
  copy_to(result);
}

void Walker::copy_to(Result& result) const {
  std::copy(state_.observation.begin(), state_.observation.end(), result.observation);
  std::copy(state_.info.begin(), state_.info.end(), result.info);
  result.reward = state_.reward;
  result.terminated = state_.terminated;
  result.truncated = state_.truncated;
  result.end_reason = state_.end_reason_detail();
  result.error = state_.error.c_str();
}

void Walker::sense(Sensors& sensors) { sensors = measurements(); }

void Walker::scene(Scene& scene) const {
  require_state("scene");
  robot_->scene(scene);
}

void Walker::require_state(const char* call) const {
  if (state_.has_begun() && state_.error.empty()) return;
  throw ResetNeeded(std::string(call) + ": " + state_.step_refusal() + "; reset first");
}

void Walker::capture(StateCapture& captured) {
  require_state("render");
  robot_->sense(captured.sensors);
  robot_->scene(captured.scene);
  captured.step = state_.step;
}

void capture(Environment& environment, std::uint32_t step, StateCapture& captured) {
  walker_of(environment).capture(captured);
  captured.step = step;
}

void Walker::set_coordinates(const std::vector<double>& position,
                             const std::vector<double>& velocity) {
  require_state("set_state");
  check_coordinates(specification(), position, velocity);
  if (coordinates_.size() >= kMaxRecordedCoordinates) {
    throw std::logic_error("set_state: the episode has been set " +
                           std::to_string(kMaxRecordedCoordinates) +
                           " times, as often as its record can have");
  }
  robot_->set_coordinates(position, velocity, state_.info.data());
  if (disturbances_) disturbances_->forget_past();
  observe();
  state_.reward = 0;
  state_.terminated = false;
  state_.truncated = false;
  state_.end_reason.clear();
  forget_sensors();
  if (!options_.records_actions || was_loaded_ || state_.step > kMaxRecordedSteps) return;
  coordinates_.push_back({state_.step, position, velocity});
  record_checksum();
}

void Walker::set_coordinates(const std::vector<double>& position,
                             const std::vector<double>& velocity, Result& result) {
  set_coordinates(position, velocity);
  copy_to(result);
}

std::optional<bool> Walker::is_healthy() const {
  const std::optional<bool> is_healthy = robot_->is_healthy();
  if (is_healthy) require_state("is_healthy");
  return is_healthy;
}

GeneratorState Walker::generator_state() const {
  return generator_ ? generator_->state() : GeneratorState{};
}

std::unique_ptr<Walker> make_walker(const std::string& id, const Parameters& given) {
  const Parameters complete = complete_parameters(parameter_descriptions(id), given);
  return std::make_unique<Walker>(find_registration(id).create(id, complete));
}

std::unique_ptr<Environment> make(const std::string& id, const Parameters& given) {
  return make_walker(id, given);
}

}  // namespace walker
