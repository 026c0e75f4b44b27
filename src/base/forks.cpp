#include "base/forks.h"

#include <pthread.h>

#include <atomic>

namespace walker {
namespace {

std::atomic<unsigned> forks{0};

}  // namespace

unsigned num_forks() {
  static const int is_watched = pthread_atfork(nullptr, nullptr, [] { ++forks; });
  static_cast<void>(is_watched);  // without memory for it forks go unnoticed, and nothing else
  return forks.load(std::memory_order_relaxed);
}

}  // namespace walker
