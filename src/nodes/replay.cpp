// Repeats the episodes recorded in bags and compares the results bit by bit. Needs no ROS master.
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "base/posix.h"
#include "base/printable_text.h"
#include "replay/replay.h"

namespace {

constexpr const char* kUsage =
    "Usage: replay BAG [BAG ...]\n"
    "Repeats every episode of every walker in the bags and compares observations, rewards, flags\n"
    "and info with the recorded ones to the bit, by their checksums. Several bags must be parts\n"
    "of one recording. To record every episode:\n"
    "  roslaunch walker_sim walker.launch recording:=FILE.bag agent:=random\n"
    "To record the episodes that end while rosbag runs:\n"
    "  rosbag record episode_record\n"
    "Exit status: 0 all that was compared is equal; 1 something differs, episodes are missing, or\n"
    "nothing was compared; 2 bad usage, or a bag that cannot be read\n";

constexpr int kDifferent = 1;
constexpr int kUnreadable = 2;

}  // namespace

int main(int argc, char** argv) {
  walker::open_standard_descriptors();
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  for (const std::string& argument : arguments) {
    if (argument == "--help" || argument == "-h") {
      std::cout << kUsage;
      return 0;
    }
    if (argument.rfind('-', 0) == 0) {
      std::cerr << "replay: " << argument << ": unknown option; see --help\n";
      return kUnreadable;
    }
  }
  if (arguments.empty()) {
    std::cerr << kUsage;
    return kUnreadable;
  }
  try {
    return walker::replay(arguments, std::cout) ? 0 : kDifferent;
  } catch (const std::exception& error) {
    std::cerr << "replay: " << walker::printable(error.what()) << "\n";
    return kUnreadable;
  }
}
