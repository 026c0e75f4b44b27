// The services: requests in, what the server made of them out.
#pragma once

#include <std_srvs/Trigger.h>

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

class Server;

/// Advertises the private services of a server. What it throws becomes `status_message`.
class Services {
 public:
  Services(Server& server, ServicePort& port);

 private:
  void on_reset(walker_sim::Reset::Request& request, walker_sim::Reset::Response& response);
  void on_step(walker_sim::Step::Request& request, walker_sim::Step::Response& response);
  void on_reset_batch(walker_sim::ResetBatch::Request& request,
                      walker_sim::ResetBatch::Response& response);
  void on_step_batch(walker_sim::StepBatch::Request& request,
                     walker_sim::StepBatch::Response& response);
  void on_get_spec(walker_sim::GetSpec::Request& request, walker_sim::GetSpec::Response& response);
  void on_snapshot(walker_sim::Snapshot::Request& request,
                   walker_sim::Snapshot::Response& response);
  void on_restore(const walker_sim::Restore::Request& request,
                  const Reply<walker_sim::Restore::Response>& reply);
  void on_set_real_time_factor(walker_sim::SetRealTimeFactor::Request& request,
                               walker_sim::SetRealTimeFactor::Response& response);
  void on_render(walker_sim::Render::Request& request,
                 const Reply<walker_sim::Render::Response>& reply);
  void on_pause(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);
  void on_unpause(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);

  Server& server_;
};

}  // namespace walker
