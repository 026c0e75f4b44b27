// Every environment works on a 128 KiB stack, the default of musl's threads: alone, in a pool, and
// in the pool's own threads. The tests use 96 KiB, because the caller needs some.
#include <gtest/gtest.h>
#include <pthread.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <numeric>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "episode/rollout.h"
#include "saved_states.h"

namespace walker {
namespace {

constexpr std::size_t kStackSize = std::size_t{96} << 10U;

/// Sets a small default stack size, for threads such as std::thread that set none.
class SmallStackByDefault {
 public:
  SmallStackByDefault() {
    pthread_getattr_default_np(&before_);
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    pthread_attr_setstacksize(&attributes, kStackSize);
    EXPECT_EQ(pthread_setattr_default_np(&attributes), 0);
    pthread_attr_destroy(&attributes);
  }
  SmallStackByDefault(const SmallStackByDefault&) = delete;
  SmallStackByDefault& operator=(const SmallStackByDefault&) = delete;
  ~SmallStackByDefault() {
    pthread_setattr_default_np(&before_);
    pthread_attr_destroy(&before_);
  }

 private:
  pthread_attr_t before_;
};

void run_on_small_stack(const std::function<void()>& function) {
  const SmallStackByDefault small;
  std::thread(function).join();
}

void play_alone(const std::string& id, const Parameters& parameters = {}) {
  Stepper walker(id, parameters);
  const std::vector<double> action(walker.environment->specification().action_size(), 0.5);
  Sensors sensors;
  Scene scene;
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    walker.reset(seed);
    for (int i = 0; i < 40 && !walker.has_ended(); ++i) {
      walker.step(action);
      walker.environment->sense(sensors);
    }
    walker.environment->scene(scene);
  }
  load(walker, save(walker));
}

void play_in_pool(const std::string& id) {
  const PoolOptions options{300, 3, AutoresetMode::same_step, 0};
  Rollout rollout(id, options);
  rollout.reset(0);
  std::mt19937 random(1);
  rollout.play(random, 40);
  const std::vector<double> actions(options.num_envs * rollout.pool.specification().action_size());
  std::vector<std::uint32_t> environments(options.num_envs);
  std::iota(environments.begin(), environments.end(), 0U);
  rollout.pool.send(actions.data(), environments.data(), environments.size());
  rollout.pool.recv(rollout.arrays.batch(), environments.data());
}

class SmallStackTest : public testing::TestWithParam<const char*> {};

// The first thread that makes a robot also chooses its kernel.
TEST_P(SmallStackTest, SufficesForOneEnvironment) {
  run_on_small_stack([] { play_alone(GetParam()); });
}

TEST_P(SmallStackTest, SufficesForAPool) {
  run_on_small_stack([] { play_in_pool(GetParam()); });
}

INSTANTIATE_TEST_SUITE_P(Core, SmallStackTest,
                         testing::Values("BipedalWalker-v3", "BipedalWalkerHardcore-v3",
                                         "Walker2d-v4", "Walker2d-v5", "Hopper-v4", "Hopper-v5"));

// MuJoCo compiles the model in a child process, on the stack of the thread that forked.
TEST(SmallStackModelTest, SufficesForAModel) {
  const std::string path = WALKER_SIM_SOURCE_DIR "/assets/walker2d_v5.xml";
  run_on_small_stack([&path] { play_alone("Walker2d-v5", {{"xml_file", path}}); });
}

}  // namespace
}  // namespace walker
