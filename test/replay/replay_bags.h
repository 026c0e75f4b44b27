// Records that a server publishes, made in this process, and the replay's output for bags of them.
#pragma once

#include <gtest/gtest.h>
#include <rosbag/bag.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <ostream>
#include <random>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "replay/replay.h"
#include "restorable.h"
#include "ros/message_conversions.h"
#include "server/topics/converters.h"
#include "temporary_folder.h"
#include "walker_sim/EpisodeRecord.h"
#include "walker_sim/registry.h"

namespace walker::test {

/// Changes of a message, and words of what the replay then says.
template <typename Message>
using Changes = std::vector<std::pair<std::function<void(Message&)>, std::string>>;

/// A server's episodes.
class Session {
 public:
  explicit Session(const std::string& id, const Parameters& parameters = {}) {
    start(id, parameters);
  }

  /// Begins another server.
  void start(const std::string& id, const Parameters& parameters) {
    options_.environment = parameters;
    simulation_ = std::make_unique<Restorable>([=] { return make(id, parameters); }, 0);
  }

  /// Sets the world of the resets to come.
  void set_world(const World& world) { simulation_->set_world(world); }

  void reset(std::optional<std::uint64_t> seed = std::nullopt) {
    abandon();
    simulation_->reset(seed);
    is_recorded_ = false;
  }

  /// Takes random float32 actions for this many steps, or up to the episode's end.
  void walk(int steps = 1000000) {
    std::uniform_real_distribution<float> draw(-1, 1);
    std::vector<double> action(simulation_->specification().action_size());
    for (int i = 0; i < steps && !state().has_ended(); ++i) {
      std::generate(action.begin(), action.end(), [&] { return draw(generator_); });
      simulation_->step(action);
      if (state().has_ended()) record();
    }
  }

  /// Pushes by hand in the next step.
  void push(const LinkWrench& wrench) { simulation_->push(wrench); }

  void set_coordinates(const std::vector<double>& position, const std::vector<double>& velocity) {
    simulation_->set_coordinates(position, velocity);
  }

  void restore(const EpisodeRecord& restored) {
    abandon();
    simulation_->restore(restored);
    is_recorded_ = false;
    if (state().has_ended()) record();
  }

  /// Ends the present episode as a reset does.
  void abandon() {
    if (is_recorded_) return;
    record();
    records_.back().episode.end_reason = "reset before its end";
  }

  const Restorable& simulation() const { return *simulation_; }
  const EpisodeState& state() const { return simulation_->state(); }

  /// Records of the ended episodes.
  std::vector<walker_sim::EpisodeRecord>& records() { return records_; }

  /// Writes records[first] to records[last - 1].
  /// @param node publisher; if empty, the bag names none
  void write(rosbag::Bag& bag, std::size_t first, std::size_t last,
             const std::string& node = "/walker_sim",
             const std::string& topic = "/episode_record") const {
    using Record = walker_sim::EpisodeRecord;
    auto header = boost::make_shared<ros::M_string>();
    (*header)["topic"] = topic;
    (*header)["type"] = ros::message_traits::datatype<Record>();
    (*header)["md5sum"] = ros::message_traits::md5sum<Record>();
    (*header)["message_definition"] = ros::message_traits::definition<Record>();
    if (!node.empty()) (*header)["callerid"] = node;
    for (std::size_t i = first; i < last; ++i) {
      bag.write(topic, ros::Time(1, static_cast<std::uint32_t>(i)), records_[i], header);
    }
  }

  void write(rosbag::Bag& bag) const { write(bag, 0, records_.size()); }

 private:
  void record() {
    EpisodeRecord record = simulation_->record();
    walker_sim::EpisodeRecord message;
    to_message(simulation_->specification(), options_, simulation_->world(), message.spec);
    to_message(state(), Frames(simulation_->specification(), ""), ros::Time(1), message.episode);
    to_message(std::move(record), message);
    records_.push_back(message);
    is_recorded_ = true;
  }

  ServerOptions options_{};
  std::unique_ptr<Restorable> simulation_;
  std::mt19937 generator_{1};
  bool is_recorded_ = true;  // the present episode, or there is none
  std::vector<walker_sim::EpisodeRecord> records_;
};

/// Parameters of episodes of 20 steps.
inline Parameters short_episodes(const std::string& id) {
  Parameters parameters{{"max_episode_steps", std::int64_t{20}}};
  if (id.rfind("Walker2d", 0) == 0) parameters["terminate_when_unhealthy"] = false;
  return parameters;
}

/// Three episodes: seeded and continued, both to the time limit, then a short one.
inline Session three_episodes(const std::string& id = "BipedalWalker-v3") {
  Session session(id, short_episodes(id));
  session.reset(42);
  session.walk();
  session.reset();
  session.walk();
  session.reset(18446744073709551615U);
  session.walk(10);
  session.abandon();
  return session;
}

struct Outcome {
  bool is_equal = false;
  std::string text;

  /// Returns an episode's line without its number.
  std::string line(int episode) const {
    std::smatch match;
    const std::regex pattern("(^|\n) *" + std::to_string(episode) + "  ([^\n]*)");
    return std::regex_search(text, match, pattern) ? match[2].str() : "(no line)";
  }
};

inline bool contains(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

inline bool starts_with(const std::string& text, const std::string& begin) {
  return text.rfind(begin, 0) == 0;
}

inline bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

inline bool matches(const std::string& text, const std::string& pattern) {
  return std::regex_search(text, std::regex(pattern));
}

inline std::ostream& operator<<(std::ostream& out, const Outcome& outcome) {
  return out << outcome.text;
}

class BagTest : public testing::Test {
 protected:
  std::string path(const std::string& name = "walk.bag") const { return folder_.path(name); }

  std::string write(const Session& session) const {
    rosbag::Bag bag(path(), rosbag::bagmode::Write);
    session.write(bag);
    return path();
  }

  static Outcome replay_bags(const std::vector<std::string>& paths) {
    std::ostringstream text;
    Outcome outcome;
    outcome.is_equal = replay(paths, text);
    outcome.text = text.str();
    return outcome;
  }

  Outcome replay_of(const Session& session) const { return replay_bags({write(session)}); }

  /// Returns the error for a bag that cannot be read, else "(read) " and the replay's text.
  static std::string refusal_of(const std::string& path) {
    try {
      return "(read) " + replay_bags({path}).text;
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }

  static void change_bytes(const std::string& file,
                           const std::function<void(std::string&)>& change) {
    std::ifstream in(file, std::ios::binary);
    std::string bytes((std::istreambuf_iterator<char>(in)), {});
    change(bytes);
    std::ofstream(file, std::ios::binary) << bytes;
  }

  Folder folder_;
};

}  // namespace walker::test
