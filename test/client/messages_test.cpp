// Answers that are malformed or contradict the server's specification, one field at a time.
#include "client/messages.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <set>
#include <utility>

#include "client/scripted_walker.h"
#include "error_message.h"

namespace walker::test {
namespace {

constexpr std::uint32_t kMax = std::numeric_limits<std::uint32_t>::max();

Reader reader_of(const std::string& answer) {
  return {reinterpret_cast<const std::uint8_t*>(answer.data()), answer.size()};
}

/// Reads a valid answer, and the same with one change at a time.
template <typename Answer>
class Rejections {
 public:
  using Read = std::function<void(Reader&, Answer&)>;

  Rejections(Answer valid, Read read) : valid_(std::move(valid)), read_(std::move(read)) {
    const std::string bytes = to_bytes(valid_);
    Reader reader = reader_of(bytes);
    Answer answer;
    read_(reader, answer);
    EXPECT_EQ(to_bytes(answer), bytes);
  }

  template <typename Change>
  void expect(const Change& change, const std::string& reason) const {
    Answer changed = valid_;
    change(changed);
    const std::string bytes = to_bytes(changed);
    Reader reader = reader_of(bytes);
    Answer answer;
    EXPECT_EQ(message_of<std::runtime_error>([&] { read_(reader, answer); }),
              "its answer's " + reason);
  }

  template <typename Field>
  void expect_size(const std::string& name, Field Answer::*field) const {
    const std::size_t size = (valid_.*field).size();
    for (const std::size_t other : std::set<std::size_t>{0, size - 1, size + 1}) {
      expect(
          [&](Answer& answer) { (answer.*field).resize(other); },
          name + " has " + std::to_string(other) + " elements; must have " + std::to_string(size));
    }
  }

