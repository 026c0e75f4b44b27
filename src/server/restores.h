// ~restore: repeats records while the server handles other requests.
#pragma once

#include <deque>
#include <memory>

#include "server/outputs.h"
#include "server/simulation.h"
#include "server/transport/pending_answer.h"
#include "walker_sim/EpisodeRecord.h"
#include "walker_sim/Restore.h"

namespace walker {

/// Repeats records in the order of the requests, a millisecond at a time, in a scratch environment.
/// The present episode continues meanwhile, and stays if a record is wrong.
class Restores {
 public:
  using Response = walker_sim::Restore::Response;

  /// @param simulation, outputs outlive this
  Restores(Simulation& simulation, Outputs& outputs, const MakeEnvironment& make);

  /// @throws std::exception if there are several environments or the record is malformed
  void add(const walker_sim::EpisodeRecord& record, const Reply<Response>& reply);

  bool are_in_flight() const { return !waiting_.empty(); }

  /// Repeats one slice of the first record, if there is one.
  /// @return whether an episode has been restored
  bool continue_first();

 private:
  struct Waiting {
    EpisodeRecord record;
    Reply<Response> reply;
    bool has_begun = false;
  };

  Simulation& simulation_;
  Outputs& outputs_;
  std::unique_ptr<Environment> scratch_;  // null if there are several environments
  std::deque<Waiting> waiting_;           // the first is in flight
};

}  // namespace walker
