// Messages that a server publishes, made in this process, to be falsified and written to a bag.
#pragma once

#include <rosbag/bag.h>

#include <algorithm>
#include <map>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "restorable.h"
#include "server/topics/converters.h"
#include "walker_sim/EpisodeRecord.h"
#include "walker_sim/registry.h"

namespace walker::test {

class Session {
 public:
  using Message = std::variant<walker_sim::EnvironmentSpec, walker_sim::Episode,
                               walker_sim::EpisodeRecord, walker_sim::Transition>;
  struct Entry {
    std::string topic;
    ros::Time time;
    Message message;
  };

  /// @param space namespace of the recorded topics, with a trailing slash
  explicit Session(std::string id, Parameters parameters = {}, std::string space = "/")
      : space_(std::move(space)) {
    start(std::move(id), std::move(parameters));
  }

  void start(std::string id, Parameters parameters) {
    id_ = std::move(id);
    options_.environment = std::move(parameters);
    simulation_ = std::make_unique<Restorable>(
        [id = id_, given = options_.environment] { return make(id, given); }, 0);
    frames_ = std::make_unique<Frames>(simulation_->specification(), "");
    tick();
    add("spec", spec());
  }

  walker_sim::EnvironmentSpec spec() const {
    walker_sim::EnvironmentSpec message;
    to_message(simulation_->specification(), options_, message);
    return message;
  }

  void reset(std::optional<std::uint64_t> seed = std::nullopt) {
    simulation_->reset(seed);
    tick();
    add("episode", told<walker_sim::Episode>());
    add("transition", told<walker_sim::Transition>());
  }

  void step(const std::vector<double>& action) {
    simulation_->step(action);
    tick();
    add("transition", told<walker_sim::Transition>());
    if (simulation_->state().has_ended()) add("episode", told<walker_sim::Episode>());
  }

  /// Takes random float32 actions for this many steps, or up to the episode's end.
  void walk(int steps = 1000000) {
    std::uniform_real_distribution<float> draw(-1, 1);
    std::vector<double> action(simulation_->specification().action_size());
    for (int i = 0; i < steps && !simulation_->state().has_ended(); ++i) {
      std::generate(action.begin(), action.end(), [&] { return draw(generator_); });
      step(action);
    }
  }

  walker_sim::EpisodeRecord snapshot() const {
    walker_sim::EpisodeRecord message;
    message.spec = spec();
    message.episode = told<walker_sim::Episode>();
    message.actions = simulation_->record().actions;
    return message;
  }

  void restore(const EpisodeRecord& record) {
    simulation_->restore(record);
    tick();
    add("restored", snapshot());
    add("episode", told<walker_sim::Episode>());
    add("transition", told<walker_sim::Transition>());
  }

  const Restorable& simulation() const { return *simulation_; }
  std::vector<Entry>& entries() { return entries_; }

  template <typename Type>
  std::vector<Type*> all() {
    std::vector<Type*> found;
    for (Entry& entry : entries_) {
      if (auto* message = std::get_if<Type>(&entry.message)) found.push_back(message);
    }
    return found;
  }

  walker_sim::Transition& transition(std::uint32_t episode, std::uint32_t step) {
    for (walker_sim::Transition* one : all<walker_sim::Transition>()) {
      if (one->episode == episode && one->step == step) return *one;
    }
    throw std::logic_error("no such transition");
  }

  template <typename Type, typename Condition>
  void lose(const Condition& is_lost) {
    const auto goes = [&](const Entry& entry) {
      const auto* message = std::get_if<Type>(&entry.message);
      return message != nullptr && is_lost(*message);
    };
    entries_.erase(std::remove_if(entries_.begin(), entries_.end(), goes), entries_.end());
  }

  /// Writes the entries [first, last) to the bag.
  /// @param node publisher of the entries; if empty, the bag names none
  void write(rosbag::Bag& bag, std::size_t first, std::size_t last,
             const std::string& node = "") const {
    for (std::size_t i = first; i < last; ++i) {
      const Entry& entry = entries_[i];
      std::visit([&](const auto& message) { write(bag, entry, message, node); }, entry.message);
    }
  }

  void write(rosbag::Bag& bag, const std::string& node = "") const {
    write(bag, 0, entries_.size(), node);
  }

 private:
  template <typename Type>
  static void write(rosbag::Bag& bag, const Entry& entry, const Type& message,
                    const std::string& node) {
    boost::shared_ptr<ros::M_string> header;
    if (!node.empty()) {
      header = boost::make_shared<ros::M_string>();
      (*header)["callerid"] = node;
      (*header)["topic"] = entry.topic;
      (*header)["type"] = ros::message_traits::datatype<Type>();
      (*header)["md5sum"] = ros::message_traits::md5sum<Type>();
      (*header)["message_definition"] = ros::message_traits::definition<Type>();
    }
    bag.write(entry.topic, entry.time, message, header);
  }

  template <typename Type>
  Type told() const {
    Type message;
    to_message(simulation_->state(), *frames_, now_, message);
    return message;
  }

  template <typename Type>
  void add(const std::string& topic, const Type& message) {
    entries_.push_back({space_ + topic, now_, message});
  }

  void tick() { now_ += ros::Duration(simulation_->specification().dt); }

  std::string space_;
  std::string id_;
  ServerOptions options_{};
  std::unique_ptr<Restorable> simulation_;
  std::unique_ptr<Frames> frames_;
  ros::Time now_{1};
  std::mt19937 generator_{1};
  std::vector<Entry> entries_;
};

}  // namespace walker::test
