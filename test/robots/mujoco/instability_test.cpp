// Failures of MuJoCo in the middle of a step.
#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>
#include <cmath>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "error_message.h"
#include "robots/mujoco/model_file.h"
#include "robots/mujoco/player.h"
#include "stepper.h"

namespace walker::mujoco {
namespace {

const std::vector<double> kRest(kJointCount, 0);
const std::vector<double> kFull(kJointCount, 1);

/// At full control, the motors destabilize the simulation.
std::string strong_walker() {
  return replaced(builtin_text("walker2d_v5.xml"), "gear=\"100\"", "gear=\"1e14\"");
}

/// The walker falls upwards, without contacts or joint forces.
std::string flying_walker(const std::string& acceleration, const std::string& timestep) {
  return replaced(builtin_text("walker2d_v5.xml"), "timestep=\"0.002\"",
                  "gravity=\"0 0 " + acceleration + "\" timestep=\"" + timestep + "\"");
}

void expect_finite(const Stepper& walker) {
  EXPECT_TRUE(std::isfinite(walker.result.reward));
  for (const double value : walker.observation) EXPECT_TRUE(std::isfinite(value));
}

class InstabilityTest : public QuietTest {
 protected:
  Stepper make(const std::string& text, Parameters parameters = {}) const {
    parameters["xml_file"] = folder_.write("unstable.xml", text);
    parameters["terminate_when_unhealthy"] = false;
    return Stepper("Walker2d-v5", parameters);
  }

  /// The walker must have been reset with seed 1.
  static void expect_failure(Stepper& walker, const std::vector<double>& action,
                             const std::string& words) {
    const std::vector<double> before = walker.observation;
    walker.step(action);
    EXPECT_TRUE(walker.result.terminated);
    EXPECT_FALSE(walker.result.truncated);
    EXPECT_EQ(std::string(walker.result.error).rfind("MuJoCo: ", 0), 0U) << walker.result.error;
    EXPECT_NE(std::string(walker.result.error).find(words), std::string::npos)
        << walker.result.error;
    EXPECT_STREQ(walker.result.end_reason, "the simulation failed");
    EXPECT_EQ(walker.observation, before);
    expect_finite(walker);
    Sensors sensors;
    Scene scene;
    EXPECT_THROW(walker.step(kRest), ResetNeeded);
    EXPECT_THROW(walker.environment->sense(sensors), ResetNeeded);
    EXPECT_THROW(walker.environment->scene(scene), ResetNeeded);
  }

