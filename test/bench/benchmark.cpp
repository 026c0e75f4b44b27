// Measures speed and memory of in-process environments, and the speed of walker::Client. Prints one
// line of JSON per number of environments. The Python files in this folder define the comparisons.
//
// Pools reset an ended episode in place of its next step, which counts as a step, as in EnvPool.
// Other resets take time and do not count as steps.
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <iostream>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/program.h"
#include "stepper.h"
#include "walker_sim/client.h"
#include "walker_sim/policy.h"
#include "walker_sim/pool.h"

namespace walker::bench {
namespace {

constexpr const char* kUsage =
    "usage: walker_sim_benchmark loop   --env ID --seconds S\n"
    "       walker_sim_benchmark reset  --env ID --seconds S\n"
    "       walker_sim_benchmark pool   --env ID --num-envs N[,N...] --threads K --seconds S\n"
    "       walker_sim_benchmark world  as pool, with --world WORLD\n"
    "       walker_sim_benchmark async  --env ID --num-envs N[,N...] --threads K --seconds S\n"
    "       walker_sim_benchmark act    --file FILE --seconds S\n"
    "       walker_sim_benchmark memory --env ID --num-envs N --steps M\n"
    "       walker_sim_benchmark client --server NAME --seconds S    one environment, by ~step\n"
    "       walker_sim_benchmark batch  --server NAME --seconds S    all, by ~step_batch\n";

/// A pool with arrays for the results that Gymnasium returns.
class PooledEnvironments {
 public:
  PooledEnvironments(const std::string& id, const PoolOptions& options,
                     const std::string& world = "gymnasium")
      : pool_([&id] { return make(id); }, options),
        observations_(options.num_envs * pool_.specification().observation_size()),
        rewards_(options.num_envs),
        terminated_(options.num_envs),
        truncated_(options.num_envs),
        info_(options.num_envs * pool_.specification().info_names.size()) {
    batch_.observations = observations_.data();
    batch_.rewards = rewards_.data();
    batch_.terminated = terminated_.data();
    batch_.truncated = truncated_.data();
    batch_.info = info_.data();
    pool_.set_world({}, {load_world(world)});
    std::vector<std::optional<std::uint64_t>> seeds(options.num_envs);
    std::vector<std::uint32_t> all(options.num_envs);
    std::iota(all.begin(), all.end(), 0U);
    for (const std::uint32_t index : all) seeds[index] = index;
    pool_.reset(all, seeds, batch_);
  }

  std::size_t action_size() const { return pool_.specification().action_size(); }
  Pool& pool() { return pool_; }
  const Batch& batch() const { return batch_; }

