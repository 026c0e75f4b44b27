#include "server/services.h"

#include <cstdint>
#include <exception>
#include <optional>

#include <ros/node_handle.h>

#include "server/server.h"

namespace walker {
namespace {

/// Makes the call and tells how it went. What was half filled is not told.
template <typename Response, typename Call>
void answer(Response& response, const Call& call) {
  try {
    call();
    response.success = 1;
  } catch (const std::exception& error) {
    response = Response();
    response.status_message = error.what();
  }
}

}  // namespace

Services::Services(Server& server, ServicePort& port) : server_(server) {
  const ros::NodeHandle node("~");
  const auto advertise = [&](auto service, const char* name, auto method) {
    using Service = decltype(service);
    port.advertise<Service>(node.resolveName(name), [this, method](auto& request, auto& response) {
      (this->*method)(request, response);
    });
  };
  advertise(walker_sim::Reset(), "reset", &Services::on_reset);
  advertise(walker_sim::Step(), "step", &Services::on_step);
  advertise(walker_sim::ResetBatch(), "reset_batch", &Services::on_reset_batch);
  advertise(walker_sim::StepBatch(), "step_batch", &Services::on_step_batch);
  advertise(walker_sim::GetSpec(), "get_spec", &Services::on_get_spec);
  advertise(walker_sim::Snapshot(), "snapshot", &Services::on_snapshot);
  port.advertise_pending<walker_sim::Restore>(
      node.resolveName("restore"),
      [this](auto& request, const auto& reply) { on_restore(request, reply); });
  advertise(walker_sim::SetRealTimeFactor(), "set_real_time_factor",
            &Services::on_set_real_time_factor);
  port.advertise_pending<walker_sim::Render>(
      node.resolveName("render"),
      [this](auto& request, const auto& reply) { on_render(request, reply); });
  advertise(std_srvs::Trigger(), "pause", &Services::on_pause);
  advertise(std_srvs::Trigger(), "unpause", &Services::on_unpause);
}

void Services::on_reset(walker_sim::Reset::Request& request,
                        walker_sim::Reset::Response& response) {
  answer(response, [&] {
    server_.reset(request.has_seed != 0 ? std::optional<std::uint64_t>(request.seed)
                                        : std::nullopt);
    server_.tell(response.transition);
  });
}

void Services::on_step(walker_sim::Step::Request& request, walker_sim::Step::Response& response) {
  answer(response, [&] {
    server_.step(request.action);
    server_.tell(response.transition);
  });
}

void Services::on_reset_batch(walker_sim::ResetBatch::Request& request,
                              walker_sim::ResetBatch::Response& response) {
  answer(response, [&] { server_.reset_batch(request, response); });
}

void Services::on_step_batch(walker_sim::StepBatch::Request& request,
                             walker_sim::StepBatch::Response& response) {
  answer(response, [&] { server_.step_batch(request.actions, response); });
}

void Services::on_get_spec(walker_sim::GetSpec::Request& /*request*/,
                           walker_sim::GetSpec::Response& response) {
  server_.tell(response.spec);
}

void Services::on_snapshot(walker_sim::Snapshot::Request& /*request*/,
                           walker_sim::Snapshot::Response& response) {
  answer(response, [&] { response.record = server_.snapshot(); });
}

void Services::on_restore(const walker_sim::Restore::Request& request,
                          const Reply<walker_sim::Restore::Response>& reply) {
  walker_sim::Restore::Response refusal;
  answer(refusal, [&] { server_.restore(request.record, reply); });
  if (refusal.success == 0) reply(refusal);
}

void Services::on_set_real_time_factor(walker_sim::SetRealTimeFactor::Request& request,
                                       walker_sim::SetRealTimeFactor::Response& response) {
  answer(response, [&] { server_.set_real_time_factor(request.factor); });
}

void Services::on_render(walker_sim::Render::Request& request,
                         const Reply<walker_sim::Render::Response>& reply) {
  walker_sim::Render::Response refusal;
  answer(refusal, [&] { server_.render(request, reply); });
  if (refusal.success == 0) reply(refusal);
}

void Services::on_pause(std_srvs::Trigger::Request& /*request*/,
                        std_srvs::Trigger::Response& response) {
  response.success = 1;
  response.message = server_.pause();
}

void Services::on_unpause(std_srvs::Trigger::Request& /*request*/,
                          std_srvs::Trigger::Response& response) {
  response.success = 1;
  response.message = server_.unpause();
}

}  // namespace walker
