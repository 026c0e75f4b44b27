// Runs the tests of one source file of a GoogleTest program. Each file runs in its own process, so
// no test depends on the tests of another file.
#pragma once

#include <gtest/gtest.h>

#include <iostream>
#include <string>
#include <string_view>

namespace walker::test {

inline bool stands_in(const testing::TestInfo& test, std::string_view name) {
  const std::string path = test.file();
  const std::string end = '/' + std::string(name);
  return path.size() > end.size() && path.compare(path.size() - end.size(), end.size(), end) == 0;
}

/// Returns GoogleTest's filter for the tests of a file; empty if it has none.
inline std::string filter_of(std::string_view name) {
  std::string filter;
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  for (int i = 0; i < all.total_test_suite_count(); ++i) {
    const testing::TestSuite& suite = *all.GetTestSuite(i);
    for (int k = 0; k < suite.total_test_count(); ++k) {
      const testing::TestInfo& test = *suite.GetTestInfo(k);
      if (!stands_in(test, name)) continue;
      filter += (filter.empty() ? "" : ":") + std::string(suite.name()) + '.' + test.name();
    }
  }
  return filter;
}

/// Parses the arguments that GoogleTest and ROS have left: none (run all tests) or --file=NAME.
/// @return whether there are tests to run; if not, prints the reason to stderr
inline bool choose_file(int argc, char** argv) {
  constexpr std::string_view kOption = "--file=";
  if (argc == 1) return true;
  const std::string_view argument = argv[1];
  if (argc != 2 || argument.substr(0, kOption.size()) != kOption) {
    std::cerr << argv[0] << ": " << argument << ": takes " << kOption
              << "NAME and the options of GoogleTest alone\n";
    return false;
  }
  const std::string filter = filter_of(argument.substr(kOption.size()));
  if (filter.empty()) {
    std::cerr << argv[0] << ": " << argument << ": none of its tests stands there\n";
    return false;
  }
  testing::GTEST_FLAG(filter) = filter;
  return true;
}

}  // namespace walker::test
