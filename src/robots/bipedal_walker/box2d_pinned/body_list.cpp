// Compiled with -fno-access-control: Box2D's lists are private.
#include "robots/bipedal_walker/body_list.h"

namespace walker::bipedal_walker {

/// The step sizes its island by m_bodyCount. Only terrain with a contact can join the island.
/// Contacts with new terrain are therefore found here, as the step would do first.
ShortBodyList::ShortBodyList(b2World& world, b2Body& last)
    : world_(world), last_(last), rest_(last.m_next), count_(world.m_bodyCount) {
  if ((world_.m_flags & b2World::e_newFixture) != 0) {
    world_.m_contactManager.FindNewContacts();
    world_.m_flags &= ~b2World::e_newFixture;
  }
  last_.m_next = nullptr;
  world_.m_bodyCount = world_.m_contactManager.m_contactCount;
  for (const b2Body* body = world_.m_bodyList; body != nullptr; body = body->m_next) {
    ++world_.m_bodyCount;
  }
}

/// Box2D's step resets alpha0 of every body in the list, which does not include the terrain. Only
/// terrain with a contact can have an alpha0 other than 0.
ShortBodyList::~ShortBodyList() {
  last_.m_next = rest_;
  world_.m_bodyCount = count_;
  for (const b2Contact* contact = world_.GetContactList(); contact != nullptr;
       contact = contact->m_next) {
    for (b2Fixture* fixture : {contact->m_fixtureA, contact->m_fixtureB}) {
      if (fixture->m_body->m_type == b2_staticBody) fixture->m_body->m_sweep.alpha0 = 0;
    }
  }
}

}  // namespace walker::bipedal_walker
