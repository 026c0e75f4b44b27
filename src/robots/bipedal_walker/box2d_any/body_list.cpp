#include "robots/bipedal_walker/body_list.h"

namespace walker::bipedal_walker {

ShortBodyList::ShortBodyList(b2World& world, b2Body& last) : world_(world), last_(last) {}

ShortBodyList::~ShortBodyList() = default;

}  // namespace walker::bipedal_walker
