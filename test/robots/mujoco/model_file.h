// Model files for tests, made from the texts of the built-in models, and a fixture for them.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <stdexcept>
#include <string>

#include "robots/mujoco/model.h"
#include "temporary_folder.h"

namespace walker::mujoco {

inline std::string builtin_text(const std::string& name) { return builtin_models().at(name); }

/// Replaces every `from` by `to`. At least one must exist, so that no test runs an unchanged model.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  std::size_t place = text.find(from);
  if (place == std::string::npos) throw std::out_of_range(from + ": is not in the text");
  for (; place != std::string::npos; place = text.find(from, place + to.size())) {
    text.replace(place, from.size(), to);
  }
  return text;
}

/// Removes the first range from `begin` through `end`.
inline std::string without(std::string text, const std::string& begin, const std::string& end) {
  const std::size_t first = text.find(begin);
  const std::size_t last = text.find(end, first);
  if (last == std::string::npos) throw std::out_of_range(begin + ": is not in the text");
  return text.erase(first, last + end.size() - first);
}

/// Text of a built-in model without contact pairs and with MuJoCo's default buffer sizes.
inline std::string stock_text(const std::string& name) {
  std::string text = builtin_text(name);
  text = replaced(text, " collision=\"predefined\"", "");
  text = without(text, "<size", "/>");
  text = without(text, "<contact>", "</contact>");
  return without(text, "<pair", "/>");
}

/// Tests of models, in an empty working directory, because MuJoCo writes its log file there. Fails
/// if anything is printed or logged.
class QuietTest : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::current_path(elsewhere_.path());
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
  }

  void TearDown() override {
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_TRUE(std::filesystem::is_empty(elsewhere_.path()));
    std::filesystem::current_path(home_);
  }

  Folder folder_;

 private:
  Folder elsewhere_;
  std::filesystem::path home_ = std::filesystem::current_path();
};

}  // namespace walker::mujoco
