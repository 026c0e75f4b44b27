// Command-line options of the benchmark programs.
#pragma once

#include <map>
#include <set>
#include <stdexcept>
#include <string>

namespace walker::bench {

/// Parses options of the form `--name value`. All are required.
class Arguments {
 public:
  /// @param needed option names without the dashes
  /// @throws std::invalid_argument naming the option that is missing, unknown or without a value
  Arguments(char** begin, char** end, const std::set<std::string>& needed) {
    for (char** argument = begin; argument < end; argument += 2) {
      const std::string option = *argument;
      const std::string name = option.rfind("--", 0) == 0 ? option.substr(2) : "";
      if (needed.count(name) == 0) throw std::invalid_argument(option + ": unknown option");
      if (argument + 1 == end) throw std::invalid_argument(option + ": needs a value");
      values_[name] = argument[1];
    }
    for (const std::string& name : needed) {
      if (values_.count(name) == 0) throw std::invalid_argument("--" + name + ": is missing");
    }
  }

  const std::string& text(const std::string& name) const { return values_.at(name); }

  /// @throws std::invalid_argument unless the value is a number
  double number(const std::string& name) const {
    std::size_t used = 0;
    double number = 0;
    try {
      number = std::stod(text(name), &used);
    } catch (const std::exception&) {
      used = 0;
    }
    if (used == 0 || used != text(name).size()) {
      throw std::invalid_argument("--" + name + " = " + text(name) + "; must be a number");
    }
    return number;
  }

 private:
  std::map<std::string, std::string> values_;
};

}  // namespace walker::bench
