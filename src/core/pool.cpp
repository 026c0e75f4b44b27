#include "walker_sim/pool.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/action_check.h"
#include "core/parking.h"
#include "core/pool_members.h"
#include "core/thread_pool.h"

namespace walker {
namespace {

static_assert(Environment::kLargestGroup <= ThreadPool::kLargestGroup);

constexpr std::size_t kMostEnvironments = 1U << 20U;
constexpr std::size_t kMostThreads = 1024;

void check_range(const char* name, std::size_t value, std::size_t lowest, std::size_t highest) {
  if (value < lowest || value > highest) {
    throw std::invalid_argument(std::string(name) + " = " + std::to_string(value) +
                                ": must be in [" + std::to_string(lowest) + ", " +
                                std::to_string(highest) + "]");
  }
}

PoolOptions complete(PoolOptions options) {
  check_range("num_envs", options.num_envs, 1, kMostEnvironments);
  check_range("num_threads", options.num_threads, 0, kMostThreads);
  check_range("batch_size", options.batch_size, 0, options.num_envs);
  if (options.num_threads == 0) {
    options.num_threads = std::min(num_processors(), kMostThreads);
    options.num_threads = std::min(options.num_threads, options.num_envs);
  }
  if (options.batch_size == 0) options.batch_size = options.num_envs;
  return options;
}

}  // namespace

const char* to_text(AutoresetMode mode) {
  switch (mode) {
    case AutoresetMode::next_step:
      return "next_step";
    case AutoresetMode::same_step:
      return "same_step";
    case AutoresetMode::disabled:
      return "disabled";
  }
  return "";
}

std::optional<AutoresetMode> find_autoreset_mode(const std::string& text) {
  for (const AutoresetMode mode :
       {AutoresetMode::next_step, AutoresetMode::same_step, AutoresetMode::disabled}) {
    if (text == to_text(mode)) return mode;
  }
  return std::nullopt;
}

/// Checks the caller's requests and hands them to the threads.
class Pool::Implementation {
 public:
  Implementation(const std::function<std::unique_ptr<Environment>()>& make,
                 const PoolOptions& options)
      : options_(complete(options)),
        members_(make, options_.num_envs, options_.autoreset_mode),
        is_under_way_(options_.num_envs),
        last_list_(options_.num_envs),
        all_(options_.num_envs),
        arrived_(options_.num_envs),
        threads_(
            options_.num_envs, options_.num_threads, members_.group_size(),
            [this](const std::uint32_t* indices, std::size_t count) { work(indices, count); }) {
    std::iota(all_.begin(), all_.end(), 0U);
  }

  const PoolOptions& options() const { return options_; }
  const PoolMembers& members() const { return members_; }
  /// The members, when this one is not under way.
  const PoolMembers& member_at_rest(std::size_t index) const {
    need_at_rest(index);
    return members_;
  }

  void reset(const std::vector<std::uint32_t>& environments,
             const std::vector<std::optional<std::uint64_t>>& seeds, const Batch& batch);
  void step(const double* actions, std::size_t size, const Batch& batch);
  void send(const double* actions, const std::uint32_t* environments, std::size_t count);
  void send_resets(const std::vector<std::uint32_t>& environments);
  void recv(const Batch& batch, std::uint32_t* environments);

 private:
  /// What the threads do with the environments that they are given. Changes only while none is
  /// under way.
  struct Task {
    bool is_reset = false;
    const double* actions = nullptr;                      // rows of all environments
    const std::optional<std::uint64_t>* seeds = nullptr;  // of all environments
    const Batch* batch = nullptr;                         // rows of all; null: `recv` writes
  };

  void work(const std::uint32_t* indices, std::size_t count);
  void run(const Task& task, const std::vector<std::uint32_t>& environments);
  void begin_sending();
  void put_under_way(std::uint32_t index);
  void start_sent(std::size_t count);
  std::size_t num_groups(std::size_t count) const;
  void need_none_under_way(const char* call) const;
  void need_at_rest(std::size_t index) const;
  void check_list(const std::uint32_t* environments, std::size_t count);
  void check_steps(const double* actions, const std::uint32_t* environments,
                   std::size_t count) const;

