#include "server/services.h"

#include <cstdint>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>

#include <ros/console.h>
#include <ros/node_handle.h>
#include <std_srvs/Empty.h>
#include <std_srvs/Trigger.h>

#include "server/environments/restores.h"
#include "server/loop.h"
#include "server/outputs.h"
#include "server/simulation.h"
#include "server/transport/service_port.h"
#include "walker_sim/GetSpec.h"
#include "walker_sim/Render.h"
#include "walker_sim/Reset.h"
#include "walker_sim/ResetBatch.h"
#include "walker_sim/Restore.h"
#include "walker_sim/SetRealTimeFactor.h"
#include "walker_sim/Snapshot.h"
#include "walker_sim/Step.h"
#include "walker_sim/StepBatch.h"

namespace walker {
namespace {

std::string name(const char* service) { return ros::NodeHandle("~").resolveName(service); }

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

/// @param call fills the response, or throws a std::exception
template <typename Service, typename Call>
void advertise(ServicePort& port, const char* service, const Call& call) {
  port.advertise<Service>(name(service), [call](auto& request, auto& response) {
    answer(response, [&] { call(request, response); });
  });
}

/// @param call takes the reply with it, or throws a std::exception that says why there is none
template <typename Service, typename Call>
void advertise_pending(ServicePort& port, const char* service, const Call& call) {
  port.advertise_pending<Service>(name(service), [call](auto& request, const auto& reply) {
    typename Service::Response refusal;
    answer(refusal, [&] { call(request, reply); });
    if (refusal.success == 0) reply(refusal);
  });
}

/// @param call returns what has changed
template <typename Call>
void advertise_trigger(ServicePort& port, const char* service, const Call& call) {
  port.advertise<std_srvs::Trigger>(name(service), [call](auto& /*request*/, auto& response) {
    response.message = call();
    response.success = 1;
  });
}

/// An empty response has no room for a reason: it is logged, and the client's call fails with it.
/// @param call throws a std::exception that says why not
template <typename Call>
void advertise_empty(ServicePort& port, const char* service, const Call& call) {
  port.advertise<std_srvs::Empty>(name(service), [service, call](auto&, auto&) {
    try {
      call();
    } catch (const std::exception& error) {
      ROS_ERROR_STREAM(service << ": " << error.what());
      throw;
    }
  });
}

void advertise_steps(const Served& served, ServicePort& port) {
  advertise<walker_sim::Reset>(port, "reset", [served](const auto& request, auto& response) {
    const std::optional<std::uint64_t> seed = request.seed;
    served.loop.reset(request.has_seed != 0 ? seed : std::nullopt);
    response.transition = served.outputs.take_transition();
  });
  advertise<walker_sim::Step>(port, "step", [served](const auto& request, auto& response) {
    served.loop.refuse_while_it_runs("step");
    served.simulation.step(request.action);
    response.transition = served.outputs.take_transition();
  });
  advertise<walker_sim::ResetBatch>(port, "reset_batch",
                                    [served](const auto& request, auto& response) {
                                      served.simulation.reset_batch(request, response);
                                      served.loop.restart_schedule();
                                    });
  advertise<walker_sim::StepBatch>(port, "step_batch",
                                   [served](const auto& request, auto& response) {
                                     served.loop.refuse_while_it_runs("step_batch");
                                     served.simulation.step_batch(request.actions, response);
                                   });
}

void advertise_records(const Served& served, ServicePort& port) {
  port.advertise<walker_sim::GetSpec>(
      name("get_spec"),
      [served](auto& /*request*/, auto& response) { response.spec = served.outputs.spec(); });
  advertise<walker_sim::Snapshot>(port, "snapshot",
                                  [served](const auto& /*request*/, auto& response) {
                                    response.record = served.simulation.snapshot();
                                  });
  advertise_pending<walker_sim::Restore>(port, "restore",
                                         [served](const auto& request, const auto& reply) {
                                           served.restores.add(request.record, reply);
                                         });
  advertise_pending<walker_sim::Render>(
      port, "render", [served](const auto& request, const auto& reply) {
        served.outputs.camera().render(request, served.simulation.clock().now(), reply);
      });
}

void advertise_pace(Loop& loop, ServicePort& port) {
  advertise<walker_sim::SetRealTimeFactor>(port, "set_real_time_factor",
                                           [&loop](const auto& request, auto& /*response*/) {
                                             loop.set_real_time_factor(request.factor);
                                           });
  advertise_trigger(port, "pause", [&loop] { return loop.pause(); });
  advertise_trigger(port, "unpause", [&loop] { return loop.unpause(); });
}

}  // namespace

void advertise_services(const Served& served, ServicePort& port) {
  advertise_steps(served, port);
  advertise_records(served, port);
  advertise_pace(served.loop, port);
}

void advertise_gazebo_services(Loop& loop, Mode mode, ServicePort& port) {
  const auto reset = [&loop] { loop.reset(std::nullopt); };
  advertise_empty(port, "pause_physics", [&loop] { loop.pause(); });
  advertise_empty(port, "unpause_physics", [&loop, mode] {
    const std::string outcome = loop.unpause();
    // A client that now waits for something to move would wait in vain.
    if (mode == Mode::lockstep) throw std::logic_error(outcome);
  });
  advertise_empty(port, "reset_simulation", reset);
  advertise_empty(port, "reset_world", reset);
}

}  // namespace walker
