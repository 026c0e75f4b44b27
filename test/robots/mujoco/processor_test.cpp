// check_processor, and the name of the C library's variant in the engine version.
#include <gtest/gtest.h>

#include <cstddef>
#include <regex>
#include <stdexcept>
#include <vector>

#include "base/engine_release.h"
#include "episode/saved_state.h"
#include "error_message.h"
#include "robots/mujoco/processor.h"
#include "walker_sim/registry.h"

namespace walker::mujoco {
namespace {

// test/robots/mujoco/no_avx_test.py covers an emulated processor without AVX.
TEST(Processor, RejectsAProcessorWithoutAvx) {
  EXPECT_EQ(message_of<std::runtime_error>([] {
              check_processor(false);
            }).rfind("MuJoCo's library needs a processor with AVX", 0),
            0U);
  EXPECT_NO_THROW(check_processor(true));
  EXPECT_NO_THROW(check_processor());
}

TEST(Libm, IsPartOfTheEngineVersion) {
  for (const Registration& registration : registrations()) {
    const auto walker = make(registration.id);
    const Specification& specification = walker->specification();
    EXPECT_EQ(libm_of(specification.engine_version),
              specification.engine == "MuJoCo" ? libm_variant() : "")
        << registration.id;
  }
  EXPECT_TRUE(std::regex_match(libm_variant(), std::regex("fma|no fma|[0-9a-f]{16}")));
}

TEST(Libm, DoesNotAffectSavedStates) {
  Specification specification = make("Walker2d-v5")->specification();
  std::vector<std::byte> state;
  const std::size_t begin = StateOrigin(specification).begin(state);
  StateOrigin::seal(state, begin);
  specification.engine_version =
      engine_release(specification.engine_version) + kLibm + "another" + kSteppedBy + "hand";
  EXPECT_NO_THROW(StateOrigin(specification).open(state.data(), state.size()));
  specification.engine_version = "9" + specification.engine_version;
  EXPECT_THROW(StateOrigin(specification).open(state.data(), state.size()), std::invalid_argument);
}

}  // namespace
}  // namespace walker::mujoco
