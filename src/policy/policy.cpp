#include "walker_sim/policy.h"

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>
#include <vector>

#include "base/posix.h"
#include "base/printable_text.h"
#include "base/shortest_text.h"
#include "policy/network.h"
#include "policy/safetensors.h"

namespace walker {
namespace {

/// The files' order of weights.
template <typename Number>
using Rows = Eigen::Matrix<Number, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr const char* kFormat = "walker_sim policy 1";
constexpr std::size_t kMaxLayers = 16;
constexpr std::size_t kMaxHistory = 1000;
constexpr std::streamoff kMaxFile = std::streamoff{1} << 28U;

[[noreturn]] void refuse(const std::string& name, const std::string& reason) {
  throw PolicyError("policy " + printable(name) + ": " + printable(reason));
}

std::vector<char> read_file(const std::string& path) {
  const bool has_zero = path.find('\0') != std::string::npos;  // C functions would cut it there
  if (has_zero || is_irregular_file(path)) {
    refuse(path, "it must be a regular file");
  }
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = file ? std::streamoff{file.tellg()} : -1;
  if (size < 0 || size > kMaxFile) refuse(path, "it cannot be read as a file");
  std::vector<char> data(static_cast<std::size_t>(size));
  file.seekg(0);
  if (!file.read(data.data(), size)) refuse(path, "it cannot be read");
  return data;
}

std::string take(std::map<std::string, std::string>& metadata, const std::string& name) {
  const auto found = metadata.find(name);
  if (found == metadata.end()) throw std::invalid_argument("its header has no " + name);
  std::string text = std::move(found->second);
  metadata.erase(found);
  return text;
}

/// Whether the text is `first`. @throws std::invalid_argument if it is neither
bool is_first(const std::string& name, const std::string& text, const std::string& first,
              const std::string& second) {
  if (text != first && text != second) {
    throw std::invalid_argument(name + " = " + text + ": must be " + first + " or " + second);
  }
  return text == first;
}

const Tensor& tensor(const Tensors& tensors, const std::string& name, std::size_t dimensions) {
  const auto found = tensors.by_name.find(name);
  if (found == tensors.by_name.end()) throw std::invalid_argument("it has no tensor " + name);
  if (found->second.shape.size() != dimensions) {
    throw std::invalid_argument(name + " has " + std::to_string(found->second.shape.size()) +
                                " dimensions; must have " + std::to_string(dimensions));
  }
  return found->second;
}

Eigen::VectorXd vector(const Tensors& tensors, const std::string& name, Eigen::Index size) {
  const Tensor& found = tensor(tensors, name, 1);
  const auto length = static_cast<Eigen::Index>(found.shape[0]);
  if (size > 0 && length != size) {
    throw std::invalid_argument(name + " has " + std::to_string(length) + " values; must have " +
                                std::to_string(size));
  }
  return Eigen::Map<const Eigen::VectorXd>(found.values.data(), length);
}

Layer read_layer(const Tensors& tensors, const std::string& name, Eigen::Index inputs) {
  const std::string weight_name = name + ".weight";
  const Tensor& weight = tensor(tensors, weight_name, 2);
  const auto outputs = static_cast<Eigen::Index>(weight.shape[0]);
  if (static_cast<Eigen::Index>(weight.shape[1]) != inputs) {
    throw std::invalid_argument(weight_name + " has " + std::to_string(weight.shape[1]) +
                                " inputs; must have " + std::to_string(inputs));
  }
  return {Eigen::Map<const Rows<double>>(weight.values.data(), outputs, inputs).cast<float>(),
          vector(tensors, name + ".bias", outputs).cast<float>()};
}

std::size_t read_count(const std::string& name, const std::string& text, std::size_t min,
                       std::size_t max) {
  for (std::size_t count = min; count <= max; ++count) {
    if (text == std::to_string(count)) return count;
  }
  throw std::invalid_argument(name + " = " + text + ": must be a number from " +
                              std::to_string(min) + " to " + std::to_string(max));
}

/// Returns the header's history; without such entries, the present observation alone.
PolicyHistory read_history(std::map<std::string, std::string>& metadata) {
  const auto read = [&metadata](const std::string& name, std::size_t absent, std::size_t min) {
    return metadata.count(name) == 0 ? absent
                                     : read_count(name, take(metadata, name), min, kMaxHistory);
  };
  return {read("history.observations", 1, 1), read("history.actions", 0, 0)};
}

Network read_network(const Tensors& tensors, std::map<std::string, std::string>& metadata) {
  Network network;
  network.activation = is_first("activation", take(metadata, "activation"), "tanh", "relu")
                           ? Activation::tanh
                           : Activation::relu;
  network.output =
      is_first("output", take(metadata, "output"), "clip", "tanh") ? Output::clip : Output::tanh;
  network.mean = vector(tensors, "observation.mean", 0);
  network.deviation = vector(tensors, "observation.deviation", network.mean.size());
  Eigen::Index at = 0;
  if (network.deviation.minCoeff(&at) <= 0) {
    throw std::invalid_argument("observation.deviation[" + std::to_string(at) + "] = " +
                                shortest_text(network.deviation[at]) + "; must be above 0");
  }
  network.low = vector(tensors, "action.low", 0).cast<float>();
  network.high = vector(tensors, "action.high", network.low.size()).cast<float>();
  network.history = read_history(metadata);
  const auto num_observations = static_cast<Eigen::Index>(network.history.observations);
  const auto num_actions = static_cast<Eigen::Index>(network.history.actions);
  const Eigen::Index observed = network.mean.size() - num_actions * network.low.size();
  if (observed <= 0 || observed % num_observations != 0) {
    throw std::invalid_argument("observation.mean has " + std::to_string(network.mean.size()) +
                                " values; must have those of " + std::to_string(num_observations) +
                                " observations and " + std::to_string(num_actions) +
                                " actions of " + std::to_string(network.low.size()));
  }
  if ((network.high - network.low).minCoeff(&at) <= 0) {
    throw std::invalid_argument("action.high[" + std::to_string(at) +
                                "] = " + shortest_text(network.high[at]) +
                                "; must be above action.low, " + shortest_text(network.low[at]));
  }
  Eigen::Index inputs = network.mean.size();
  const std::size_t count = read_count("layers", take(metadata, "layers"), 1, kMaxLayers);
  for (std::size_t i = 0; i < count; ++i) {
    network.layers.push_back(read_layer(tensors, "layers." + std::to_string(i), inputs));
    inputs = network.layers.back().bias.size();
  }
  if (inputs != network.low.size()) {
    throw std::invalid_argument("its last layer has " + std::to_string(inputs) +
                                " outputs; must have " + std::to_string(network.low.size()) +
                                ", as action.low has");
  }
  return network;
}

void check_limits(const char* name, const Eigen::VectorXf& ours,
                  const std::vector<double>& theirs) {
  for (std::size_t i = 0; i < theirs.size(); ++i) {
    const float value = ours[static_cast<Eigen::Index>(i)];
    if (value != static_cast<float>(theirs[i])) {
      throw std::invalid_argument(std::string(name) + " of action " + std::to_string(i) + " is " +
                                  shortest_text(value) + "; the environment's is " +
                                  shortest_text(theirs[i]));
    }
  }
}

class PolicyAgent : public Agent {
 public:
  PolicyAgent(const std::string& file, const Specification& specification)
      : policy_(file), input_(policy_), action_(specification.action_size()) {
    policy_.check(specification);
  }

