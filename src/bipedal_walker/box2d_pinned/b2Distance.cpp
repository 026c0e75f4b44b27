// Box2D's file without its process-wide counters. Where they are defined, `int32
// discarded(int32())` declares a function; where they are counted, it is a call that gives a number
// to throw away.
#include <Box2D/Collision/b2Distance.h>

#include "bipedal_walker/box2d_pinned/discarded.h"

#define b2_gjkCalls discarded(int32())
#define b2_gjkIters discarded(int32())
#define b2_gjkMaxIters discarded(int32())
#include <Box2D/Collision/b2Distance.cpp>  // NOLINT(bugprone-suspicious-include)
