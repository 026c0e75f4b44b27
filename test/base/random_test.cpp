#include "base/random.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "error_message.h"
#include "recording.h"

namespace walker {
namespace {

TEST(Random, EqualsNumpy) {
  Recording recording("random.txt");
  Generator generator(0);
  std::uint64_t seed = 0;
  int draws = 0;
  while (recording.has_more()) {
    const auto word = recording.next<std::string>();
    SCOPED_TRACE("seed " + std::to_string(seed) + ", draw " + std::to_string(draws) + ", " + word);
    if (word == "seed") {
      seed = recording.next<std::uint64_t>();
      generator = Generator(seed);
    } else if (word == "state") {
      for (const std::uint64_t number : generator.state()) {
        ASSERT_EQ(number, recording.next<std::uint64_t>());
      }
    } else if (word == "random") {
      ASSERT_EQ(to_bits(generator.random()), recording.next_hexadecimal());
    } else if (word == "uniform") {
      const auto low = recording.next<double>();
      const auto high = recording.next<double>();
      ASSERT_EQ(to_bits(generator.uniform(low, high)), recording.next_hexadecimal());
    } else {
      ASSERT_EQ(word, "integers");
      const auto low = recording.next<std::int64_t>();
      const auto high = recording.next<std::int64_t>();
      ASSERT_EQ(generator.integers(low, high), recording.next<std::int64_t>());
    }
    ++draws;
  }
  EXPECT_GT(draws, 1500);
}

TEST(Random, ContinuesFromAStateWithABufferedHalf) {
  Generator generator(5);
  generator.integers(0, 10);
  Generator copy(generator.state());
  EXPECT_EQ(generator.state()[4], 1U) << "the other 32 bits wait";
  EXPECT_EQ(copy.state(), generator.state());
  EXPECT_EQ(copy.integers(0, 1000000), generator.integers(0, 1000000));
  EXPECT_EQ(copy.state()[4], 0U);
  EXPECT_EQ(copy.random(), generator.random());
}

TEST(Random, RejectsInvalidStates) {
  const GeneratorState state = Generator(5).state();
  const auto refusal = [&](std::size_t word, std::uint64_t value) {
    GeneratorState wrong = state;
    wrong[word] = value;
    return message_of<std::invalid_argument>([&] { Generator generator(wrong); });
  };
  EXPECT_EQ(refusal(3, 4), "generator_state[3] (increment, low half) = 4: must be odd");
  EXPECT_EQ(refusal(4, 2), "generator_state[4] (has_uint32) = 2: must be 0 or 1");
  EXPECT_EQ(refusal(5, 4294967296),
            "generator_state[5] (uinteger) = 4294967296: must be below 2^32");
  EXPECT_EQ(refusal(5, 4294967295), "nothing thrown");
}

TEST(Random, RejectsEmptyAndTooLargeRanges) {
  Generator generator(5);
  const GeneratorState before = generator.state();
  const std::pair<std::int64_t, std::int64_t> ranges[] = {
      {3, 3},
      {3, 2},
      {0, std::int64_t{1} << 32},
      {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()}};
  for (const auto& [low, high] : ranges) {
    const std::string message =
        message_of<std::invalid_argument>([&] { generator.integers(low, high); });
    EXPECT_NE(message.find("must hold 1 .. 2^32 - 1 values"), std::string::npos) << message;
  }
  EXPECT_EQ(generator.state(), before);
}

TEST(Random, DrawsDifferentSeedsOf64Bits) {
  std::uint64_t together = 0;
  for (int i = 0; i < 16; ++i) together |= draw_seed();
  EXPECT_GT(together >> 48U, 0U);
  EXPECT_NE(draw_seed(), draw_seed());
}

}  // namespace
}  // namespace walker