  void reset() override { input_.reset(); }

  const std::vector<double>& act(const std::vector<double>& observation) override {
    policy_.act(observation.data(), input_, action_.data());
    return action_;
  }

 private:
  Policy policy_;
  PolicyInput input_;
  std::vector<double> action_;
};

}  // namespace

struct Policy::State {
  std::string name;
  std::string id;
  std::map<std::string, std::string> notes;
  Forward forward;
  Scratch scratch{forward.network()};
};

const Forward& forward_of(const Policy& policy) { return policy.state_->forward; }

Policy::Policy(const std::string& file) : Policy(file, read_file(file)) {}

Policy::Policy(const std::string& name, const std::vector<char>& content) {
  try {
    Tensors tensors = read_safetensors(content);
    std::map<std::string, std::string>& metadata = tensors.metadata;
    const std::string format = take(metadata, "format");
    if (format != kFormat) {
      throw std::invalid_argument("its format is " + format + "; must be " + kFormat);
    }
    std::string id = take(metadata, "id");
    Network network = read_network(tensors, metadata);
    state_ = std::make_unique<State>(
        State{name, std::move(id), std::move(metadata), Forward(std::move(network))});
  } catch (const std::invalid_argument& error) {
    refuse(name, error.what());
  }
}

Policy::Policy(std::unique_ptr<State> state) : state_(std::move(state)) {}
Policy::Policy(Policy&&) noexcept = default;
Policy& Policy::operator=(Policy&&) noexcept = default;
Policy::~Policy() = default;

const std::string& Policy::id() const { return state_->id; }

const std::map<std::string, std::string>& Policy::notes() const { return state_->notes; }

std::size_t Policy::observation_size() const {
  return (input_size() - history().actions * action_size()) / history().observations;
}

std::size_t Policy::action_size() const {
  return static_cast<std::size_t>(state_->forward.network().low.size());
}

const PolicyHistory& Policy::history() const { return state_->forward.network().history; }

std::size_t Policy::input_size() const {
  return static_cast<std::size_t>(state_->forward.network().mean.size());
}

void Policy::check(const Specification& specification) const {
  try {
    const std::size_t observations = specification.observation_size();
    const std::size_t actions = specification.action_size();
    if (observation_size() != observations || action_size() != actions) {
      throw std::invalid_argument("it takes " + std::to_string(observation_size()) +
                                  " observations and gives " + std::to_string(action_size()) +
                                  " actions; " + specification.id + " has " +
                                  std::to_string(observations) + " and " + std::to_string(actions));
    }
    check_limits("the lower limit", state_->forward.network().low, specification.action_low);
    check_limits("the upper limit", state_->forward.network().high, specification.action_high);
  } catch (const std::invalid_argument& error) {
    const auto found = notes().find("parameters");
    const bool has_parameters = found != notes().end() && found->second != "{}";
    const std::string parameters = has_parameters ? " with " + printable(found->second) : "";
    throw PolicyError("policy " + state_->name + ", made for " + id() + parameters + ": " +
                      error.what());
  }
}

std::vector<float> Policy::parameters() const {
  std::vector<float> parameters;
  for (const Layer& layer : state_->forward.network().layers) {
    const Rows<float> weight = layer.weight;
    parameters.insert(parameters.end(), weight.data(), weight.data() + weight.size());
    parameters.insert(parameters.end(), layer.bias.data(), layer.bias.data() + layer.bias.size());
  }
  return parameters;
}

Policy Policy::with_parameters(const std::vector<float>& parameters) const {
  Network network = state_->forward.network();
  std::size_t count = 0;
  for (const Layer& layer : network.layers) count += layer.weight.size() + layer.bias.size();
  if (parameters.size() != count) {
    throw std::invalid_argument("policy " + printable(state_->name) + ": got " +
                                std::to_string(parameters.size()) + " parameters; must be " +
                                std::to_string(count));
  }
  const float* next = parameters.data();
  for (Layer& layer : network.layers) {
    layer.weight = Eigen::Map<const Rows<float>>(next, layer.weight.rows(), layer.weight.cols());
    next += layer.weight.size();
    layer.bias = Eigen::Map<const Eigen::VectorXf>(next, layer.bias.size());
    next += layer.bias.size();
  }
  return Policy(std::make_unique<State>(
      State{state_->name, state_->id, state_->notes, Forward(std::move(network))}));
}

void Policy::act(const double* observation, double* action) { act(observation, 1, action); }

void Policy::act(const double* observations, std::size_t rows, double* actions) {
  const auto& [num_observations, num_actions] = history();
  if (num_observations > 1 || num_actions > 0) {
    throw PolicyError("policy " + printable(state_->name) + ": acts on its last " +
                      std::to_string(num_observations) + " observations and " +
                      std::to_string(num_actions) + " actions; must be given a PolicyInput");
  }
  act_on_inputs(observations, rows, actions);
}

void Policy::act(const double* observation, PolicyInput& input, double* action) {
  if (input.size() != input_size()) {
    throw PolicyError("policy " + printable(state_->name) + ": the PolicyInput has " +
                      std::to_string(input.size()) + " values; must have " +
                      std::to_string(input_size()));
  }
  act_on_inputs(input.add_observation(observation), 1, action);
  input.add_action(action);
}

void Policy::act_on_inputs(const double* inputs, std::size_t rows, double* actions) {
  state_->forward.act(inputs, rows, actions, state_->scratch);
}

PolicyInput::PolicyInput(const Policy& policy)
    : observation_size_(policy.observation_size()),
      action_size_(policy.action_size()),
      num_observed_(policy.history().observations * observation_size_),
      values_(policy.input_size()) {}

void PolicyInput::reset() { std::fill(values_.begin(), values_.end(), 0); }

const double* PolicyInput::add_observation(const double* observation) {
  double* const end = values_.data() + num_observed_;
  std::copy(values_.data() + observation_size_, end, values_.data());
  std::copy_n(observation, observation_size_, end - observation_size_);
  return values_.data();
}

void PolicyInput::add_action(const double* action) {
  if (values_.size() == num_observed_) return;
  double* const begin = values_.data() + num_observed_;
  double* const end = values_.data() + values_.size();
  std::copy(begin + action_size_, end, begin);
  std::copy_n(action, action_size_, end - action_size_);
}

std::unique_ptr<Agent> make_policy_agent(const std::string& file,
                                         const Specification& specification) {
  return std::make_unique<PolicyAgent>(file, specification);
}

}  // namespace walker
