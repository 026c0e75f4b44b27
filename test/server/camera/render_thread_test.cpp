// RenderThread with fake renderers that block until the test opens a gate.
#include "server/camera/camera.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <utility>
#include <vector>

#include "server/gate.h"

namespace walker::test {
namespace {

/// State that the renderers of a test share.
struct Shared {
  Gate gate;                             // passed by each `render`
  std::vector<std::int64_t> made;        // cameras of the renderers, in order
  std::vector<std::uint32_t> rendered;   // steps of the captures, in order
  std::vector<std::thread::id> threads;  // threads that made or destroyed a renderer
  std::string failure;                   // thrown by each `render`, unless empty
};

class FakeRenderer : public Renderer {
 public:
  FakeRenderer(Shared& shared, const Parameters& parameters) : shared_(shared) {
    shared_.made.push_back(std::get<std::int64_t>(parameters.at("number")));
    shared_.threads.push_back(std::this_thread::get_id());
  }
  ~FakeRenderer() override { shared_.threads.push_back(std::this_thread::get_id()); }

  const Camera& camera() const override { return camera_; }

  void render(const StateCapture& captured, const Channels& channels, Image& image) override {
    shared_.gate.pass();
    if (!shared_.failure.empty()) throw std::runtime_error(shared_.failure);
    shared_.rendered.push_back(captured.step);
    image.width = captured.step;
    image.depth.assign(channels.depth ? 1 : 0, 0.5F);
  }

 private:
  Shared& shared_;
  Camera camera_;
};

class RenderThreadTest : public testing::Test {
 protected:
  RenderThreadTest()
      : thread_(std::make_unique<RenderThread>([this](const Parameters& camera) {
          return std::make_unique<FakeRenderer>(shared_, camera);
        })) {}

  ~RenderThreadTest() override { shared_.gate.open(); }

  /// A job that renders `step`; `outcomes_` receives its outcome.
  RenderJob job(std::uint32_t step, std::int64_t camera = 0) {
    RenderJob job;
    job.captured.step = step;
    job.camera = {{"number", camera}};
    job.is_wanted = [] { return true; };
    job.finish = [this](const Camera& /*camera*/, Image& image) {
      outcomes_.add(std::to_string(image.width) + (image.depth.empty() ? "" : " depth"));
    };
    job.fail = [this](const std::string& why) { outcomes_.add(why); };
    return job;
  }

  RenderJob newest(std::uint32_t step) {
    RenderJob newest = job(step);
    newest.may_be_skipped = true;
    return newest;
  }

  /// Opens the gate, renders step 99 and returns all outcomes up to it.
  std::vector<std::string> finish_all() {
    shared_.gate.open();
    thread_->render(job(99));
    return outcomes_.take_until("99");
  }

  using Texts = std::vector<std::string>;

