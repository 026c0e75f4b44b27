// The services that clients written for Gazebo call.
#pragma once

#include "server/parameter_reader.h"
#include "server/transport/service_port.h"

namespace walker {

class Server;

/// Advertises private services of type std_srvs/Empty under Gazebo's names, for a remap alone does
/// not serve a client that expects another type: `pause_physics`, `unpause_physics`,
/// `reset_simulation` and `reset_world`. Both resets begin an episode, and time goes on.
/// @param server, port outlive the calls
void advertise_gazebo_services(Server& server, Mode mode, ServicePort& port);

}  // namespace walker
