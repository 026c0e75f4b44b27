#include "bipedal_walker/body_list.h"

namespace walker::bipedal_walker {

ShortBodyList::ShortBodyList(b2World& world, b2Body& last) : world_(world), last_(last) {}

// The header leaves it to the files.
ShortBodyList::~ShortBodyList() = default;  // NOLINT(performance-trivially-destructible)

}  // namespace walker::bipedal_walker
