// libFuzzer's entry point: runs the program's only target.
#include "fuzz/target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  walker::fuzz::targets().front().run(data, size);
  return 0;
}
