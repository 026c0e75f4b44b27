#include "robots/bipedal_walker/world_state.h"

#include <stdexcept>

namespace walker::bipedal_walker {
namespace {

[[noreturn]] void refuse() { throw std::logic_error("this Box2D's worlds cannot be saved"); }

}  // namespace

bool WorldState::can_be_saved() { return false; }

void WorldState::save(const Physics& /*physics*/, StateWriter& /*writer*/) { refuse(); }

WorldState WorldState::read(StateReader& /*reader*/, const Terrain& /*terrain*/) { refuse(); }

void WorldState::put_into(Physics& /*physics*/) const { refuse(); }

}  // namespace walker::bipedal_walker
