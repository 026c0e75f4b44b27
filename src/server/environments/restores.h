// ~restore: records that are repeated while everybody else is served.
#pragma once

#include <deque>
#include <functional>
#include <optional>

#include "server/environments/environments.h"
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

  /// Lets the repeated episode take the present one's place and fills the response, or throws a
  /// std::exception that says why not.
  using TakePlace = std::function<void(EpisodeRecorder& repeated, Response& response)>;

  /// @param environments outlive this
  /// @param make         makes the scratch environment, as the others
  Restores(Environments& environments, const MakeEnvironment& make, TakePlace take_place);

  /// @throws std::exception that says why this record cannot be repeated here
  void add(const walker_sim::EpisodeRecord& record, const Reply<Response>& reply);

  bool are_in_flight() const { return !waiting_.empty(); }

  /// One slice. Nothing, where none is in flight.
  void go_on();

 private:
  struct Waiting {
    EpisodeRecord record;
    Reply<Response> reply;
    bool has_begun = false;
  };

  bool repeat(Waiting& waiting);

  Environments& environments_;
  std::optional<EpisodeRecorder> scratch_;  // none beside many
  TakePlace take_place_;
  std::deque<Waiting> waiting_;  // the first is in flight
};

}  // namespace walker
