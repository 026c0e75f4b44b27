// Box2D's file without its process-wide counters; b2Distance.cpp says how.
#include <Box2D/Collision/b2TimeOfImpact.h>

#include "bipedal_walker/box2d_pinned/discarded.h"

#define b2_toiTime discarded(float32())
#define b2_toiMaxTime discarded(float32())
#define b2_toiCalls discarded(int32())
#define b2_toiIters discarded(int32())
#define b2_toiMaxIters discarded(int32())
#define b2_toiRootIters discarded(int32())
#define b2_toiMaxRootIters discarded(int32())
#include <Box2D/Collision/b2TimeOfImpact.cpp>  // NOLINT(bugprone-suspicious-include)
