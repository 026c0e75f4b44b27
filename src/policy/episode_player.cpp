#include "walker_sim/episode_player.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

#include "base/checks.h"
#include "base/interruption.h"
#include "base/limits.h"
#include "episode/thread_pool.h"
#include "episode/walker.h"
#include "policy/network.h"

namespace walker {
namespace {

// More make no step faster, and more of them idle while the last episodes end.
constexpr std::size_t kEnvsPerThread = 64;

// Rows of a network between two checks for an interruption.
constexpr std::size_t kRowsPerCheck = 16;

struct Stopping : std::exception {};  // ends a worker after the failure of another one

/// One call of `play`, shared by its threads.
class PlayCall {
 public:
  PlayCall(const std::vector<const Policy*>& all_policies, const std::vector<EpisodeJob>& all_jobs,
           std::vector<std::shared_ptr<const CheckedWorld>> checked_worlds)
      : policies(all_policies), jobs(all_jobs), worlds(std::move(checked_worlds)) {}

  const std::vector<const Policy*>& policies;
  const std::vector<EpisodeJob>& jobs;
  std::vector<std::shared_ptr<const CheckedWorld>> worlds;  // null: Gymnasium's

  /// Returns the index of the next job; nullopt if all have begun or the call is ending.
  std::optional<std::size_t> take_job() {
    if (is_stopping_ || next_job_ >= jobs.size()) return std::nullopt;
    const std::size_t job = next_job_++;
    return job < jobs.size() ? std::optional(job) : std::nullopt;
  }

  /// Call between groups of environments, in every thread.
  /// @throws Stopping; Interrupted in the caller's thread
  void check() const {
    if (is_stopping_) throw Stopping();
    if (std::this_thread::get_id() == caller_) check_step_interruption();
  }

  void finish(std::size_t job, PlayedEpisode episode) {
    const std::lock_guard<std::mutex> lock(mutex_);
    finished_.emplace_back(job, std::move(episode));
    has_news_.notify_one();
  }

  /// Ends the call with the exception that is being handled.
  void fail() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!failure_) failure_ = std::current_exception();
    is_stopping_ = true;
    has_news_.notify_one();
  }

  /// Hands over the outcomes so far, in the caller's thread.
  /// @param patience upper bound of the time to wait for one
  void deliver(const EpisodePlayer::Receive& receive, std::chrono::milliseconds patience) {
    check_step_interruption();
    std::vector<std::pair<std::size_t, PlayedEpisode>> delivered;
    {
      std::unique_lock<std::mutex> lock(mutex_);
      has_news_.wait_for(lock, patience, [this] { return !finished_.empty() || is_stopping_; });
      std::swap(finished_, delivered);
    }
    num_delivered_ += delivered.size();
    for (const auto& [job, episode] : delivered) receive(job, episode);
  }

  bool is_done() const { return is_stopping_ || num_delivered_ == jobs.size(); }

  void rethrow() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  std::atomic<std::size_t> next_job_{0};
  std::atomic<bool> is_stopping_{false};
  std::thread::id caller_ = std::this_thread::get_id();
  std::mutex mutex_;
  std::condition_variable has_news_;
  std::vector<std::pair<std::size_t, PlayedEpisode>> finished_;
  std::exception_ptr failure_;
  std::size_t num_delivered_ = 0;
};

/// The environments of one thread, and the episodes that it is playing.
class Worker {
 public:
  explicit Worker(bool sums_observations) : sums_observations_(sums_observations) {}

  std::size_t num_envs() const { return slots_.size(); }
  const Specification& specification() const { return slots_.front()->walker->specification(); }

  void add(std::unique_ptr<Walker> walker) {
    slots_.push_back(std::make_unique<Slot>());
    slots_.back()->walker = std::move(walker);
  }

  /// Plays until no job is left, or the call ends early.
  /// @param after_step called after each step of all episodes
  template <typename AfterStep>
  void play(PlayCall& call, AfterStep after_step) {
    playing_.clear();
    free_.clear();
    for (const std::unique_ptr<Slot>& slot : slots_) free_.push_back(slot.get());
    const std::size_t action_size = specification().action_size();
    while (begin_episodes(call), !playing_.empty()) {
      act(call);
      step_together(playing_, call, [this, action_size](std::size_t i) {
        return Walker::GroupStep{playing_[i]->walker.get(), &actions_[i * action_size]};
      });
      const auto ended = std::stable_partition(playing_.begin(), playing_.end(), is_running);
      std::for_each(ended, playing_.end(), [&](Slot* slot) { conclude(*slot, call); });
      playing_.erase(ended, playing_.end());
      after_step();
    }
  }

 private:
  /// An environment and its present job.
  struct Slot {
    std::unique_ptr<Walker> walker;
    std::size_t job = 0;
    const Policy* policy = nullptr;
    std::optional<PolicyInput> input;
    PlayedEpisode outcome;  // only the sums, until the episode ends
  };

  static bool is_running(const Slot* slot) { return !slot->walker->state().has_ended(); }

