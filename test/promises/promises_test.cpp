// Each script gives each interface in this process the oracle's trace, to the bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "episode/rollout.h"
#include "episode/walker.h"
#include "promises/oracle.h"
#include "promises/promises.h"
#include "walker_sim/pool.h"

namespace walker::promises {
namespace {

class Episodes : public SingleWalkers {
 public:
  Episodes(const Case& one, bool resets_at_once)
      : SingleWalkers(make(one.id, parameters_of(one))->specification(), resets_at_once) {
    for (std::uint32_t i = 0; i < kNumWalkers; ++i) {
      walkers_.push_back(make_walker(one.id, parameters_of(one)));
    }
  }

  void set_world(std::uint32_t walker, const World& world) override {
    walkers_[walker]->set_world(world);
  }
  void set_coordinates(std::uint32_t walker, const std::vector<double>& position,
                       const std::vector<double>& velocity) override {
    walkers_[walker]->set_coordinates(position, velocity);
  }
  std::vector<std::byte> save(std::uint32_t walker) override {
    std::vector<std::byte> state;
    walkers_[walker]->save_state(state);
    return state;
  }
  void load(std::uint32_t walker, const std::vector<std::byte>& state) override {
    walkers_[walker]->load_state(state.data(), state.size());
  }

 protected:
  void reset_one(std::uint32_t i, Seed seed) override {
    walkers_[i]->reset(seed);
    const EpisodeState& state = walkers_[i]->state();
    add_reset(i, state.observation.data(), state.info.data(), state.drawn_world(), state.error);
  }
  void step_one(std::uint32_t i, const double* action, std::size_t size) override {
    walkers_[i]->step(action, size);
    const EpisodeState& state = walkers_[i]->state();
    add_step(i, state.observation.data(), state.reward, state.terminated, state.truncated,
             state.info.data(), state.error);
  }
  bool has_ended(std::uint32_t i) const override { return walkers_[i]->state().has_ended(); }

  std::vector<std::unique_ptr<Walker>> walkers_;
};

/// Episodes whose states are records, which others repeat.
class RecordedEpisodes final : public Episodes {
 public:
  explicit RecordedEpisodes(const Case& one) : Episodes(one, true), case_(one) {
    for (std::uint32_t i = 0; i < kNumWalkers; ++i) prepare(*walkers_[i]);
  }

  /// A state is the index of a record.
  std::vector<std::byte> save(std::uint32_t walker) override {
    records_.push_back(walkers_[walker]->record());
    return std::vector<std::byte>(records_.size());
  }
  void load(std::uint32_t walker, const std::vector<std::byte>& state) override {
    const std::unique_ptr<Walker> other = make_walker(case_.id, parameters_of(case_));
    prepare(*other);
    EpisodeRecord record = records_.at(state.size() - 1);
    if (state.back() != std::byte{}) record.checksums.back() ^= 1U;  // a damaged one
    other->begin(record);
    while (!other->repeat(record, std::chrono::steady_clock::now())) {
    }
    walkers_[walker]->take_over(*other);
  }

 private:
  static void prepare(Walker& walker) { walker.configure({std::nullopt, true}); }

  const Case case_;
  std::vector<EpisodeRecord> records_;
};

/// A pool whose walkers step together, in groups beyond the kernels' sizes.
class PoolWalkers : public Interface {
 public:
  static constexpr std::uint32_t kCount = 19;

  PoolWalkers(const Case& one, AutoresetMode mode, std::size_t num_threads,
              std::size_t batch_size = 0)
      : Interface(make(one.id, parameters_of(one))->specification(), kCount),
        pool([&] { return make(one.id, parameters_of(one)); },
             {kCount, num_threads, mode, batch_size}),
        arrays(specification(), kCount) {}

  void reset(const Rows& walkers, Seed seed) override {
    const Rows rows = all_of(walkers);
    std::vector<Seed> seeds;
    for (const std::uint32_t row : rows) {
      if (seed) seeds.emplace_back(*seed + row % kNumWalkers);
    }
    pool.reset(rows, seeds, arrays.batch());
    for (const std::uint32_t row : rows) add_first_row(row, row);
  }

  void step(const std::vector<double>& actions) override {
    const std::vector<bool> resets = find_resets();
    const std::vector<double> all = for_all(actions);
    pool.step(all.data(), all.size(), arrays.batch());
    for (std::uint32_t row = 0; row < kCount; ++row) add_row(row, row, resets[row]);
  }

