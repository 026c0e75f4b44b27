// Prints the oracle's traces of all scripts for one case, a line each: script, walker, line.
#include <cstdlib>
#include <exception>
#include <iostream>
#include <stdexcept>
#include <string>

#include "promises/oracle.h"

namespace walker::promises {
namespace {

int print(const std::string& name, const std::string& when) {
  const Scripts all = read_scripts();
  for (const Case& one : all.cases) {
    if (one.name != name) continue;
    for (const Script& script : all.scripts) {
      Oracles oracle(one, when == "at_once");
      const Trace trace = play(script, one, oracle);
      for (std::uint32_t walker = 0; walker < kNumWalkers; ++walker) {
        for (const std::string& line : trace[walker]) {
          std::cout << script.name << '\t' << walker << '\t' << line << '\n';
        }
      }
    }
    return EXIT_SUCCESS;
  }
  throw std::invalid_argument(name + ": no such case");
}

}  // namespace
}  // namespace walker::promises

int main(int argc, char** argv) try {
  if (argc == 3) return walker::promises::print(argv[1], argv[2]);
  std::cerr << "usage: walker_sim_oracle CASE at_once|in_step\n";
  return 2;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 2;
}
