// RenderThread with fake renderers that block until the test opens a gate.
#include "server/camera/render_thread.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/gate.h"

namespace walker {
namespace {

using test::Gate;

/// State that the renderers of a test share.
struct Studio {
  Gate gate;                              // passed by each `render`
  std::vector<std::int64_t> made;         // cameras of the renderers, in order
  std::vector<std::uint32_t> drawn;       // steps of the captures, in order
  std::vector<std::thread::id> painters;  // threads that made or destroyed a renderer
  std::string complaint;                  // thrown by each `render`, unless empty
};

class FakeRenderer : public Renderer {
 public:
  FakeRenderer(Studio& studio, const Parameters& parameters) : studio_(studio) {
    studio_.made.push_back(std::get<std::int64_t>(parameters.at("number")));
    studio_.painters.push_back(std::this_thread::get_id());
  }
  ~FakeRenderer() override { studio_.painters.push_back(std::this_thread::get_id()); }

  const Camera& camera() const override { return camera_; }

  void render(const StateCapture& captured, const Channels& channels, Image& image) override {
    studio_.gate.pass();
    if (!studio_.complaint.empty()) throw std::runtime_error(studio_.complaint);
    studio_.drawn.push_back(captured.step);
    image.width = captured.step;
    image.depth.assign(channels.depth ? 1 : 0, 0.5F);
  }

 private:
  Studio& studio_;
  Camera camera_;
};

class RenderThreadTest : public testing::Test {
 protected:
  RenderThreadTest()
      : thread_(std::make_unique<RenderThread>([this](const Parameters& camera) {
          return std::make_unique<FakeRenderer>(studio_, camera);
        })) {}

  ~RenderThreadTest() override { studio_.gate.open(); }

  /// A job that renders `step`; `told_` receives its outcome.
  RenderJob job(std::uint32_t step, std::int64_t camera = 0) {
    RenderJob job;
    job.captured.step = step;
    job.camera = {{"number", camera}};
    job.is_wanted = [] { return true; };
    job.finish = [this](const Camera& /*camera*/, Image& image) {
      told_.add(std::to_string(image.width) + (image.depth.empty() ? "" : " depth"));
    };
    job.fail = [this](const std::string& why) { told_.add(why); };
    return job;
  }

  RenderJob newest(std::uint32_t step) {
    RenderJob newest = job(step);
    newest.may_be_skipped = true;
    return newest;
  }

  /// Opens the gate, renders step 99 and returns all outcomes up to it.
  std::vector<std::string> finish_all() {
    studio_.gate.open();
    thread_->render(job(99));
    return told_.take_until("99");
  }

  using Texts = std::vector<std::string>;

