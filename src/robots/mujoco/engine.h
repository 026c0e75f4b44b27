// MuJoCo's header, and what its C functions need in C++.
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

/// A row of one of MuJoCo's arrays, such as the 3 coordinates of a position.
template <typename T>
const T* at(const T* array, int index, int width) {
  return array + static_cast<std::ptrdiff_t>(index) * width;
}

}  // namespace walker::mujoco
