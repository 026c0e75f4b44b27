#include "server/topics/episode_statistics.h"

#include <algorithm>
#include <cmath>

namespace walker {

void EpisodeStatistics::add(const EpisodeState& state) {
  End end = state.terminated ? End::terminated : End::truncated;
  if (!state.error.empty()) end = End::failed;
  const std::size_t place = count_ % kCapacity;
  returns_(place) = state.episode_return;
  lengths_(place) = state.step;
  ends_[place] = end;
  ++count_;
}

EpisodeStatistics::Summary EpisodeStatistics::summary() const {
  Summary summary;
  if (count_ == 0) return summary;
  summary.episodes = std::min<std::uint64_t>(count_, kCapacity);
  const auto count = static_cast<Eigen::Index>(summary.episodes);
  const auto returns = returns_.head(count);
  summary.return_mean = returns.mean();
  summary.return_deviation = std::sqrt((returns - summary.return_mean).square().mean());
  summary.return_min = returns.minCoeff();
  summary.return_max = returns.maxCoeff();
  summary.length_mean = lengths_.head(count).mean();
  const auto number_of = [&](End end) {
    return static_cast<std::size_t>(std::count(ends_.begin(), ends_.begin() + count, end));
  };
  summary.terminated = number_of(End::terminated);
  summary.truncated = number_of(End::truncated);
  summary.failed = number_of(End::failed);
  return summary;
}

}  // namespace walker
