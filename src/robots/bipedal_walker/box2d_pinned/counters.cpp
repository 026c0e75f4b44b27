// Box2D's two files with process-wide counters, without these: all threads would write them, and
// nobody reads them. Where they are defined, `int32 discarded(int32())` declares a function; where
// they are counted, it is a call that gives a number to throw away.
#include <Box2D/Collision/b2Distance.h>
#include <Box2D/Collision/b2TimeOfImpact.h>

/// A place that lasts until the end of the expression.
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
