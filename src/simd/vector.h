// SIMD vectors with one number per lane: Vector<double, 4> holds one double of each of four
// instances, Vector<double, 1> is a double.
//
// This header is compiled once per instruction set. WALKER_SIM_INSTRUCTION_SET names the set and
// the inline namespace, so that the linker never merges code of different sets.
#pragma once

#include <limits>
#include <type_traits>
#include <utility>

#ifdef __SSE2__
#include <immintrin.h>
#endif

#ifndef WALKER_SIM_INSTRUCTION_SET
#error "WALKER_SIM_INSTRUCTION_SET must name the set of instructions that this is compiled for"
#endif

/// Without inlining, a lambda's arrays stay in memory and constants in its loops are not folded.
#define WALKER_SIM_INLINE __attribute__((always_inline))

namespace walker::simd {
inline namespace WALKER_SIM_INSTRUCTION_SET {

/// Calls function(0), ..., function(N - 1) with constant arguments, so that the compiler folds
/// elements of constant arrays.
template <typename Function, int... Indices>
WALKER_SIM_INLINE inline void call_with_each(const Function& function,
                                             std::integer_sequence<int, Indices...> /*indices*/) {
  (function(std::integral_constant<int, Indices>{}), ...);
}

template <int N, typename Function>
WALKER_SIM_INLINE inline void unrolled(const Function& function) {
  call_with_each(function, std::make_integer_sequence<int, N>{});
}

/// The same from N - 1 down to 0.
template <int N, typename Function>
WALKER_SIM_INLINE inline void unrolled_backwards(const Function& function) {
  unrolled<N>([&](auto i) WALKER_SIM_INLINE {
    function(std::integral_constant<int, N - 1 - decltype(i)::value>{});
  });
}

template <typename Scalar>
struct IntegerOf;
template <>
struct IntegerOf<double> {
  using Type = long long;
};
template <>
struct IntegerOf<float> {
  using Type = int;
};
/// Signed integer of the number's size.
template <typename Scalar>
using Integer = typename IntegerOf<Scalar>::Type;

/// The compiler's vector types.
template <typename Scalar, int W>
struct Native {          // GCC loses the attribute in a `using`
  typedef Scalar Number  // NOLINT(modernize-use-using)
      __attribute__((vector_size(sizeof(Scalar) * W)));
  typedef Integer<Scalar> Truth  // NOLINT(modernize-use-using)
      __attribute__((vector_size(sizeof(Scalar) * W)));
};

template <typename Scalar>
struct Native<Scalar, 1> {
  using Number = Scalar;
  using Truth = Integer<Scalar>;  // 0 or -1, as in a vector
};

/// One boolean per lane.
template <typename Scalar, int W>
struct Mask {
  using Truth = typename Native<Scalar, W>::Truth;

  WALKER_SIM_INLINE static Mask none() { return {Truth{}}; }
  /// Converts the result of comparing two numbers or vectors.
  template <typename Comparison>
  WALKER_SIM_INLINE static Mask of(Comparison comparison) {
    if constexpr (W == 1) {
      return {comparison ? Truth{-1} : Truth{0}};
    } else {
      return {reinterpret_cast<Truth>(comparison)};
    }
  }

  WALKER_SIM_INLINE friend Mask operator&(Mask a, Mask b) { return {a.truth & b.truth}; }
  WALKER_SIM_INLINE friend Mask operator|(Mask a, Mask b) { return {a.truth | b.truth}; }
  WALKER_SIM_INLINE friend Mask operator^(Mask a, Mask b) { return {a.truth ^ b.truth}; }
  WALKER_SIM_INLINE friend Mask operator~(Mask a) { return {~a.truth}; }

  Truth truth;
};

/// Bit i is set if lane i is true.
template <typename Scalar, int W>
WALKER_SIM_INLINE inline unsigned to_bits(Mask<Scalar, W> mask) {
  [[maybe_unused]] constexpr bool kIsFloat = std::is_same_v<Scalar, float>;
  if constexpr (W == 1) {
    return static_cast<unsigned>(mask.truth & 1);
#ifdef __SSE2__
  } else if constexpr (sizeof(mask) == 16) {
    if constexpr (kIsFloat) {
      return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(mask.truth)));
    } else {
      return static_cast<unsigned>(_mm_movemask_pd(reinterpret_cast<__m128d>(mask.truth)));
    }
#endif
#ifdef __AVX__
  } else if constexpr (sizeof(mask) == 32) {
    if constexpr (kIsFloat) {
      return static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<__m256>(mask.truth)));
    } else {
      return static_cast<unsigned>(_mm256_movemask_pd(reinterpret_cast<__m256d>(mask.truth)));
    }
