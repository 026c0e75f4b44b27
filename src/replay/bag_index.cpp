#include "replay/bag_index.h"

#include <algorithm>
#include <utility>

#include <ros/serialization.h>

namespace walker {
namespace {

/// Compares bit by bit; compared as messages, NaN would differ from itself.
bool same(const walker_sim::EnvironmentSpec& one, const walker_sim::EnvironmentSpec& other) {
  const ros::SerializedMessage a = ros::serialization::serializeMessage(one);
  const ros::SerializedMessage b = ros::serialization::serializeMessage(other);
  return a.num_bytes == b.num_bytes &&
         std::equal(a.buf.get(), a.buf.get() + a.num_bytes, b.buf.get());
}

}  // namespace

void BagIndex::add(const walker_sim::EnvironmentSpec& message) {
  const bool belongs_to_run = !spec_ || episodes_.empty();
  (belongs_to_run ? spec_ : next_spec_) = std::make_shared<walker_sim::EnvironmentSpec>(message);
  spec_came_ = true;
}

void BagIndex::add(const walker_sim::Transition& message) {
  const bool begins_run = episodes_.empty() || goes_back(message) || is_next_server(message);
  if (begins_run && !episodes_.empty()) end_run();
  const bool begins = begins_run || message.episode != episodes_.back().number;
  if (begins) open(message, begins_run);
  BagEpisode& episode = episodes_.back();
  ++episode.num_transitions;
  const bool is_next = begins || message.step == step_ + 1;
  if (episode.first_gap_end == 0 && !is_next) episode.first_gap_end = message.step - 1;
  if (episode.first_gap_end == 0) {
    episode.last_step = message.step;
    episode.last_stamp = message.header.stamp;
    episode.episode_return = message.episode_return;
    episode.terminated = message.terminated != 0;
    episode.truncated = message.truncated != 0;
  }
  step_ = message.step;
  spec_came_ = false;
}

/// Returns whether the counters restart, as they do with a new server.
bool BagIndex::goes_back(const walker_sim::Transition& message) const {
  const std::uint32_t episode = episodes_.back().number;
  return message.episode < episode || (message.episode == episode && message.step <= step_);
}

/// Returns whether a new server is recognized by its specification alone, since its counters are
/// ahead of the previous server's.
bool BagIndex::is_next_server(const walker_sim::Transition& message) const {
  const std::uint32_t episode = episodes_.back().number;
  const bool is_next_step = message.episode == episode && message.step == step_ + 1;
  if (!next_spec_ || is_next_step) return false;
  if (!same(*spec_, *next_spec_)) return true;
  // An equal specification may be a latched message that the recorder repeated when it split a bag.
  const bool is_next_episode = message.episode == episode + 1 && message.step == 0;
  return spec_came_ && !is_next_episode;
}

void BagIndex::end_run() {
  if (repeated_spec_ && spec_came_ && !next_spec_) next_spec_ = std::exchange(spec_, nullptr);
  if (!spec_) spec_ = std::move(repeated_spec_);
  repeated_spec_.reset();
  for (std::size_t i = run_begin_; i < episodes_.size(); ++i) episodes_[i].spec = spec_;
  run_begin_ = episodes_.size();
  // An equal specification within the run: repeated by the recorder, or early from the next server.
  const bool may_be_repeated = next_spec_ && !spec_came_ && same(*spec_, *next_spec_);
  (may_be_repeated ? repeated_spec_ : spec_) = std::move(next_spec_);
  if (may_be_repeated) spec_.reset();
}

void BagIndex::open(const walker_sim::Transition& message, bool begins_run) {
  BagEpisode episode;
  episode.number = message.episode;
  episode.first_step = message.step;
  episode.first_stamp = message.header.stamp;
  episode.opens_recording = begins_run;
  if (!episodes_.empty()) {
    BagEpisode& previous = episodes_.back();
    if (!begins_run) episode.missing_before = message.episode - previous.number - 1;
    previous.successor =
        begins_run ? BagEpisode::Successor::other_server : BagEpisode::Successor::reset;
  }
  episodes_.push_back(std::move(episode));
}

std::vector<BagEpisode> BagIndex::finish() {
  if (episodes_.empty()) return {};
  spec_came_ = false;  // no run follows
  end_run();
  std::vector<Place> beginnings;
  Place from = 0;
  for (std::size_t i = 0; i < episodes_.size(); ++i) {
    beginnings.push_back(find_beginning(i, from));
    if (beginnings.back() == announcements_.size()) continue;
    from = beginnings.back();
    episodes_[i].beginning = announcements_[from];
    episodes_[i].restored = find_record(i);
  }
  Place to = announcements_.size();
  for (std::size_t i = episodes_.size(); i-- > 0;) {
    const bool has_beginning = beginnings[i] != announcements_.size();
    join_end(i, has_beginning ? beginnings[i] : 0, to);
    if (has_beginning) to = beginnings[i];
  }
  return std::move(episodes_);
}

BagIndex::Place BagIndex::find_beginning(std::size_t index, Place from) const {
  const std::uint32_t number = episodes_[index].number;
  for (Place place = from; place < announcements_.size(); ++place) {
    if (announcements_[place].episode != number) continue;
    if (announcements_[place].header.stamp != episodes_[index].first_stamp) continue;
    // If only an episode's last step was recorded, this is its end.
    const bool is_end = !announcements_[place].end_reason.empty() && place > 0 &&
                        announcements_[place - 1].episode == number &&
                        announcements_[place - 1].header.stamp < episodes_[index].first_stamp;
    return is_end ? announcements_.size() : place;
  }
  return announcements_.size();
}

std::shared_ptr<const walker_sim::EpisodeRecord> BagIndex::find_record(std::size_t index) const {
  for (const auto& record : records_) {
    const walker_sim::Episode& announcement = record->episode;
    if (announcement.episode == episodes_[index].number &&
        announcement.header.stamp == episodes_[index].first_stamp) {
      return record;
    }
  }
  return nullptr;
}

void BagIndex::join_end(std::size_t index, Place from, Place to) {
  BagEpisode& episode = episodes_[index];
  for (Place place = from; place < to; ++place) {
    const walker_sim::Episode& announcement = announcements_[place];
    if (announcement.episode != episode.number || announcement.end_reason.empty()) continue;
    if (announcement.header.stamp < episode.last_stamp) continue;
    episode.end = announcement;
    if (episode.first_gap_end == 0 && announcement.length > episode.last_step) {
      episode.first_gap_end = announcement.length;
    }
    return;
  }
}

}  // namespace walker
