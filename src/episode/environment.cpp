#include "walker_sim/environment.h"

namespace walker {
namespace {

[[noreturn]] void refuse_to_save(const Specification& specification) {
  throw std::logic_error("the state of " + specification.id + " on " + specification.engine + " " +
                         specification.engine_version +
                         " cannot be saved; its episode can only be repeated");
}

}  // namespace

void Environment::step_together(StepCall* const* calls, std::size_t count,
                                std::size_t size) noexcept {
  for (StepCall* const* call = calls; call != calls + count; ++call) {
    try {
      (*call)->environment->step((*call)->action, size, *(*call)->result);
    } catch (...) {
      (*call)->failure = std::current_exception();
    }
  }
}

void Environment::save_state(const Result& /*last*/, std::vector<std::byte>& /*state*/) const {
  refuse_to_save(specification());
}

Progress Environment::load_state(const std::byte* /*state*/, std::size_t /*size*/,
                                 Result* /*last*/) {
  refuse_to_save(specification());
}

void Environment::set_coordinates(const std::vector<double>& /*position*/,
                                  const std::vector<double>& /*velocity*/, Result& /*result*/) {
  throw std::logic_error(specification().id +
                         " has no positions and velocities that can be set; load a saved state");
}

}  // namespace walker
