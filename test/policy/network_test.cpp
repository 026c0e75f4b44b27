// A network fixes its order of summation: its bits are those of Eigen 3.4, whichever version of
// Eigen is installed. It allocates nothing.
#include "policy/network.h"

#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Core>

#include "bits.h"
#include "policy/arithmetic.h"

namespace {
// Eigen allocates with malloc, so the test counts its calls.
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

/// FNV-1a hash over 32-bit words.
class Hash {
 public:
  void add(float value) { hash_ = (hash_ ^ float_bits(value)) * 1099511628211U; }
  std::uint64_t get() const { return hash_; }

 private:
  std::uint64_t hash_ = 14695981039346656037U;
};

struct Product {
  Eigen::MatrixXf weight;
  Eigen::VectorXf input;
  Eigen::VectorXf bias;
};

void add(const Product& given, Eigen::VectorXf& result) {
  add_product<4, 1>(given.weight.data(), given.weight.rows(), given.weight.cols(),
                    given.input.data(), result.data());
}

class ArithmeticTest : public testing::Test {
 protected:
  Product product(Eigen::Index rows, Eigen::Index columns) {
    Product made{Eigen::MatrixXf(rows, columns), Eigen::VectorXf(columns), Eigen::VectorXf(rows)};
    for (Eigen::Index i = 0; i < made.weight.size(); ++i) made.weight.data()[i] = draw();
    for (Eigen::Index i = 0; i < columns; ++i) made.input[i] = draw();
    for (Eigen::Index i = 0; i < rows; ++i) made.bias[i] = draw();
    return made;
  }

  float draw() { return static_cast<float>(static_cast<std::int32_t>(random_())) * 0x1p-31F; }

  // Whole and partial groups of rows, and both sides of the limit of 128 columns.
  static constexpr std::array<std::array<Eigen::Index, 2>, 9> kSizes{
      {{64, 24}, {64, 64}, {256, 256}, {4, 256}, {6, 64}, {3, 127}, {400, 300}, {31, 128}, {1, 1}}};

 private:
  std::mt19937 random_{5};
};

template <int lanes, int batch>
void expect_same_product(const Product& given) {
  const Eigen::MatrixXf inputs = given.input * Eigen::RowVectorXf::LinSpaced(batch, 1, 2);
  Eigen::MatrixXf results = given.bias.replicate(1, batch);
  add_product<lanes, batch>(given.weight.data(), given.weight.rows(), given.weight.cols(),
                            inputs.data(), results.data());
  for (int k = 0; k < batch; ++k) {
    Eigen::VectorXf alone = given.bias;
    add({given.weight, inputs.col(k), given.bias}, alone);
    for (Eigen::Index i = 0; i < alone.size(); ++i) {
      ASSERT_EQ(float_bits(results(i, k)), float_bits(alone[i]))
          << lanes << " lanes, " << alone.size();
    }
  }
}

TEST_F(ArithmeticTest, BatchedProductsHaveTheSameBits) {
  for (const auto& [rows, columns] : kSizes) {
    const Product given = product(rows, columns);
    expect_same_product<4, 4>(given);
    expect_same_product<8, 1>(given);
    expect_same_product<8, 4>(given);
  }
}

TEST_F(ArithmeticTest, TanhIsAccurate) {
  for (std::uint32_t word = 0; word < 0xff000000U; word += 9973) {
    const float value = from_float_bits(word);
    if (std::isnan(value)) continue;
    ASSERT_NEAR(rational_tanh(value), std::tanh(static_cast<double>(value)), 4e-7) << value;
  }
}

// Recorded on Debian 12, where the next tests compare with its Eigen 3.4.
TEST_F(ArithmeticTest, BitsAreTheSameEverywhere) {
  Hash products;
  for (const auto& [rows, columns] : kSizes) {
    const Product given = product(rows, columns);
    Eigen::VectorXf result = given.bias;
    add(given, result);
    for (Eigen::Index i = 0; i < rows; ++i) products.add(result[i]);
  }
  EXPECT_EQ(products.get(), 7626950780351435771U);
  Hash tangents;
  for (int i = 0; i < 100000; ++i) tangents.add(rational_tanh(10 * draw()));
  EXPECT_EQ(tangents.get(), 2235215069966023328U);
}

#if EIGEN_WORLD_VERSION == 3 && EIGEN_MAJOR_VERSION == 4 && !defined(EIGEN_VECTORIZE_FMA)

TEST_F(ArithmeticTest, ProductHasEigensBits) {
  for (const auto& [rows, columns] : kSizes) {
    const Product given = product(rows, columns);
    Eigen::VectorXf result = given.bias;
    add(given, result);
    Eigen::VectorXf eigens = given.bias;
    eigens.noalias() += given.weight * given.input;
    for (Eigen::Index i = 0; i < rows; ++i) {
      ASSERT_EQ(float_bits(result[i]), float_bits(eigens[i]))
          << rows << " x " << columns << ", " << i;
    }
  }
}

TEST_F(ArithmeticTest, TanhHasEigensBits) {
  for (std::uint32_t word = 0; word < 0xff000000U; word += 9973) {
    const float value = from_float_bits(word);
    if (std::isnan(value)) continue;
    const Eigen::Array4f eigens = Eigen::Array4f::Constant(value).tanh();
    ASSERT_EQ(float_bits(rational_tanh(value)), float_bits(eigens[0])) << value;
  }
}

#endif

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
        const Forward forward = network(activation, output, sizes);
        Scratch scratch(forward.network());
        constexpr std::size_t kRows = 5;
        const std::vector<double> observations(kRows * static_cast<std::size_t>(sizes.front()),
                                               0.3);
        std::vector<double> actions(kRows * static_cast<std::size_t>(sizes.back()));
        allocations = 0;
        is_counting = true;
        for (int i = 0; i < 10; ++i) {
          forward.act(observations.data(), i % 2 == 0 ? 1 : kRows, actions.data(), scratch);
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