  PoolOptions options_;
  PoolMembers members_;
  Task task_;
  std::size_t num_under_way_ = 0;
  std::vector<std::uint8_t> is_under_way_;
  std::uint64_t num_lists_ = 0;           // checked so far
  std::vector<std::uint64_t> last_list_;  // in which the environment stood
  std::vector<std::uint32_t> all_;        // 0 .. num_envs - 1
  std::vector<std::uint32_t> arrived_;
  std::vector<double> sent_actions_;                 // rows of all; none before the first `send`
  std::vector<std::optional<std::uint64_t>> seeds_;  // of all; none before the first `reset`
  ThreadPool threads_;  // the last: its threads end before what they use
};

void Pool::Implementation::work(const std::uint32_t* indices, std::size_t count) {
  if (task_.is_reset) {
    std::for_each(indices, indices + count,
                  [this](std::uint32_t i) { members_.reset(i, task_.seeds[i]); });
  } else {
    members_.step(indices, count, task_.actions);
  }
  if (!task_.batch) return;
  std::for_each(indices, indices + count,
                [this](std::uint32_t i) { members_.write(i, *task_.batch, i); });
}

void Pool::Implementation::run(const Task& task, const std::vector<std::uint32_t>& environments) {
  task_ = task;
  for (const std::uint32_t index : environments) threads_.add(index);
  threads_.start(num_groups(environments.size()) - 1);  // one is the caller's
  threads_.collect(environments.size(), arrived_.data());
}

std::size_t Pool::Implementation::num_groups(std::size_t count) const {
  const std::size_t size = members_.group_size();
  return (count + size - 1) / size;
}

void Pool::Implementation::need_none_under_way(const char* call) const {
  if (num_under_way_ == 0) return;
  throw std::logic_error(std::string(call) + ": " + std::to_string(num_under_way_) +
                         " environments are under way; receive them first");
}

void Pool::Implementation::need_at_rest(std::size_t index) const {
  if (index >= options_.num_envs) {
    throw std::invalid_argument("environment " + std::to_string(index) + ": must be in [0, " +
                                std::to_string(options_.num_envs - 1) + "]");
  }
  if (is_under_way_[index] != 0) {
    throw std::logic_error("environment " + std::to_string(index) +
                           ": is under way; receive it first");
  }
}

void Pool::Implementation::check_list(const std::uint32_t* environments, std::size_t count) {
  ++num_lists_;
  for (const std::uint32_t* index = environments; index != environments + count; ++index) {
    need_at_rest(*index);
    if (std::exchange(last_list_[*index], num_lists_) == num_lists_) {
      throw std::invalid_argument("environment " + std::to_string(*index) + ": listed twice");
    }
  }
}

void Pool::Implementation::check_steps(const double* actions, const std::uint32_t* environments,
                                       std::size_t count) const {
  const Specification& specification = members_.specification();
  const std::size_t size = specification.action_size();
  for (std::size_t i = 0; i < count; ++i) {
    const double* const action = actions + i * size;
    // Looked at twice, so that no text is made for nothing.
    if (!std::all_of(action, action + size, [](double value) { return std::isfinite(value); })) {
      check_action(specification, action, size,
                   "environment " + std::to_string(environments[i]) + ": ");
    }
    members_.need_episode(environments[i]);
  }
}

void Pool::Implementation::reset(const std::vector<std::uint32_t>& environments,
                                 const std::vector<std::optional<std::uint64_t>>& seeds,
                                 const Batch& batch) {
  need_none_under_way("reset");
  const std::vector<std::uint32_t>& listed = environments.empty() ? all_ : environments;
  check_list(listed.data(), listed.size());
  if (!seeds.empty() && seeds.size() != listed.size()) {
    throw std::invalid_argument(std::to_string(seeds.size()) + " seeds; must be 0, or " +
                                std::to_string(listed.size()) + " as the environments");
  }
  seeds_.assign(options_.num_envs, std::nullopt);
  for (std::size_t i = 0; i < seeds.size(); ++i) seeds_[listed[i]] = seeds[i];
  Task task;
  task.is_reset = true;
  task.seeds = seeds_.data();
  task.batch = &batch;
  run(task, listed);
}

void Pool::Implementation::step(const double* actions, std::size_t size, const Batch& batch) {
  need_none_under_way("step");
  const std::size_t action_size = members_.specification().action_size();
  if (size != options_.num_envs * action_size) {
    throw InvalidAction("actions have " + std::to_string(size) + " values; must have " +
                        std::to_string(options_.num_envs * action_size) + ", " +
                        std::to_string(action_size) + " for each of " +
                        std::to_string(options_.num_envs) + " environments");
  }
  check_steps(actions, all_.data(), all_.size());
  Task task;
  task.actions = actions;
  task.batch = &batch;
  run(task, all_);
}

void Pool::Implementation::send(const double* actions, const std::uint32_t* environments,
                                std::size_t count) {
  check_list(environments, count);
  check_steps(actions, environments, count);
  const std::size_t action_size = members_.specification().action_size();
  begin_sending();
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t index = environments[i];
    std::copy_n(actions + i * action_size, action_size, &sent_actions_[index * action_size]);
    put_under_way(index);
  }
  start_sent(count);
}

