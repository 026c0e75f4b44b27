#include "replay/bag_episodes.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <stdexcept>
#include <utility>

#include <ros/message_traits.h>
#include <rosbag/view.h>

#include "base/shortest_text.h"
#include "replay/bag_check.h"
#include "replay/bag_index.h"
#include "ros/checked_stream.h"

namespace walker {
namespace {

[[noreturn]] void refuse(const std::string& path, const std::string& reason) {
  throw std::runtime_error(path + ": " + reason);
}

std::unique_ptr<rosbag::Bag> open(const std::string& path) {
  if (!std::filesystem::exists(path)) refuse(path, "no such file");
  if (!std::filesystem::is_regular_file(path)) refuse(path, "is not a file");
  check_bag(path);
  try {
    return std::make_unique<rosbag::Bag>(path, rosbag::bagmode::Read);
  } catch (const rosbag::BagUnindexedException&) {
    refuse(path,
           "was not closed when it was recorded; make it readable by: rosbag reindex " + path);
  } catch (const std::exception& error) {
    refuse(path, std::string("is not a bag, or is cut off: ") + error.what());
  }
}

struct Contents {
  std::vector<const rosbag::ConnectionInfo*> connections;
  ros::Time begin;  // of the first message
};

Contents contents_of(const std::string& path, rosbag::Bag& bag) {
  try {
    rosbag::View view(bag);
    return {view.getConnections(), view.getBeginTime()};
  } catch (const std::exception& error) {
    refuse(path, std::string("is damaged: ") + error.what());
  }
}

template <typename Message>
bool is(const rosbag::ConnectionInfo& connection) {
  return connection.datatype == ros::message_traits::datatype<Message>();
}

/// @throws std::runtime_error if this message type had another definition when it was recorded
template <typename Message>
void check_definition(const std::string& path, const rosbag::ConnectionInfo& connection) {
  if (!is<Message>(connection)) return;
  const std::string own = ros::message_traits::md5sum<Message>();
  if (connection.md5sum == own) return;
  refuse(path, "topic " + connection.topic + ": " + connection.datatype + " has the MD5 " +
                   connection.md5sum + "; here it is " + own +
                   ", so another version of walker_sim recorded it");
}

/// Returns the topic `name` in the namespace of the walker's transitions.
std::string beside(const std::string& transition_topic, const std::string& name) {
  return transition_topic.substr(0, transition_topic.rfind('/') + 1) + name;
}

std::string node_of(const rosbag::ConnectionInfo& connection) {
  if (!connection.header) return "";
  const auto found = connection.header->find("callerid");
  return found == connection.header->end() ? "" : found->second;
}

/// @return false for a message of another type @throws std::runtime_error if it is malformed
template <typename Message>
bool read(const rosbag::MessageInstance& instance, Message& message) {
  if (instance.getDataType() != ros::message_traits::datatype<Message>()) return false;
  std::vector<std::uint8_t> bytes(instance.size());
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  instance.write(stream);
  ClassicStream what;
  what << "a message on " << instance.getTopic() << ", received at " << instance.getTime() << " s,";
  read_exactly(bytes.data(), bytes.size(), what.str(), message);
  return true;
}

template <typename Message>
std::pair<std::string, std::string> typed(const std::string& topic) {
  return {topic, ros::message_traits::datatype<Message>()};
}

/// Calls `visit` with each of the node's messages on `topics`, pairs of topic and type.
template <typename Files, typename Visit>
void for_each_message(const Files& files, const std::string& node,
                      const std::set<std::pair<std::string, std::string>>& topics,
                      const Visit& visit) {
  for (const auto& file : files) {
    try {
      rosbag::View view(*file.bag, [&](const rosbag::ConnectionInfo* connection) {
        return node_of(*connection) == node &&
               topics.count({connection->topic, connection->datatype}) != 0;
      });
      for (const rosbag::MessageInstance& message : view) visit(message);
    } catch (const std::exception& error) {
      refuse(file.path, std::string("is damaged: ") + error.what());
    }
  }
}

}  // namespace

BagEpisodes::BagEpisodes(const std::vector<std::string>& paths) {
  std::set<std::pair<std::string, std::string>> publications;  // topic, node
  std::set<std::filesystem::path> known;
  for (const std::string& path : paths) {
    std::unique_ptr<rosbag::Bag> bag = open(path);
    if (!known.insert(std::filesystem::canonical(path)).second) refuse(path, "is given twice");
    const Contents contents = contents_of(path, *bag);
    for (const rosbag::ConnectionInfo* connection : contents.connections) {
      check_definition<walker_sim::Transition>(path, *connection);
      check_definition<walker_sim::EnvironmentSpec>(path, *connection);
      check_definition<walker_sim::Episode>(path, *connection);
      check_definition<walker_sim::EpisodeRecord>(path, *connection);
      if (!is<walker_sim::Transition>(*connection)) continue;
      publications.emplace(connection->topic, node_of(*connection));
    }
    files_.push_back({path, contents.begin, std::move(bag)});
  }
  // A bag's messages are sorted by time. Bags are not merged by time, since many messages may have
  // the same: in lock-step, simulation time stands still.
  std::stable_sort(files_.begin(), files_.end(),
                   [](const File& one, const File& other) { return one.begin < other.begin; });
  for (const auto& [topic, node] : publications) {
    walkers_.push_back({topic, node, {}});
    walkers_.back().episodes = index(walkers_.back());
  }
}

std::vector<BagEpisode> BagEpisodes::index(const BagWalker& walker) const {
  BagIndex index;
  const auto add = [&](const rosbag::MessageInstance& instance, auto message) {
    if (read(instance, message)) index.add(message);
  };
  for_each_message(files_, walker.node,
                   {typed<walker_sim::Transition>(walker.topic),
                    typed<walker_sim::EnvironmentSpec>(beside(walker.topic, "spec")),
                    typed<walker_sim::Episode>(beside(walker.topic, "episode")),
                    typed<walker_sim::EpisodeRecord>(beside(walker.topic, "restored"))},
                   [&](const rosbag::MessageInstance& message) {
                     add(message, walker_sim::Transition());
                     add(message, walker_sim::EnvironmentSpec());
                     add(message, walker_sim::Episode());
                     add(message, walker_sim::EpisodeRecord());
                   });
  return index.finish();
}

void BagEpisodes::read_transitions(
    const BagWalker& walker,
    const std::function<void(const walker_sim::Transition&)>& visit) const {
  for_each_message(files_, walker.node, {typed<walker_sim::Transition>(walker.topic)},
                   [&](const rosbag::MessageInstance& message) {
                     walker_sim::Transition transition;
                     read(message, transition);
                     visit(transition);
                   });
}

}  // namespace walker
