// Heuristic episodes against Gymnasium's as samples of one distribution: what remains of fidelity
// where the engine's bits differ (WALKER_SIM_ENGINES=system).
//
// Ours are 200 episodes of other seeds than the 1000 recorded ones, so the two samples are
// independent. Returns and lengths each must pass
//   - the two-sample Kolmogorov-Smirnov test at the level 0.001: sup |F - G| is at most
//     sqrt(-ln(0.001 / 2) / 2) sqrt((n + m) / (n m)) = 0.151 (conservative where values repeat),
//   - means within 3.3 standard errors of their difference, also a level of 0.001.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "bipedal_walker/player.h"

namespace walker::bipedal_walker {
namespace {

constexpr double kLevel = 0.001;
constexpr double kStandardErrors = 3.3;

struct Samples {
  std::vector<double> lengths;
  std::vector<double> returns;
};

Samples gymnasiums() {
  Recording recording("heuristic_returns.txt");
  Samples samples;
  while (recording.has_more()) {
    recording.next<std::uint64_t>();  // seed
    samples.lengths.push_back(recording.next<double>());
    samples.returns.push_back(recording.next<double>());
  }
  return samples;
}

Samples ours() {
  constexpr std::uint64_t kFirstSeed = 1000;  // beyond the recorded ones
  Samples samples;
  for (std::uint64_t seed = kFirstSeed; seed < kFirstSeed + 200; ++seed) {
    Stepper walker("BipedalWalker-v3");
    const auto rows = play(walker, seed, Actions("heuristic", 0));
    samples.lengths.push_back(static_cast<double>(rows.size() - 1));
    double sum = 0;
    for (const auto& row : rows) sum += row[kObservationSize];
    samples.returns.push_back(sum);
  }
  return samples;
}

/// Largest difference of the two empirical distribution functions.
double largest_gap(std::vector<double> one, std::vector<double> other) {
  std::sort(one.begin(), one.end());
  std::sort(other.begin(), other.end());
  const auto share = [](const std::vector<double>& sample, double value) {
    const auto below = std::upper_bound(sample.begin(), sample.end(), value) - sample.begin();
    return static_cast<double>(below) / static_cast<double>(sample.size());
  };
  double gap = 0;
  for (const auto* sample : {&one, &other}) {
    for (const double value : *sample) {
      gap = std::max(gap, std::abs(share(one, value) - share(other, value)));
    }
  }
  return gap;
}

double mean(const std::vector<double>& sample) {
  return std::accumulate(sample.begin(), sample.end(), 0.0) / static_cast<double>(sample.size());
}

/// Squared standard error of the mean.
double squared_error(const std::vector<double>& sample) {
  const double center = mean(sample);
  double sum = 0;
  for (const double value : sample) sum += (value - center) * (value - center);
  const auto n = static_cast<double>(sample.size());
  return sum / (n - 1) / n;
}

void expect_same_distribution(const std::vector<double>& one, const std::vector<double>& other) {
  const auto n = static_cast<double>(one.size());
  const auto m = static_cast<double>(other.size());
  const double largest_allowed =
      std::sqrt(-std::log(kLevel / 2) / 2) * std::sqrt((n + m) / (n * m));
  EXPECT_LE(largest_gap(one, other), largest_allowed);
  const double error = std::sqrt(squared_error(one) + squared_error(other));
  EXPECT_LE(std::abs(mean(one) - mean(other)), kStandardErrors * error)
      << "means " << mean(one) << " and " << mean(other);
  std::cout << "means " << mean(one) << " and " << mean(other) << ", "
            << std::abs(mean(one) - mean(other)) / error << " standard errors apart; gap "
            << largest_gap(one, other) << " of " << largest_allowed << " allowed\n";
}

TEST(Statistics, HeuristicEpisodesAreDistributedAsGymnasiums) {
  const Samples theirs = gymnasiums();
  ASSERT_EQ(theirs.returns.size(), 1000U);
  const Samples mine = ours();
  {
    SCOPED_TRACE("returns");
    expect_same_distribution(mine.returns, theirs.returns);
  }
  {
    SCOPED_TRACE("lengths");
    expect_same_distribution(mine.lengths, theirs.lengths);
  }
}

}  // namespace
}  // namespace walker::bipedal_walker
