// Queue length of the topics whose listeners want every message; those of recorders are longer.
#pragma once

#include <cstdint>

namespace walker {

/// Upper bound of the steps of one request as well: its messages overflow no queue.
constexpr std::uint32_t kListenerQueue = 100;

}  // namespace walker