void Pool::Implementation::send_resets(const std::vector<std::uint32_t>& environments) {
  const std::vector<std::uint32_t>& listed = environments.empty() ? all_ : environments;
  check_list(listed.data(), listed.size());
  begin_sending();
  for (const std::uint32_t index : listed) {
    members_.request_reset(index);
    put_under_way(index);
  }
  start_sent(listed.size());
}

void Pool::Implementation::begin_sending() {
  if (num_under_way_ != 0) return;  // the threads are reading the task
  sent_actions_.resize(options_.num_envs * members_.specification().action_size());
  task_ = {};
  task_.actions = sent_actions_.data();
}

void Pool::Implementation::put_under_way(std::uint32_t index) {
  is_under_way_[index] = 1;
  threads_.add(index);
}

void Pool::Implementation::start_sent(std::size_t count) {
  num_under_way_ += count;
  threads_.start(num_groups(count));
}

void Pool::Implementation::recv(const Batch& batch, std::uint32_t* environments) {
  const std::size_t size = options_.batch_size;
  if (num_under_way_ < size) {
    throw std::logic_error("recv: " + std::to_string(num_under_way_) +
                           " environments are under way; must be at least " + std::to_string(size) +
                           ", the batch size");
  }
  threads_.collect(size, environments);
  for (std::size_t row = 0; row < size; ++row) {
    is_under_way_[environments[row]] = 0;
    members_.write(environments[row], batch, row);
  }
  num_under_way_ -= size;
}

Pool::Pool(const std::function<std::unique_ptr<Environment>()>& make, const PoolOptions& options)
    : implementation_(std::make_unique<Implementation>(make, options)) {}

Pool::~Pool() = default;

const Specification& Pool::specification() const {
  return implementation_->members().specification();
}

const PoolOptions& Pool::options() const { return implementation_->options(); }

void Pool::reset(const std::vector<std::uint32_t>& environments,
                 const std::vector<std::optional<std::uint64_t>>& seeds, const Batch& batch) {
  implementation_->reset(environments, seeds, batch);
}

void Pool::step(const double* actions, std::size_t size, const Batch& batch) {
  implementation_->step(actions, size, batch);
}

void Pool::send(const double* actions, const std::uint32_t* environments, std::size_t count) {
  implementation_->send(actions, environments, count);
}

void Pool::send_resets(const std::vector<std::uint32_t>& environments) {
  implementation_->send_resets(environments);
}

void Pool::recv(const Batch& batch, std::uint32_t* environments) {
  implementation_->recv(batch, environments);
}

Environment& Pool::environment(std::size_t index) {
  return implementation_->member_at_rest(index).environment(index);
}

const char* Pool::error(std::size_t index) const {
  return implementation_->member_at_rest(index).error(index);
}

const char* Pool::reset_error(std::size_t index) const {
  return implementation_->member_at_rest(index).reset_error(index);
}

const char* Pool::end_reason(std::size_t index) const {
  return implementation_->member_at_rest(index).end_reason(index);
}

}  // namespace walker
