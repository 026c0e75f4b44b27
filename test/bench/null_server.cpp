// A server node whose robot does nothing in step(), to measure the transport alone. It takes the
// parameters of `server`. Resets are the robot's own; steps repeat the observation.
#include <memory>
#include <utility>

#include "episode/walker.h"
#include "robots/robot.h"
#include "ros/node_main.h"
#include "server/server.h"
#include "walker_sim/registry.h"

namespace walker::bench {
namespace {

class Frozen : public Robot {
 public:
  explicit Frozen(std::unique_ptr<Robot> robot) : robot_(std::move(robot)) {}

  const Specification& specification() const override { return robot_->specification(); }
  void set_world(const WorldValues& values) override { robot_->set_world(values); }
  void change_physics(const WorldValues& values) override { robot_->change_physics(values); }
  void reset(Generator& generator, double* info) override { robot_->reset(generator, info); }
  void step(RobotStep& step) override { step.reward = 0; }
  void observe(double* observation) const override { robot_->observe(observation); }
  void observe(const SensorNoise& noise, double* observation) const override {
    robot_->observe(noise, observation);
  }
  void sense(Sensors& sensors) override { robot_->sense(sensors); }
  void scene(Scene& scene) const override { robot_->scene(scene); }
  void save(StateWriter& writer) const override { robot_->save(writer); }
  std::function<void()> load(StateReader& reader, const WorldValues& values,
                             bool is_alive) override {
    return robot_->load(reader, values, is_alive);
  }

 private:
  std::unique_ptr<Robot> robot_;
};

}  // namespace
}  // namespace walker::bench

int main(int argc, char** argv) {
  const walker::NodeDescription node{
      "null_server", "walker_sim", "A server whose steps do nothing.", walker::server_parameters(),
      walker::environment_parameter_names()};
  return walker::run_node(argc, argv, node, [] {
    const walker::ServerOptions options = walker::read_server_options();
    const walker::Registration& registration = walker::find_registration(options.id);
    const walker::Parameters parameters = walker::complete_parameters(
        walker::parameter_descriptions(options.id), options.environment);
    walker::Server server(
        options,
        [&] {
          return std::make_unique<walker::Walker>(
              std::make_unique<walker::bench::Frozen>(registration.create(options.id, parameters)));
        },
        [&options](const walker::Parameters& camera) {
          return walker::make_renderer(options.id, options.environment, camera);
        });
    server.run();
  });
}
