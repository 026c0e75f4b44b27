// A policy's act allocates nothing. Eigen allocates with malloc, so the test counts its calls.
#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <string>
#include <vector>

#include "policy/network.h"

namespace {
std::atomic<bool> is_counting{false};  // NOLINT
std::atomic<int> allocations{0};       // NOLINT
}  // namespace

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
/// The sanitizer's malloc must stay; it calls these hooks. GCC has no header that declares this.
extern "C" int __sanitizer_install_malloc_and_free_hooks(  // NOLINT
    void (*on_malloc)(const volatile void*, std::size_t), void (*on_free)(const volatile void*));
const int hooks = __sanitizer_install_malloc_and_free_hooks(
    [](const volatile void*, std::size_t) {
      if (is_counting) ++allocations;
    },
    [](const volatile void*) {});
#else
extern "C" void* __libc_malloc(std::size_t size);  // NOLINT: glibc's own

/// Replaces the C library's malloc in the whole program.
extern "C" void* malloc(std::size_t size) noexcept {  // NOLINT
  if (is_counting) ++allocations;
  return __libc_malloc(size);
}
#endif

namespace walker {
namespace {

Forward network(Activation activation, Output output, const std::vector<int>& sizes) {
  Network result;
  result.activation = activation;
  result.output = output;
  result.mean = Eigen::VectorXd::Zero(sizes.front());
  result.deviation = Eigen::VectorXd::Ones(sizes.front());
  result.low = Eigen::VectorXf::Constant(sizes.back(), -1);
  result.high = Eigen::VectorXf::Constant(sizes.back(), 1);
  for (std::size_t i = 1; i < sizes.size(); ++i) {
    result.layers.push_back({Eigen::MatrixXf::Constant(sizes[i], sizes[i - 1], 0.01F),
                             Eigen::VectorXf::Constant(sizes[i], 0.1F)});
  }
  return Forward(std::move(result));
}

TEST(PolicyAllocation, ActDoesNotAllocate) {
  for (const Activation activation : {Activation::tanh, Activation::relu}) {
    for (const Output output : {Output::clip, Output::tanh}) {
      for (const std::vector<int>& sizes :
           {std::vector<int>{24, 64, 64, 4}, {17, 256, 256, 6}, {11, 1023, 3}}) {
        Forward forward = network(activation, output, sizes);
        constexpr std::size_t kRows = 5;
        const std::vector<double> observations(kRows * static_cast<std::size_t>(sizes.front()),
                                               0.3);
        std::vector<double> actions(kRows * static_cast<std::size_t>(sizes.back()));
        allocations = 0;
        is_counting = true;
        for (int i = 0; i < 10; ++i) {
          forward.act(observations.data(), i % 2 == 0 ? 1 : kRows, actions.data());
        }
        is_counting = false;
        EXPECT_EQ(allocations, 0);
      }
    }
  }
}

TEST(PolicyAllocation, CountsAllocations) {
  allocations = 0;
  is_counting = true;
  const Eigen::VectorXf taken = Eigen::VectorXf::Zero(100);
  is_counting = false;
  EXPECT_GE(allocations, 1);
  EXPECT_EQ(taken.size(), 100);
}

}  // namespace
}  // namespace walker
