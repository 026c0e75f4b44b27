// The services: requests in, what came of them out.
#pragma once

#include "server/parameter_reader.h"

namespace walker {

class Loop;
class Outputs;
class Restores;
class ServicePort;
class Simulation;

/// Who does what the services ask for.
struct Served {
  Simulation& simulation;
  Loop& loop;
  Outputs& outputs;
  Restores& restores;
};

/// Advertises the private services. What those throw becomes `status_message`.
/// @param port outlives the calls, as does who is served
void advertise_services(const Served& served, ServicePort& port);

/// Those of type std_srvs/Empty under Gazebo's names, for a remap alone does not serve a client
/// that expects another type: `pause_physics`, `unpause_physics`, `reset_simulation` and
/// `reset_world`. Both resets begin an episode, and time goes on.
/// @param loop, port outlive the calls
void advertise_gazebo_services(Loop& loop, Mode mode, ServicePort& port);

}  // namespace walker
