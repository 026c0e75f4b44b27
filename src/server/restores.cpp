#include "server/restores.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

#include "base/printable_text.h"
#include "ros/records.h"

namespace walker {

Restores::Restores(Simulation& simulation, Outputs& outputs, const MakeEnvironment& make)
    : simulation_(simulation), outputs_(outputs) {
  if (simulation.pool().options().num_envs != 1) return;
  scratch_ = make();
  EpisodeOptions options;
  options.records_actions = true;
  episode_of(*scratch_).configure(options);
}

void Restores::add(const walker_sim::EpisodeRecord& record, const Reply<Response>& reply) {
  single_episode(simulation_.pool(), "restore");  // throws if there are several
  // Frees the records of clients that have disconnected.
  waiting_.erase(std::remove_if(waiting_.begin(), waiting_.end(),
                                [](const Waiting& each) { return !each.reply.is_awaited(); }),
                 waiting_.end());
  waiting_.push_back({to_record(record), reply});
}

bool Restores::continue_first() {
  while (!waiting_.empty() && !waiting_.front().reply.is_awaited()) waiting_.pop_front();
  if (waiting_.empty()) return false;
  Waiting& first = waiting_.front();
  Episode& scratch = episode_of(*scratch_);
  Response response;
  try {
    if (!std::exchange(first.has_begun, true)) scratch.begin(first.record);
    // Upper bound of the delay of other requests and of a due step.
    constexpr std::chrono::milliseconds kSlice{1};
    if (!scratch.repeat(first.record, std::chrono::steady_clock::now() + kSlice)) return false;
    const EpisodeState& state = simulation_.restore(scratch);
    response.transition = outputs_.message(state, simulation_.clock().now());
    response.success = 1;
  } catch (const std::exception& error) {
    response.status_message = printable(error.what());
  }
  first.reply(response);
  waiting_.pop_front();
  return response.success != 0;
}

}  // namespace walker
