// How a thread waits for a number to change: first awake, then asleep in the kernel.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace walker {

/// How many processors this thread may use, at least 1.
std::size_t num_processors();

/// What a thread does with its processor while it waits awake.
enum class Awake {
  spins,   ///< keeps it: for threads that have one each
  yields,  ///< leaves it to whoever wants it, whom a scheduler may then let run for milliseconds
};

/// Waits up to 150 us for `number` to be another one than `old`.
/// @return whether the number changed
bool wait_awake(const std::atomic<std::uint32_t>& number, std::uint32_t old, Awake awake);

/// Sleeps while `number` is `old`, until `wake` is called; may return sooner.
void sleep_while(const std::atomic<std::uint32_t>& number, std::uint32_t old);

/// Wakes up to `count` threads that sleep on `number`.
void wake(const std::atomic<std::uint32_t>& number, int count);

}  // namespace walker
