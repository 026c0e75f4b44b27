#include "robots/mujoco/compile_apart.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "base/interruption.h"
#include "base/posix.h"

namespace walker::mujoco {
namespace {

[[noreturn]] void fail(int error, const std::string& what) {
  throw std::system_error(error, std::generic_category(),
                          "MuJoCo's compiler gets no process of its own: " + what);
}

/// Returns the folder of the file that has this code: a library, the Python extension or a program,
/// whose name need not be a path.
std::filesystem::path find_folder() {
  Dl_info where{};
  static const char kHere = 0;
  std::error_code error;
  std::filesystem::path file;
  if (dladdr(&kHere, &where) != 0) file = std::filesystem::absolute(where.dli_fname, error);
  if (!exists(file, error)) file = std::filesystem::read_symlink("/proc/self/exe", error);
  return file.parent_path();
}

const std::filesystem::path kFolder = find_folder();  // before the working directory changes

std::filesystem::path find_program() {
  for (const char* const way : {WALKER_SIM_WAYS_TO_PROGRAMS}) {
    std::filesystem::path program = kFolder / way / "compile_model";
    if (access(program.c_str(), X_OK) == 0) return program;
  }
  fail(ENOENT, (kFolder / "compile_model").string());
}

/// A path by which another process reaches the file that this one reaches by `path`.
std::string shared_path(const std::string& path) {
  const std::string own = "/proc/" + std::to_string(getpid()) + "/";
  if (path == "/dev/stdin") return own + "fd/0";
  if (path.rfind("/dev/fd/", 0) == 0) return own + path.substr(std::strlen("/dev/"));
  if (path.rfind("/proc/self/", 0) == 0) return own + path.substr(std::strlen("/proc/self/"));
  return path;
}

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

/// The process of the program; the destructor kills and reaps it.
class Compiler {
 public:
  /// @throws std::system_error
  Compiler(const std::string& path, const CompileLimits& limits, const std::string* text)
      : limits_(limits) {
    if (pipe2(pipe_.ends.data(), O_CLOEXEC) != 0) fail(errno, "pipe");
    for (int& end : pipe_.ends) {
      end = above_standard(end);  // the program's standard ones must not be these
      if (end < 0) fail(errno, "pipe");
    }
    Pipe others;
    auto& [nowhere, content] = others.ends;
    nowhere = above_standard(::open("/dev/null", O_RDWR | O_CLOEXEC));
    if (nowhere < 0) fail(errno, "/dev/null");
    if (text != nullptr) {
      content = above_standard(memfd_create("model", MFD_CLOEXEC));
      if (content < 0 ||
          pwrite(content, text->data(), text->size(), 0) != static_cast<ssize_t>(text->size())) {
        fail(errno, "memfd");
      }
    }
    spawn({find_program().string(), shared_path(path), text != nullptr ? "text" : "file",
           std::to_string(limits.memory), std::to_string(limits.processor_seconds),
           std::to_string(limits.elements), std::to_string(limits.bytes)},
          {text != nullptr ? content : nowhere, pipe_.ends[1], nowhere});
    ::close(std::exchange(pipe_.ends[1], -1));
  }
  Compiler(const Compiler&) = delete;
  Compiler& operator=(const Compiler&) = delete;
  ~Compiler() {
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

  /// Whether `read_all` failed because the program was idle.
  bool is_idle() const { return is_idle_; }

  /// Why the message is incomplete. Requires that `read_all` has returned false.
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
  /// @param standard the program's standard input, output and error
  void spawn(std::vector<std::string> words, const std::array<int, 3>& standard) {
    std::vector<char*> arguments;
    arguments.reserve(words.size() + 1);
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    for (int i = 0; i <= STDERR_FILENO; ++i) {
      posix_spawn_file_actions_adddup2(&files, standard[static_cast<std::size_t>(i)], i);
    }
    // The host may have blocked or ignored signals.
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t signals;
    sigemptyset(&signals);
    posix_spawnattr_setsigmask(&attributes, &signals);
    sigfillset(&signals);
    sigdelset(&signals, SIGKILL);
    sigdelset(&signals, SIGSTOP);
    posix_spawnattr_setsigdefault(&attributes, &signals);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    const int error =
        posix_spawn(&process_, arguments[0], &files, &attributes, arguments.data(), environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&files);
    if (error == 0) return;
    process_ = -1;
    fail(error, words[0]);
  }

  /// Waits for data or EOF.
  /// @return false if the program is idle
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

  /// Reaps the process.
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
                                     const std::string* text) {
  Compiler compiler(path, limits, text);
  CompileHeading heading{};
  std::vector<std::byte> message;
  if (compiler.read_all(&heading, sizeof(heading))) {
    message.resize(heading.size);
    if (compiler.read_all(message.data(), message.size())) {
      if (heading.is_model != 0) return message;
      throw std::runtime_error(
          std::string(reinterpret_cast<const char*>(message.data()), message.size()));
    }
  }
  throw std::runtime_error(compiler.end_text());
}

}  // namespace walker::mujoco
