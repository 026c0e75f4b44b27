// Box2D's file with chunks of one page instead of four. There is a chunk at least for each of its
// sizes of blocks and all of it is written to, so four take half as much memory again for a walker.
#include <Box2D/Common/b2BlockAllocator.h>

#define b2_chunkSize 4096
#include <Box2D/Common/b2BlockAllocator.cpp>  // NOLINT(bugprone-suspicious-include)