  static void expect_recovery(Stepper& walker, Stepper& fresh) {
    walker.reset(1);
    fresh.reset(1);
    EXPECT_STREQ(walker.result.error, "");
    EXPECT_FALSE(walker.result.terminated);
    EXPECT_EQ(walker.observation, fresh.observation);
    for (int i = 0; i < 100; ++i) {
      walker.step(kRest);
      fresh.step(kRest);
      ASSERT_STREQ(fresh.result.error, "");
      ASSERT_EQ(walker.row(), fresh.row()) << i;
    }
  }
};

TEST_F(InstabilityTest, BadAccelerationsEndTheEpisode) {
  Stepper walker = make(strong_walker());
  Stepper fresh = make(strong_walker());
  walker.reset(1);
  for (int round = 0; round < 2; ++round) {
    for (int i = 0; i < 3; ++i) walker.step(kRest);
    expect_failure(walker, kFull, "QACC");
    expect_recovery(walker, fresh);
  }
}

/// Any engine step within a step may fail, including the last one.
TEST_F(InstabilityTest, BadVelocitiesAndPositionsEndTheEpisode) {
  const struct {
    const char *acceleration, *timestep, *error, *error_of_one_frame;
  } cases[] = {{"9e9", "1.2", "Q", "QVEL at DOF 1"},
               {"5e9", "3", "QPOS at DOF 1", "QPOS at DOF 1"}};
  for (const auto& [acceleration, timestep, error, error_of_one_frame] : cases) {
    for (const int frame_skip : {1, 2, 4}) {
      Stepper walker = make(flying_walker(acceleration, timestep),
                            {{"frame_skip", std::int64_t{frame_skip}}, {"reset_noise_scale", 0.0}});
      for (int round = 0; round < 2; ++round) {
        walker.reset(1);
        expect_failure(walker, kRest, frame_skip == 1 ? error_of_one_frame : error);
      }
    }
  }
}

TEST_F(InstabilityTest, BadControlsEndTheEpisode) {
  const std::string text =
      replaced(builtin_text("walker2d_v5.xml"), "collision=\"predefined\"/>",
               "collision=\"predefined\"><flag clampctrl=\"disable\"/></option>");
  Stepper walker = make(text);
  Stepper fresh = make(text);
  walker.reset(1);
  expect_failure(walker, {0, 0, 1e300, 0, 0, 0}, "CTRL");
  expect_recovery(walker, fresh);
}

TEST_F(InstabilityTest, ExtremeStartsStayFinite) {
  Stepper walker("Walker2d-v4", {{"reset_noise_scale", 1e6}, {"terminate_when_unhealthy", false}});
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    walker.reset(seed);
    expect_finite(walker);
    Sensors sensors;
    walker.environment->sense(sensors);
    for (const Pose& pose : sensors.link_poses) {
      for (const double value : pose.position) EXPECT_TRUE(std::isfinite(value));
    }
    for (int i = 0; i < 5 && !walker.has_ended(); ++i) {
      walker.step(kFull);
      expect_finite(walker);
    }
    EXPECT_STRNE(walker.result.error, "") << seed;
  }
}

std::string refusal_of(const std::string& model) {
  return message_of<std::invalid_argument>([&] {
    walker::make("Walker2d-v5", {{"xml_file", model}});
  });
}

#ifdef __SANITIZE_ADDRESS__
// With GCC before 14, fork is unsafe while another thread is in AddressSanitizer's allocator: the
// child, which compiles the model, then waits forever for the allocator's lock.
std::mutex allocating;  // NOLINT
const int is_kept_apart = pthread_atfork([] { allocating.lock(); }, [] { allocating.unlock(); },
                                         [] { allocating.unlock(); });
std::unique_lock<std::mutex> keep_apart() { return std::unique_lock(allocating); }
#else
struct [[maybe_unused]] Nothing {};
Nothing keep_apart() { return {}; }
#endif

/// MuJoCo's default error handler would end the process. The small stack suffices for a standing
/// walker, but not for one on its back; after each overflow a reset repeats the same fall.
TEST_F(InstabilityTest, ThreadsFailIndependently) {
  const std::string broken = folder_.write("broken.xml", "<mujoco><body/></mujoco>");
  const std::string cramped =
      folder_.write("cramped.xml",
                    replaced(builtin_text("walker2d_v5.xml"), "nstack=\"8000\"", "nstack=\"520\""));
  Stepper falling("Walker2d-v5", {{"xml_file", cramped}, {"terminate_when_unhealthy", false}});
  Stepper scattered("Walker2d-v4", {{"reset_noise_scale", 1e6}});
  std::atomic<bool> is_compiled{false};
  const auto compile = [&] {
    for (int i = 0; i < 100; ++i) {
      EXPECT_NE(refusal_of(broken).find("XML Error"), std::string::npos) << refusal_of(broken);
      EXPECT_EQ(refusal_of(cramped), "nothing thrown");
    }
    is_compiled = true;
  };
  const auto overflow = [&] {
    std::vector<double> last;
    for (int i = 0; i < 20 || !is_compiled; ++i) {
      {
        const auto apart = keep_apart();
        falling.reset(1);
      }
      int steps = 0;
      for (; !falling.has_ended(); ++steps) {
        const auto apart = keep_apart();
        falling.step(kRest);
      }
      EXPECT_STREQ(falling.result.error, "MuJoCo: Stack overflow");
      EXPECT_GT(steps, 1);
      if (last.empty()) last = falling.observation;
      EXPECT_EQ(falling.observation, last);
    }
  };
  const auto run_away = [&] {
    for (std::uint64_t seed = 0; seed < 300 || !is_compiled; ++seed) {
      const auto apart = keep_apart();
      scattered.reset(seed);
      scattered.step(kRest);
      EXPECT_TRUE(scattered.result.terminated);
    }
  };
  std::vector<std::thread> threads;
  threads.emplace_back(compile);
  threads.emplace_back(overflow);
  threads.emplace_back(run_away);
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace walker::mujoco
