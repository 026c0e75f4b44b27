#include "walker_sim/pool.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "base/checks.h"
#include "base/interruption.h"
#include "base/limits.h"
#include "episode/thread_pool.h"
#include "episode/walker.h"

namespace walker {
namespace {

constexpr std::array<const char*, 3> kAutoresetModes{"next_step", "same_step", "disabled"};

std::string name_of(std::size_t index) { return "environment " + std::to_string(index) + ": "; }

PoolOptions complete(PoolOptions options) {
  check_number("num_envs", options.num_envs, 1, kMaxPoolSize);
  check_number("num_threads", options.num_threads, 0, kMaxThreads);
  check_number("batch_size", options.batch_size, 0, options.num_envs);
  if (options.num_threads == 0) {
    options.num_threads = std::min({num_processors(), kMaxThreads, options.num_envs});
  }
  if (options.batch_size == 0) options.batch_size = options.num_envs;
  return options;
}

/// Returns the size at which each thread gets one group. Smaller groups compute less in common,
/// which costs more than threads that idle while others finish their group.
std::size_t max_group(const PoolOptions& options) {
  return (options.batch_size + options.num_threads - 1) / options.num_threads;
}

template <typename T>
void write_row(const std::vector<double>& from, T* to, std::size_t row) {
  if (to == nullptr) return;
  std::transform(from.begin(), from.end(), to + row * from.size(),
                 [](double value) { return static_cast<T>(value); });
}

template <typename T, typename Value>
void write_value(Value value, T* to, std::size_t row) {
  if (to != nullptr) to[row] = value;
}

/// A walker and its autoreset state. Cache-line aligned, as different threads may write
/// neighbours.
struct alignas(kCacheLine) Slot {
  std::unique_ptr<Walker> walker;
  bool wants_reset = false;
  std::optional<std::uint64_t> seed;  ///< of the requested reset
  bool has_final = false;
  EpisodeState final_state;  ///< same_step: of the episode that ended in the last call

  const EpisodeState& state() const { return walker->state(); }
  /// The state after the last step or reset; with same_step possibly the ended episode's.
  const EpisodeState& outcome() const { return has_final ? final_state : state(); }
  bool is_reset_by_step() const {
    return wants_reset || !state().has_begun() || state().has_ended();
  }
};

void write(const Slot& slot, const Batch& batch, std::size_t row) {
  const EpisodeState& state = slot.state();
  const EpisodeState& outcome = slot.outcome();
  write_row(state.observation, batch.observations, row);
  write_row(state.observation, batch.single_observations, row);
  write_row(state.info, batch.info, row);
  write_value(outcome.reward, batch.rewards, row);
  write_value(outcome.terminated, batch.terminated, row);
  write_value(outcome.truncated, batch.truncated, row);
  write_value(state.episode, batch.episodes, row);
  write_value(state.step, batch.steps, row);
  if (!slot.has_final) return;
  write_row(outcome.observation, batch.final_observations, row);
  write_row(outcome.info, batch.final_info, row);
}

}  // namespace

const char* to_text(AutoresetMode mode) {
  return kAutoresetModes.at(static_cast<std::size_t>(mode));
}

std::optional<AutoresetMode> find_autoreset_mode(const std::string& text) {
  for (int i = 0; i < static_cast<int>(kAutoresetModes.size()); ++i) {
    if (text == kAutoresetModes[i]) return static_cast<AutoresetMode>(i);
  }
  return std::nullopt;
}

struct Pool::Implementation {
  Implementation(const std::function<std::unique_ptr<Environment>()>& make,
                 const PoolOptions& given)
      : options(complete(given)),
        slots(make_slots(make, options)),
        is_under_way(options.num_envs),
        last_list(options.num_envs),
        all(options.num_envs),
        arrived(options.num_envs),
        action_size(specification().action_size()),
        group_size(std::min(slots[0].walker->group_size(), max_group(options))),
        threads(options.num_envs, options.num_threads, group_size,
                [this](const std::uint32_t* indices, std::size_t count) { work(indices, count); }) {
    std::iota(all.begin(), all.end(), 0U);
    if (options.autoreset_mode == AutoresetMode::same_step) ended.reserve(options.num_envs);
  }