  /// Gives jobs to free environments. One whose reset fails is free again.
  void begin_episodes(PlayCall& call) {
    while (true) {
      std::vector<Slot*> begun;
      while (!free_.empty()) {
        const std::optional<std::size_t> job = call.take_job();
        if (!job) break;
        begun.push_back(free_.back());
        free_.pop_back();
        assign(*begun.back(), *job, call);
      }
      if (begun.empty()) return;
      step_together(begun, call, [&](std::size_t i) {
        return Walker::GroupStep{begun[i]->walker.get(), nullptr, call.jobs[begun[i]->job].seed};
      });
      for (Slot* slot : begun) {
        if (is_running(slot)) {
          playing_.push_back(slot);
        } else {
          conclude(*slot, call);
        }
      }
      // Rows of the same policy are computed together.
      std::stable_sort(playing_.begin(), playing_.end(), [](const Slot* one, const Slot* other) {
        return std::less<>()(one->policy, other->policy);
      });
    }
  }

  void assign(Slot& slot, std::size_t index, const PlayCall& call) {
    const EpisodeJob& job = call.jobs[index];
    slot.job = index;
    slot.policy = call.policies[job.policy];
    slot.input.emplace(*slot.policy);
    slot.outcome = {};
    if (sums_observations_) {
      const std::size_t size = specification().observation_size();
      slot.outcome.observation_sums.resize(size);
      slot.outcome.observation_squares.resize(size);
    }
    slot.walker->set_world(call.worlds.empty() ? nullptr : call.worlds[job.world]);
  }

  /// Computes the actions of all episodes that are being played.
  void act(const PlayCall& call) {
    const std::size_t action_size = specification().action_size();
    const bool is_single = specification().observation_dtype == "float32";
    actions_.resize(playing_.size() * action_size);
    for (std::size_t begin = 0, end = 0; begin < playing_.size(); begin = end) {
      const Policy& policy = *playing_[begin]->policy;
      const Forward& network = forward_of(policy);
      while (end < playing_.size() && playing_[end]->policy == &policy) ++end;
      // Networks of other sizes need other memory.
      if (!scratch_ || !scratch_->fits(network.network())) scratch_.emplace(network.network());
      const std::size_t input_size = policy.input_size();
      inputs_.resize(kRowsPerCheck * input_size);
      for (std::size_t i = begin; i < end; i += kRowsPerCheck) {
        call.check();
        const std::size_t count = std::min(kRowsPerCheck, end - i);
        for (std::size_t row = 0; row < count; ++row) {
          std::copy_n(observe(*playing_[i + row], is_single), input_size,
                      &inputs_[row * input_size]);
        }
        network.act(inputs_.data(), count, &actions_[i * action_size], *scratch_);
        for (std::size_t row = i; row < i + count; ++row) {
          playing_[row]->input->add_action(&actions_[row * action_size]);
        }
      }
    }
    const auto wrong = std::find_if(actions_.begin(), actions_.end(),
                                    [](double action) { return !std::isfinite(action); });
    if (wrong == actions_.end()) return;
    const Slot& slot = *playing_[static_cast<std::size_t>(wrong - actions_.begin()) / action_size];
    const EpisodeJob& job = call.jobs[slot.job];
    throw PolicyError("policy " + std::to_string(job.policy) + ", seed " +
                      std::to_string(job.seed) + ": action " + std::to_string(*wrong) +
                      " in step " + std::to_string(slot.walker->state().step + 1) +
                      ": must be finite");
  }

  /// Returns the policy's input, with the present observation.
  /// @param is_single whether observations have single precision
  const double* observe(Slot& slot, bool is_single) {
    observation_ = slot.walker->state().observation;
    if (is_single) {
      for (double& value : observation_) value = static_cast<float>(value);
    }
    PlayedEpisode& outcome = slot.outcome;
    for (std::size_t i = 0; i < outcome.observation_sums.size(); ++i) {
      outcome.observation_sums[i] += observation_[i];
      outcome.observation_squares[i] += observation_[i] * observation_[i];
    }
    return slot.input->add_observation(observation_.data());
  }

  /// Steps or resets the environments of slots.
  /// @param step_of returns the step of the slot at an index
  template <typename StepOf>
  static void step_together(const std::vector<Slot*>& slots, const PlayCall& call, StepOf step_of) {
    const std::size_t group_size = slots.front()->walker->group_size();
    std::array<Walker::GroupStep, kMaxGroupSize> steps;
    for (std::size_t begin = 0; begin < slots.size(); begin += group_size) {
      const std::size_t count = std::min(group_size, slots.size() - begin);
      for (std::size_t i = 0; i < count; ++i) steps[i] = step_of(begin + i);
      call.check();
      Walker::step_group(steps.data(), count);
    }
  }

