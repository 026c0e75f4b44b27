// Steps all environments of a server by ~step_batch, with walker::Client. Prints one line of JSON.
#include <cstdlib>
#include <exception>
#include <iostream>

#include "bench/arguments.h"
#include "bench/slice.h"
#include "walker_sim/client.h"

namespace walker::bench {
namespace {

void run(const Arguments& arguments) {
  ClientOptions client_options;
  client_options.server = arguments.text("server");
  Client client(client_options);
  const ServerSpecification specification = client.specification();
  BatchReset reset;
  client.reset_batch({}, {}, reset);
  Actions actions(static_cast<std::size_t>(specification.num_envs) * specification.action_size);
  BatchTransition transition;
  print(std::cout, specification.num_envs,
        measure(arguments.number("seconds"), specification.num_envs,
                [&] { client.step_batch(actions.next(), actions.size(), transition); }));
}

}  // namespace
}  // namespace walker::bench

int main(int argc, char** argv) {
  try {
    walker::bench::run({argv + 1, argv + argc, {"server", "seconds"}});
    return EXIT_SUCCESS;
  } catch (const std::exception& error) {
    std::cerr << "usage: walker_sim_batch_client --server NAME --seconds S\n"
              << "walker_sim_batch_client: " << error.what() << '\n';
    return EXIT_FAILURE;
  }
}
