// main() of the unit tests. --file=NAME runs only the tests of the source file NAME.
#include <gtest/gtest.h>

#include "test_file.h"

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (!walker::test::choose_file(argc, argv)) return 2;
  return RUN_ALL_TESTS();
}
