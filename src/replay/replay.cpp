#include "replay/replay.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <exception>
#include <iomanip>
#include <memory>
#include <ostream>
#include <set>
#include <stdexcept>
#include <utility>

#include "base/engine_release.h"
#include "base/printable_text.h"
#include "base/shortest_text.h"
#include "episode/walker.h"
#include "replay/bag_reader.h"
#include "ros/message_conversions.h"

namespace walker {
namespace {

struct Counts {
  std::size_t equal = 0;
  std::size_t steps = 0;  // of equal episodes
  std::size_t differing = 0;
  std::size_t missing = 0;
  std::size_t not_compared = 0;
};

/// Number, seed, steps, return and end of an episode.
using Row = std::array<std::string, 5>;

std::string return_text(double value) {
  constexpr double kManyDigits = 1e9;
  if (std::abs(value) < kManyDigits) return fixed_text(value, 2);
  ClassicStream stream;
  stream << value;
  return stream.str();
}

Row describe(const walker_sim::Episode& episode) {
  return {std::to_string(episode.episode),
          episode.has_seed != 0 ? std::to_string(episode.seed) : "continued",
          std::to_string(episode.length), return_text(episode.episode_return),
          printable(episode.end_reason, kMaxQuotedBytes)};
}

void write(const Row& row, const std::string& verdict, std::ostream& out) {
  constexpr std::array<int, 5> kWidths{7, 9, 6, 8, 35};
  ClassicStream line;
  for (std::size_t i = 0; i + 1 < row.size(); ++i) line << std::setw(kWidths[i]) << row[i] << "  ";
  line << std::left << std::setw(verdict.empty() ? 0 : kWidths.back()) << row.back();
  if (!verdict.empty()) line << "  " << printable(verdict);
  out << line.str() << '\n' << std::flush;  // shows progress in a long recording
}

/// Returns what must be supported here: the record's environment, engine and world.
EpisodeRecord origin_of(const EpisodeRecord& record) {
  EpisodeRecord origin;
  origin.id = record.id;
  origin.parameters = record.parameters;
  origin.engine = record.engine;
  origin.engine_version = record.engine_version;
  origin.world = record.world;
  return origin;
}

/// Repeats the episodes of one publisher in the order of recording.
class WalkerReport {
 public:
  WalkerReport(std::string publisher, Counts& counts, std::ostream& out)
      : publisher_(std::move(publisher)), counts_(counts), out_(out) {}

  void add(const BagEpisode& episode) {
    if (episode.publisher != publisher_ || !known_.insert(episode.hash).second) return;
    const walker_sim::EpisodeRecord& record = episode.record;
    set_environment(record.spec);
    const std::uint32_t number = record.episode.episode;
    // After the restart of a server the numbers begin again.
    if (last_number_ != 0 && number > last_number_ + 1) write_missing(last_number_ + 1, number - 1);
    last_number_ = number;
    write(describe(record.episode), verdict(record), out_);
  }

 private:
  /// Makes the environment, and writes a heading, unless the previous episode had the same.
  void set_environment(const walker_sim::EnvironmentSpec& spec) {
    std::string key = spec.id + '\n' + spec.engine + '\n' + spec.engine_version;
    for (const auto* texts : {&spec.parameter_names, &spec.parameter_values}) {
      for (const std::string& text : *texts) key += '\n' + text;
    }
    if (key == environment_key_) return;
    environment_key_ = std::move(key);
    out_ << printable(publisher_ + ": " + spec.id + " on " + spec.engine + " " +
                      engine_release(spec.engine_version))
         << "\n";
    write({"episode", "seed", "steps", "return", "end"}, "", out_);
    environment_.reset();
    try {
      environment_ =
          make_walker(spec.id, parameters_of(spec.id, spec.parameter_names, spec.parameter_values));
      WalkerOptions options;
      options.records_actions = true;
      environment_->configure(options);
    } catch (const std::exception& error) {
      unsupported_reason_ = error.what();
    }
  }

