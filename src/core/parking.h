// How a thread waits for a number to change: first awake, then asleep in the kernel.
#pragma once

#include <atomic>
#include <cstdint>

namespace walker {

/// Waits up to 50 us for `number` to be another one than `old`, and yields the processor to whoever
/// else wants it meanwhile.
/// @return whether the number changed
bool wait_awake(const std::atomic<std::uint32_t>& number, std::uint32_t old);

/// Sleeps while `number` is `old`, until `wake` is called; may return sooner.
void sleep_while(const std::atomic<std::uint32_t>& number, std::uint32_t old);

/// Wakes up to `count` threads that sleep on `number`.
void wake(const std::atomic<std::uint32_t>& number, int count);

}  // namespace walker
