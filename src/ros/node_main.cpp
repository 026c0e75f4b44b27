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
#include <ros/network.h>
#include <ros/this_node.h>

#include "base/interruption.h"
#include "base/printable_text.h"
#include "base/standard_descriptors.h"
#include "ros/library_fixes.h"
#include "ros/listening.h"
#include "wire/master.h"

namespace walker {
namespace {

// An end without hindrance takes less. After it the master is asked.
constexpr std::chrono::milliseconds kPatience{500};
// An error may list all that is allowed; and it may have a stranger's words.
constexpr std::size_t kMaxErrorBytes = 8000;

sem_t is_told;  // what a handler may do to wake a thread
std::atomic<bool> is_signalled{false};
std::atomic<bool> is_started{false};  // ros::start may have registered the node

/// @throws Interrupted once a signal has told the node to end
int poll_until_end(pollfd* files, nfds_t num_files, int timeout) {
  const int result = ::poll(files, num_files, timeout);
  if (is_signalled) throw Interrupted();
  return result;
}

void on_signal(int /*signal*/) {
  const int error = errno;
  is_signalled = true;
  ros::requestShutdown();  // sets a flag
  sem_post(&is_told);
  errno = error;
}

/// What does not come to an end in time is left behind in a thread.
bool is_done_within(std::chrono::milliseconds longest, const std::function<void()>& work) {
  try {
    std::packaged_task<void()> task(work);
    const std::future<void> done = task.get_future();
    std::thread(std::move(task)).detach();
    return done.wait_for(longest) == std::future_status::ready;
  } catch (const std::exception&) {  // there is no thread left
    return false;
  }
}

/// Whether roscpp waits for it in vain. One that has gone is no hindrance.
bool master_hangs() {
  const std::string call = xml_rpc::make_call("getPid", {ros::this_node::getName()});
  return !is_done_within(kMasterTimeout, [uri = ros::master::getURI(), call] {
    // Longer, so that it does not end by itself.
    call_master(uri, call, Deadline(std::chrono::steady_clock::now() + 2 * kMasterTimeout));
  });
}

/// Ends the node on SIGINT and on SIGTERM.
class EndOnSignals {
 public:
  EndOnSignals() {
    sem_init(&is_told, 0, 0);
    thread_ = std::thread([this] { watch(); });
    set_poll(&poll_until_end);
    std::signal(SIGINT, on_signal);
    std::signal(SIGTERM, on_signal);
  }
  EndOnSignals(const EndOnSignals&) = delete;
  EndOnSignals& operator=(const EndOnSignals&) = delete;
  /// The node has come to its end, whatever led to it: takes it off the master.
  ~EndOnSignals() {
    // Left to the end of the process, it would come when objects are gone that roscpp's threads
    // use.
    if (is_started) ros::shutdown();
    end_.set_value();
    sem_post(&is_told);
    thread_.join();
  }

 private:
  void watch() {
    while (sem_wait(&is_told) != 0) {  // interrupted by another signal
    }
    const std::future<void> end = end_.get_future();
    // ros::init, which sets parameters, waits for a master without end. None knows the node yet.
    if (!is_started && end.wait_for(kPatience) != std::future_status::ready && !is_started) {
      std::_Exit(EXIT_SUCCESS);
    }
    while (end.wait_for(kPatience) != std::future_status::ready) {
      ros::requestShutdown();  // again: ros::start forgets one that came before it
      if (!master_hangs()) continue;
      is_done_within(kPatience, [] {  // whoever reads the output may hang too
        std::fputs("The ROS master does not answer: the node ends without taking itself off it\n",
                   stderr);
        std::fflush(nullptr);
      });
      std::_Exit(EXIT_SUCCESS);
    }
  }

  std::promise<void> end_;
  std::thread thread_;
};

/// roscpp aborts on a master's address that it cannot read.
/// @throws std::invalid_argument
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
                                "http://HOST:PORT; http://localhost:11311 is roscore's");
  }
}

}  // namespace

int run_node(int argc, char** argv, const NodeDescription& node, const std::function<void()>& run) {
  open_standard_descriptors();
  use_library_fixes();
  const std::vector<std::string> arguments(argv + std::min(argc, 1), argv + argc);
  for (const std::string& argument : arguments) {
    if (argument != "--help" && argument != "-h") continue;
    std::fputs(help_text(node).c_str(), stdout);
    return EXIT_SUCCESS;
  }
  const EndOnSignals end_on_signals;  // before anything of ROS
  try {
    check_arguments(arguments, node);
    check_master(arguments);
    ros::init(argc, argv, node.name, ros::init_options::NoSigintHandler);
    is_started = true;
    ros::start();
    ROS_DEBUG_STREAM(listening_addresses());
    if (ros::ok()) run();
  } catch (const Interrupted&) {
    return EXIT_SUCCESS;
  } catch (const std::exception& error) {
    // Without a master, or while it ends, what it needs is missing.
    if (is_signalled || (is_started && !ros::ok())) return EXIT_SUCCESS;
    ROS_FATAL_STREAM(printable(error.what(), kMaxErrorBytes));
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}

}  // namespace walker
