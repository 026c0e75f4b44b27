// A Walker2d model whose stack overflows at some resets, depending on the seed.
#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

#include "robots/mujoco/model_file.h"
#include "stepper.h"
#include "walker_sim/registry.h"

namespace walker {

/// Makes environments whose MuJoCo stack suffices for a standing walker but not for one lying on
/// its back. The seed decides the posture.
class CrampedWalker {
 public:
  CrampedWalker() {
    const std::string text = mujoco::replaced(mujoco::builtin_text("walker2d_v5.xml"),
                                              "nstack=\"8000\"", "nstack=\"520\"");
    parameters_ = {{"xml_file", folder_.write("cramped.xml", text)},
                   {"terminate_when_unhealthy", false},
                   {"reset_noise_scale", 3.0},
                   {"max_episode_steps", std::int64_t{20}}};
  }

  std::unique_ptr<Environment> operator()() const { return make("Walker2d-v5", parameters_); }

  /// Returns the first seed >= `from` whose reset succeeds (or fails, if `succeeds` is false).
  std::uint64_t seed(bool succeeds, std::uint64_t from = 0) const {
    Stepper walker((*this)());
    for (std::uint64_t seed = from;; ++seed) {
      bool has_succeeded = true;
      try {
        walker.reset(seed);
      } catch (const std::runtime_error&) {
        has_succeeded = false;
      }
      if (has_succeeded == succeeds) return seed;
    }
  }
  std::uint64_t good_seed(std::uint64_t from = 0) const { return seed(true, from); }
  std::uint64_t bad_seed(std::uint64_t from = 0) const { return seed(false, from); }

 private:
  Folder folder_;
  Parameters parameters_;
};

}  // namespace walker
