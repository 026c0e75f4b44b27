#include "base/shared_library.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "error_message.h"

namespace walker {
namespace {

constexpr const char* kMathematics = "libm.so.6";

TEST(SharedLibraryTest, FindsFunctions) {
  const SharedLibrary library(kMathematics, "libc6");
  double (*const floor)(double) = library.function("floor");
  EXPECT_EQ(floor(-1.5), -2);
}

TEST(SharedLibraryTest, NamesAMissingLibraryAndItsPackage) {
  const std::string message = message_of<std::runtime_error>(
      [] { const SharedLibrary library("libnowhere.so.7", "libnowhere7"); });
  EXPECT_EQ(message.find("libnowhere.so.7 cannot be loaded ("), 0U) << message;
  EXPECT_NE(message.find("; install the package libnowhere7"), std::string::npos) << message;
}

TEST(SharedLibraryTest, NamesAMissingFunction) {
  const SharedLibrary library(kMathematics, "libc6");
  const std::string message =
      message_of<std::runtime_error>([&library] { library.function("square_circle"); });
  EXPECT_EQ(message, "libm.so.6 has no function square_circle");
}

}  // namespace
}  // namespace walker
