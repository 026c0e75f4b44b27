#include "server/environments/restores.h"

#include <chrono>
#include <exception>
#include <utility>

#include "ros/records.h"

namespace walker {

void Restores::add(const walker_sim::EpisodeRecord& record, const Reply<Response>& reply) {
  environments_.only("restore");  // throws where there are many
  waiting_.push_back({to_record(record), reply});
}

void Restores::go_on() {
  // A client that has gone wants it no more.
  while (!waiting_.empty() && !waiting_.front().reply.is_awaited()) waiting_.pop_front();
  if (waiting_.empty()) return;
  Waiting& first = waiting_.front();
  Response response;
  try {
    if (!repeat(first)) return;
    take_place_(response);
    response.success = 1;
  } catch (const std::exception& error) {
    response = Response();
    response.status_message = error.what();
  }
  first.reply(response);
  waiting_.pop_front();
}

/// @return whether it has come to the record's end
bool Restores::repeat(Waiting& waiting) {
  Simulation& simulation = environments_.only("restore");
  if (!std::exchange(waiting.has_begun, true)) simulation.begin_restore(std::move(waiting.record));
  // Others wait for it, and so may a step that is due.
  constexpr std::chrono::milliseconds kSlice{1};
  return simulation.go_on_restoring(std::chrono::steady_clock::now() + kSlice);
}

}  // namespace walker
