#include "replay/replay_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <iomanip>
#include <memory>
#include <ostream>

#include "base/engine_release.h"
#include "base/printable_text.h"
#include "base/shortest_text.h"
#include "replay/bag_episodes.h"
#include "replay/replay.h"

namespace walker {
namespace {

struct Counts {
  std::size_t equal = 0;
  std::size_t steps = 0;  // of equal episodes
  std::size_t differing = 0;
  std::size_t with_gap = 0;
  std::size_t not_compared = 0;
};

/// An episode's line without its verdict.
using Row = std::array<std::string, 5>;

const Row kHeader{"episode", "seed", "steps", "return", "end"};

std::string steps_text(std::uint32_t first, std::uint32_t last) {
  if (first == last) return "step " + std::to_string(first) + " is";
  return "steps " + std::to_string(first) + " to " + std::to_string(last) + " are";
}

std::string return_text(double value) {
  constexpr double kManyDigits = 1e9;
  ClassicStream stream;
  if (std::abs(value) < kManyDigits) stream << std::fixed << std::setprecision(2);
  stream << value;
  return stream.str();
}

std::string end_text(const BagEpisode& episode) {
  if (episode.end) return printable(episode.end->end_reason);
  if (episode.terminated) return "terminated";
  if (episode.truncated) return "truncated";
  switch (episode.successor) {
    case BagEpisode::Successor::reset:
      return "reset before its end";
    case BagEpisode::Successor::other_server:
      return "its server ended";
    case BagEpisode::Successor::none:
      break;
  }
  return "goes on after the bag";
}

Row describe(const BagEpisode& episode) {
  std::string seed = "unknown";
  if (episode.beginning) {
    const bool has_seed = episode.beginning->has_seed != 0;
    seed = has_seed ? std::to_string(episode.beginning->seed) : "continued";
  }
  return {std::to_string(episode.number), seed, std::to_string(episode.last_step),
          return_text(episode.episode_return), end_text(episode)};
}

/// Recorded data that is missing to repeat the episode; empty if none.
std::string missing_data(const BagEpisode& episode) {
  if (episode.first_step == 0) {
    return episode.beginning ? "" : "its beginning is not in the bag (topic episode)";
  }
  if (episode.restored) return "";
  if (episode.beginning)
    return "begun by ~restore, whose record is not in the bag (topic restored)";
  return steps_text(0, episode.first_step - 1) + " not in the bag";
}

/// Writes one walker's report while its transitions are read.
class WalkerReport {
 public:
  WalkerReport(const BagWalker& walker, Counts& counts, std::ostream& out)
      : walker_(walker), counts_(counts), out_(out) {
    widen(kHeader);
    for (const BagEpisode& episode : walker.episodes) widen(describe(episode));
  }

  void take(const walker_sim::Transition& transition) {
    const BagEpisode& episode = walker_.episodes[index_];
    if (num_taken_ == 0) begin(episode);
    if (is_repeated_ && num_taken_ < episode.num_consecutive()) replay_->compare(transition);
    if (++num_taken_ < episode.num_transitions) return;
    write(describe(episode), judge(episode));
    ++index_;
    num_taken_ = 0;
  }

 private:
  void begin(const BagEpisode& episode) {
    if (index_ == 0 || episode.spec != walker_.episodes[index_ - 1].spec) introduce(episode);
    if (episode.missing_before > 0) write_missing_episodes(episode);
    is_repeated_ = replay_ && missing_data(episode).empty();
    if (!is_repeated_) return;
    if (episode.restored) {
      replay_->begin(episode.restored->episode, episode.restored->actions);
    } else {
      replay_->begin(*episode.beginning);
    }
  }

  /// Writes a heading and makes the environment for the following episodes.
  void introduce(const BagEpisode& episode) {
    replay_.reset();
    obstacle_.clear();
    std::string heading = walker_.topic;
    if (!walker_.node.empty()) heading += " of " + walker_.node;
    if (!episode.spec) {
      obstacle_ = "no specification in the bag (topic spec)";
    } else {
      heading += ": " + episode.spec->id + " on " + episode.spec->engine + " " +
                 engine_release(episode.spec->engine_version);
      try {
        replay_ = std::make_unique<Replay>(*episode.spec);
      } catch (const std::exception& error) {
        obstacle_ = error.what();
      }
    }
    write_line(heading);
    if (!obstacle_.empty()) write_line("not compared: " + obstacle_);
    if (replay_ && !replay_->other_versions().empty()) write_line(replay_->other_versions());
    write(kHeader, "");
  }