#endif
#ifdef __AVX512DQ__
  } else if constexpr (sizeof(mask) == 64 && kIsFloat) {
    return static_cast<unsigned>(_mm512_movepi32_mask(reinterpret_cast<__m512i>(mask.truth)));
#endif
  } else {
    unsigned bits = 0;
    for (int lane = 0; lane < W; ++lane) bits |= (mask.truth[lane] != 0 ? 1U : 0U) << lane;
    return bits;
  }
}

template <typename Scalar, int W>
WALKER_SIM_INLINE inline bool any(Mask<Scalar, W> mask) {
  return to_bits(mask) != 0;
}

template <typename Scalar, int W>
struct Vector {
  using Number = typename Native<Scalar, W>::Number;

  Vector() = default;
  /// Broadcasts the value to all lanes.
  WALKER_SIM_INLINE Vector(Scalar value) {  // NOLINT(google-explicit-constructor): as a number
    if constexpr (W == 1) {
      number = value;
    } else {
      number = value - Number{};
    }
  }

  WALKER_SIM_INLINE static Vector of(Number number) {
    Vector vector;
    vector.number = number;
    return vector;
  }

  WALKER_SIM_INLINE Scalar operator[]([[maybe_unused]] int lane) const {
    if constexpr (W == 1) {
      return number;
    } else {
      return number[lane];
    }
  }

  WALKER_SIM_INLINE void set([[maybe_unused]] int lane, Scalar value) {
    if constexpr (W == 1) {
      number = value;
    } else {
      number[lane] = value;
    }
  }

  WALKER_SIM_INLINE Vector& operator+=(Vector b) { return *this = *this + b; }
  WALKER_SIM_INLINE Vector& operator-=(Vector b) { return *this = *this - b; }
  WALKER_SIM_INLINE Vector& operator*=(Vector b) { return *this = *this * b; }
  WALKER_SIM_INLINE Vector& operator/=(Vector b) { return *this = *this / b; }
  WALKER_SIM_INLINE friend Vector operator-(Vector a) { return of(-a.number); }
  WALKER_SIM_INLINE friend Vector operator+(Vector a, Vector b) { return of(a.number + b.number); }
  WALKER_SIM_INLINE friend Vector operator-(Vector a, Vector b) { return of(a.number - b.number); }
  WALKER_SIM_INLINE friend Vector operator*(Vector a, Vector b) { return of(a.number * b.number); }
  WALKER_SIM_INLINE friend Vector operator/(Vector a, Vector b) { return of(a.number / b.number); }
  WALKER_SIM_INLINE friend Mask<Scalar, W> operator<(Vector a, Vector b) {
    return Mask<Scalar, W>::of(a.number < b.number);
  }
  WALKER_SIM_INLINE friend Mask<Scalar, W> operator<=(Vector a, Vector b) {
    return Mask<Scalar, W>::of(a.number <= b.number);
  }
  WALKER_SIM_INLINE friend Mask<Scalar, W> operator>(Vector a, Vector b) { return b < a; }
  WALKER_SIM_INLINE friend Mask<Scalar, W> operator>=(Vector a, Vector b) { return b <= a; }

  Number number;
};

/// mask ? a : b in each lane.
template <typename Scalar, int W>
WALKER_SIM_INLINE inline Vector<Scalar, W> select(Mask<Scalar, W> mask, Vector<Scalar, W> a,
                                                  Vector<Scalar, W> b) {
  if constexpr (W == 1) {
    return mask.truth != 0 ? a : b;
  } else {
    return Vector<Scalar, W>::of(mask.truth ? a.number : b.number);
  }
}

template <typename Scalar, int W>
WALKER_SIM_INLINE inline Vector<Scalar, W> abs(Vector<Scalar, W> a) {
  return select(a < Vector<Scalar, W>(0), -a, a);
}

/// a < b ? a : b in each lane, also for signed zeros and NaN.
template <typename Scalar, int W>
WALKER_SIM_INLINE inline Vector<Scalar, W> min(Vector<Scalar, W> a, Vector<Scalar, W> b) {
  return select(a < b, a, b);
}

