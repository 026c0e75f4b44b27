// Damaged bags: the error names the bag and the damage, and nothing crashes.
#include "replay/bag_reader.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "replay/replay_bags.h"

namespace walker::test {
namespace {

std::string bytes_of(std::uint32_t number) {
  std::string bytes(sizeof(number), '\0');
  std::memcpy(bytes.data(), &number, sizeof(number));
  return bytes;
}

bool is_refused(const std::string& said) { return said.rfind("(read) ", 0) != 0; }

/// Makes the bag look as if its recorder had not closed it.
void clear_index_position(std::string& bytes) {
  const std::string field = "index_pos=";
  bytes.replace(bytes.find(field) + field.size(), 8, std::string(8, '\0'));
}

class BagReaderTest : public BagTest, public testing::WithParamInterface<rosbag::CompressionType> {
 protected:
  BagReaderTest() {
    Session session("Walker2d-v5", short_episodes("Walker2d-v5"));
    for (const int steps : {4, 20, 7, 20}) {
      session.reset();
      session.walk(steps);
    }
    rosbag::Bag bag(path(), rosbag::bagmode::Write);
    bag.setCompression(GetParam());
    bag.setChunkThreshold(4096);  // several chunks
    session.write(bag);
  }

  /// Returns the replay's text for a changed copy, or the error that prevents reading it.
  std::string said_of(const std::function<void(std::string&)>& change) const {
    const std::string copy = path("copy.bag");
    std::filesystem::copy(path(), copy, std::filesystem::copy_options::overwrite_existing);
    change_bytes(copy, change);
    const std::string said = refusal_of(copy);
    EXPECT_TRUE(!is_refused(said) || said.rfind(copy + ": ", 0) == 0) << said;
    return said;
  }
};

TEST_P(BagReaderTest, IntactBag) {
  const Outcome outcome = replay_bags({path()});
  EXPECT_TRUE(outcome.is_equal) << outcome;
}

TEST_P(BagReaderTest, SurvivesRandomDamages) {
  std::mt19937 random(17);
  const auto draw = [&](std::size_t end) { return static_cast<std::size_t>(random() % end); };
  int refused = 0;
  constexpr int kTrials = 200;
  for (int trial = 0; trial < kTrials; ++trial) {
    const std::string said = said_of([&](std::string& bytes) {
      if (draw(2) == 0) clear_index_position(bytes);
      const std::size_t place = draw(bytes.size() - 8);
      switch (trial % 5) {
        case 0:
          bytes.resize(place);
          break;
        case 1:
          bytes.erase(place, 1 + draw(64));
          break;
        case 2:
          bytes.replace(place, 4, bytes_of(static_cast<std::uint32_t>(random())));
          break;
        case 3:
          bytes.replace(place, 4, bytes_of(static_cast<std::uint32_t>(draw(2000))));
          break;
        default:
          bytes[place] = static_cast<char>(bytes[place] ^ (1 << draw(8)));
      }
    });
    refused += is_refused(said) ? 1 : 0;
  }
  EXPECT_GT(refused, kTrials / 4);
}

struct Damage {
  std::string place;  ///< its first occurrence
  std::size_t from;   ///< offset from the start of `place`
  std::string put;
  std::string said;
};

/// Damages the file's own records and, without compression, those of a chunk.
TEST_P(BagReaderTest, NamesTheDamage) {
  std::vector<Damage> damages{
      {"#ROSBAG V2.0", 9, "1", "at byte 0: must begin with #ROSBAG V2.0"},
      {"index_pos=", 0, "index_pas=", "a record without a valid field index_pos"},
      {std::string("op=") + '\5', 3, "\x7f", "a record of unknown kind 127"},
      {"compression=", 12, "x", "a chunk with an unknown compression"},
      {"size=", 5, bytes_of(0x7fffffff), "2147483647 bytes; at most 268435456 are read"}};
  if (GetParam() == rosbag::compression::Uncompressed) {
    damages.pop_back();  // nothing reads the size
    damages.push_back({"md5sum=", 7, "0", "walker_sim/EpisodeRecord has the MD5 0"});
    damages.push_back({"topic=", 5, "?", "a field is not of the form name=value"});
    damages.push_back({std::string("op=") + '\2', 3, "\x5", "a chunk in a chunk"});
    damages.push_back({bytes_of(13) + "time=", 4, "tide", "a record without a valid field time"});
    // Id of the specification, after the message's first 4 bytes.
    damages.push_back({bytes_of(11) + "Walker2d-v5", 0, bytes_of(0xffffffff),
                       "an episode's record ends within a field"});
  }
  for (const Damage& damage : damages) {
    const std::string said = said_of([&](std::string& bytes) {
      const std::size_t at = bytes.find(damage.place);
      ASSERT_NE(at, std::string::npos) << damage.said;
      bytes.replace(at + damage.from, damage.put.size(), damage.put);
    });
    EXPECT_PRED2(contains, said, damage.said);
  }
}

TEST_P(BagReaderTest, ReadsABagThatWasNotClosedUpToItsEnd) {
  std::size_t end = 0;
  const std::string said = said_of([&](std::string& bytes) {
    clear_index_position(bytes);
    end = bytes.rfind("compression=");
    bytes.resize(end + 100);  // within the last chunk
  });
  EXPECT_PRED2(starts_with, said, "(read) " + path("copy.bag") + ": was not closed; its last");
  EXPECT_PRED2(contains, said, " equal to the bit (");
}

TEST_P(BagReaderTest, RefusesAClosedBagThatIsCutOff) {
  const std::string said = said_of([](std::string& bytes) { bytes.resize(bytes.size() / 2); });
  EXPECT_PRED2(contains, said, "cut off: at byte ");
  EXPECT_PRED2(contains, said, "the file ends within a record");
}

constexpr const char* kNames[] = {"none", "bz2", "lz4"};

INSTANTIATE_TEST_SUITE_P(Compressions, BagReaderTest,
                         testing::Values(rosbag::compression::Uncompressed,
                                         rosbag::compression::BZ2, rosbag::compression::LZ4),
                         [](const auto& one) { return std::string(kNames[one.param]); });

TEST_F(BagTest, PathsThatAreNoBagAreNamed) {
  EXPECT_EQ(refusal_of(path("missing.bag")), path("missing.bag") + ": no such file");
  EXPECT_EQ(refusal_of(path("")), path("") + ": is not a file");
  for (const char* content : {"", "no bag", "#ROSBAG V1.2\n and more"}) {
    std::ofstream(path("text.bag")) << content;
    EXPECT_PRED2(starts_with, refusal_of(path("text.bag")), path("text.bag") + ": is not a bag");
  }
}

}  // namespace
}  // namespace walker::test
