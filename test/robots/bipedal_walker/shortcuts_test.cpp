// Each shortcut of box2d_pinned/ by itself, and all together, give the plain engine's bits.
#include <gtest/gtest.h>

#include <cstdio>
#include <memory>
#include <string>

#include "bits.h"
#include "robots/bipedal_walker/shortcut_rows.h"

namespace walker::bipedal_walker {
namespace {

/// A running player of its own.
class Player {
 public:
  explicit Player(const char* program)
      : name_(program),
        pipe_(popen(program, "r")) {}  // NOLINT(bugprone-command-processor): a program of our own
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;
  ~Player() { pclose(pipe_); }

  bool read(ShortcutRow& row) {
    return std::fread(row.data(), sizeof(double), row.size(), pipe_) == row.size();
  }
  const std::string& name() const { return name_; }

 private:
  std::string name_;
  std::FILE* pipe_;
};

TEST(Shortcuts, EachGivesThePlainEnginesBits) {
  Player plain(WALKER_SIM_SHORTCUT_none);
  std::vector<std::unique_ptr<Player>> players;
  for (const char* program :
       {WALKER_SIM_SHORTCUT_blocks, WALKER_SIM_SHORTCUT_broad_phase, WALKER_SIM_SHORTCUT_clock,
        WALKER_SIM_SHORTCUT_counters, WALKER_SIM_SHORTCUT_velocity_loops,
        WALKER_SIM_SHORTCUT_body_list, WALKER_SIM_SHORTCUT_rays, WALKER_SIM_SHORTCUT_all}) {
    players.push_back(std::make_unique<Player>(program));
  }
  ShortcutRow expected{};
  ShortcutRow row{};
  std::size_t rows = 0;
  for (; plain.read(expected); ++rows) {
    for (const auto& player : players) {
      ASSERT_TRUE(player->read(row)) << player->name() << " ends before row " << rows;
      for (std::size_t i = 0; i < row.size(); ++i) {
        ASSERT_EQ(to_bits(row[i]), to_bits(expected[i]))
            << player->name() << ", row " << rows << ", number " << i << ": " << row[i] << ", not "
            << expected[i];
      }
    }
  }
  EXPECT_GE(rows, 100000U);
  for (const auto& player : players) EXPECT_FALSE(player->read(row)) << player->name();
}

}  // namespace
}  // namespace walker::bipedal_walker
