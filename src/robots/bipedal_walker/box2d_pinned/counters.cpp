// Removes the process-wide counters, which all threads would write and nothing reads, from the two
// Box2D files that have them. Where Box2D defines a counter, `int32 discarded(int32())` declares a
// function; where Box2D increments it, the macro is a call that returns a temporary.
#include <Box2D/Collision/b2Distance.h>
#include <Box2D/Collision/b2TimeOfImpact.h>

/// Returns the temporary as an lvalue, valid until the end of the full expression.
template <class Number>
Number& discarded(Number&& place) {
  return place;
}

#define b2_gjkCalls discarded(int32())
#define b2_gjkIters discarded(int32())
#define b2_gjkMaxIters discarded(int32())
#include <Box2D/Collision/b2Distance.cpp>  // NOLINT(bugprone-suspicious-include)

#define b2_toiTime discarded(float32())
#define b2_toiMaxTime discarded(float32())
#define b2_toiCalls discarded(int32())
#define b2_toiIters discarded(int32())
#define b2_toiMaxIters discarded(int32())
#define b2_toiRootIters discarded(int32())
#define b2_toiMaxRootIters discarded(int32())
#include <Box2D/Collision/b2TimeOfImpact.cpp>  // NOLINT(bugprone-suspicious-include)
