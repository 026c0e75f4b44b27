// An environment whose episodes are recorded and restored, as a server has it.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "episode/episode_recorder.h"

namespace walker {

/// A recorder, and a scratch environment in which records are repeated.
class Restorable {
 public:
  Restorable(const std::function<std::unique_ptr<Environment>()>& make, std::uint64_t first_seed)
      : recorder_(make(), {0, first_seed}), scratch_(make()) {}

  void reset(std::optional<std::uint64_t> seed) { recorder_.reset(seed); }
  void step(const std::vector<double>& action) { recorder_.step(action); }
  const Specification& specification() const { return recorder_.specification(); }
  const EpisodeState& state() const { return recorder_.state(); }
  const Sensors& sensors() { return recorder_.sensors(); }
  EpisodeRecord record() const { return recorder_.record(); }

  void begin_restore(const EpisodeRecord& record) {
    record_ = record;
    scratch_.begin(record_);
  }
  bool go_on_restoring(std::chrono::steady_clock::time_point until) {
    return scratch_.repeat(record_, until);
  }
  void finish_restore() { recorder_.take_over(scratch_); }

  void restore(const EpisodeRecord& record) {
    begin_restore(record);
    go_on_restoring(std::chrono::steady_clock::time_point::max());
    finish_restore();
  }

 private:
  EpisodeRecorder recorder_;
  EpisodeRecorder scratch_;
  EpisodeRecord record_;
};

}  // namespace walker
