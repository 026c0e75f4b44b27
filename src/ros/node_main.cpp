#include "ros/node_main.h"

#include <semaphore.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <future>
#include <string>
#include <thread>
#include <utility>

#include <ros/console.h>
#include <ros/init.h>
#include <ros/master.h>
#include <ros/this_node.h>

#include "client/master.h"
#include "core/interruption.h"
#include "core/printable_text.h"
#include "ros/listening.h"

namespace walker {
namespace {

// An end without hindrance takes less. After it the master is asked.
constexpr std::chrono::milliseconds kPatience{500};
constexpr std::chrono::seconds kMasterTimeout{2};
// An error may list all that is allowed; and it may have a stranger's words.
constexpr std::size_t kMostErrorBytes = 8000;

sem_t is_told;  // what a handler may do to wake a thread
std::atomic<bool> is_ended{false};

/// @throws Interrupted once a signal has told the node to end
int poll_until_end(pollfd* files, nfds_t num_files, int timeout) {
  const int result = ::poll(files, num_files, timeout);
  if (is_ended) throw Interrupted();
  return result;
}

void on_signal(int /*signal*/) {
  const int error = errno;
  is_ended = true;
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
    ros::shutdown();
    end_.set_value();
    sem_post(&is_told);
    thread_.join();
  }

 private:
  void watch() {
    while (sem_wait(&is_told) != 0) {  // interrupted by another signal
    }
    const std::future<void> end = end_.get_future();
    while (end.wait_for(kPatience) != std::future_status::ready) {
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

}  // namespace

int run_node(int argc, char** argv, const char* name, const std::function<void()>& run) {
  ros::init(argc, argv, name, ros::init_options::NoSigintHandler);
  const EndOnSignals end_on_signals;  // before anything else of ROS
  try {
    ros::start();
    ROS_DEBUG_STREAM(listening_addresses());
    run();
  } catch (const Interrupted&) {
    return EXIT_SUCCESS;
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(printable(error.what(), kMostErrorBytes));
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}

}  // namespace walker