/// a > b ? a : b in each lane, likewise.
template <typename Scalar, int W>
WALKER_SIM_INLINE inline Vector<Scalar, W> max(Vector<Scalar, W> a, Vector<Scalar, W> b) {
  return select(a > b, a, b);
}

/// Correctly rounded, as IEEE 754 requires.
template <typename Scalar, int W>
WALKER_SIM_INLINE inline Vector<Scalar, W> sqrt(Vector<Scalar, W> a) {
  [[maybe_unused]] constexpr bool kIsFloat = std::is_same_v<Scalar, float>;
#ifdef __SSE2__
  if constexpr (sizeof(a) == 16) {
    if constexpr (kIsFloat) {
      return Vector<Scalar, W>::of(_mm_sqrt_ps(a.number));
    } else {
      return Vector<Scalar, W>::of(_mm_sqrt_pd(a.number));
    }
  }
#endif
#ifdef __AVX__
  if constexpr (sizeof(a) == 32) {
    if constexpr (kIsFloat) {
      return Vector<Scalar, W>::of(_mm256_sqrt_ps(a.number));
    } else {
      return Vector<Scalar, W>::of(_mm256_sqrt_pd(a.number));
    }
  }
#endif
#ifdef __AVX512F__
  if constexpr (sizeof(a) == 64 && kIsFloat) {
    // GCC 12 warns that the unmasked intrinsic reads an uninitialised value.
    return Vector<Scalar, W>::of(_mm512_maskz_sqrt_ps(0xFFFF, a.number));
  }
#endif
  Vector<Scalar, W> root;
  for (int lane = 0; lane < W; ++lane) {
    if constexpr (kIsFloat) {
      root.set(lane, __builtin_sqrtf(a[lane]));
    } else {
      root.set(lane, __builtin_sqrt(a[lane]));
    }
  }
  return root;
}

template <typename Scalar, int W>
WALKER_SIM_INLINE inline typename Mask<Scalar, W>::Truth bits_of(Vector<Scalar, W> a) {
  typename Mask<Scalar, W>::Truth bits;
  __builtin_memcpy(&bits, &a, sizeof bits);
  return bits;
}

template <typename Scalar>
constexpr Integer<Scalar> kAllButSign = std::numeric_limits<Integer<Scalar>>::max();

/// Whether the magnitude is above the limit, or the number is NaN. Compares bits, because under
/// -ffinite-math-only the compiler may assume that there is no NaN.
template <typename Scalar, int W>
WALKER_SIM_INLINE inline Mask<Scalar, W> exceeds(Vector<Scalar, W> a, Scalar limit) {
  const Integer<Scalar> limit_bits = bits_of(Vector<Scalar, 1>(limit));
  return Mask<Scalar, W>::of((bits_of(a) & kAllButSign<Scalar>) > limit_bits);
}

/// Whether the number is 0 or -0.
template <typename Scalar, int W>
WALKER_SIM_INLINE inline Mask<Scalar, W> is_zero(Vector<Scalar, W> a) {
  return Mask<Scalar, W>::of((bits_of(a) & kAllButSign<Scalar>) == 0);
}

/// Whether all bits are equal: 0 differs from -0.
template <typename Scalar, int W>
WALKER_SIM_INLINE inline Mask<Scalar, W> is_same(Vector<Scalar, W> a, Vector<Scalar, W> b) {
  return Mask<Scalar, W>::of(bits_of(a) == bits_of(b));
}

/// W doubles in two vectors.
template <int W>
struct Halves {
  Vector<double, W / 2> low, high;
};

template <int W>
WALKER_SIM_INLINE inline Halves<W> to_double(Vector<float, W> a) {
  typedef float Half __attribute__((vector_size(2 * W)));  // NOLINT(modernize-use-using)
  Half halves[2];
  __builtin_memcpy(halves, &a, sizeof a);
  using Number = typename Native<double, W / 2>::Number;
  return {Vector<double, W / 2>::of(__builtin_convertvector(halves[0], Number)),
          Vector<double, W / 2>::of(__builtin_convertvector(halves[1], Number))};
}

template <int W>
WALKER_SIM_INLINE inline Vector<float, W> to_float(Halves<W> a) {
  typedef float Half __attribute__((vector_size(2 * W)));  // NOLINT(modernize-use-using)
  const Half halves[2] = {__builtin_convertvector(a.low.number, Half),
                          __builtin_convertvector(a.high.number, Half)};
  Vector<float, W> numbers;
  __builtin_memcpy(&numbers, halves, sizeof numbers);
  return numbers;
}

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::simd
