// Prints what the oracle says of one case: the traces of all scripts, or the outcomes of episodes
// that a policy plays.
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "promises/oracle.h"
#include "walker_sim/policy.h"

namespace walker::promises {
namespace {

const Case& find(const Scripts& all, const std::string& name) {
  for (const Case& one : all.cases) {
    if (one.name == name) return one;
  }
  throw std::invalid_argument(name + ": no such case");
}

/// Prints a line for each line of a trace: script, walker, line.
void print_traces(const std::string& name, const std::string& when) {
  const Scripts all = read_scripts();
  const Case& one = find(all, name);
  for (const Script& script : all.scripts) {
    Oracles oracle(one, when == "at_once");
    const Trace trace = play(script, one, oracle);
    for (std::uint32_t walker = 0; walker < kNumWalkers; ++walker) {
      for (const std::string& line : trace[walker]) {
        std::cout << script.name << '\t' << walker << '\t' << line << '\n';
      }
    }
  }
}

/// Plays an episode by a policy.
/// @return its return, length, end, last info, world and error
std::string play_out(Oracle& walker, Policy& policy, std::uint64_t seed) {
  const Specification& specification = walker.specification();
  const bool is_single = specification.observation_dtype == "float32";
  std::vector<double> action(specification.action_size());
  double sum = 0;
  int length = 0;
  for (walker.reset(seed); !walker.terminated && !walker.truncated; ++length) {
    std::vector<double> observation = walker.observation;
    for (double& value : observation) value = is_single ? static_cast<float>(value) : value;
    policy.act(observation.data(), action.data());
    walker.step(action.data());
    sum += walker.reward;
  }
  std::string line = hexadecimal(sum) + " " + std::to_string(length);
  if (walker.terminated) line += " terminated";
  if (walker.truncated) line += " truncated";
  if (length > 0) line += to_text(specification.info_names, walker.info.data());
  line += to_text(walker.drawn);
  return walker.error.empty() ? line : line + " failed: " + walker.error;
}

/// Prints a line for each of a policy's episodes with the seeds 0 to `count` - 1 in each world.
void print_outcomes(const std::string& name, const std::string& file, int count,
                    const std::vector<std::string>& worlds) {
  const Scripts all = read_scripts();
  const Case& one = find(all, name);
  Policy policy(file);
  for (const std::string& world : worlds) {
    for (int seed = 0; seed < count; ++seed) {
      Oracle walker(one);
      walker.world = to_world(world == "level" ? one.level : world);
      std::cout << play_out(walker, policy, static_cast<std::uint64_t>(seed)) << '\n';
    }
  }
}

}  // namespace
}  // namespace walker::promises

int main(int argc, char** argv) try {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() == 2) {
    walker::promises::print_traces(words[0], words[1]);
    return EXIT_SUCCESS;
  }
  if (words.size() > 3) {
    walker::promises::print_outcomes(words[0], words[1], std::stoi(words[2]),
                                     {words.begin() + 3, words.end()});
    return EXIT_SUCCESS;
  }
  std::cerr << "usage: walker_sim_oracle CASE at_once|in_step\n"
               "       walker_sim_oracle CASE POLICY SEEDS WORLD...\n";
  return 2;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 2;
}
