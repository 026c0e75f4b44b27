// Compiled with -fno-access-control: Box2D's lists are private.
#include "bipedal_walker/body_list.h"

namespace walker::bipedal_walker {

ShortBodyList::ShortBodyList(b2World& world, b2Body& last)
    : world_(world), last_(last), rest_(last.m_next) {
  last_.m_next = nullptr;
}

/// A step starts with alpha0 = 0 in every body of the list. Only what has a contact can have left
/// that value.
ShortBodyList::~ShortBodyList() {
  last_.m_next = rest_;
  for (const b2Contact* contact = world_.GetContactList(); contact; contact = contact->m_next) {
    for (b2Fixture* fixture : {contact->m_fixtureA, contact->m_fixtureB}) {
      if (fixture->m_body->m_type == b2_staticBody) fixture->m_body->m_sweep.alpha0 = 0;
    }
  }
}

}  // namespace walker::bipedal_walker