  static std::vector<Slot> make_slots(const std::function<std::unique_ptr<Environment>()>& make,
                                      const PoolOptions& options) {
    std::vector<Slot> slots(options.num_envs);
    for (std::uint32_t i = 0; i < options.num_envs; ++i) {
      check_interruption();
      slots[i].walker.reset(&walker_of(*make().release()));
      Walker& walker = *slots[i].walker;
      const Walker& first = *slots[0].walker;
      if (!walker.can_step_together(first)) {
        throw std::invalid_argument(name_of(i) + walker.specification().id +
                                    "; must be as the first one, " + first.specification().id +
                                    " with the same parameters");
      }
      walker.set_index(i);
      if (options.autoreset_mode != AutoresetMode::same_step) continue;
      slots[i].final_state = walker.state();
      slots[i].final_state.action.reserve(walker.specification().action_size());
      slots[i].final_state.end_reason.reserve(kMaxEndReason);
    }
    return slots;
  }

  const Specification& specification() const { return slots[0].walker->specification(); }

  /// Steps environments together, or resets those whose reset is due, and writes their rows.
  void work(const std::uint32_t* indices, std::size_t count) {
    if (is_dropping.load(std::memory_order_relaxed)) return drop(indices, count);
    std::array<Walker::GroupStep, kMaxGroupSize> steps;
    for (std::size_t i = 0; i < count; ++i) {
      Slot& slot = slots[indices[i]];
      steps[i] = {slot.walker.get(), nullptr, std::exchange(slot.seed, std::nullopt)};
      if (!slot.is_reset_by_step()) steps[i].action = actions + indices[i] * action_size;
      slot.wants_reset = false;
    }
    Walker::step_group(steps.data(), count);
    std::size_t num_resets = 0;
    for (std::size_t i = 0; i < count && resets_ended; ++i) {
      Slot& slot = slots[indices[i]];
      if (keep_final(slot)) steps[num_resets++] = {slot.walker.get(), nullptr, {}};
    }
    Walker::step_group(steps.data(), num_resets);
    if (batch == nullptr) return;
    std::for_each(indices, indices + count,
                  [this](std::uint32_t i) { write(slots[i], *batch, i); });
  }

  /// Leaves the environments as they are.
  void drop(const std::uint32_t* indices, std::size_t count) {
    std::for_each(indices, indices + count, [this](std::uint32_t i) {
      slots[i].wants_reset = false;
      slots[i].seed = std::nullopt;
    });
  }

  /// Keeps the state of an episode that has ended under same_step. @return whether to reset it now
  bool keep_final(Slot& slot) const {
    slot.has_final = options.autoreset_mode == AutoresetMode::same_step && slot.state().has_ended();
    if (slot.has_final) slot.final_state = slot.state();
    return slot.has_final && !slot.state().failed_at_reset();
  }

  /// Steps all environments, and makes a call between the steps and the autoresets.
  void step_all(const double* wanted_actions, const Batch& rows,
                const std::function<void()>& on_stepped) {
    for (Slot& slot : slots) slot.has_final = false;
    run(wanted_actions, &rows, all.data(), all.size(), /*with_autoresets=*/false);
    on_stepped();
    if (options.autoreset_mode != AutoresetMode::same_step) return;
    ended.clear();
    for (const std::uint32_t index : all) {
      if (keep_final(slots[index])) {
        ended.push_back(index);
      } else if (slots[index].has_final) {
        write(slots[index], rows, index);
      }
    }
    if (!ended.empty()) run(nullptr, &rows, ended.data(), ended.size(), /*with_autoresets=*/false);
  }

  std::size_t num_groups(std::size_t count) const { return (count + group_size - 1) / group_size; }