  /// Escapes the text, since bags have strings of untrusted origin.
  void write_line(const std::string& text) { out_ << printable(text) << "\n"; }

  void write_missing_episodes(const BagEpisode& episode) {
    counts_.with_gap += episode.missing_before;
    const std::uint32_t last = episode.number - 1;
    const std::uint32_t first = episode.number - episode.missing_before;
    std::string numbers = std::to_string(first);
    if (first != last) numbers += "-" + std::to_string(last);
    write({numbers}, "not in the bag");
  }

  /// Returns the verdict and counts it.
  std::string judge(const BagEpisode& episode) {
    if (!replay_) {
      ++counts_.not_compared;
      return "not compared";
    }
    if (!is_repeated_) {
      // What was published before the recorder started is not lost.
      const bool is_lost =
          episode.first_step != 0 && !episode.beginning && !episode.opens_recording;
      ++(is_lost ? counts_.with_gap : counts_.not_compared);
      return "not compared: " + missing_data(episode);
    }
    if (episode.end && episode.first_gap_end == 0) replay_->compare_end(*episode.end);
    if (!replay_->difference().empty()) {
      ++counts_.differing;
      return "differs " + replay_->difference();
    }
    if (episode.first_gap_end != 0 && !is_cut_off(episode)) {
      ++counts_.with_gap;
      return "equal up to step " + std::to_string(episode.last_step) + "; " +
             steps_text(episode.last_step + 1, episode.first_gap_end) + " not in the bag";
    }
    ++counts_.equal;
    counts_.steps += episode.last_step;
    if (episode.first_gap_end != 0) {
      return "equal up to step " + std::to_string(episode.last_step) + ", where the recording ends";
    }
    return episode.restored ? "equal, restored at step " + std::to_string(episode.first_step)
                            : "equal";
  }

  /// Returns whether only the last published steps are missing. Each topic has its own connection,
  /// so a recorder that is stopped may have received an episode's end but not its last steps.
  bool is_cut_off(const BagEpisode& episode) const {
    return index_ + 1 == walker_.episodes.size() &&
           episode.num_transitions == episode.num_consecutive();
  }

  void widen(const Row& row) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      widths_[i] = std::max(widths_[i], static_cast<int>(row[i].size()));
    }
  }

  void write(const Row& row, const std::string& verdict) {
    ClassicStream line;
    const std::size_t end = row.size() - 1;
    for (std::size_t i = 0; i < end; ++i) line << std::setw(widths_[i]) << row[i] << "  ";
    line << std::left;
    if (verdict.empty()) {
      line << row[end];
    } else {
      line << std::setw(widths_[end]) << row[end] << "  " << verdict;
    }
    out_ << line.str() << '\n' << std::flush;  // shows progress in a long recording
  }

  const BagWalker& walker_;
  Counts& counts_;
  std::ostream& out_;
  std::array<int, std::tuple_size_v<Row>> widths_{};
  std::size_t index_ = 0;           // of the current episode
  std::size_t num_taken_ = 0;       // its transitions so far
  std::unique_ptr<Replay> replay_;  // null: no equal environment
  std::string obstacle_;            // why `replay_` is null
  bool is_repeated_ = false;        // the current episode
};

bool summarize(const Counts& counts, std::ostream& out) {
  if (counts.equal + counts.differing + counts.with_gap == 0) {
    out << "Nothing was compared\n";
    return false;
  }
  out << counts.equal << (counts.equal == 1 ? " episode" : " episodes") << " equal to the bit ("
      << counts.steps << " steps)";
  if (counts.differing != 0) out << ", " << counts.differing << " differing";
  if (counts.with_gap != 0) out << ", " << counts.with_gap << " with steps missing";
  if (counts.not_compared != 0) out << ", " << counts.not_compared << " not compared";
  out << "\n";
  return counts.differing == 0 && counts.with_gap == 0;
}

}  // namespace

bool replay(const std::vector<std::string>& paths, std::ostream& out) {
  const BagEpisodes bags(paths);
  if (bags.walkers().empty()) {
    out << "No walker in the bag: no topic has the type walker_sim/Transition; record transition, "
           "episode, spec and restored\n";
    return false;
  }
  Counts counts;
  for (const BagWalker& walker : bags.walkers()) {
    WalkerReport report(walker, counts, out);
    bags.read_transitions(
        walker, [&](const walker_sim::Transition& transition) { report.take(transition); });
  }
  return summarize(counts, out);
}

}  // namespace walker
