// Damaged bags: the error names the bag and the damage, and nothing crashes.
#include "replay/bag_check.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <functional>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include "error_message.h"
#include "replay/replay_bags.h"

namespace walker::test {
namespace {

struct Compression {
  rosbag::CompressionType type;
  const char* name;
};

std::ostream& operator<<(std::ostream& out, const Compression& one) { return out << one.name; }

std::string bytes_of(std::uint32_t number) {
  std::string bytes(sizeof(number), '\0');
  std::memcpy(bytes.data(), &number, sizeof(number));
  return bytes;
}

class BagCheckTest : public BagTest, public testing::WithParamInterface<Compression> {
 protected:
  BagCheckTest() {
    Session session("Walker2d-v5", short_episodes("Walker2d-v5"));
    session.reset(3);
    session.walk(4);
    session.restore(session.simulation().record());
    session.walk(2);
    session.reset();
    session.walk();
    rosbag::Bag bag(path(), rosbag::bagmode::Write);
    bag.setCompression(GetParam().type);
    bag.setChunkThreshold(4096);  // several chunks
    session.write(bag, "/walker_sim");
  }

  /// Returns the replay's text for a changed copy, or the error that prevents reading it.
  std::string said_of(const std::function<void(std::string&)>& change) const {
    const std::string copy = path("copy.bag");
    std::filesystem::copy(path(), copy, std::filesystem::copy_options::overwrite_existing);
    spoil(copy, change);
    const std::string said = refusal_of({copy});
    EXPECT_TRUE(said.rfind("(read) ", 0) == 0 || said.rfind(copy + ": ", 0) == 0) << said;
    return said;
  }

