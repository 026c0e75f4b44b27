// Parameters as text. The first byte selects an environment or its camera; a line is NAME=VALUE.
#include "base/parameter_text.h"

#include <sstream>
#include <stdexcept>

#include "fuzz/input.h"
#include "fuzz/target.h"
#include "walker_sim/registry.h"

namespace walker::fuzz {
namespace {

const std::vector<std::vector<ParameterDescription>>& all_descriptions() {
  static const std::vector<std::vector<ParameterDescription>> kAll = [] {
    std::vector<std::vector<ParameterDescription>> all;
    for (const Registration& registration : registrations()) {
      all.push_back(parameter_descriptions(registration.id));
      all.push_back(camera_parameter_descriptions(registration.id));
    }
    return all;
  }();
  return kAll;
}

void run(const std::uint8_t* data, std::size_t size) {
  Input input(data, size);
  const auto which = input.number<std::uint8_t>();
  const auto& descriptions = all_descriptions()[which % all_descriptions().size()];
  std::vector<std::string> lines;
  std::istringstream text(input.rest());
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  try {
    const Parameters complete =
        complete_parameters(descriptions, parse_assignments(descriptions, lines));
    std::vector<std::string> written;
    for (const auto& [name, value] : complete) written.push_back(name + "=" + to_string(value));
    require(complete_parameters(descriptions, parse_assignments(descriptions, written)) == complete,
            "parameters read back as they are written");
  } catch (const std::invalid_argument& refusal) {
    accept(refusal);
  }
}

const Registered kTarget("parameter_text", run);

}  // namespace
}  // namespace walker::fuzz
