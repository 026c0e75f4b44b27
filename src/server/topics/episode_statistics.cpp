#include "server/topics/episode_statistics.h"

#include <algorithm>
#include <cmath>

namespace walker {

void EpisodeStatistics::add(const EpisodeState& state) {
  End end = state.terminated ? End::terminated : End::truncated;
  if (!state.error.empty()) end = End::failed;
  episodes_[count_ % kCapacity] = {state.episode_return, state.step, end};
  ++count_;
}

EpisodeStatistics::Summary EpisodeStatistics::summary() const {
  Summary summary;
  if (count_ == 0) return summary;
  summary.episodes = std::min<std::uint64_t>(count_, kCapacity);
  summary.return_min = summary.return_max = episodes_[0].episode_return;
  double squares = 0;  // of the distances from the mean, after Welford: no large numbers cancel
  for (std::size_t i = 0; i < summary.episodes; ++i) {
    const Episode& episode = episodes_[i];
    const double value = episode.episode_return;
    const auto count = static_cast<double>(i + 1);
    const double distance = value - summary.return_mean;
    summary.return_mean += distance / count;
    squares += distance * (value - summary.return_mean);
    summary.return_min = std::min(summary.return_min, value);
    summary.return_max = std::max(summary.return_max, value);
    summary.length_mean += (episode.length - summary.length_mean) / count;
    if (episode.end == End::terminated) ++summary.terminated;
    if (episode.end == End::truncated) ++summary.truncated;
    if (episode.end == End::failed) ++summary.failed;
  }
  summary.return_deviation = std::sqrt(squares / static_cast<double>(summary.episodes));
  return summary;
}

}  // namespace walker
