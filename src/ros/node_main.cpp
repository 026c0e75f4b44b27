#include "ros/node_main.h"

#include <semaphore.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <future>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <ros/console.h>
#include <ros/init.h>
#include <ros/master.h>
#include <ros/names.h>
#include <ros/network.h>
#include <ros/param.h>
#include <ros/this_node.h>

#include "base/interruption.h"
#include "base/posix.h"
#include "base/printable_text.h"
#include "ros/interposed.h"
#include "wire/master.h"

namespace ros::names {

void init(const M_string& remappings);  // adds remappings; in roscpp's library, but in no header

}  // namespace ros::names

namespace walker {
namespace {

// An unobstructed shutdown takes less. After this time the watching thread probes the master.
constexpr std::chrono::milliseconds kShutdownTimeout{500};
// After this time the node exits even if the master answers new calls: roscpp unregisters over a
// connection that it keeps open, which the network may have lost. roslaunch kills nodes after 15 s.
constexpr std::chrono::seconds kMaxShutdown{10};
// An error may list all allowed values, and may quote a peer.
constexpr std::size_t kMaxErrorBytes = 8000;

sem_t wake_semaphore;  // wakes the watching thread: sem_post is async-signal-safe
std::atomic<bool> is_signalled{false};
std::atomic<bool> sets_simulated_time{false};  // under /use_sim_time, not following /clock
std::atomic<bool> is_started{false};           // ros::start may have registered the node

/// ::poll that throws Interrupted after SIGINT or SIGTERM.
int poll_until_end(pollfd* files, nfds_t num_files, int timeout) {
  const int result = ::poll(files, num_files, timeout);
  if (is_signalled) throw Interrupted();
  return result;
}

void on_signal(int /*signal*/) {
  const int error = errno;
  is_signalled = true;
  ros::requestShutdown();  // only sets a flag
  sem_post(&wake_semaphore);
  errno = error;
}

/// Runs `work` in a detached thread, which is abandoned if it exceeds the timeout.
bool is_done_within(std::chrono::milliseconds longest, const std::function<void()>& work) {
  try {
    std::packaged_task<void()> task(work);
    const std::future<void> done = task.get_future();
    std::thread(std::move(task)).detach();
    return done.wait_for(longest) == std::future_status::ready;
  } catch (const std::exception&) {  // no thread could be created
    return false;
  }
}

/// Returns whether the master does not answer in time, so that roscpp would block on it. A master
/// that has exited refuses the connection, which blocks nothing.
bool master_hangs() {
  const std::string call = xml_rpc::make_call("getPid", {ros::this_node::getName()});
  return !is_done_within(kMasterTimeout, [uri = ros::master::getURI(), call] {
    // A longer deadline, since a call that times out would count as done.
    call_master(uri, call, Deadline(std::chrono::steady_clock::now() + 2 * kMasterTimeout));
  });
}

class EndOnSignals {
 public:
  EndOnSignals() {
    sem_init(&wake_semaphore, 0, 0);
    thread_ = std::thread([this] { watch(); });
    set_poll(&poll_until_end);
    std::signal(SIGXFSZ, SIG_IGN);  // beyond `ulimit -f`, calls fail with EFBIG
    std::signal(SIGINT, on_signal);
    std::signal(SIGTERM, on_signal);
  }
  EndOnSignals(const EndOnSignals&) = delete;
  EndOnSignals& operator=(const EndOnSignals&) = delete;
  ~EndOnSignals() {
    // roscpp's own shutdown at exit runs after the destruction of objects that its threads use.
    if (is_started) ros::shutdown();
    end_.set_value();
    sem_post(&wake_semaphore);
    thread_.join();
  }

