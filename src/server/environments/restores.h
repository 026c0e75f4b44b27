// ~restore: records that are repeated while everybody else is served.
#pragma once

#include <deque>
#include <functional>
#include <utility>

#include "server/environments/environments.h"
#include "server/transport/pending_answer.h"
#include "walker_sim/EpisodeRecord.h"
#include "walker_sim/Restore.h"

namespace walker {

/// Repeats records one after the other, in the order in which they were asked for, a slice of a
/// millisecond at a time. The present episode goes on meanwhile as if nothing had been asked.
class Restores {
 public:
  using Response = walker_sim::Restore::Response;

  /// @param environments outlive this
  /// @param take_place   lets the repeated episode take the present one's place and fills the
  ///                     response, or throws a std::exception that says why not
  Restores(Environments& environments, std::function<void(Response&)> take_place)
      : environments_(environments), take_place_(std::move(take_place)) {}

  /// @throws std::exception that says why this record cannot be repeated here
  void add(const walker_sim::EpisodeRecord& record, const Reply<Response>& reply);

  bool are_under_way() const { return !waiting_.empty(); }

  /// One slice. Nothing, where none is under way.
  void go_on();

 private:
  struct Waiting {
    EpisodeRecord record;
    Reply<Response> reply;
    bool has_begun = false;
  };

  bool repeat(Waiting& waiting);

  Environments& environments_;
  std::function<void(Response&)> take_place_;
  std::deque<Waiting> waiting_;  // the first is under way
};

}  // namespace walker