 private:
  Pool pool_;
  std::vector<double> observations_;
  std::vector<double> rewards_;
  std::vector<std::uint8_t> terminated_;
  std::vector<std::uint8_t> truncated_;
  std::vector<double> info_;
  Batch batch_;
};

/// @throws std::invalid_argument unless the option has positive numbers
std::vector<std::size_t> counts(const Arguments& arguments, const std::string& name) {
  std::vector<std::size_t> counts;
  for (const double number : arguments.numbers(name)) {
    constexpr double kMax = 1e9;
    if (!(number >= 1 && number <= kMax)) {
      throw std::invalid_argument("--" + name + " = " + arguments.text(name) +
                                  ": must be between 1 and 1000000000");
    }
    counts.push_back(static_cast<std::size_t>(number));
  }
  return counts;
}

void loop(const Arguments& arguments) {
  Stepper stepper(arguments.text("env"));
  const double seconds = arguments.number("seconds");
  Actions actions(stepper.environment->specification().action_size());
  stepper.reset(0);
  print(1, measure(seconds, 1, [&] {
          stepper.environment->step(actions.next(), actions.size(), stepper.result);
          if (stepper.has_ended()) stepper.reset();
        }));
}

void reset(const Arguments& arguments) {
  Stepper stepper(arguments.text("env"));
  const double seconds = arguments.number("seconds");
  stepper.reset(0);
  print(1, measure(seconds, 1, [&] { stepper.reset(); }));
}

void step_pool(const Arguments& arguments, const std::string& world = "gymnasium") {
  const std::string id = arguments.text("env");
  const double seconds = arguments.number("seconds");
  PoolOptions options;
  options.num_threads = counts(arguments, "threads").at(0);
  for (const std::size_t count : counts(arguments, "num-envs")) {
    options.num_envs = count;
    PooledEnvironments environments(id, options, world);
    Actions actions(count * environments.action_size());
    print(count, measure(seconds, count, [&] {
            environments.pool().step(actions.next(), actions.size(), environments.batch());
          }));
  }
}

/// Measures send() and recv() with a batch size of half of the environments.
void step_pool_asynchronously(const Arguments& arguments) {
  const std::string id = arguments.text("env");
  const double seconds = arguments.number("seconds");
  PoolOptions options;
  options.num_threads = counts(arguments, "threads").at(0);
  for (const std::size_t count : counts(arguments, "num-envs")) {
    options.num_envs = count;
    options.batch_size = (count + 1) / 2;
    PooledEnvironments environments(id, options);
    Pool& pool = environments.pool();
    std::vector<std::uint32_t> arrived(count);
    std::iota(arrived.begin(), arrived.end(), 0U);
    pool.send(Actions(count * environments.action_size()).next(), arrived.data(), count);
    arrived.resize(options.batch_size);
    Actions actions(arrived.size() * environments.action_size());
    print(count, measure(seconds, arrived.size(), [&] {
            pool.recv(environments.batch(), arrived.data());
            pool.send(actions.next(), arrived.data(), arrived.size());
          }));
  }
}

void act(const Arguments& arguments) {
  Policy policy(arguments.text("file"));
  Actions observations(policy.observation_size());
  std::vector<double> action(policy.action_size());
  print(1, measure(arguments.number("seconds"), 1,
                   [&] { policy.act(observations.next(), action.data()); }));
}

double resident_bytes() {
  malloc_trim(0);  // returns freed memory to the system
  std::ifstream file("/proc/self/statm");
  double all = 0;
  double resident = 0;
  if (!(file >> all >> resident)) throw std::runtime_error("/proc/self/statm: not readable");
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

/// Measures the memory per environment after `steps` steps, without what all environments share.
void memory(const Arguments& arguments) {
  const std::string id = arguments.text("env");
  const std::size_t steps = counts(arguments, "steps").at(0);
  PoolOptions options;
  options.num_threads = 1;
  PooledEnvironments first(id, options);  // keeps the shared model loaded
  options.num_envs = counts(arguments, "num-envs").at(0);
  Actions actions(options.num_envs * first.action_size());
  const double before = resident_bytes();
  PooledEnvironments environments(id, options);
  for (std::size_t i = 0; i < steps; ++i) {
    environments.pool().step(actions.next(), actions.size(), environments.batch());
  }
  std::cout << "{\"num_envs\": " << options.num_envs << ", \"bytes_per_environment\": "
            << (resident_bytes() - before) / static_cast<double>(options.num_envs) << "}\n";
}

ClientOptions client_options(const Arguments& arguments) {
  ClientOptions options;
  options.server = arguments.text("server");
  return options;
}

void step_by_client(const Arguments& arguments) {
  Client client(client_options(arguments));
  Actions actions(client.specification().action_size);
  Transition transition;
  client.reset(0, transition);
  Latencies latencies;
  const Slice slice = measure(arguments.number("seconds"), 1, [&] {
    latencies.time([&] { client.step(actions.next(), actions.size(), transition); });
    if (transition.terminated || transition.truncated) client.reset(std::nullopt, transition);
  });
  print(1, slice, latencies);
}

void step_batch_by_client(const Arguments& arguments) {
  Client client(client_options(arguments));
  const ServerSpecification specification = client.specification();
  BatchReset reset;
  client.reset_batch({}, {}, reset);
  Actions actions(static_cast<std::size_t>(specification.num_envs) * specification.action_size);
  BatchTransition transition;
  print(specification.num_envs, measure(arguments.number("seconds"), specification.num_envs, [&] {
          client.step_batch(actions.next(), actions.size(), transition);
        }));
}

void run(const std::string& what, char** begin, char** end) {
  const std::set<std::string> one = {"env", "seconds"};
  const std::set<std::string> many = {"env", "seconds", "num-envs", "threads"};
  if (what == "loop") return loop({begin, end, one});
  if (what == "reset") return reset({begin, end, one});
  if (what == "pool") return step_pool({begin, end, many});
  if (what == "world") {
    std::set<std::string> names = many;
    names.insert("world");
    const Arguments arguments(begin, end, names);
    return step_pool(arguments, arguments.text("world"));
  }
  if (what == "async") return step_pool_asynchronously({begin, end, many});
  if (what == "act") return act({begin, end, {"file", "seconds"}});
  if (what == "memory") return memory({begin, end, {"env", "num-envs", "steps"}});
  if (what == "client") return step_by_client({begin, end, {"server", "seconds"}});
  if (what == "batch") return step_batch_by_client({begin, end, {"server", "seconds"}});
  throw std::invalid_argument(what + ": unknown measurement\n" + kUsage);
}

}  // namespace
}  // namespace walker::bench

int main(int argc, char** argv) {
  return walker::bench::run_program("walker_sim_benchmark", [&] {
    walker::bench::run(argc > 1 ? argv[1] : "", argv + std::min(argc, 2), argv + argc);
  });
}
