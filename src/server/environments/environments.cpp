#include "server/environments/environments.h"

#include "server/environments/many_environments.h"
#include "server/environments/one_environment.h"

namespace walker {

std::unique_ptr<Environments> make_environments(
    const ServerOptions& options, const std::function<std::unique_ptr<Environment>()>& make) {
  if (options.num_envs == 1) {
    return std::make_unique<OneEnvironment>(make, options.seed, options.autoreset_mode);
  }
  return std::make_unique<ManyEnvironments>(options, make);
}

}  // namespace walker