  Studio studio_;
  test::Mailbox told_;
  std::unique_ptr<RenderThread> thread_;
};

TEST_F(RenderThreadTest, MakesNothingBeforeTheFirstPicture) {
  thread_.reset();
  EXPECT_TRUE(studio_.made.empty());
}

TEST_F(RenderThreadTest, DrawsInOrderWhileTheCallerGoesOn) {
  for (const std::uint32_t step : {1U, 2U, 3U}) thread_->render(job(step));
  studio_.gate.wait_for_arrivals(1);  // the first picture is in progress
  EXPECT_TRUE(told_.texts().empty());
  EXPECT_EQ(thread_->num_rendered(), 0U);
  EXPECT_EQ(finish_all(), (Texts{"1", "2", "3", "99"}));
  EXPECT_EQ(thread_->num_rendered(), 4U);
  EXPECT_EQ(thread_->num_skipped(), 0U);
  EXPECT_EQ(studio_.made.size(), 1U);
}

TEST_F(RenderThreadTest, HandsTheChannelsOn) {
  RenderJob depth = job(1);
  depth.channels = {false, true};
  thread_->render(std::move(depth));
  EXPECT_EQ(finish_all(), (Texts{"1 depth", "99"}));
}

TEST_F(RenderThreadTest, TheNewestOfThoseThatMayBeSkippedWins) {
  thread_->render(newest(1));
  studio_.gate.wait_for_arrivals(1);
  thread_->render(newest(2));
  thread_->render(job(3));
  for (const std::uint32_t step : {4U, 5U, 6U}) thread_->render(newest(step));
  thread_->render(job(7));
  EXPECT_EQ(finish_all(), (Texts{"1", "6", "3", "7", "99"})) << "it keeps the place of the first";
  EXPECT_EQ(thread_->num_skipped(), 3U);
}

TEST_F(RenderThreadTest, DrawsNothingThatNobodyWantsAnyMore) {
  RenderJob unwanted = job(1);
  unwanted.is_wanted = [] { return false; };
  thread_->render(std::move(unwanted));
  EXPECT_EQ(finish_all(), (Texts{"99"}));
  EXPECT_EQ(studio_.drawn, (std::vector<std::uint32_t>{99}));
}

TEST_F(RenderThreadTest, SaysWhyThereIsNoPictureAndTriesAgain) {
  studio_.complaint = "no OpenGL";
  studio_.gate.open();
  thread_->render(job(1));
  EXPECT_EQ(told_.take_until("no OpenGL"), (Texts{"no OpenGL"}));
  studio_.complaint.clear();
  EXPECT_EQ(finish_all(), (Texts{"99"}));
  EXPECT_EQ(studio_.made.size(), 2U) << "what has failed is made anew";
  EXPECT_EQ(thread_->num_rendered(), 1U);
}

TEST_F(RenderThreadTest, ARendererThatCannotBeMadeHurtsNoOther) {
  studio_.gate.open();
  thread_->render(job(1));
  RenderJob wrong = job(2);
  wrong.camera.clear();
  thread_->render(std::move(wrong));
  const Texts told = finish_all();
  ASSERT_EQ(told.size(), 3U);
  EXPECT_EQ(told.front(), "1");
  EXPECT_EQ(told.back(), "99");
  EXPECT_EQ(studio_.made.size(), 1U);
}

TEST_F(RenderThreadTest, PassesOnWhatTheReceiverThrows) {
  RenderJob refused = job(1);
  refused.finish = [](const Camera& /*camera*/, Image& /*image*/) {
    throw std::runtime_error("no memory");
  };
  thread_->render(std::move(refused));
  EXPECT_EQ(finish_all(), (Texts{"no memory", "99"}));
}

TEST_F(RenderThreadTest, KeepsTheRenderersOfTheLastFewCameras) {
  for (const std::int64_t camera : {0, 1, 2, 3, 0, 4, 0, 1}) thread_->render(job(1, camera));
  finish_all();
  EXPECT_EQ(studio_.made, (std::vector<std::int64_t>{0, 1, 2, 3, 4, 1}));
}

TEST_F(RenderThreadTest, RenderersLiveAndDieInItsThread) {
  for (const std::int64_t camera : {0, 1, 2, 3, 4}) thread_->render(job(1, camera));
  finish_all();
  thread_.reset();
  ASSERT_EQ(studio_.painters.size(), 12U) << "six are made, and as many destroyed";
  for (const std::thread::id painter : studio_.painters) {
    EXPECT_EQ(painter, studio_.painters.front());
    EXPECT_NE(painter, std::this_thread::get_id());
  }
}

TEST_F(RenderThreadTest, EndsAfterThePictureInFlight) {
  for (const std::uint32_t step : {1U, 2U, 3U}) thread_->render(job(step));
  studio_.gate.wait_for_arrivals(1);
  std::thread opener([this] { studio_.gate.open(); });
  thread_.reset();
  EXPECT_FALSE(studio_.drawn.empty());
  EXPECT_EQ(told_.texts().size(), studio_.drawn.size());
  opener.join();
}

}  // namespace
}  // namespace walker
