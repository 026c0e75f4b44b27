// The server as a node whose environment does nothing at a step: what is left is the transport.
// Takes the parameters of `server`; resets are the environment's own, steps repeat the observation.
#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "ros/node_main.h"
#include "server/server.h"
#include "walker_sim/registry.h"

namespace walker::bench {
namespace {

/// An environment in which nothing moves and no episode ends.
class Frozen : public Environment {
 public:
  explicit Frozen(std::unique_ptr<Environment> environment)
      : environment_(std::move(environment)),
        observation_(environment_->specification().observation_size()),
        info_(environment_->specification().info_names.size()) {}

  const Specification& specification() const override { return environment_->specification(); }

  void reset(std::optional<std::uint64_t> seed, Result& result) override {
    environment_->reset(seed, result);
    std::copy_n(result.observation, observation_.size(), observation_.begin());
    std::copy_n(result.info, info_.size(), info_.begin());
  }

  void step(const double* /*action*/, std::size_t /*size*/, Result& result) override {
    std::copy(observation_.begin(), observation_.end(), result.observation);
    std::copy(info_.begin(), info_.end(), result.info);
  }

  void sense(Sensors& sensors) override { environment_->sense(sensors); }
  void scene(Scene& scene) const override { environment_->scene(scene); }
  GeneratorState generator_state() const override { return environment_->generator_state(); }
  void set_generator_state(const GeneratorState& state) override {
    environment_->set_generator_state(state);
  }

 private:
  std::unique_ptr<Environment> environment_;
  std::vector<double> observation_;  // right after the reset
  std::vector<double> info_;
};

}  // namespace
}  // namespace walker::bench

int main(int argc, char** argv) {
  const walker::NodeDescription node{
      "null_server", "walker_sim", "A server whose steps do nothing.", walker::server_parameters(),
      walker::environment_parameter_names()};
  return walker::run_node(argc, argv, node, [] {
    const walker::ServerOptions options = walker::read_server_options();
    walker::Server server(
        options,
        [&options] {
          return std::make_unique<walker::bench::Frozen>(
              walker::make(options.id, options.environment));
        },
        [&options](const walker::Parameters& camera) {
          return walker::make_renderer(options.id, options.environment, camera);
        });
    server.run();
  });
}
