// Lock-step: only services move anything.
#pragma once

#include <stdexcept>

#include "server/drive/drive.h"

namespace walker {

class LockstepDrive : public Drive {
 public:
  using Drive::Drive;

  void take_command(const std::vector<double>& /*efforts*/, const std::string& /*agent*/) override {
    simulation_.refuse_command("effort command: in mode lockstep only ~step drives the walker");
  }
  bool takes_commands() const override { return false; }
  void set_real_time_factor(double /*factor*/) override {
    throw std::logic_error("set_real_time_factor: in lockstep who calls ~step sets the pace");
  }
  std::string pause() override {
    return "nothing to pause: in lockstep nothing moves between steps";
  }
  std::string unpause() override {
    return "nothing to unpause: in lockstep only ~step moves anything";
  }
  bool stands_still() const override { return true; }
  const char* pace() const override { return "who calls ~step sets the pace"; }
};

}  // namespace walker