  void set_world(std::uint32_t walker, const World& world) override {
    pool.set_world(all_of({walker}), {world});
  }
  void set_coordinates(std::uint32_t walker, const std::vector<double>& position,
                       const std::vector<double>& velocity) override {
    for (const std::uint32_t row : all_of({walker})) {
      pool.walker(row).set_coordinates(position, velocity);
    }
  }
  std::vector<std::byte> save(std::uint32_t walker) override {
    std::vector<std::byte> state;
    pool.save_state(walker, state);
    return state;
  }
  void load(std::uint32_t walker, const std::vector<std::byte>& state) override {
    const Rows rows = all_of({walker});
    pool.load_states(rows, std::vector<std::vector<std::byte>>(rows.size(), state), {});
  }

 protected:
  /// Returns the rows of these walkers.
  static Rows all_of(const Rows& walkers) {
    Rows rows;
    for (std::uint32_t row = 0; row < kCount; ++row) {
      if (std::count(walkers.begin(), walkers.end(), row % kNumWalkers) != 0) rows.push_back(row);
    }
    return rows;
  }

  std::vector<double> for_all(const std::vector<double>& actions) const {
    std::vector<double> all;
    while (!actions.empty() && all.size() < kCount * specification().action_size()) {
      all.insert(all.end(), actions.begin(), actions.end());
    }
    all.resize(std::min(all.size(), kCount * specification().action_size()));
    return all;
  }

  /// Returns which rows the next step resets.
  std::vector<bool> find_resets() {
    std::vector<bool> resets(kCount);
    for (std::uint32_t row = 0; row < kCount; ++row) {
      resets[row] = pool.walker(row).state().has_ended();
    }
    return resets;
  }

  void add_row(std::uint32_t row, std::uint32_t walker, bool is_reset) {
    if (is_reset) return add_first_row(row, walker);
    const bool terminated = arrays.terminated[row] != 0;
    const bool truncated = arrays.truncated[row] != 0;
    const bool is_final =
        pool.options().autoreset_mode == AutoresetMode::same_step && (terminated || truncated);
    const double* const observation =
        (is_final ? arrays.final_observations : arrays.observations).data();
    const double* const info = (is_final ? arrays.final_info : arrays.info).data();
    add_step(walker, observation + row * arrays.observation_size, arrays.rewards[row], terminated,
             truncated, info + row * arrays.num_infos, pool.error(walker));
    if (is_final) add_first_row(row, walker);
  }

  void add_first_row(std::uint32_t row, std::uint32_t walker) {
    add_reset(walker, &arrays.observations[row * arrays.observation_size],
              arrays.info.data() + row * arrays.num_infos,
              pool.walker(walker).state().drawn_world(), pool.reset_error(walker));
  }

  Pool pool;
  PoolArrays arrays;
};

/// A pool whose user resets ended walkers, and steps the others.
class DisabledPool final : public PoolWalkers {
 public:
  explicit DisabledPool(const Case& one) : PoolWalkers(one, AutoresetMode::disabled, 2) {}

  void step(const std::vector<double>& actions) override {
    if (actions.empty()) return PoolWalkers::step(actions);
    const std::vector<bool> resets = find_resets();
    const std::vector<double> all = for_all(actions);
    const std::size_t size = specification().action_size();
    Rows stepped;
    Rows ended;
    std::vector<double> their_actions;
    for (std::uint32_t walker = 0; walker < kCount; ++walker) {
      if (resets[walker]) {
        ended.push_back(walker);
        continue;
      }
      stepped.push_back(walker);
      their_actions.insert(their_actions.end(), &all[walker * size], &all[walker * size] + size);
    }
    if (!stepped.empty()) {
      pool.step(their_actions.data(), stepped.data(), stepped.size(), arrays.batch());
    }
    for (std::uint32_t row = 0; row < stepped.size(); ++row) {
      add_row(row, stepped[row], false);
      if (pool.walker(stepped[row]).state().has_ended()) ended.push_back(stepped[row]);
    }
    if (ended.empty()) return;
    pool.reset(ended, {}, arrays.batch());
    for (const std::uint32_t walker : ended) add_first_row(walker, walker);
  }
};

/// A pool whose walkers are received one by one.
class AsynchronousPool final : public PoolWalkers {
 public:
  AsynchronousPool(const Case& one, AutoresetMode mode) : PoolWalkers(one, mode, 3, 1) {}

