// How a thread waits for a number to change: first awake, then asleep in the kernel.
#pragma once

#include <atomic>
#include <cstdint>

namespace walker {

/// Yields the processor a few times while `number` is `old`. A sleeping thread needs some ten
/// microseconds to come back, which a short wait saves; whoever shares the processor has it
/// meanwhile.
/// @return whether the number changed
bool wait_awake(const std::atomic<std::uint32_t>& number, std::uint32_t old);

/// Sleeps while `number` is `old`, until `wake` is called; may return sooner.
void sleep_while(const std::atomic<std::uint32_t>& number, std::uint32_t old);

/// Wakes up to `count` threads that sleep on `number`.
void wake(const std::atomic<std::uint32_t>& number, int count);

}  // namespace walker