  bool is_refused(const std::string& said) const { return said.rfind("(read) ", 0) != 0; }
};

TEST_P(BagCheckTest, AWholeBagIsRead) {
  EXPECT_EQ(message_of<std::runtime_error>([&] { check_bag(path()); }), "nothing thrown");
  const Outcome outcome = replay_bags({path()});
  EXPECT_TRUE(outcome.is_equal) << outcome;
}

TEST_P(BagCheckTest, DrawnDamagesAreSurvived) {
  std::mt19937 random(17);
  const auto draw = [&](std::size_t end) { return static_cast<std::size_t>(random() % end); };
  int refused = 0;
  constexpr int kTrials = 200;
  for (int trial = 0; trial < kTrials; ++trial) {
    const std::string said = said_of([&](std::string& bytes) {
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
  EXPECT_GT(refused, kTrials / 3);
}

/// A header parser must not trust the lengths of fields.
TEST_P(BagCheckTest, EveryLengthOfAFieldIsChecked) {
  const auto fields = {
      "op=",  "conn=", "time=",        "topic=", "index_pos=", "chunk_pos=", "count=",
      "ver=", "size=", "compression=", "type=",  "md5sum=",    "callerid="};
  for (const char* field : fields) {
    for (const std::uint32_t length : {0U, 1U, 999999U, 0x7fffffffU, 0xffffffffU}) {
      std::size_t count = 0;
      const auto change = [&](std::size_t which) {
        return [&, which](std::string& bytes) {
          count = 0;
          for (std::size_t at = 0; (at = bytes.find(field, at + 1)) != std::string::npos; ++count) {
            if (count == which) bytes.replace(at - 4, 4, bytes_of(length));
          }
        };
      };
      said_of(change(std::string::npos));
      for (std::size_t which = 0; which < std::min<std::size_t>(count, 4); ++which) {
        const std::string said = said_of(change(which));
        EXPECT_TRUE(is_refused(said)) << field << " " << length << " " << which << ": " << said;
        EXPECT_NE(said.find("at byte "), std::string::npos) << said;
      }
    }
  }
}

TEST_P(BagCheckTest, WhatTheIndexNamesMustBeThere) {
  const auto with = [&](const std::string& field, std::uint64_t value, std::size_t which = 0) {
    return said_of([&](std::string& bytes) {
      std::size_t at = bytes.find(field);
      for (; which > 0; --which) at = bytes.find(field, at + 1);
      std::memcpy(bytes.data() + at + field.size(), &value, sizeof(value));
    });
  };
  for (const std::uint64_t place :
       {std::uint64_t{1}, std::uint64_t{4117}, std::uint64_t{1} << 40U, ~std::uint64_t{0}}) {
    EXPECT_TRUE(is_refused(with("index_pos=", place))) << place;
    EXPECT_TRUE(is_refused(with("chunk_pos=", place + 1))) << place;
  }
  // First index record after a chunk: 4 bytes of length, then seconds, nanoseconds and offset.
  for (const std::uint32_t place : {1U, 5U, 0x7fffffffU, 0xffffffffU}) {
    const std::string said = said_of([&](std::string& bytes) {
      const std::string op = std::string("op=") + '\4';
      const std::size_t count = bytes.find("count=", bytes.find(op) - 64);
      ASSERT_NE(count, std::string::npos);
      std::size_t end = bytes.find(op);
      end = std::max(end + op.size(), bytes.find("ver=", end - 64) + 8);
      bytes.replace(end + 4 + 8, 4, bytes_of(place));
    });
    EXPECT_TRUE(is_refused(said)) << said;
  }
}

struct Damage {
  std::string place;  ///< its first occurrence
  std::size_t from;   ///< offset from the start of `place`
  std::string put;
  std::string said;
};

/// Damages the file's own records and, without compression, those of a chunk.
TEST_P(BagCheckTest, WhatIsWrongIsNamed) {
  std::vector<Damage> damages{
      {"index_pos=", 0, "index_pas=", "a record without index_pos"},
      {"conn_count=", 11, bytes_of(99), "no index of 99 connections"},
      {"chunk_count=", 12, bytes_of(99), "no index of 99 chunks"},
      {std::string("op=") + '\5', 3, "\x7f", "a record of unknown kind 127"},
      {"compression=", 12, "x", "a chunk with an unknown compression"},
      {"size=", 5, bytes_of(0x7fffffff), "2147483647"},
      {"ver=", 4, bytes_of(7), "a record of version 7; must be 1"},
      {bytes_of(10) + "count=", 10, bytes_of(99), "an index of 99 messages in "},
      {"chunk_pos=", 10, bytes_of(13), "no chunk at byte 13"},
      {"chunk_pos=", 28, bytes_of(99), "99 connections of a chunk in "}};
  if (GetParam().type == rosbag::compression::Uncompressed) {
    damages.push_back({"topic=", 0, "tonic=", "a connection without a topic"});
    damages.push_back({"topic=", 5, "?", "a field without a name"});
    damages.push_back({std::string("op=") + '\2', 3, "\x7f", "a record of kind 127 in a chunk"});
    damages.push_back({bytes_of(13) + "time=", 4, "tide", "a record without time"});
  }
  for (const Damage& damage : damages) {
    const std::string said = said_of([&](std::string& bytes) {
      const std::size_t at = bytes.find(damage.place);
      ASSERT_NE(at, std::string::npos) << damage.said;
      bytes.replace(at + damage.from, damage.put.size(), damage.put);
    });
    EXPECT_NE(said.find(damage.said), std::string::npos) << damage.said << ": " << said;
  }
}

TEST_P(BagCheckTest, OtherFormatsAreNotRead) {
  EXPECT_NE(said_of([](std::string& bytes) { bytes[9] = '1'; }).find("must begin with #ROSBAG V2"),
            std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(Compressions, BagCheckTest,
                         testing::Values(Compression{rosbag::compression::Uncompressed, "none"},
                                         Compression{rosbag::compression::BZ2, "bz2"},
                                         Compression{rosbag::compression::LZ4, "lz4"}),
                         [](const auto& one) { return std::string(one.param.name); });

/// The array's length field exceeds the memory.
TEST_F(BagTest, AnArrayIsNoLargerThanItsMessage) {
  Session session = three_episodes("BipedalWalker-v3");
  const std::string bag = write(session);
  const std::vector<double>& observation = session.transition(1, 3).observation;
  const std::string size = bytes_of(static_cast<std::uint32_t>(observation.size()));
  std::string content(observation.size() * sizeof(double), '\0');
  std::memcpy(content.data(), observation.data(), content.size());
  spoil(bag, [&](std::string& bytes) {
    const std::size_t at = bytes.find(size + content);
    ASSERT_NE(at, std::string::npos);
    bytes.replace(at, 4, bytes_of(0xffffffffU));
  });
  const std::string said = refusal_of({bag});
  EXPECT_EQ(said.rfind(bag + ": is damaged: a message on /transition, received at ", 0), 0U)
      << said;
  EXPECT_NE(said.find(" s, ends within a field"), std::string::npos) << said;
}

}  // namespace
}  // namespace walker::test
