#include "base/forks.h"

#include <pthread.h>

#include <atomic>

namespace walker {
namespace {

std::atomic<unsigned> forks{0};

}  // namespace

unsigned num_forks() {
  static const int is_watched = pthread_atfork(nullptr, nullptr, [] { ++forks; });
  static_cast<void>(is_watched);  // fails only without memory; forks are then not detected
  return forks.load(std::memory_order_relaxed);
}

}  // namespace walker
