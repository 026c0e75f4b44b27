// Writes the robot description (URDF) of an environment's running world. Needs no ROS master.
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
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
    "Prints the URDF of environment ID (default: BipedalWalker-v3), made from its simulation.\n"
    "  NAME=VALUE       parameters of the environment, e.g. xml_file=/path/model.xml\n"
    "  --urdf FILE      writes the URDF to FILE instead\n"
    "  --meshes FOLDER  copies the meshes that the URDF names to FOLDER, which must exist\n"
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

// Writes a file beside `path` that then replaces it: a full disk leaves the earlier file as it was.
// Writes to a pipe or a device directly.
void write(const std::string& path, const std::string& content) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  const bool replaces = !fs::exists(status) || fs::is_regular_file(status);
  const bool is_there = replaces && fs::exists(status);
  const fs::path target = is_there ? fs::canonical(path) : fs::path(path);  // a link stays one
  fs::path written = target;
  if (replaces) written += "." + std::to_string(getpid()) + ".new";
  std::ofstream file(written, std::ios::binary);
  file << content;
  file.close();
  error =
      file ? std::error_code() : std::error_code(errno != 0 ? errno : EIO, std::generic_category());
  if (!error && is_there) fs::permissions(written, status.permissions(), error);
  if (!error && replaces) fs::rename(written, target, error);
  if (!error) return;
  if (replaces) unlink(written.c_str());
  throw std::runtime_error(path + ": could not be written: " + error.message());
}

void copy_mesh(const std::string& name, const std::string& folder) {
  std::ifstream file(ros::package::getPath("walker_sim") + "/assets/" + name, std::ios::binary);
  const std::string content(std::istreambuf_iterator<char>(file), {});
  if (!file) throw std::runtime_error(name + ": could not be read");
  write(folder + "/" + name, content);
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
  std::signal(SIGXFSZ, SIG_IGN);  // a write beyond the limit of `ulimit -f` fails instead
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
