#include "server/gazebo_services.h"

#include <exception>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>

#include <ros/console.h>
#include <ros/node_handle.h>
#include <std_srvs/Empty.h>

#include "server/server.h"

namespace walker {
namespace {

/// An empty response has no room for a reason: it is logged, and the client's call fails with it.
/// @param call throws a std::exception that says why not
void advertise(ServicePort& port, const std::string& name, const std::function<void()>& call) {
  port.advertise<std_srvs::Empty>(ros::NodeHandle("~").resolveName(name),
                                  [name, call](auto&, auto&) {
                                    try {
                                      call();
                                    } catch (const std::exception& error) {
                                      ROS_ERROR_STREAM(name << ": " << error.what());
                                      throw;
                                    }
                                  });
}

}  // namespace

void advertise_gazebo_services(Server& server, Mode mode, ServicePort& port) {
  const auto reset = [&server] { server.reset(std::nullopt); };
  const auto unpause = [&server, mode] {
    const std::string outcome = server.unpause();
    // A client that now waits for something to move would wait in vain.
    if (mode == Mode::lockstep) throw std::logic_error(outcome);
  };
  advertise(port, "pause_physics", [&server] { server.pause(); });
  advertise(port, "unpause_physics", unpause);
  advertise(port, "reset_simulation", reset);
  advertise(port, "reset_world", reset);
}

}  // namespace walker