 private:
  void watch() {
    while (sem_wait(&wake_semaphore) != 0) {  // EINTR
    }
    const std::future<void> end = end_.get_future();
    // ros::init waits for the master without a timeout. The node is not registered yet.
    if (!is_started && end.wait_for(kShutdownTimeout) != std::future_status::ready && !is_started) {
      std::_Exit(EXIT_SUCCESS);
    }
    const auto deadline = std::chrono::steady_clock::now() + kMaxShutdown;
    while (end.wait_for(kShutdownTimeout) != std::future_status::ready) {
      ros::requestShutdown();  // again: ros::start clears an earlier request
      const bool hangs = master_hangs();
      if (!hangs && std::chrono::steady_clock::now() < deadline) continue;
      is_done_within(kShutdownTimeout, [hangs] {  // a full pipe may block this, too
        const char* const reason = hangs ? "The ROS master does not answer" : "A connection stalls";
        std::fprintf(stderr, "%s: the node exits without unregistering\n", reason);
        std::fflush(nullptr);
      });
      std::_Exit(EXIT_SUCCESS);
    }
  }

  std::promise<void> end_;
  std::thread thread_;
};

/// Calls ros::start, which subscribes to /clock if the parameter /use_sim_time is true. For a node
/// that does not follow /clock, the parameter is remapped to one that is never set. Without an
/// answer of the master, which ros::start waits for, the node follows /clock.
void start(const NodeDescription& node) {
  const std::string parameter = "/use_sim_time";
  const bool sets_time =
      ros::master::check() && (node.follows_clock == nullptr || !node.follows_clock());
  const bool is_simulated = sets_time && ros::param::param(parameter, false);
  if (sets_time) ros::names::init({{parameter, parameter + "_of_followers"}});
  ros::start();
  sets_simulated_time = is_simulated;
  set_time({});
}

/// Validates the master's URI: roscpp aborts on one that it cannot parse.
void check_master(const std::vector<std::string>& arguments) {
  const std::string setting = "__master:=";
  const char* const variable = std::getenv("ROS_MASTER_URI");
  std::string name = "ROS_MASTER_URI = ";
  std::string uri = variable == nullptr ? "" : variable;
  for (const std::string& argument : arguments) {
    if (argument.rfind(setting, 0) != 0 || argument == setting) continue;
    name = setting;
    uri = argument.substr(setting.size());
  }
  std::string host;
  std::uint32_t port = 0;
  constexpr std::uint32_t kMaxPort = 65535;
  if (uri.empty() || !ros::network::splitURI(uri, host, port) || port == 0 || port > kMaxPort) {
    throw std::invalid_argument(name + uri + ": must be the ROS master's address, " +
                                "http://HOST:PORT; roscore's is http://localhost:11311");
  }
}

}  // namespace

void set_time(ros::Time time) {
  if (sets_simulated_time) ros::Time::setNow(time);
}

int run_node(int argc, char** argv, const NodeDescription& node, const std::function<void()>& run) {
  open_standard_descriptors();
  const std::vector<std::string> arguments(argv + std::min(argc, 1), argv + argc);
  for (const std::string& argument : arguments) {
    if (argument != "--help" && argument != "-h") continue;
    std::fputs(help_text(node).c_str(), stdout);
    return EXIT_SUCCESS;
  }
  const EndOnSignals end_on_signals;  // before any call of ROS
  try {
    check_arguments(arguments, node);
    check_master(arguments);
    ros::init(argc, argv, node.name, ros::init_options::NoSigintHandler);
    is_started = true;
    start(node);
    const std::string addresses = listening_addresses();  // linked even if DEBUG is compiled out
    ROS_DEBUG_STREAM(addresses);
    if (ros::ok()) run();
  } catch (const Interrupted&) {
    return EXIT_SUCCESS;
  } catch (const std::exception& error) {
    // Calls of ROS fail during a shutdown: that is no error of the node.
    if (is_signalled || (is_started && !ros::ok())) return EXIT_SUCCESS;
    ROS_FATAL_STREAM(printable(error.what(), kMaxErrorBytes));
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}

}  // namespace walker
