// The number of threads decides on nothing: every walker, to the bit, stepped together or sent and
// received in whichever order they arrive.
#include <gtest/gtest.h>

#include <numeric>

#include "bits.h"
#include "core/pool_arrays.h"
#include "core/random.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

constexpr std::size_t kCount = 7;
constexpr std::size_t kBatchSize = 3;
constexpr std::size_t kSteps = 75;

struct Case {
  std::string id;
  AutoresetMode mode;
};

/// All that each environment gave, step after step: [environment][step x row].
using History = std::vector<std::vector<std::uint64_t>>;

class Player {
 public:
  Player(const Case& chosen, std::size_t num_threads)
      : pool_([&] { return make(chosen.id, {{"max_episode_steps", std::int64_t{30}}}); },
              options(chosen.mode, num_threads)),
        arrays_(pool_.specification(), kCount),
        history_(kCount) {
    const std::size_t size = pool_.specification().action_size();
    Generator generator(3);
    actions_.resize(kSteps * kCount * size);
    for (double& value : actions_) value = generator.uniform(-1.2, 1.2);
    std::vector<std::optional<std::uint64_t>> seeds(kCount);
    for (std::size_t i = 0; i < kCount; ++i) seeds[i] = 50 + i;
    pool_.reset({}, seeds, arrays_.batch());
    for (std::size_t i = 0; i < kCount; ++i) keep(i, i);
  }

  const History& play_together() {
    const std::size_t size = pool_.specification().action_size() * kCount;
    for (std::size_t step = 0; step < kSteps; ++step) {
      reset_those({ended_});
      clear_final_rows();
      pool_.step(&actions_[step * size], size, arrays_.batch());
      for (std::size_t i = 0; i < kCount; ++i) keep(i, i);
    }
    return history_;
  }

  /// Each environment gets the actions it gets above. Those that arrive are sent again, but for
  /// those that need a reset: they wait until nobody is under way.
  const History& play_as_they_arrive() {
    std::vector<std::size_t> num_sent(kCount);
    std::vector<std::uint32_t> sendable(kCount);
    std::iota(sendable.begin(), sendable.end(), 0);
    std::size_t num_under_way = 0;
    while (true) {
      for (const std::uint32_t i : sendable) {
        if (num_sent[i] == kSteps) continue;
        const std::size_t size = pool_.specification().action_size();
        pool_.send(&actions_[(num_sent[i]++ * kCount + i) * size], &i, 1);
        ++num_under_way;
      }
      sendable.clear();
      if (num_under_way < kBatchSize) {
        if (!pad(num_sent, num_under_way)) break;
      }
      std::vector<std::uint32_t> arrived(kBatchSize);
      clear_final_rows();
      pool_.recv(arrays_.batch(), arrived.data());
      num_under_way -= kBatchSize;
    }
    return history_;
  }

 private:
  Pool pool_;
  PoolArrays arrays_;
  History history_;
  std::vector<double> actions_;
};

}  // namespace
}  // namespace walker
