// The program that compiles a model for compile_apart:
//   compile_model PATH file|text MEMORY PROCESSOR_SECONDS ELEMENTS BYTES
// `text`: standard input has the content. Writes a CompileHeading and the message to standard
// output.
#include <fcntl.h>
#include <mujoco/mujoco.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <new>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "robots/mujoco/compile_apart.h"

namespace walker::mujoco {
namespace {

void limit(int resource, std::size_t most) {
  rlimit limits{};
  getrlimit(resource, &limits);
  limits.rlim_cur = std::min<rlim_t>(most, limits.rlim_max);
  setrlimit(resource, &limits);
}

/// Size of this process's address space [bytes]; 0: unknown.
std::size_t address_space() {
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

/// Dies with the host, leaves Ctrl-C to it, dumps no core, and keeps to the limits.
void restrict_process(const CompileLimits& limits) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  std::signal(SIGINT, SIG_IGN);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, limits.processor_seconds);
  const std::size_t used = address_space();
  if (used > 0) limit(RLIMIT_AS, used + limits.memory);
}

void write_all(int file, const void* bytes, std::size_t size) {
  const auto* from = static_cast<const char*>(bytes);
  while (size > 0) {
    const ssize_t written = ::write(file, from, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) _exit(EXIT_FAILURE);  // the host has closed the pipe
    from += written;
    size -= static_cast<std::size_t>(written);
  }
}

void tell(int file, const CompileHeading& heading, const void* bytes) {
  write_all(file, &heading, sizeof(heading));
  write_all(file, bytes, heading.size);
}

constexpr auto npos = std::string_view::npos;

/// Returns the file's text, truncated after the first block that exceeds `max_bytes`.
std::string read_text(const std::filesystem::path& path, std::size_t max_bytes) {
  std::string text;
  std::ifstream file(path, std::ios::binary);
  std::array<char, std::size_t{1} << 16U> block{};
  while (text.size() <= max_bytes && (file.read(block.data(), block.size()), file.gcount() > 0)) {
    text.append(block.data(), static_cast<std::size_t>(file.gcount()));
  }
  return text;
}

/// @param tag without its brackets, such as: include file="NAME"
/// @return NAME; empty if the tag includes no file
std::string_view included_file(std::string_view tag) {
  constexpr std::string_view kInclude = "include";
  if (tag.size() <= kInclude.size() || tag.substr(0, kInclude.size()) != kInclude) return {};
  tag.remove_prefix(kInclude.size());
  const std::size_t file =
      std::isspace(static_cast<unsigned char>(tag[0])) != 0 ? tag.find("file") : npos;
  if (file == npos) return {};
  const std::size_t begin = tag.find_first_of("\"'", file);
  if (begin == npos) return {};
  const std::size_t end = tag.find(tag[begin], begin + 1);
  return end == npos ? std::string_view() : tag.substr(begin + 1, end - begin - 1);
}

/// Counts a text's elements, and appends the names of the files that it includes.
std::size_t count_elements(std::string_view text, std::vector<std::string>& included) {
  std::size_t count = 0;
  for (std::size_t at = text.find('<'); at != npos; at = text.find('<', at)) {
    text.remove_prefix(at + 1);
    at = 0;
    if (text.substr(0, 3) == "!--") {
      at = text.find("-->");
    } else if (!text.empty() && std::isalpha(static_cast<unsigned char>(text[0])) != 0) {
      ++count;
      const std::string_view name = included_file(text.substr(0, text.find('>')));
      if (!name.empty()) included.emplace_back(name);
    }
    if (at == npos) break;
  }
  return count;
}

/// Checks the size of a file and the files that it includes, in its directory; unreadable ones are
/// ignored. MuJoCo's compile time grows with the square of the number of elements.
/// @throws std::runtime_error naming the size and the limit
void check_size(const std::filesystem::path& path, const CompileLimits& limits) {
  std::size_t num_bytes = 0;
  std::size_t num_elements = 0;
  std::vector<std::string> files{path.filename()};
  std::set<std::string> known;
  while (!files.empty() && num_bytes <= limits.bytes) {
    const std::string file = files.back();
    files.pop_back();
    if (!known.insert(file).second) continue;  // MuJoCo rejects a file that is included twice
    const std::string text = read_text(path.parent_path() / file, limits.bytes - num_bytes);
    num_bytes += text.size();
    num_elements += count_elements(text, files);
  }
  if (num_elements > limits.elements) {
    throw std::runtime_error("has " + std::to_string(num_elements) +
                             " elements, included files counted; must have at most " +
                             std::to_string(limits.elements));
  }
  if (num_bytes > limits.bytes) {
    throw std::runtime_error("has, included files counted, more than " +
                             std::to_string(limits.bytes) + " bytes");
  }
}

/// Puts a text into MuJoCo's virtual file system.
void add_file(mjVFS& files, const std::string& name, const std::string& text) {
  if (mj_makeEmptyFileVFS(&files, name.c_str(), static_cast<int>(text.size())) != 0) {
    throw std::bad_alloc();
  }
  std::memcpy(files.filedata[0], text.data(), text.size());
}

/// @throws std::exception if MuJoCo rejects the model or runs out of memory
std::vector<std::byte> compile(const std::string& path, const mjVFS* files) {
  std::array<char, kMaxErrorBytes> message{};
  const mjModel* const model = mj_loadXML(path.c_str(), files, message.data(), kMaxErrorBytes);
  if (model == nullptr) throw std::runtime_error(message.data());
  // Every user of a model starts with these calls, so its sizes must allow them.
  mjData* const data = mj_makeData(model);
  if (data == nullptr) throw std::runtime_error("its data cannot be made");
  mj_forward(model, data);
  const int size = mj_sizeModel(model);
  if (size <= 0) throw std::bad_alloc();  // the size overflows an int
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  mj_saveModel(model, nullptr, bytes.data(), size);
  return bytes;
}

/// @param arguments those of the command line, without the program
std::vector<std::byte> compile_as_asked(const std::vector<std::string>& arguments,
                                        const CompileLimits& limits) {
  mju_user_error = [](const char* message) {
    throw std::runtime_error(std::string("MuJoCo: ") + message);
  };
  mju_user_warning = [](const char* /*message*/) {};  // the default one writes a file
  const std::string& path = arguments[0];
  if (arguments[1] == "file") {
    check_size(path, limits);
    return compile(path, nullptr);
  }
  const std::string text{std::istreambuf_iterator<char>(std::cin), {}};
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  add_file(*files, path, text);
  return compile(path, files.get());
}

int run(const std::vector<std::string>& arguments) {
  CompileLimits limits;
  limits.memory = std::stoull(arguments.at(2));
  limits.processor_seconds = static_cast<unsigned int>(std::stoul(arguments.at(3)));
  limits.elements = std::stoull(arguments.at(4));
  limits.bytes = std::stoull(arguments.at(5));
  // MuJoCo may print.
  const int result = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (result < 0 || nowhere < 0) return EXIT_FAILURE;
  dup2(nowhere, STDOUT_FILENO);
  restrict_process(limits);
  try {
    try {
      const std::vector<std::byte> model = compile_as_asked(arguments, limits);
      tell(result, {1, model.size()}, model.data());
    } catch (const std::bad_alloc&) {
      throw std::runtime_error("it needs more than " + std::to_string(limits.memory >> 20U) +
                               " MiB of memory");
    }
  } catch (const std::exception& error) {
    tell(result, {0, std::strlen(error.what())}, error.what());
  }
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace walker::mujoco

int main(int argc, char** argv) try {
  return walker::mujoco::run({argv + 1, argv + argc});
} catch (const std::exception&) {
  std::cerr << "usage: compile_model PATH file|text MEMORY PROCESSOR_SECONDS ELEMENTS BYTES\n"
               "Other programs of walker_sim start this one, to compile a model.\n";
  return 2;
}
