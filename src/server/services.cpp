#include "server/services.h"

#include <cstdint>
#include <exception>
#include <optional>

#include "server/server.h"

namespace walker {
namespace {

/// Makes the call and tells how it went. @return true, for false would drop the message
template <typename Response, typename Call>
bool answer(Response& response, const Call& call) {
  try {
    call();
    response.success = 1;
  } catch (const std::exception& error) {
    response.success = 0;
    response.status_message = error.what();
  }
  return true;
}

}  // namespace

Services::Services(Server& server) : server_(server) {
  ros::NodeHandle node("~");
  advertised_ = {
      node.advertiseService("reset", &Services::on_reset, this),
      node.advertiseService("step", &Services::on_step, this),
      node.advertiseService("get_spec", &Services::on_get_spec, this),
      node.advertiseService("snapshot", &Services::on_snapshot, this),
      node.advertiseService("restore", &Services::on_restore, this),
      node.advertiseService("set_real_time_factor", &Services::on_set_real_time_factor, this),
      node.advertiseService("pause", &Services::on_pause, this),
      node.advertiseService("unpause", &Services::on_unpause, this)};
}

bool Services::on_reset(walker_sim::Reset::Request& request,
                        walker_sim::Reset::Response& response) {
  return answer(response, [&] {
    server_.reset(request.has_seed != 0 ? std::optional<std::uint64_t>(request.seed)
                                        : std::nullopt);
    server_.tell(response.transition);
  });
}

bool Services::on_step(walker_sim::Step::Request& request, walker_sim::Step::Response& response) {
  return answer(response, [&] {
    server_.step(request.action);
    server_.tell(response.transition);
  });
}

bool Services::on_get_spec(walker_sim::GetSpec::Request& /*request*/,
                           walker_sim::GetSpec::Response& response) {
  server_.tell(response.spec);
  return true;
}

bool Services::on_snapshot(walker_sim::Snapshot::Request& /*request*/,
                           walker_sim::Snapshot::Response& response) {
  return answer(response, [&] { response.record = server_.snapshot(); });
}

bool Services::on_restore(walker_sim::Restore::Request& request,
                          walker_sim::Restore::Response& response) {
  return answer(response, [&] {
    server_.restore(request.record);
    server_.tell(response.transition);
  });
}

bool Services::on_set_real_time_factor(walker_sim::SetRealTimeFactor::Request& request,
                                       walker_sim::SetRealTimeFactor::Response& response) {
  return answer(response, [&] { server_.set_real_time_factor(request.factor); });
}

bool Services::on_pause(std_srvs::Trigger::Request& /*request*/,
                        std_srvs::Trigger::Response& response) {
  response.success = 1;
  response.message = server_.pause();
  return true;
}

bool Services::on_unpause(std_srvs::Trigger::Request& /*request*/,
                          std_srvs::Trigger::Response& response) {
  response.success = 1;
  response.message = server_.unpause();
  return true;
}

}  // namespace walker