  /// Steps or resets environments and blocks until all are done. An interruption drops those that
  /// no thread has begun.
  /// @param rows output for all environments, written by the threads; null: the caller writes it
  /// @param with_autoresets whether the threads reset environments that have ended under same_step
  void run(const double* wanted_actions, const Batch* rows, const std::uint32_t* environments,
           std::size_t count, bool with_autoresets = true) {
    actions = wanted_actions;
    batch = rows;
    resets_ended = with_autoresets;
    std::for_each(environments, environments + count,
                  [this](std::uint32_t index) { threads.add(index); });
    threads.start(num_groups(count) - 1);  // the caller works on one itself
    try {
      threads.collect(count, arrived.data(), check_step_interruption);
    } catch (...) {  // the threads use the caller's arrays
      is_dropping = true;
      threads.collect(count, arrived.data());
      is_dropping = false;
      throw;
    }
  }

  void begin_sending() {
    if (num_under_way != 0) return;  // already set, and the threads are reading them
    sent_actions.resize(options.num_envs * action_size);
    actions = sent_actions.data();
    batch = nullptr;
    resets_ended = true;
  }

  /// Copies the actions of listed environments to their rows in `sent_actions`.
  void take_actions(const double* given, const std::uint32_t* environments, std::size_t count) {
    begin_sending();
    for (std::size_t i = 0; i < count; ++i) {
      std::copy_n(given + i * action_size, action_size,
                  &sent_actions[environments[i] * action_size]);
    }
  }

  void put_under_way(const std::uint32_t* environments, std::size_t count) {
    begin_sending();
    std::for_each(environments, environments + count, [this](std::uint32_t index) {
      is_under_way[index] = 1;
      threads.add(index);
    });
    num_under_way += count;
    threads.start(num_groups(count));
  }

  void require_none_under_way(const char* call) const {
    if (num_under_way == 0) return;
    throw std::logic_error(std::string(call) + ": " + std::to_string(num_under_way) +
                           " environments are under way; receive them first");
  }

  /// @throws std::invalid_argument if the index is out of range, std::logic_error if under way
  Slot& slot_at_rest(std::size_t index) {
    if (index >= options.num_envs) {
      throw std::invalid_argument(name_of(index) + "must be in [0, " +
                                  std::to_string(options.num_envs - 1) + "]");
    }
    if (is_under_way[index] != 0) {
      throw std::logic_error(name_of(index) + "is under way; receive it first");
    }
    return slots[index];
  }

  void check_list(const std::uint32_t* environments, std::size_t count) {
    ++num_lists;
    for (const std::uint32_t* index = environments; index != environments + count; ++index) {
      slot_at_rest(*index);
      if (std::exchange(last_list[*index], num_lists) == num_lists) {
        throw std::invalid_argument(name_of(*index) + "listed twice");
      }
    }
  }

  /// Returns the listed environments, or all for an empty list.
  const std::vector<std::uint32_t>& checked_list(const std::vector<std::uint32_t>& environments) {
    const std::vector<std::uint32_t>& listed = environments.empty() ? all : environments;
    check_list(listed.data(), listed.size());
    return listed;
  }

  void check_steps(const double* given, const std::uint32_t* environments, std::size_t count) {
    // Once every episode has begun, only `disabled` refuses steps. Skipping the check then avoids
    // reading cache lines that other threads have written.
    const bool is_checked = !all_have_begun || options.autoreset_mode == AutoresetMode::disabled;
    for (std::size_t i = 0; i < count; ++i) {
      check_action_of(environments[i], specification(), given + i * action_size);
      if (is_checked) require_episode(environments[i]);
    }
    all_have_begun = all_have_begun || count == slots.size();
  }

  /// @throws ResetNeeded naming the environment if it needs a reset that a step does not make
  void require_episode(std::size_t index) const {
    const EpisodeState& state = slots[index].state();
    if (state.has_begun() && !state.has_ended()) return;
    const std::string refusal = state.step_refusal(options.autoreset_mode);
    if (!refusal.empty()) throw ResetNeeded(name_of(index) + refusal + "; reset first");
  }

