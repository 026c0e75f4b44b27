// MuJoCo's header, with smart pointers for its objects.
#pragma once

#include <mujoco/mujoco.h>

#include <cstddef>
#include <memory>

namespace walker::mujoco {

struct DeleteData {
  void operator()(mjData* data) const { mj_deleteData(data); }
};

using ModelPointer = std::shared_ptr<const mjModel>;
using DataPointer = std::unique_ptr<mjData, DeleteData>;

/// Returns a row of a MuJoCo array, such as the 3 coordinates of a position.
template <typename T>
const T* at(const T* array, int index, int width) {
  return array + static_cast<std::ptrdiff_t>(index) * width;
}

}  // namespace walker::mujoco
