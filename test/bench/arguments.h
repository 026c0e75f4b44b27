// Command-line options of the benchmark programs.
#pragma once

#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

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

  /// @throws std::invalid_argument unless the value consists of comma-separated numbers
  std::vector<double> numbers(const std::string& name) const {
    std::vector<double> numbers;
    std::istringstream stream(text(name));
    char comma = ',';
    for (double number = 0; comma == ',' && stream >> number; stream >> comma) {
      numbers.push_back(number);
      comma = 0;
    }
    if (numbers.empty() || !stream.eof()) {
      throw std::invalid_argument("--" + name + " = " + text(name) + ": must be numbers");
    }
    return numbers;
  }

  double number(const std::string& name) const { return numbers(name).front(); }

 private:
  std::map<std::string, std::string> values_;
};

}  // namespace walker::bench