  PoolOptions options;
  std::vector<Slot> slots;
  std::size_t num_under_way = 0;
  std::vector<std::uint8_t> is_under_way;
  std::uint64_t num_lists = 0;           // lists checked so far
  std::vector<std::uint64_t> last_list;  // per environment: number of the last list with it
  std::vector<std::uint32_t> all;        // 0 .. num_envs - 1
  std::vector<std::uint32_t> arrived;
  std::vector<std::uint32_t> ended;  // under same_step, in the last `step_all`
  std::vector<double> sent_actions;  // num_envs x action size; empty before the first list
  std::size_t action_size;
  std::size_t group_size;
  bool all_have_begun = false;
  std::atomic<bool> is_dropping{false};
  // Read by the threads; constant while environments are under way.
  bool resets_ended = true;         // under same_step, the threads reset ended environments
  const double* actions = nullptr;  // num_envs x action size
  const Batch* batch = nullptr;     // rows of all environments; null: the threads write none
  ThreadPool threads;               // last, so that its threads end before their data
};

Pool::Pool(const std::function<std::unique_ptr<Environment>()>& make, const PoolOptions& options)
    : implementation_(std::make_unique<Implementation>(make, options)) {}

Pool::~Pool() = default;

const Specification& Pool::specification() const { return implementation_->specification(); }

const PoolOptions& Pool::options() const { return implementation_->options; }

void Pool::reset(const std::vector<std::uint32_t>& environments,
                 const std::vector<std::optional<std::uint64_t>>& seeds, const Batch& batch) {
  Implementation& pool = *implementation_;
  pool.require_none_under_way("reset");
  const std::vector<std::uint32_t>& listed = pool.checked_list(environments);
  if (!seeds.empty() && seeds.size() != listed.size()) {
    throw std::invalid_argument(std::to_string(seeds.size()) + " seeds; must be 0, or " +
                                std::to_string(listed.size()) + ", one per environment");
  }
  for (std::size_t i = 0; i < listed.size(); ++i) {
    Slot& slot = pool.slots[listed[i]];
    slot.wants_reset = true;
    slot.seed = seeds.empty() ? std::nullopt : seeds[i];
  }
  pool.run(nullptr, &batch, listed.data(), listed.size());
  pool.all_have_begun = pool.all_have_begun || listed.size() == pool.slots.size();
}

void Pool::step(const double* actions, std::size_t size, const Batch& batch,
                const std::function<void()>& on_stepped) {
  Implementation& pool = *implementation_;
  pool.require_none_under_way("step");
  check_actions_size(specification(), size, pool.options.num_envs);
  pool.check_steps(actions, pool.all.data(), pool.all.size());
  if (on_stepped) {
    pool.step_all(actions, batch, on_stepped);
  } else {
    pool.run(actions, &batch, pool.all.data(), pool.all.size());
  }
}

void Pool::step(const double* actions, const std::uint32_t* environments, std::size_t count,
                const Batch& batch) {
  Implementation& pool = *implementation_;
  pool.require_none_under_way("step");
  if (count == 0) throw std::invalid_argument("step: no environment is listed");
  pool.check_list(environments, count);
  pool.check_steps(actions, environments, count);
  pool.take_actions(actions, environments, count);
  pool.run(pool.sent_actions.data(), nullptr, environments, count);
  for (std::size_t row = 0; row < count; ++row) write(pool.slots[environments[row]], batch, row);
}

void Pool::send(const double* actions, const std::uint32_t* environments, std::size_t count) {
  Implementation& pool = *implementation_;
  pool.check_list(environments, count);
  pool.check_steps(actions, environments, count);
  pool.take_actions(actions, environments, count);
  pool.put_under_way(environments, count);
}

void Pool::send_resets(const std::vector<std::uint32_t>& environments) {
  Implementation& pool = *implementation_;
  const std::vector<std::uint32_t>& listed = pool.checked_list(environments);
  for (const std::uint32_t index : listed) pool.slots[index].wants_reset = true;
  pool.put_under_way(listed.data(), listed.size());
  pool.all_have_begun = pool.all_have_begun || listed.size() == pool.slots.size();
}

void Pool::recv(const Batch& batch, std::uint32_t* environments) {
  Implementation& pool = *implementation_;
  const std::size_t size = pool.options.batch_size;
  if (pool.num_under_way < size) {
    throw std::logic_error("recv: " + std::to_string(pool.num_under_way) +
                           " environments are under way; must be at least " + std::to_string(size) +
                           ", the batch size");
  }
  pool.threads.collect(size, environments, check_step_interruption);
  for (std::size_t row = 0; row < size; ++row) {
    pool.is_under_way[environments[row]] = 0;
    write(pool.slots[environments[row]], batch, row);
  }
  pool.num_under_way -= size;
}

void Pool::save_state(std::size_t index, std::vector<std::byte>& state) const {
  implementation_->slot_at_rest(index).walker->save_state(state);
}

void Pool::load_states(const std::vector<std::uint32_t>& environments,
                       const std::vector<std::vector<std::byte>>& states, const Batch& batch) {
  Implementation& pool = *implementation_;
  pool.require_none_under_way("load_states");
  const std::vector<std::uint32_t>& listed = pool.checked_list(environments);
  if (states.size() != listed.size()) {
    throw std::invalid_argument(std::to_string(states.size()) + " states; must be " +
                                std::to_string(listed.size()) + ", one per environment");
  }
  std::vector<std::function<void()>> loads(states.size());
  for (std::size_t i = 0; i < states.size(); ++i) {
    check_step_interruption();
    try {
      loads[i] = pool.slots[listed[i]].walker->read_state(states[i].data(), states[i].size());
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(name_of(listed[i]) + error.what());
    }
  }
  pool.all_have_begun = false;
  for (std::size_t i = 0; i < loads.size(); ++i) {
    loads[i]();
    pool.slots[listed[i]].has_final = false;
    write(pool.slots[listed[i]], batch, listed[i]);
  }
}

void Pool::set_world(const std::vector<std::uint32_t>& environments,
                     const std::vector<World>& worlds) {
  Implementation& pool = *implementation_;
  const std::vector<std::uint32_t>& listed = pool.checked_list(environments);
  if (worlds.size() != 1 && worlds.size() != listed.size()) {
    throw std::invalid_argument(std::to_string(worlds.size()) + " worlds; must be 1, or " +
                                std::to_string(listed.size()) + ", one per environment");
  }
  std::vector<std::shared_ptr<const CheckedWorld>> checked(worlds.size());
  for (std::size_t i = 0; i < worlds.size(); ++i) {
    check_step_interruption();
    checked[i] = CheckedWorld::share(specification(), worlds[i]);
  }
  for (std::size_t i = 0; i < listed.size(); ++i) {
    pool.slots[listed[i]].walker->set_world(checked[worlds.size() == 1 ? 0 : i]);
  }
}

Environment& Pool::environment(std::size_t index) { return walker(index); }

Walker& Pool::walker(std::size_t index) { return *implementation_->slot_at_rest(index).walker; }

const EpisodeState& Pool::outcome(std::size_t index) const {
  return implementation_->slot_at_rest(index).outcome();
}

const char* Pool::error(std::size_t index) const {
  return outcome(index).failed_at_reset() ? "" : outcome(index).error.c_str();
}

const char* Pool::reset_error(std::size_t index) const {
  const EpisodeState& state = implementation_->slot_at_rest(index).state();
  return state.failed_at_reset() ? state.error.c_str() : "";
}

const char* Pool::end_reason(std::size_t index) const { return outcome(index).end_reason_detail(); }

}  // namespace walker