  Shared shared_;
  Mailbox outcomes_;
  std::unique_ptr<RenderThread> thread_;
};

TEST_F(RenderThreadTest, MakesNoRendererBeforeTheFirstJob) {
  thread_.reset();
  EXPECT_TRUE(shared_.made.empty());
}

TEST_F(RenderThreadTest, RendersInOrderWithoutBlockingTheCaller) {
  for (const std::uint32_t step : {1U, 2U, 3U}) thread_->render(job(step));
  shared_.gate.wait_for_arrivals(1);  // the first picture is in progress
  EXPECT_TRUE(outcomes_.texts().empty());
  EXPECT_EQ(thread_->num_rendered(), 0U);
  EXPECT_EQ(finish_all(), (Texts{"1", "2", "3", "99"}));
  EXPECT_EQ(thread_->num_rendered(), 4U);
  EXPECT_EQ(thread_->num_skipped(), 0U);
  EXPECT_EQ(shared_.made.size(), 1U);
}

TEST_F(RenderThreadTest, PassesChannelsToTheRenderer) {
  RenderJob depth = job(1);
  depth.channels = {false, true};
  thread_->render(std::move(depth));
  EXPECT_EQ(finish_all(), (Texts{"1 depth", "99"}));
}

TEST_F(RenderThreadTest, ReplacesAWaitingJobThatMayBeSkipped) {
  thread_->render(newest(1));
  shared_.gate.wait_for_arrivals(1);
  thread_->render(newest(2));
  thread_->render(job(3));
  for (const std::uint32_t step : {4U, 5U, 6U}) thread_->render(newest(step));
  thread_->render(job(7));
  EXPECT_EQ(finish_all(), (Texts{"1", "6", "3", "7", "99"})) << "it keeps the place of the first";
  EXPECT_EQ(thread_->num_skipped(), 3U);
}

TEST_F(RenderThreadTest, DropsUnwantedJobs) {
  RenderJob unwanted = job(1);
  unwanted.is_wanted = [] { return false; };
  thread_->render(std::move(unwanted));
  EXPECT_EQ(finish_all(), (Texts{"99"}));
  EXPECT_EQ(shared_.rendered, (std::vector<std::uint32_t>{99}));
}

TEST_F(RenderThreadTest, ReportsFailuresAndRemakesTheRenderer) {
  shared_.failure = "no OpenGL";
  shared_.gate.open();
  thread_->render(job(1));
  EXPECT_EQ(outcomes_.take_until("no OpenGL"), (Texts{"no OpenGL"}));
  shared_.failure.clear();
  EXPECT_EQ(finish_all(), (Texts{"99"}));
  EXPECT_EQ(shared_.made.size(), 2U) << "what has failed is made anew";
  EXPECT_EQ(thread_->num_rendered(), 1U);
}

TEST_F(RenderThreadTest, SurvivesARendererThatCannotBeMade) {
  shared_.gate.open();
  thread_->render(job(1));
  RenderJob wrong = job(2);
  wrong.camera.clear();
  thread_->render(std::move(wrong));
  const Texts outcomes = finish_all();
  ASSERT_EQ(outcomes.size(), 3U);
  EXPECT_EQ(outcomes.front(), "1");
  EXPECT_EQ(outcomes.back(), "99");
  EXPECT_EQ(shared_.made.size(), 1U);
}

TEST_F(RenderThreadTest, ReportsExceptionsOfFinish) {
  RenderJob refused = job(1);
  refused.finish = [](const Camera& /*camera*/, Image& /*image*/) {
    throw std::runtime_error("no memory");
  };
  thread_->render(std::move(refused));
  EXPECT_EQ(finish_all(), (Texts{"no memory", "99"}));
}

TEST_F(RenderThreadTest, CachesTheFourLatestRenderers) {
  for (const std::int64_t camera : {0, 1, 2, 3, 0, 4, 0, 1}) thread_->render(job(1, camera));
  finish_all();
  EXPECT_EQ(shared_.made, (std::vector<std::int64_t>{0, 1, 2, 3, 4, 1}));
}

TEST_F(RenderThreadTest, MakesAndDestroysRenderersInItsThread) {
  for (const std::int64_t camera : {0, 1, 2, 3, 4}) thread_->render(job(1, camera));
  finish_all();
  thread_.reset();
  ASSERT_EQ(shared_.threads.size(), 12U) << "six are made, and as many destroyed";
  for (const std::thread::id thread : shared_.threads) {
    EXPECT_EQ(thread, shared_.threads.front());
    EXPECT_NE(thread, std::this_thread::get_id());
  }
}

TEST_F(RenderThreadTest, FinishesTheRunningJobWhenDestroyed) {
  for (const std::uint32_t step : {1U, 2U, 3U}) thread_->render(job(step));
  shared_.gate.wait_for_arrivals(1);
  std::thread opener([this] { shared_.gate.open(); });
  thread_.reset();
  EXPECT_FALSE(shared_.rendered.empty());
  EXPECT_EQ(outcomes_.texts().size(), shared_.rendered.size());
  opener.join();
}

}  // namespace
}  // namespace walker::test
