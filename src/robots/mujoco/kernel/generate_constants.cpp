// Writes the constants of a robot's compiled model as a C++ header:
// generate_constants MODEL.xml ROBOT HEADER.h
#include <mujoco/mujoco.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>

#include "robots/mujoco/kernel/model_fields.h"

namespace {

/// Formats the exact value, in hexadecimal.
std::string to_code(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%a", value);
  return text.data();
}

std::string to_code(int value) { return std::to_string(value); }

template <typename T, typename Source>
void write_array(std::ostream& header, const char* type, const char* name, const Source* values,
                 int rows, int columns) {
  header << "inline constexpr " << type << ' ' << name << '[' << rows << ']';
  if (columns > 1) header << '[' << columns << ']';
  header << " = {";
  for (int row = 0; row < rows; ++row) {
    header << (row > 0 ? ", " : "") << (columns > 1 ? "{" : "");
    for (int column = 0; column < columns; ++column) {
      header << (column > 0 ? ", " : "") << to_code(static_cast<T>(values[row * columns + column]));
    }
    header << (columns > 1 ? "}" : "");
  }
  header << "};\n";
}

void write(const mjModel& model, const std::string& source, const std::string& robot,
           std::ostream& header) {
  const std::string space = "walker::mujoco::kernel::" + robot + "::model";
  header << "// Constants of " << source << ", as MuJoCo " << mj_versionString()
         << " compiles it; generated. The names are mjModel's.\n#pragma once\n\n"
         << "namespace " << space << " {\n\n";
#define WRITE_COUNT(name) header << "inline constexpr int " #name " = " << model.name << ";\n";
  WALKER_SIM_MODEL_COUNTS(WRITE_COUNT)
  WALKER_SIM_MODEL_BUFFERS(WRITE_COUNT)
#define WRITE_NUMBER(type, part, name)                                                      \
  header << "inline constexpr " #type " " #part "_" #name " = " << to_code(model.part.name) \
         << ";\n";
  WALKER_SIM_MODEL_NUMBERS(WRITE_NUMBER)
  write_array<double>(header, "double", "opt_gravity", model.opt.gravity, 3, 1);
  write_array<double>(header, "double", "opt_wind", model.opt.wind, 3, 1);
#define WRITE_ARRAY(type, name, rows, columns) \
  write_array<type>(header, #type, #name, model.name, model.rows, columns);
  WALKER_SIM_MODEL_ARRAYS(WRITE_ARRAY)
  header << "\n}  // namespace " << space << '\n';
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 4) {
    std::cerr << "usage: generate_constants MODEL.xml ROBOT HEADER.h\n";
    return EXIT_FAILURE;
  }
  std::array<char, 1000> message{};
  const std::string file = arguments[1];
  mjModel* const model = mj_loadXML(file.c_str(), nullptr, message.data(), message.size());
  if (model == nullptr) {
    std::cerr << file << ": " << message.data() << '\n';
    return EXIT_FAILURE;
  }
  std::ofstream header(arguments[3]);
  write(*model, file.substr(file.rfind('/') + 1), arguments[2], header);
  mj_deleteModel(model);
  header.close();
  if (!header) {
    std::cerr << arguments[3] << ": could not be written\n";
    return EXIT_FAILURE;
  }
}
