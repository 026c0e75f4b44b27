// Speed and size of Walker2d, in process. Random float32 actions; an episode that has ended is
// reset in place of its next step, as EnvPool does it, and that counts as a step there and here.
#include <benchmark/benchmark.h>
#include <malloc.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/random.h"
#include "stepper.h"
#include "walker2d/builtin_models.h"
#include "walker2d/constants.h"
#include "walker2d/physics.h"

namespace walker::walker2d {
namespace {

constexpr std::size_t kEnvironments = 16;

/// Random actions, drawn beforehand and taken in turn.
class Actions {
 public:
  Actions() : values_(kCount, std::vector<double>(kJointCount)) {
    Generator generator(0);
    for (std::vector<double>& action : values_) {
      for (double& value : action) value = static_cast<float>(generator.uniform(-1, 1));
    }
  }

  const std::vector<double>& next() { return values_[next_++ % kCount]; }

 private:
  static constexpr std::size_t kCount = 8192;
  std::vector<std::vector<double>> values_;
  std::size_t next_ = 0;
};

std::vector<Stepper> make_steppers(const std::string& id, std::size_t count) {
  std::vector<Stepper> steppers;
  steppers.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    steppers.emplace_back(id);
    steppers.back().reset(i);
  }
  return steppers;
}

void step_or_reset(Stepper& stepper, Actions& actions) {
  if (stepper.has_ended()) {
    stepper.reset();
  } else {
    stepper.step(actions.next());
  }
}

void step(benchmark::State& state, const std::string& id) {
  std::vector<Stepper> steppers = make_steppers(id, kEnvironments);
  Actions actions;
  while (state.KeepRunning()) {
    for (Stepper& stepper : steppers) step_or_reset(stepper, actions);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kEnvironments));
}

void reset(benchmark::State& state, const std::string& id) {
  std::vector<Stepper> steppers = make_steppers(id, 1);
  while (state.KeepRunning()) steppers.front().reset();
}

/// Memory of this process that is in use now [bytes].
double resident_bytes() {
  malloc_trim(0);  // what earlier benchmarks have given back
  std::ifstream file("/proc/self/statm");
  double all = 0;
  double resident = 0;
  if (!(file >> all >> resident)) throw std::runtime_error("/proc/self/statm: not readable");
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

/// What an environment costs in memory beyond the shared model, after it has run.
void memory(benchmark::State& state, const std::string& id) {
  constexpr std::size_t kCount = 1000;
  constexpr int kSteps = 100;
  constexpr double kKilobyte = 1000;
  Actions actions;
  const std::vector<Stepper> first = make_steppers(id, 1);  // holds the model
  while (state.KeepRunning()) {
    const double before = resident_bytes();
    std::vector<Stepper> steppers = make_steppers(id, kCount);
    for (int i = 0; i < kSteps; ++i) {
      for (Stepper& stepper : steppers) step_or_reset(stepper, actions);
    }
    state.counters["kB_per_environment"] = (resident_bytes() - before) / kCount / kKilobyte;
  }
}

/// The text without what stands from the first `begin` to the next `end`, both included.
std::string without(std::string text, const std::string& begin, const std::string& end) {
  const std::size_t from = text.find(begin);
  if (from == std::string::npos) throw std::runtime_error("the model has no " + begin);
  const std::size_t to = text.find(end, from + begin.size());
  if (to == std::string::npos) throw std::runtime_error("the model has no end of " + begin);
  return text.erase(from, to + end.size() - from);
}

/// The model as Gymnasium has it: no named pairs, no sizes.
std::string plain_text(const std::string& text) {
  const std::string no_pairs = without(without(text, "<pair ", "/>"), "<contact>", "</contact>");
  return without(without(no_pairs, "<size ", "/>"), " collision=\"", "\"");
}

ModelPointer compile(const std::string& text) {
  constexpr const char* kName = "model.xml";
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  mj_makeEmptyFileVFS(files.get(), kName, static_cast<int>(text.size()));
  std::memcpy(files->filedata[0], text.data(), text.size());
  std::array<char, 1000> message{};
  ModelPointer model(mj_loadXML(kName, files.get(), message.data(), message.size()), DeleteModel{});
  mj_deleteVFS(files.get());
  if (!model) throw std::runtime_error(message.data());
  return model;
}

/// Physics alone: no observation, no reward, no rules.
void engine(benchmark::State& state, const std::string& text) {
  Physics physics(compile(text));
  Actions actions;
  constexpr int kSteps = 20;  // about as long as an episode under random actions lasts
  const std::vector<double> at_rest(kDegreesOfFreedom);
  while (state.KeepRunning()) {
    physics.reset(physics.model().qpos0, at_rest.data());
    for (int i = 0; i < kSteps; ++i) physics.step(actions.next().data(), kFrameSkip);
  }
  state.SetItemsProcessed(state.iterations() * kSteps);
  state.counters["buffer_kB"] = physics.data().nbuffer / 1000.0;
}

void engine_without_pairs_and_sizes(benchmark::State& state, const std::string& text) {
  engine(state, plain_text(text));
}

BENCHMARK_CAPTURE(step, v4, "Walker2d-v4")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(step, v5, "Walker2d-v5")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(reset, v4, "Walker2d-v4")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(reset, v5, "Walker2d-v5")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(memory, v4, "Walker2d-v4")->Unit(benchmark::kSecond)->Iterations(1);
BENCHMARK_CAPTURE(memory, v5, "Walker2d-v5")->Unit(benchmark::kSecond)->Iterations(1);
BENCHMARK_CAPTURE(engine, v4, kBuiltinModels[0].text)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(engine, v5, kBuiltinModels[1].text)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(engine_without_pairs_and_sizes, v4, kBuiltinModels[0].text)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(engine_without_pairs_and_sizes, v5, kBuiltinModels[1].text)
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace walker::walker2d

BENCHMARK_MAIN();
