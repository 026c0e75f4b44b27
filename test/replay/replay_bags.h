// Bags for a single test, and the replay's output for them.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <functional>
#include <iterator>
#include <ostream>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "bits.h"
#include "replay/replay_report.h"
#include "replay/replay_session.h"
#include "temporary_folder.h"

namespace walker::test {

struct Outcome {
  bool is_equal = false;
  std::string text;

  bool says(const std::string& words) const { return text.find(words) != std::string::npos; }

  std::string line(int episode) const {
    std::smatch match;
    const std::regex pattern("(^|\n) *" + std::to_string(episode) + "  ([^\n]*)");
    return std::regex_search(text, match, pattern) ? match[2].str() : "(no line)";
  }
};

inline std::ostream& operator<<(std::ostream& out, const Outcome& outcome) {
  return out << outcome.text;
}

inline bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

inline void falsify(double& value) { value = from_bits(to_bits(value) ^ 1U); }

class BagTest : public testing::Test {
 protected:
  std::string path(const std::string& name = "walk.bag") const { return folder_.path(name); }

  std::string write(const Session& session, const std::string& name = "walk.bag") const {
    rosbag::Bag bag(path(name), rosbag::bagmode::Write);
    session.write(bag);
    return path(name);
  }

  static Outcome replay_bags(const std::vector<std::string>& paths) {
    std::ostringstream text;
    Outcome outcome;
    outcome.is_equal = replay(paths, text);
    outcome.text = text.str();
    return outcome;
  }

  Outcome replay_of(const Session& session) const { return replay_bags({write(session)}); }

  /// Returns the error for bags that cannot be read, else "(read) " and the replay's text.
  static std::string refusal_of(const std::vector<std::string>& paths) {
    try {
      const Outcome outcome = replay_bags(paths);
      return "(read) " + outcome.text;
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }

  void spoil(const std::string& file, const std::function<void(std::string&)>& change) const {
    std::ifstream in(file, std::ios::binary);
    std::string bytes((std::istreambuf_iterator<char>(in)), {});
    change(bytes);
    std::ofstream(file, std::ios::binary) << bytes;
  }

  Folder folder_;
};

constexpr int kLimit = 20;  // steps

inline Parameters short_episodes(const std::string& id) {
  Parameters parameters{{"max_episode_steps", std::int64_t{kLimit}}};
  if (id.rfind("Walker2d", 0) == 0) parameters["terminate_when_unhealthy"] = false;
  return parameters;
}

/// Three episodes: seeded and continued, both to the time limit, then a short one.
inline Session three_episodes(const std::string& id) {
  Session session(id, short_episodes(id));
  session.reset(42);
  session.walk();
  session.reset();
  session.walk();
  session.reset(18446744073709551615U);
  session.walk(10);
  return session;
}

}  // namespace walker::test