  /// Reports the outcome of an episode that has ended, and frees its environment.
  void conclude(Slot& slot, PlayCall& call) {
    const EpisodeState& state = slot.walker->state();
    PlayedEpisode& outcome = slot.outcome;
    outcome.episode_return = state.episode_return;
    outcome.length = state.step;
    outcome.terminated = state.terminated;
    outcome.truncated = state.truncated;
    outcome.reward = state.reward;
    outcome.end_reason = state.end_reason_detail();
    outcome.error = state.error;
    outcome.info = state.info;
    outcome.world = state.drawn_world();
    call.finish(slot.job, std::move(outcome));
    free_.push_back(&slot);
  }

  bool sums_observations_;
  std::vector<std::unique_ptr<Slot>> slots_;
  std::vector<Slot*> playing_;  // in the order of their policies
  std::vector<Slot*> free_;
  std::vector<double> observation_;  // of one that is playing
  std::vector<double> inputs_;       // rows of a network
  std::vector<double> actions_;      // a row for each that is playing
  std::optional<Scratch> scratch_;
};

void check(const std::vector<EpisodeJob>& jobs, std::size_t num_policies, std::size_t num_worlds) {
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const std::string name = "job " + std::to_string(i) + ": ";
    if (num_policies == 0) throw std::invalid_argument(name + "there is no policy");
    check_number(name + "policy", jobs[i].policy, 0, num_policies - 1);
    check_number(name + "world", jobs[i].world, 0, std::max<std::size_t>(num_worlds, 1) - 1);
  }
}

}  // namespace

struct EpisodePlayer::Implementation {
  Implementation(std::function<std::unique_ptr<Environment>()> make_environment,
                 const EpisodePlayerOptions& given)
      : make(std::move(make_environment)), options(given) {
    check_number("num_threads", options.num_threads, 0, kMaxThreads);
    check_number("num_envs", options.num_envs, 0, kMaxPoolSize);
    if (options.num_threads == 0) options.num_threads = std::min(num_processors(), kMaxThreads);
    if (options.num_envs == 0) options.num_envs = kEnvsPerThread * options.num_threads;
    options.num_threads = std::min(options.num_threads, options.num_envs);
    for (std::size_t i = 0; i < options.num_threads; ++i) {
      workers.emplace_back(options.sums_observations);
    }
    workers[0].add(make_one());
    if (!workers[0].specification().episodes_are_independent) {
      throw std::invalid_argument("reuse_world = true: an episode would depend on those before it");
    }
  }

  std::unique_ptr<Walker> make_one() const {
    check_step_interruption();
    return std::unique_ptr<Walker>(&walker_of(*make().release()));
  }

  /// Makes the environments that `num_jobs` need.
  /// @return number of threads that play
  std::size_t prepare(std::size_t num_jobs) {
    const std::size_t num_threads = std::min(workers.size(), num_jobs);
    if (num_threads == 0) return 0;
    const std::size_t num_envs = std::min(options.num_envs, num_jobs);
    for (std::size_t i = 0; i < num_threads; ++i) {
      const std::size_t share = num_envs * (i + 1) / num_threads - num_envs * i / num_threads;
      while (workers[i].num_envs() < share) workers[i].add(make_one());
    }
    return num_threads;
  }

  std::function<std::unique_ptr<Environment>()> make;
  EpisodePlayerOptions options;
  std::vector<Worker> workers;  // by thread
};

EpisodePlayer::EpisodePlayer(std::function<std::unique_ptr<Environment>()> make,
                             const EpisodePlayerOptions& options)
    : implementation_(std::make_unique<Implementation>(std::move(make), options)) {}

EpisodePlayer::~EpisodePlayer() = default;

const Specification& EpisodePlayer::specification() const {
  return implementation_->workers[0].specification();
}

const EpisodePlayerOptions& EpisodePlayer::options() const { return implementation_->options; }

void EpisodePlayer::play(const std::vector<const Policy*>& policies,
                         const std::vector<World>& worlds, const std::vector<EpisodeJob>& jobs,
                         const Receive& receive) {
  check(jobs, policies.size(), worlds.size());
  for (const Policy* policy : policies) policy->check(specification());
  std::vector<std::shared_ptr<const CheckedWorld>> checked;
  for (const World& world : worlds) checked.push_back(CheckedWorld::share(specification(), world));
  const std::size_t num_threads = implementation_->prepare(jobs.size());
  if (num_threads == 0) return;
  PlayCall call(policies, jobs, std::move(checked));
  const auto run = [&call](Worker& worker, const auto& after_step) {
    try {
      worker.play(call, after_step);
    } catch (...) {
      call.fail();
    }
  };
  std::vector<std::thread> threads;
  try {
    for (std::size_t i = 1; i < num_threads; ++i) {
      threads.emplace_back([&, i] { run(implementation_->workers[i], [] {}); });
    }
    run(implementation_->workers[0], [&] { call.deliver(receive, std::chrono::milliseconds(0)); });
    // A signal that ends the call must not wait for the episodes of other threads.
    while (!call.is_done()) call.deliver(receive, std::chrono::milliseconds(50));
  } catch (...) {
    call.fail();
  }
  for (std::thread& thread : threads) thread.join();
  call.rethrow();
}

}  // namespace walker