  void write_missing(std::uint32_t first, std::uint32_t last) {
    counts_.missing += last - first + 1;
    std::string numbers = std::to_string(first);
    if (first != last) numbers += "-" + std::to_string(last);
    write({numbers}, "not in the bag", out_);
  }

  /// Repeats the episode. Returns what its line ends with, and counts it.
  std::string verdict(const walker_sim::EpisodeRecord& message) {
    EpisodeRecord record;
    try {
      if (!environment_) throw std::invalid_argument(unsupported_reason_);
      record = to_record(message);
      check_repeatable(origin_of(record), environment_->specification());
      if (record.checksums.empty()) throw std::invalid_argument("the record has no checksums");
    } catch (const std::exception& error) {
      ++counts_.not_compared;
      return std::string("not compared: ") + error.what();
    }
    const std::string difference = repeat(record, message.episode.end_reason);
    if (!difference.empty()) {
      ++counts_.differing;
      return "differs at " + difference;
    }
    ++counts_.equal;
    counts_.steps += record.num_steps;
    return "equal";
  }

  /// Returns where the repeated episode differs from the record, and how; empty if it does not.
  std::string repeat(const EpisodeRecord& record, const std::string& end_reason) {
    try {
      environment_->begin(record);
    } catch (const std::exception& error) {
      return std::string("its beginning: ") + error.what();
    }
    try {
      environment_->repeat(record, std::chrono::steady_clock::time_point::max());
    } catch (const std::exception& error) {
      return error.what();
    }
    const EpisodeState& state = environment_->state();
    if (!state.has_ended() || state.end_reason == end_reason) return "";
    return "its end: end_reason = " + end_reason + "; repeated here it is " + state.end_reason;
  }

  std::string publisher_;
  Counts& counts_;
  std::ostream& out_;
  std::set<std::size_t> known_;  // hashes
  std::uint32_t last_number_ = 0;
  std::string environment_key_;
  std::unique_ptr<Walker> environment_;  // null: cannot be made here
  std::string unsupported_reason_;       // why `environment_` is null
};

bool summarize(const Counts& counts, std::ostream& out) {
  if (counts.equal + counts.differing == 0) {
    out << "Nothing was compared\n";
    return false;
  }
  out << counts.equal << (counts.equal == 1 ? " episode" : " episodes") << " equal to the bit ("
      << counts.steps << " steps)";
  if (counts.differing != 0) out << ", " << counts.differing << " differing";
  if (counts.missing != 0) out << ", " << counts.missing << " missing";
  if (counts.not_compared != 0) out << ", " << counts.not_compared << " not compared";
  out << "\n";
  return counts.differing == 0 && counts.missing == 0;
}

}  // namespace

bool replay(const std::vector<std::string>& paths, std::ostream& out) {
  std::vector<std::pair<std::uint64_t, std::string>> bags;  // with the time of their first episode
  std::vector<std::string> publishers;
  for (const std::string& path : paths) {
    std::uint64_t begin = 0;
    const bool is_closed = read_episodes(path, [&](const BagEpisode& episode) {
      if (begin == 0) begin = episode.time;
      const std::string& publisher = episode.publisher;
      if (std::find(publishers.begin(), publishers.end(), publisher) == publishers.end()) {
        publishers.push_back(publisher);
      }
    });
    if (!is_closed)
      out << printable(path) << ": was not closed; its last episodes may be missing\n";
    bags.emplace_back(begin, path);
  }
  if (publishers.empty()) {
    out << "No episode in the bag: it has no message of the type walker_sim/EpisodeRecord; record "
           "the topic episode_record\n";
    return false;
  }
  std::sort(bags.begin(), bags.end());
  Counts counts;
  for (const std::string& publisher : publishers) {
    WalkerReport report(publisher, counts, out);
    for (const auto& bag : bags) {
      read_episodes(bag.second, [&](const BagEpisode& episode) { report.add(episode); });
    }
  }
  return summarize(counts, out);
}

}  // namespace walker
