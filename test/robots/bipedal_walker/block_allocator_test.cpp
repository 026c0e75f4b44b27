// The replacement of Box2D's block allocator.
#include <Box2D/Common/b2BlockAllocator.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <random>
#include <vector>

namespace walker::bipedal_walker {
namespace {

constexpr int kMax = 2 * b2_maxBlockSize;  // sizes above b2_maxBlockSize come from the heap

struct Block {
  unsigned char* bytes;
  int size;
  unsigned char mark;  // value of every byte
};

/// Allocates a block of each size up to kMax, in random order, and checks pointer alignment.
std::vector<Block> take_all_sizes(b2BlockAllocator& allocator, unsigned seed) {
  std::vector<int> sizes(kMax);
  std::iota(sizes.begin(), sizes.end(), 1);
  std::shuffle(sizes.begin(), sizes.end(), std::mt19937(seed));
  std::vector<Block> blocks;
  for (const int size : sizes) {
    auto* bytes = static_cast<unsigned char*>(allocator.Allocate(size));
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(bytes) % alignof(void*), 0U) << size;
    const auto mark = static_cast<unsigned char>(blocks.size() + seed);
    std::memset(bytes, mark, static_cast<std::size_t>(size));
    blocks.push_back({bytes, size, mark});
  }
  return blocks;
}

void expect_marks(const std::vector<Block>& blocks) {
  for (const Block& block : blocks) {
    EXPECT_TRUE(std::all_of(block.bytes, block.bytes + block.size,
                            [&](unsigned char byte) { return byte == block.mark; }))
        << block.size << " bytes";
  }
}

TEST(BlockAllocator, BlocksOfAllSizesAreApart) {
  b2BlockAllocator allocator;
  const std::vector<Block> first = take_all_sizes(allocator, 1);
  const std::vector<Block> second = take_all_sizes(allocator, 2);
  expect_marks(first);
  for (const Block& block : first) allocator.Free(block.bytes, block.size);
  const std::vector<Block> third = take_all_sizes(allocator, 3);
  expect_marks(second);
  expect_marks(third);
  for (const Block& block : second) allocator.Free(block.bytes, block.size);
  for (const Block& block : third) allocator.Free(block.bytes, block.size);
  EXPECT_EQ(allocator.Allocate(0), nullptr);
}

TEST(BlockAllocator, AFreeBlockIsTheNextOfItsSize) {
  b2BlockAllocator allocator;
  for (const int size : {1, 32, 184, 288, b2_maxBlockSize}) {
    void* one = allocator.Allocate(size);
    void* other = allocator.Allocate(size);
    allocator.Free(one, size);
    allocator.Free(other, size);
    EXPECT_EQ(allocator.Allocate(size), other) << size;
    EXPECT_EQ(allocator.Allocate(size), one) << size;
  }
}

}  // namespace
}  // namespace walker::bipedal_walker
