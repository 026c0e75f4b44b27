#include "server/gazebo_services.h"

#include <exception>
#include <optional>
#include <stdexcept>

#include <ros/console.h>
#include <std_srvs/Empty.h>

#include "server/server.h"

namespace walker {

GazeboServices::GazeboServices(Server& server, Mode mode) {
  const auto reset = [&server] { server.reset(std::nullopt); };
  const auto unpause = [&server, mode] {
    const std::string outcome = server.unpause();
    // A client that now waits for something to move would wait in vain.
    if (mode == Mode::lockstep) throw std::logic_error(outcome);
  };
  advertise("pause_physics", [&server] { server.pause(); });
  advertise("unpause_physics", unpause);
  advertise("reset_simulation", reset);
  advertise("reset_world", reset);
}

/// An empty reply has no room for a reason: it is logged, and the client's call fails.
/// @param call throws a std::exception that says why not
void GazeboServices::advertise(const std::string& name, const std::function<void()>& call) {
  using Request = std_srvs::Empty::Request;
  using Response = std_srvs::Empty::Response;
  const boost::function<bool(Request&, Response&)> answer = [name, call](Request&, Response&) {
    try {
      call();
      return true;
    } catch (const std::exception& error) {
      ROS_ERROR_STREAM(name << ": " << error.what());
      return false;
    }
  };
  advertised_.push_back(node_.advertiseService(name, answer));
}

}  // namespace walker
