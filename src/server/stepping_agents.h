// Detects two agents that step one walker in turns. No ROS.
#pragma once

#include <string>

namespace walker {

/// Distinguishes two agents that step one walker in turns from an agent that replaces another.
class SteppingAgents {
 public:
  /// Forgets earlier callers: the new episode may belong to another agent.
  void clear() {
    last_.clear();
    other_.clear();
  }

  /// @param agent name of the node that made a step
  /// @return whether it resumes after the steps of another agent that had replaced it
  bool record(const std::string& agent) {
    if (agent == last_) return false;
    const bool comes_back = agent == other_;
    other_ = last_;
    last_ = agent;
    return comes_back;
  }

  /// The agent that stepped before the latest one; empty if none.
  const std::string& other() const { return other_; }

 private:
  std::string last_, other_;
};

}  // namespace walker