  void step(const std::vector<double>& actions) override {
    if (actions.empty()) return PoolWalkers::step(actions);
    const std::vector<bool> resets = find_resets();
    const std::vector<double> all = for_all(actions);
    const std::size_t size = specification().action_size();
    // Two parts, the second first.
    for (const Rows& part : {rows_between(kCount / 2, kCount), rows_between(0, kCount / 2)}) {
      pool.send(&all[part.front() * size], part.data(), part.size());
    }
    for (std::uint32_t left = kCount; left > 0; --left) {
      std::uint32_t walker = 0;
      pool.recv(arrays.batch(), &walker);
      add_row(0, walker, resets[walker]);
    }
  }

 private:
  static Rows rows_between(std::uint32_t begin, std::uint32_t end) {
    Rows rows(end - begin);
    std::iota(rows.begin(), rows.end(), begin);
    return rows;
  }
};

template <typename Walkers, auto... arguments>
std::unique_ptr<Interface> make_walkers(const Case& one) {
  return std::make_unique<Walkers>(one, arguments...);
}

struct Entry {
  const char* name;
  bool resets_at_once;
  std::unique_ptr<Interface> (*make)(const Case& one);
};

constexpr Entry kInterfaces[] = {
    {"episode", true, make_walkers<Episodes, true>},
    {"record", true, make_walkers<RecordedEpisodes>},
    {"pool_next_step", false, make_walkers<PoolWalkers, AutoresetMode::next_step, 1>},
    {"pool_same_step", true, make_walkers<PoolWalkers, AutoresetMode::same_step, 2>},
    {"pool_disabled", true, make_walkers<DisabledPool>},
    {"pool_asynchronous", false, make_walkers<AsynchronousPool, AutoresetMode::next_step>},
    {"pool_asynchronous_same_step", true, make_walkers<AsynchronousPool, AutoresetMode::same_step>},
};

const Scripts& all() {
  static const Scripts kAll = read_scripts();
  return kAll;
}

/// Returns the oracle's trace, which is made once.
const Trace& oracle(std::size_t script, std::size_t one, const Entry& entry) {
  static std::map<std::tuple<std::size_t, std::size_t, bool>, Trace> traces;
  Trace& trace = traces[{script, one, entry.resets_at_once}];
  if (trace.empty()) {
    Oracles walkers(all().cases[one], entry.resets_at_once);
    trace = play(all().scripts[script], all().cases[one], walkers);
  }
  return trace;
}

/// Indices of a script, a case and an interface.
using Cell = std::tuple<std::size_t, std::size_t, std::size_t>;

class Promises : public testing::TestWithParam<Cell> {};

TEST_P(Promises, AreKept) {
  const Script& script = all().scripts[std::get<0>(GetParam())];
  const Case& one = all().cases[std::get<1>(GetParam())];
  const Entry& entry = kInterfaces[std::get<2>(GetParam())];
  const Trace& expected = oracle(std::get<0>(GetParam()), std::get<1>(GetParam()), entry);
  const Trace actual = play(script, one, *entry.make(one));
  for (std::size_t walker = 0; walker < actual.size(); ++walker) {
    const std::vector<std::string>& lines = expected[walker % kNumWalkers];
    for (std::size_t i = 0; i < lines.size() && i < actual[walker].size(); ++i) {
      ASSERT_EQ(actual[walker][i], lines[i]) << "walker " << walker << ", line " << i;
    }
    ASSERT_EQ(actual[walker].size(), lines.size()) << "walker " << walker;
  }
}

std::string name_of(const testing::TestParamInfo<Cell>& cell) {
  const auto& [script, one, entry] = cell.param;
  return all().scripts[script].name + "__" + all().cases[one].name + "__" + kInterfaces[entry].name;
}

INSTANTIATE_TEST_SUITE_P(Table, Promises,
                         testing::Combine(testing::Range(std::size_t{0}, all().scripts.size()),
                                          testing::Range(std::size_t{0}, all().cases.size()),
                                          testing::Range(std::size_t{0}, std::size(kInterfaces))),
                         name_of);

/// A script that meets no end and no failure would compare too little.
TEST(Scripts, MeetEveryKindOfEnd) {
  for (const Case& one : all().cases) {
    Oracles oracle(one, true);
    std::set<std::string> ends;
    for (const auto& lines : play(all().scripts.front(), one, oracle)) {
      for (const std::string& line : lines) {
        for (const char* const end : {" terminated", " truncated", " failed: MuJoCo"}) {
          if (line.find(end) != std::string::npos) ends.insert(line.substr(0, 4) + end);
        }
      }
    }
    std::set<std::string> expected{"step terminated", "step truncated"};
    if (one.name == "cramped") expected.insert({"step failed: MuJoCo", "rese failed: MuJoCo"});
    EXPECT_EQ(ends, expected) << one.name;
  }
}

}  // namespace
}  // namespace walker::promises
