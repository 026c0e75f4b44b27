// ~restore: records that are repeated while everybody else is served.
#pragma once

#include <deque>
#include <memory>

#include "server/outputs.h"
#include "server/simulation.h"
#include "server/transport/pending_answer.h"
#include "walker_sim/EpisodeRecord.h"
#include "walker_sim/Restore.h"

namespace walker {

/// Repeats records one after the other, in the order in which they were asked for, a slice of a
/// millisecond at a time, in a scratch environment: the present episode goes on meanwhile as if
/// nothing had been asked, and stays where a record turns out wrong.
class Restores {
 public:
  using Response = walker_sim::Restore::Response;

  /// @param simulation, outputs outlive this
  /// @param make makes the scratch environment, as the others
  Restores(Simulation& simulation, Outputs& outputs, const MakeEnvironment& make);

  /// @throws std::exception that says why this record cannot be repeated here
  void add(const walker_sim::EpisodeRecord& record, const Reply<Response>& reply);

  bool are_in_flight() const { return !waiting_.empty(); }

  /// One slice. Nothing, where none is in flight.
  /// @return whether an episode has been restored
  bool go_on();

 private:
  struct Waiting {
    EpisodeRecord record;
    Reply<Response> reply;
    bool has_begun = false;
  };

  Simulation& simulation_;
  Outputs& outputs_;
  std::unique_ptr<Environment> scratch_;  // none beside many
  std::deque<Waiting> waiting_;           // the first is in flight
};

}  // namespace walker
