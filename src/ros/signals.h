// How a node is told to end.
#pragma once

#include <future>
#include <thread>

namespace walker {

/// Ends the node on SIGINT and on SIGTERM: as roscpp does it, with its services and topics taken
/// off the master. roscpp asks a master for that without a limit of time, so where the master does
/// not answer the process ends without it, with the same status, 0.
///
/// To be made after `ros::init` with `NoSigintHandler`, before anything else of ROS, and once.
class EndOnSignals {
 public:
  EndOnSignals();
  EndOnSignals(const EndOnSignals&) = delete;
  EndOnSignals& operator=(const EndOnSignals&) = delete;
  /// The node has come to its end, whatever led to it: takes it off the master.
  ~EndOnSignals();

 private:
  void watch();

  std::promise<void> end_;
  std::thread thread_;
};

}  // namespace walker
