// A number per lane: Vector<4> holds one double of each of four worlds, Vector<1> is a double.
//
// Compiled once for each set of instructions, as WALKER_SIM_INSTRUCTION_SET says, which names the
// namespace too: two translation units never share code, however the linker chooses.
#pragma once

#include <type_traits>
#include <utility>

#ifdef __SSE2__
#include <immintrin.h>
#endif

#ifndef WALKER_SIM_INSTRUCTION_SET
#error "WALKER_SIM_INSTRUCTION_SET must name the set of instructions that this is compiled for"
#endif

/// Without this a lambda's arrays stay in memory, and the constants in its loops are not folded.
#define WALKER_SIM_INLINE __attribute__((always_inline))

namespace walker::simd {
inline namespace WALKER_SIM_INSTRUCTION_SET {

/// Calls function(0), ..., function(N - 1), each with a constant, so that what the index selects of
/// constant arrays is folded into the code.
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

/// The compiler's own vectors.
template <int W>
struct Native {  // not by `using`, where GCC loses the attribute
  typedef double Number __attribute__((vector_size(8 * W)));    // NOLINT(modernize-use-using)
  typedef long long Truth __attribute__((vector_size(8 * W)));  // NOLINT(modernize-use-using)
};

template <>
struct Native<1> {
  using Number = double;
  using Truth = long long;  // 0 or -1, as in a vector
};

/// Yes or no per lane.
template <int W>
struct Mask {
  using Truth = typename Native<W>::Truth;

  WALKER_SIM_INLINE friend Mask operator&(Mask a, Mask b) { return {a.truth & b.truth}; }
  WALKER_SIM_INLINE friend Mask operator|(Mask a, Mask b) { return {a.truth | b.truth}; }
  WALKER_SIM_INLINE friend Mask operator^(Mask a, Mask b) { return {a.truth ^ b.truth}; }
  WALKER_SIM_INLINE friend Mask operator~(Mask a) { return {~a.truth}; }

  Truth truth;
};

template <int W>
WALKER_SIM_INLINE inline Mask<W> no_lane() {
  return {typename Mask<W>::Truth{}};
}

/// Bit i is lane i's.
template <int W>
WALKER_SIM_INLINE inline unsigned to_bits(Mask<W> mask) {
  if constexpr (W == 1) {
    return static_cast<unsigned>(mask.truth & 1);
#ifdef __SSE2__
  } else if constexpr (W == 2) {
    return static_cast<unsigned>(_mm_movemask_pd(reinterpret_cast<__m128d>(mask.truth)));
#endif
#ifdef __AVX__
  } else if constexpr (W == 4) {
    return static_cast<unsigned>(_mm256_movemask_pd(reinterpret_cast<__m256d>(mask.truth)));
#endif
  } else {
    unsigned bits = 0;
    for (int lane = 0; lane < W; ++lane) bits |= (mask.truth[lane] != 0 ? 1U : 0U) << lane;
    return bits;
  }
}

template <int W>
WALKER_SIM_INLINE inline bool any(Mask<W> mask) {
  return to_bits(mask) != 0;
}

template <int W>
struct Vector {
  using Number = typename Native<W>::Number;

  Vector() = default;
  /// The same in each lane.
  WALKER_SIM_INLINE Vector(double value) {  // NOLINT(google-explicit-constructor): as a number
    if constexpr (W == 1) {
      number = value;
    } else {
      number = Number{} + value;
    }
  }

  WALKER_SIM_INLINE static Vector of(Number number) {
    Vector vector;
    vector.number = number;
    return vector;
  }

  WALKER_SIM_INLINE double operator[]([[maybe_unused]] int lane) const {
    if constexpr (W == 1) {
      return number;
    } else {
      return number[lane];
    }
  }

  WALKER_SIM_INLINE void set([[maybe_unused]] int lane, double value) {
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
  WALKER_SIM_INLINE friend Mask<W> operator<(Vector a, Vector b) {
    if constexpr (W == 1) {
      return {a.number < b.number ? -1LL : 0LL};
    } else {
      return {a.number < b.number};
    }
  }
  WALKER_SIM_INLINE friend Mask<W> operator>(Vector a, Vector b) { return b < a; }

  Number number;
};

/// a where the mask says yes, else b.
template <int W>
WALKER_SIM_INLINE inline Vector<W> select(Mask<W> mask, Vector<W> a, Vector<W> b) {
  if constexpr (W == 1) {
    return mask.truth != 0 ? a : b;
  } else {
    return Vector<W>::of(mask.truth ? a.number : b.number);
  }
}

template <int W>
WALKER_SIM_INLINE inline Vector<W> abs(Vector<W> a) {
  return select(a < Vector<W>(0.0), -a, a);
}

/// Correctly rounded, as IEEE 754 asks for.
template <int W>
WALKER_SIM_INLINE inline Vector<W> sqrt(Vector<W> a) {
  if constexpr (W == 1) {
    return __builtin_sqrt(a.number);
#ifdef __SSE2__
  } else if constexpr (W == 2) {
    return Vector<W>::of(_mm_sqrt_pd(a.number));
#endif
#ifdef __AVX__
  } else if constexpr (W == 4) {
    return Vector<W>::of(_mm256_sqrt_pd(a.number));
#endif
  } else {
    Vector<W> root;
    for (int lane = 0; lane < W; ++lane) root.set(lane, __builtin_sqrt(a[lane]));
    return root;
  }
}

/// Whether the magnitude is above the limit, or this is no number. By its bits, for under
/// -ffinite-math-only comparisons may take it that there are no such numbers.
template <int W>
WALKER_SIM_INLINE inline Mask<W> exceeds(Vector<W> a, double limit) {
  typename Mask<W>::Truth bits;
  long long limit_bits = 0;
  __builtin_memcpy(&bits, &a, sizeof bits);
  __builtin_memcpy(&limit_bits, &limit, sizeof limit_bits);
  bits = bits & 0x7fffffffffffffffLL;
  if constexpr (W == 1) {
    return {bits > limit_bits ? -1LL : 0LL};
  } else {
    return {bits > limit_bits};
  }
}

/// Whether it is 0 or -0.
template <int W>
WALKER_SIM_INLINE inline Mask<W> is_zero(Vector<W> a) {
  typename Mask<W>::Truth bits;
  __builtin_memcpy(&bits, &a, sizeof bits);
  bits = bits & 0x7fffffffffffffffLL;
  if constexpr (W == 1) {
    return {bits == 0 ? -1LL : 0LL};
  } else {
    return {bits == 0};
  }
}

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::simd
