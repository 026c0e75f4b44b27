#include "server/topics/recorder_watch.h"

namespace walker {

std::string RecorderWatch::complaint() const {
  if (recorder_.empty()) return "";
  std::string missing;
  for (const auto& [topic, connections] : connections_) {
    if (connections == 0) missing += (missing.empty() ? "" : ", ") + topic;
  }
  if (missing.empty()) return "";
  return recorder_ + " does not listen to " + missing + " (parameter wait_for_recorder)";
}

}  // namespace walker
