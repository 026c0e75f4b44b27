// Friction between the floor and each limb, in which the models of Walker2d-v4 and v5 differ.
#pragma once

#include <array>
#include <cstddef>

namespace walker::walker2d {

/// Contact parameters per limb, in the order of bodies.
struct Ground {
  static constexpr std::size_t kLimbs = 7;
  std::array<double, kLimbs> friction{};
  std::array<double, kLimbs> diagonal{};  ///< MuJoCo's diagApprox of a contact's rows
};

}  // namespace walker::walker2d
