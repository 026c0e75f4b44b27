// A program of many files of gtests runs one of them: as each file has a process of its own, no
// test depends on those of another file.
#pragma once

#include <gtest/gtest.h>

#include <iostream>
#include <string>
#include <string_view>

namespace walker::test {

/// Whether a test stands in the file of this name, in whatever folder.
inline bool stands_in(const testing::TestInfo& test, std::string_view name) {
  const std::string path = test.file();
  const std::string end = '/' + std::string(name);
  return path.size() > end.size() && path.compare(path.size() - end.size(), end.size(), end) == 0;
}

/// GoogleTest's filter for the tests in a file; empty where there is none.
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

/// Reads what GoogleTest and ROS have left of the arguments: nothing, for all tests, or
/// --file=NAME.
/// @return whether there is something to run; the reason why not is on stderr
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
