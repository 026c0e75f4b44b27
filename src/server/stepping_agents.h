// Whose calls step the walker. No ROS.
#pragma once

#include <string>

namespace walker {

/// Tells two agents that step one walker in turns from one that is followed by another.
class SteppingAgents {
 public:
  /// Who has stepped is forgotten, for an episode begins that may be another's.
  void clear() {
    last_.clear();
    other_.clear();
  }

  /// @param agent that has made a step
  /// @return whether somebody else has stepped since it last did
  bool note(const std::string& agent) {
    if (agent == last_) return false;
    const bool comes_back = agent == other_;
    other_ = last_;
    last_ = agent;
    return comes_back;
  }

  /// Who stepped before the one that was noted last; empty: nobody.
  const std::string& other() const { return other_; }

 private:
  std::string last_, other_;
};

}  // namespace walker
