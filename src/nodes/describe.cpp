// Writes the robot description (URDF) of an environment's running world. Needs no ROS master.
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include <ros/package.h>

#include "base/parameter_text.h"
#include "base/posix.h"
#include "base/printable_text.h"
#include "description/urdf.h"
#include "walker_sim/registry.h"

namespace {

constexpr const char* kUsage =
    "Usage: describe [--urdf FILE] [--meshes FOLDER] [--engine] [--] [ID [NAME=VALUE ...]]\n"
    "Describes environment ID (BipedalWalker-v3) as URDF, read off its running world.\n"
    "  NAME=VALUE       parameters of the environment, e.g. xml_file=/path/model.xml\n"
    "  --urdf FILE      writes the URDF there; without, it goes to the terminal\n"
    "  --meshes FOLDER  copies the package's meshes there (an existing folder), under the names "
    "that\n"
    "                   the URDF has for them\n"
    "  --engine         prints the engine, its version and its file instead\n"
    "  --               ends the options\n";

struct Options {
  std::string id = "BipedalWalker-v3";
  std::vector<std::string> assignments;  // NAME=VALUE
  std::string urdf;
  std::string meshes;
  bool wants_engine = false;
  bool wants_help = false;
};

Options parse(int argc, char** argv) {
  Options options;
  bool takes_options = true;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (!takes_options || argument.rfind('-', 0) != 0) {
      if (argument.find('=') != std::string::npos) {
        options.assignments.push_back(argument);
      } else {
        options.id = argument;
      }
    } else if (argument == "--") {
      takes_options = false;
    } else if (argument == "--help" || argument == "-h") {
      options.wants_help = true;
    } else if (argument == "--engine") {
      options.wants_engine = true;
    } else if (argument == "--urdf" || argument == "--meshes") {
      if (++i == argc) throw std::invalid_argument(argument + ": needs a value");
      (argument == "--urdf" ? options.urdf : options.meshes) = argv[i];
    } else {
      throw std::invalid_argument(argument + ": unknown option; see --help");
    }
  }
  return options;
}

void write(const std::string& path, const std::string& content) {
  std::ofstream file(path, std::ios::binary);
  file << content;
  file.close();
  if (!file) throw std::runtime_error(path + ": could not be written");
}

void copy_mesh(const std::string& name, const std::string& folder) {
  using std::filesystem::copy_options;
  const std::string path = folder + "/" + name;
  std::error_code error;
  std::filesystem::copy_file(ros::package::getPath("walker_sim") + "/assets/" + name, path,
                             copy_options::overwrite_existing, error);
  if (error) throw std::runtime_error(path + ": could not be written: " + error.message());
}

void describe(const Options& options) {
  const auto environment = walker::make(
      options.id,
      walker::parse_assignments(walker::parameter_descriptions(options.id), options.assignments));
  const walker::Specification& specification = environment->specification();
  if (options.wants_engine) {
    std::cout << specification.engine << " " << specification.engine_version << "\n"
              << specification.engine_path << "\n";
    return;
  }
  const walker::UrdfFiles files = walker::make_urdf(specification, walker::robot_name(options.id));
  if (options.urdf.empty()) {
    std::cout << files.urdf;
  } else {
    write(options.urdf, files.urdf);
  }
  if (options.meshes.empty()) return;
  for (const std::string& name : files.meshes) copy_mesh(name, options.meshes);
}

}  // namespace

int main(int argc, char** argv) {
  walker::open_standard_descriptors();
  try {
    const Options options = parse(argc, argv);
    if (options.wants_help) {
      std::cout << kUsage;
    } else {
      describe(options);
    }
  } catch (const std::exception& error) {
    std::cerr << "describe: " << walker::printable(error.what()) << "\n";
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