 private:
  Answer valid_;
  Read read_;
};

const ServerSpecification kServer = example_specification();

void read_transition(Reader& reader, Transition& transition) { read(reader, kServer, transition); }

TEST(Messages, ChecksAStep) {
  const Rejections<Transition> rejections(example_transition(), read_transition);
  rejections.expect_size("observation", &Transition::observation);
  rejections.expect_size("info", &Transition::info);
  rejections.expect_size("action", &Transition::action);
  for (const std::uint32_t environment : {std::uint32_t{2}, kMax}) {
    rejections.expect(
        [&](Transition& transition) { transition.environment = environment; },
        "environment is " + std::to_string(environment) + "; must be below num_envs = 2");
  }
  rejections.expect([](Transition& transition) { transition.step = 0; },
                    "action has 1 elements; must have 0");
}

TEST(Messages, ChecksAReset) {
  Transition valid = example_transition();
  valid.step = 0;
  valid.action.clear();
  const Rejections<Reset> rejections(
      {valid, {{"gravity", {-5, -5}}}},
      [](Reader& reader, Reset& reset) { read(reader, kServer, reset); });
  rejections.expect([](Reset& reset) { reset.transition.action = {0}; },
                    "action has 1 elements; must have 0");
  rejections.expect(
      [](Reset& reset) {
        for (int i = 0; i < 300; ++i) reset.world[std::to_string(i)];
      },
      "world has 301 parameters; must have at most 256");
  rejections.expect(
      [](Reset& reset) { reset.world["gravity"].low = std::numeric_limits<double>::quiet_NaN(); },
      "world has a range for gravity; must have a number");
  rejections.expect([](Reset& reset) { reset.world["gravity"].low = -6; },
                    "world has a range for gravity; must have a number");
}

/// Drawn values that the type cannot express.
TEST(Messages, ChecksDrawnValues) {
  const auto error_of = [](const Message& world) {
    const std::string bytes = to_bytes(example_transition()) + world.bytes();
    Reader reader = reader_of(bytes);
    Reset reset;
    return message_of<std::runtime_error>([&] { read(reader, kServer, reset); });
  };
  Message twice;
  twice.number(std::uint32_t{2});
  for (int i = 0; i < 2; ++i) twice.text("a").number(1.0).number(1.0).number(std::uint8_t{0});
  EXPECT_EQ(error_of(twice), "its answer's world has a twice");
  EXPECT_EQ(error_of(Message().number(kMax)), "the answer ends within a field");
}

TEST(Messages, ChecksARepeatedStep) {
  const Rejections<RepeatedStep> rejections(
      {example_transition(), 3, -0.5},
      [](Reader& reader, RepeatedStep& repeated) { read(reader, kServer, 4, repeated); });
  rejections.expect([](RepeatedStep& repeated) { repeated.transition.observation.clear(); },
                    "observation has 0 elements; must have 3");
  for (const std::uint32_t steps : {std::uint32_t{0}, std::uint32_t{5}, kMax}) {
    rejections.expect([&](RepeatedStep& repeated) { repeated.steps = steps; },
                      "steps is " + std::to_string(steps) + "; must be in [1, 4]");
  }
}

TEST(Messages, ChecksABatchOfSteps) {
  using Batch = BatchTransition;
  const Rejections<Batch> rejections(
      example_batch(), [](Reader& reader, Batch& batch) { read(reader, kServer, batch); });
  rejections.expect_size("observations", &Batch::observations);
  rejections.expect_size("rewards", &Batch::rewards);
  rejections.expect_size("terminated", &Batch::terminated);
  rejections.expect_size("truncated", &Batch::truncated);
  rejections.expect_size("episodes", &Batch::episodes);
  rejections.expect_size("steps", &Batch::steps);
  rejections.expect_size("info", &Batch::info);
  rejections.expect_size("final_observations", &Batch::final_observations);
  rejections.expect_size("final_info", &Batch::final_info);
  const std::pair<std::vector<std::uint32_t>, const char*> ended[] = {
      {{}, "final_observations has 3 elements; must have 0"},
      {{0, 1}, "final_observations has 3 elements; must have 6"},
      {{2}, "final_environments[0] is 2; must be below num_envs = 2"},
      {{kMax}, "final_environments[0] is 4294967295; must be below num_envs = 2"},
      {{1, 1}, "final_environments[1] is 1; must be above the one before, 1"},
      {{1, 0}, "final_environments[1] is 0; must be above the one before, 1"},
      {{0, 1, 2}, "final_environments[2] is 2; must be below num_envs = 2"},
  };
  for (const auto& row : ended) {
    rejections.expect([&](Batch& batch) { batch.final_environments = row.first; }, row.second);
  }
  rejections.expect([](Batch& batch) { batch.failed_environments[0] = 2; },
                    "failed_environments[0] is 2; must be below num_envs = 2");
  rejections.expect([](Batch& batch) { batch.failures.emplace_back(); },
                    "failures has 2 elements; must have 1");
  rejections.expect([](Batch& batch) { batch.failed_at_reset[0] = 3; },
                    "failed_at_reset[0] is 3; must be 0 or 1");
  rejections.expect([](Batch& batch) { batch.worlds[0].environment = 2; },
                    "worlds[0].environment is 2; must be below num_envs = 2");
  rejections.expect([](Batch& batch) { batch.worlds.resize(3); },
                    "worlds has 3 elements; must have at most 2");
  rejections.expect([](Batch& batch) { batch.terminated[1] = 2; },
                    "terminated[1] is 2; must be 0 or 1");
  rejections.expect([](Batch& batch) { batch.truncated[0] = 255; },
                    "truncated[0] is 255; must be 0 or 1");
}

TEST(Messages, ChecksABatchOfResets) {
  for (const std::size_t rows : {1, 2}) {
    const Rejections<BatchReset> rejections(
        {std::vector<double>(3 * rows, 0.5),
         std::vector<double>(rows, 2),
         {0},
         {"the engine"},
         {{1, {{"gravity", {-5, -5}}}}}},
        [&](Reader& reader, BatchReset& reset) { read(reader, kServer, rows, reset); });
    rejections.expect_size("observations", &BatchReset::observations);
    rejections.expect_size("info", &BatchReset::info);
    rejections.expect([](BatchReset& reset) { reset.failed_environments[0] = 2; },
                      "failed_environments[0] is 2; must be below num_envs = 2");
    rejections.expect([](BatchReset& reset) { reset.failures.clear(); },
                      "failures has 0 elements; must have 1");
    rejections.expect([](BatchReset& reset) { reset.worlds[0].environment = kMax; },
                      "worlds[0].environment is 4294967295; must be below num_envs = 2");
  }
}

TEST(Messages, ChecksASpecification) {
  using Spec = ServerSpecification;
  const Rejections<Spec> rejections(kServer,
                                    [](Reader& reader, Spec& server) { read(reader, server); });
  for (const std::uint32_t num_envs : {std::uint32_t{0}, std::uint32_t{100001}, kMax}) {
    rejections.expect([&](Spec& server) { server.num_envs = num_envs; },
                      "num_envs is " + std::to_string(num_envs) + "; must be in [1, 100000]");
  }
  for (const std::uint32_t size : {std::uint32_t{0}, std::uint32_t{4}, kMax}) {
    rejections.expect([&](Spec& server) { server.observation_size = size; },
                      "observation_low has 3 elements; must have " + std::to_string(size));
    rejections.expect([&](Spec& server) { server.action_size = size; },
                      "action_low has 1 elements; must have " + std::to_string(size));
  }
  rejections.expect_size("parameter_values", &Spec::parameter_values);
  rejections.expect_size("observation_low", &Spec::observation_low);
  rejections.expect_size("observation_high", &Spec::observation_high);
  rejections.expect_size("action_low", &Spec::action_low);
  rejections.expect_size("action_high", &Spec::action_high);
  rejections.expect_size("joint_names", &Spec::joint_names);
  // An empty string takes 4 bytes in an answer and 32 in memory.
  rejections.expect([](Spec& server) { server.info_names.resize(kMaxTexts + 1); },
                    "array has 4097 texts; must have at most 4096");
}

TEST(Messages, EscapesInvalidUtf8) {
  Transition failed = example_transition();
  failed.error = "it broke: \xC3(";
  const std::string bytes = to_bytes(failed);
  Reader reader = reader_of(bytes);
  Transition received;
  read_transition(reader, received);
  EXPECT_EQ(received.error, "it broke: \\xc3(");
}

/// The specification determines the maximum length of an answer.
TEST(Messages, BoundsTheSizeOfAnswers) {
  constexpr std::size_t kMebibyte = 1 << 20;
  for (const ServiceIndex service :
       {kReset, kStep, kStepMany, kRestore, kSetState, kResetBatch, kStepBatch}) {
    EXPECT_GE(max_answer_bytes(service, kServer), kMebibyte);
    EXPECT_LT(max_answer_bytes(service, kServer), kMebibyte + 4096 + 2 * kMaxWorldBytes);
  }
  EXPECT_EQ(max_answer_bytes(kGetSpec, kServer), kMaxSpecificationBytes);
  const std::size_t episode = max_answer_bytes(kSnapshot, kServer) - kMaxSpecificationBytes;
  constexpr std::size_t kChanges =
      kMaxRecordedPushes * kPushBytes + kMaxRecordedCoordinates * kCoordinatesBytes;
  EXPECT_GE(episode, 16000000 + kChanges);
  EXPECT_LT(episode, 18000000 + kChanges);
  EXPECT_LT(max_answer_bytes(kRender, kServer), 70 * kMebibyte);
  ServerSpecification large = kServer;
  large.num_envs = kMaxEnvironments;
  large.observation_size = 500000;
  EXPECT_EQ(max_answer_bytes(kStepBatch, large), tcpros::kMaxMessageBytes);
}

TEST(Messages, ChecksAPicture) {
  const auto error_of = [](const Picture& picture, const std::string& encoding = "rgb8",
                           const Parameters& camera = {}) {
    const std::string bytes = picture.bytes();
    Reader reader = reader_of(bytes);
    Image image;
    image.width = 7;
    image.rgb = {1};
    const std::string error =
        message_of<std::runtime_error>([&] { read(reader, encoding, camera, image); });
    EXPECT_EQ(image.width, 7U) << "a rejected picture changes nothing";
    EXPECT_EQ(image.rgb.size(), 1U);
    return error;
  };
  const auto error_after = [&](const std::function<void(Picture&)>& change) {
    Picture picture;
    change(picture);
    return error_of(picture);
  };
  EXPECT_EQ(error_of({}, "32FC1"), "the picture's encoding is rgb8 instead of 32FC1");
  EXPECT_EQ(error_after([](Picture& picture) { picture.is_bigendian = 1; }),
            "the picture's encoding is rgb8, big-endian instead of rgb8");
  EXPECT_EQ(error_after([](Picture& picture) { picture.encoding = "bgr8"; }),
            "the picture's encoding is bgr8 instead of rgb8");
  EXPECT_EQ(error_after([](Picture& picture) { picture.width = 3; }),
            "the picture's rows have 6 bytes instead of 9");
  EXPECT_EQ(error_after([](Picture& picture) { picture.height = 2; }),
            "6 bytes of data came instead of 12");
  for (const std::size_t size : {0, 5, 7}) {
    EXPECT_EQ(error_after([&](Picture& picture) { picture.data.resize(size); }),
              std::to_string(size) + " bytes of data came instead of 6");
  }
  // width * height * 3 overflows a signed 64-bit integer.
  EXPECT_EQ(error_after([](Picture& picture) {
              picture.width = picture.height = std::uint32_t{1} << 31;
              picture.row_bytes = 0;
            }),
            "the picture's rows have 0 bytes instead of 6442450944");
  // The requested number of pixels with other dimensions.
  const Parameters upright{{"width", std::int64_t{1}}, {"height", std::int64_t{2}}};
  EXPECT_EQ(error_of({}, "rgb8", upright), "the picture's width is 2 instead of 1");
  EXPECT_EQ(error_of({}, "rgb8", {{"height", std::int64_t{2}}}),
            "the picture's height is 1 instead of 2");
}

}  // namespace
}  // namespace walker::test
