#include "robots/mujoco/compile_apart.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <locale>
#include <new>
#include <set>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/interruption.h"
#include "base/posix.h"

namespace walker::mujoco {
namespace {

/// Precedes the child's message.
struct Heading {
  std::uint64_t is_model;  ///< 0: the message is the reason why there is no model
  std::uint64_t size;      ///< [bytes]
};

// ---------------------------------------------------------------- the child

void limit(int resource, std::size_t most) {
  rlimit limits{};
  getrlimit(resource, &limits);
  limits.rlim_cur = std::min<rlim_t>(most, limits.rlim_max);
  setrlimit(resource, &limits);
}

/// Size of this process's address space [bytes]; 0: unknown.
std::size_t address_space() {
  std::size_t pages = 0;
  std::ifstream file("/proc/self/statm");
  file.imbue(std::locale::classic());
  file >> pages;
  return pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

/// Undoes the host's set-up in the child: it prints nothing, dumps no core, runs none of the host's
/// exit handlers, and dies with the host.
void become_quiet(const CompileLimits& limits) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (int number = 1; number < NSIG; ++number) {
    std::signal(number, number == SIGINT ? SIG_IGN : SIG_DFL);  // the host handles Ctrl-C
  }
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  std::locale::global(std::locale::classic());  // MuJoCo may parse numbers with streams
  std::atexit([] { _exit(EXIT_FAILURE); });     // runs before handlers registered earlier
  const int nowhere = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  for (int standard = 0; standard <= STDERR_FILENO; ++standard) dup2(nowhere, standard);
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
    if (written <= 0) _exit(EXIT_FAILURE);  // the parent has closed the pipe
    from += written;
    size -= static_cast<std::size_t>(written);
  }
}

void tell(int file, const Heading& heading, const void* bytes) {
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

[[noreturn]] void run_child(int file, const std::string& path, const CompileLimits& limits,
                            const mjVFS* files) {
  become_quiet(limits);
  try {
    try {
      if (files == nullptr) check_size(path, limits);
      const std::vector<std::byte> model = compile(path, files);
      tell(file, {1, model.size()}, model.data());
    } catch (const std::bad_alloc&) {
      throw std::runtime_error("it needs more than " + std::to_string(limits.memory >> 20U) +
                               " MiB of memory");
    }
  } catch (const std::exception& error) {
    tell(file, {0, std::strlen(error.what())}, error.what());
  }
  _exit(EXIT_SUCCESS);
}

// ---------------------------------------------------------------- the parent

/// CPU time of a process [s]; negative: it has ended.
double processor_time(pid_t process) {
  clockid_t clock{};
  timespec time{};
  if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &time) != 0) return -1;
  constexpr double kPerSecond = 1e9;
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) / kPerSecond;
}

struct Pipe {
  std::array<int, 2> ends{-1, -1};

  Pipe() = default;
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  ~Pipe() {
    for (const int end : ends) {
      if (end >= 0) ::close(end);
    }
  }
};

/// The child process; the destructor kills and reaps it.
class Child {
 public:
  /// @throws std::system_error
  Child(const std::string& path, const CompileLimits& limits, const mjVFS* files)
      : limits_(limits) {
    if (pipe2(pipe_.ends.data(), O_CLOEXEC) != 0) fail("pipe");
    for (int& end : pipe_.ends) {
      end = above_standard(end);  // the child redirects the standard ones
      if (end < 0) fail("pipe");
    }
    process_ = fork();
    if (process_ < 0) fail("fork");
    if (process_ == 0) run_child(pipe_.ends[1], path, limits, files);
    ::close(std::exchange(pipe_.ends[1], -1));
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    if (process_ > 0) kill(process_, SIGKILL);
    end();
  }

  /// @return whether `size` bytes arrived
  bool read_all(void* bytes, std::size_t size) {
    auto* to = static_cast<char*>(bytes);
    while (size > 0) {
      if (!wait()) return false;
      const ssize_t received = ::read(pipe_.ends[0], to, size);
      if (received < 0 && errno == EINTR) continue;
      if (received <= 0) return false;
      to += received;
      size -= static_cast<std::size_t>(received);
    }
    return true;
  }

  /// Whether `read_all` failed because the child was idle.
  bool is_idle() const { return is_idle_; }

  /// Why the child's message is incomplete. Requires that `read_all` has returned false.
  std::string end_text() {
    if (is_idle_) {
      return "it waited for " + std::to_string(limits_.idle_seconds) +
             " s for a file that does not come: files must be regular ones";
    }
    const int status = end();
    if (!WIFSIGNALED(status)) return "MuJoCo ended its process while it compiled the model";
    const int number = WTERMSIG(status);
    if (number == SIGXCPU) {
      return "it takes MuJoCo more than " + std::to_string(limits_.processor_seconds) +
             " s to compile";
    }
    return "MuJoCo crashed while it compiled the model (signal " + std::to_string(number) +
           "); are its sizes sensible?";
  }

 private:
  [[noreturn]] static void fail(const char* what) {
    throw std::system_error(errno, std::generic_category(),
                            std::string("MuJoCo's compiler gets no process of its own: ") + what);
  }

  /// Waits for data or EOF.
  /// @return false if the child is idle
  /// @throws Interrupted
  bool wait() {
    using Clock = std::chrono::steady_clock;
    double last = processor_time(process_);
    for (unsigned int idle = 0; idle < limits_.idle_seconds;) {
      const auto end = Clock::now() + std::chrono::seconds(1);
      while (Clock::now() < end) {      // signals may shorten each wait
        constexpr int kInterval = 100;  // a signal may arrive between two waits [ms]
        pollfd file{pipe_.ends[0], POLLIN, 0};
        if (poll_interruptibly(file, kInterval) > 0) return true;
      }
      const double now = processor_time(process_);
      // A background thread, such as a sanitizer's, may wake occasionally.
      constexpr double kNothing = 0.005;  // CPU time in that second [s]
      idle = now - last > kNothing ? 0 : idle + 1;
      last = now;
    }
    is_idle_ = true;
    return false;
  }

  /// Reaps the child.
  /// @return its status; 0 if the host has reaped it already
  int end() {
    int status = 0;
    while (process_ > 0 && waitpid(process_, &status, 0) < 0 && errno == EINTR) {
    }
    process_ = -1;
    return status;
  }

  CompileLimits limits_;
  pid_t process_ = -1;
  Pipe pipe_;
  bool is_idle_ = false;
};

}  // namespace

std::vector<std::byte> compile_apart(const std::string& path, const CompileLimits& limits,
                                     const mjVFS* files) {
  // A forked child inherits the locks that other threads hold, and nothing releases them there. If
  // another thread throws during the fork, a child that throws may deadlock: before 2.35, glibc
  // looks up frames under a lock (seen once, with 2.31). A second fork happens at another moment.
  constexpr int kAttempts = 2;
  std::string reason;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    Child child(path, limits, files);
    Heading heading{};
    std::vector<std::byte> content;
    if (child.read_all(&heading, sizeof(heading))) {
      content.resize(heading.size);
      if (child.read_all(content.data(), content.size())) {
        if (heading.is_model != 0) return content;
        throw std::runtime_error(
            std::string(reinterpret_cast<const char*>(content.data()), content.size()));
      }
    }
    reason = child.end_text();
    if (!child.is_idle()) break;
  }
  throw std::runtime_error(reason);
}

}  // namespace walker::mujoco
