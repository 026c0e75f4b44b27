// Synchronization of a test with other threads.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace walker::test {

constexpr std::chrono::seconds kTimeout{30};  // reached only by a failing test

/// Blocks other threads until the test opens it.
class Gate {
 public:
  void pass() {
    std::unique_lock<std::mutex> lock(mutex_);
    ++arrivals_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return is_open_; });
  }

  void open() {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_open_ = true;
    changed_.notify_all();
  }

  void close() {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_open_ = false;
  }

  std::uint64_t arrivals() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return arrivals_;
  }

  /// Blocks until `pass` has been called `count` times, whether or not the calls have returned.
  void wait_for_arrivals(std::uint64_t count) {
    std::unique_lock<std::mutex> lock(mutex_);
    if (!changed_.wait_for(lock, kTimeout, [&] { return arrivals_ >= count; })) {
      throw std::runtime_error("no thread came to the gate");
    }
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t arrivals_ = 0;
  bool is_open_ = false;
};

/// Collects strings from other threads.
class Mailbox {
 public:
  void add(const std::string& text) {
    const std::lock_guard<std::mutex> lock(mutex_);
    texts_.push_back(text);
    changed_.notify_all();
  }

  std::vector<std::string> texts() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return texts_;
  }

  std::vector<std::string> take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::exchange(texts_, {});
  }

  /// Blocks until `last` is the newest text, then removes and returns all texts.
  std::vector<std::string> take_until(const std::string& last) {
    std::unique_lock<std::mutex> lock(mutex_);
    if (!changed_.wait_for(lock, kTimeout,
                           [&] { return !texts_.empty() && texts_.back() == last; })) {
      throw std::runtime_error("no text " + last);
    }
    return std::exchange(texts_, {});
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> texts_;
};

}  // namespace walker::test
