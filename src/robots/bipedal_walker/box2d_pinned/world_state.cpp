// Compiled with -fno-access-control: most of the state is private to Box2D's classes.
#include "robots/bipedal_walker/world_state.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "robots/bipedal_walker/physics.h"

namespace walker::bipedal_walker {
namespace {

/// Flags of a contact that persist between steps. A step clears the others when it begins.
constexpr std::uint32_t kContactFlags = b2Contact::e_touchingFlag | b2Contact::e_enabledFlag |
                                        b2Contact::e_filterFlag | b2Contact::e_bulletHitFlag;

/// Returns the fixtures in the order of a state's indices: terrain, then the walker's parts.
template <typename Parts>
std::vector<b2Fixture*> fixtures_of(const std::vector<b2Body*>& terrain, const Parts& walker) {
  std::vector<b2Fixture*> fixtures;
  fixtures.reserve(terrain.size() + walker.size());
  for (b2Body* body : terrain) fixtures.push_back(body->m_fixtureList);
  for (b2Body* body : walker) fixtures.push_back(body->m_fixtureList);
  return fixtures;
}

std::int32_t proxy_of(const b2Fixture& fixture) { return fixture.m_proxies[0].proxyId; }

[[noreturn]] void refuse(const char* what, std::int64_t index, const char* why) {
  refuse_state(std::string(what) + " " + std::to_string(index) + " " + why);
}

/// Compares bytes: 0 and -0 differ.
template <typename Value>
bool is_same(const Value& a, const Value& b) {
  // A struct without padding. NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
  return std::memcmp(&a, &b, sizeof(Value)) == 0;
}

/// Rejects non-finite numbers among the first kCount floats of a struct.
template <std::size_t kCount, typename Struct>
void check_finite(const Struct& given) {
  std::array<float, kCount> numbers;
  static_assert(sizeof numbers <= sizeof given);
  std::memcpy(numbers.data(), &given, sizeof numbers);
  if (std::all_of(numbers.begin(), numbers.end(), [](float n) { return std::isfinite(n); })) return;
  refuse_state("one of its world's numbers is not finite");
}

template <typename Element>
void write(const std::vector<Element>& elements, StateWriter& writer) {
  writer.number(static_cast<std::uint32_t>(elements.size()));
  writer.numbers(elements.data(), elements.size());
}

template <typename Element>
void read_into(std::vector<Element>& elements, StateReader& reader) {
  elements.resize(reader.count(sizeof(Element)));
  reader.numbers(elements.data(), elements.size());
}

}  // namespace

WorldState::Body WorldState::body_of(const b2Body& body) {
  const b2Sweep& sweep = body.m_sweep;
  const b2Transform& transform = body.m_xf;
  return {sweep.c0,
          sweep.c,
          sweep.a0,
          sweep.a,
          sweep.alpha0,
          transform.p,
          transform.q.s,
          transform.q.c,
          body.m_linearVelocity,
          body.m_angularVelocity,
          body.m_force,
          body.m_torque,
          body.m_sleepTime,
          body.IsAwake() ? 1U : 0U};
}

void WorldState::set_body(b2Body& body, const Body& state) {
  body.m_sweep.c0 = state.c0;
  body.m_sweep.c = state.c;
  body.m_sweep.a0 = state.a0;
  body.m_sweep.a = state.a;
  body.m_sweep.alpha0 = state.alpha0;
  body.m_xf.p = state.place;
  body.m_xf.q.s = state.sine;
  body.m_xf.q.c = state.cosine;
  body.m_linearVelocity = state.velocity;
  body.m_angularVelocity = state.angular_velocity;
  body.m_force = state.force;
  body.m_torque = state.torque;
  body.m_sleepTime = state.sleep_time;
  body.m_flags = static_cast<uint16>(body.m_flags & ~(b2Body::e_awakeFlag | b2Body::e_islandFlag));
  if (state.is_awake != 0) body.m_flags |= b2Body::e_awakeFlag;
}

WorldState::Body WorldState::terrain_at_rest() {
  Body body;
  std::memset(static_cast<void*>(&body), 0, sizeof body);
  body.cosine = 1;
  body.is_awake = 1;
  return body;
}

/// Unused fields of a manifold are 0, so that equal states have equal bytes.
WorldState::Contact WorldState::contact_of(const b2Contact& contact, std::int32_t fixture_a,
                                           std::int32_t fixture_b) {
  const b2Manifold& manifold = contact.m_manifold;
  Contact saved;
  std::memset(static_cast<void*>(&saved), 0, sizeof saved);
  saved.fixture_a = fixture_a;
  saved.fixture_b = fixture_b;
  saved.flags = contact.m_flags & kContactFlags;
  saved.num_points = manifold.pointCount;
  if (manifold.pointCount == 0) return saved;
  saved.manifold_type = manifold.type;
  saved.normal = manifold.localNormal;
  saved.point = manifold.localPoint;
  for (std::size_t i = 0; i < static_cast<std::size_t>(manifold.pointCount); ++i) {
    const b2ManifoldPoint& point = manifold.points[i];
    saved.points[i] = {point.localPoint, point.normalImpulse, point.tangentImpulse, point.id.key};
  }
  return saved;
}

void WorldState::save(const Physics& physics, StateWriter& writer) {
  constexpr std::size_t kWord = 4;
  static_assert(sizeof(Body) == 19 * kWord && sizeof(TerrainBody) == 20 * kWord &&
                sizeof(Joint) == 7 * kWord && sizeof(Contact) == 19 * kWord &&
                sizeof(Node) == 8 * kWord);
  // parts() is not const because it returns pointers to non-const.
  const WalkerParts parts = const_cast<Physics&>(physics).parts();
  const b2World& world = *parts.world;
  writer.number(std::uint8_t{physics.contacts_.hull_has_touched});
  for (const bool touches : physics.contacts_.leg_touches) writer.number(std::uint8_t{touches});
  writer.number(world.m_inv_dt0);
  for (const b2Body* body : parts.bodies) {
    const Body saved = body_of(*body);
    writer.numbers(&saved, 1);
  }
  const Body at_rest = terrain_at_rest();
  std::vector<TerrainBody> disturbed;
  for (std::size_t i = 0; i < physics.terrain_.size(); ++i) {
    const Body saved = body_of(*physics.terrain_[i]);
    if (!is_same(saved, at_rest)) disturbed.push_back({static_cast<std::int32_t>(i), saved});
  }
  write(disturbed, writer);
  for (const b2RevoluteJoint* joint : parts.joints) {
    const Joint saved{{joint->m_impulse.x, joint->m_impulse.y, joint->m_impulse.z},
                      joint->m_motorImpulse,
                      joint->m_motorSpeed,
                      joint->m_maxMotorTorque,
                      joint->m_limitState};
    writer.numbers(&saved, 1);
  }

  const b2DynamicTree& tree = world.m_contactManager.m_broadPhase.m_tree;
  const std::vector<b2Fixture*> fixtures = fixtures_of(physics.terrain_, parts.bodies);
  std::vector<std::int32_t> leaves(fixtures.size());
  std::vector<std::int32_t> fixture_of_leaf(static_cast<std::size_t>(tree.m_nodeCapacity));
  for (std::size_t i = 0; i < fixtures.size(); ++i) {
    leaves[i] = proxy_of(*fixtures[i]);
    fixture_of_leaf[static_cast<std::size_t>(leaves[i])] = static_cast<std::int32_t>(i);
  }
  const auto place_of = [&](const b2Fixture& fixture) {
    return fixture_of_leaf[static_cast<std::size_t>(proxy_of(fixture))];
  };
  std::vector<Contact> contacts;
  for (const b2Contact* contact = world.GetContactList(); contact != nullptr;
       contact = contact->m_next) {
    contacts.push_back(
        contact_of(*contact, place_of(*contact->m_fixtureA), place_of(*contact->m_fixtureB)));
  }
  write(contacts, writer);
  write(leaves, writer);
  save_tree(tree, writer);
}

void WorldState::save_tree(const b2DynamicTree& tree, StateWriter& writer) {
  writer.number(std::int32_t{tree.m_root});
  writer.number(std::int32_t{tree.m_freeList});
  std::vector<Node> nodes(static_cast<std::size_t>(tree.m_nodeCapacity));
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const b2TreeNode& node = tree.m_nodes[i];
    const b2Vec2 nowhere(0, 0);
    nodes[i] = node.height < 0 ? Node{nowhere, nowhere, node.next, 0, 0, -1}
                               : Node{node.aabb.lowerBound, node.aabb.upperBound, node.parent,
                                      node.child1,          node.child2,          node.height};
  }
  write(nodes, writer);
}

WorldState WorldState::read(StateReader& reader, const Terrain& terrain) {
  WorldState state;
  state.hull_has_touched_ = reader.flag() ? 1 : 0;
  for (std::uint8_t& touches : state.leg_touches_) touches = reader.flag() ? 1 : 0;
  state.inverse_dt_ = reader.number<float>();
  reader.numbers(state.bodies_.data(), state.bodies_.size());
  read_into(state.terrain_bodies_, reader);
  reader.numbers(state.joints_.data(), state.joints_.size());
  read_into(state.contacts_, reader);
  read_into(state.leaves_, reader);
  state.root_ = reader.number<std::int32_t>();
  state.first_free_ = reader.number<std::int32_t>();
  read_into(state.nodes_, reader);
  const std::size_t num_obstacles = terrain.obstacles.size();
  const std::size_t num_terrain = num_obstacles + terrain.ground.size() - 1;
  state.check_numbers();
  state.check_bodies(num_terrain);
  state.check_contacts(num_obstacles, num_terrain);
  state.check_tree(num_terrain + kBodies);
  return state;
}

/// Rejects non-finite numbers, which make Box2D's searches for an impact very slow.
void WorldState::check_numbers() const {
  constexpr std::size_t kBodyFloats = 18;  // all before `is_awake`
  constexpr std::size_t kJointFloats = 6;  // all before `limit_state`
  check_finite<1>(inverse_dt_);
  for (const Body& body : bodies_) check_finite<kBodyFloats>(body);
  for (const TerrainBody& terrain : terrain_bodies_) check_finite<kBodyFloats>(terrain.body);
  for (const Joint& joint : joints_) check_finite<kJointFloats>(joint);
  for (const Contact& contact : contacts_) {
    check_finite<2>(contact.normal);
    check_finite<2>(contact.point);
    for (const ContactPoint& point : contact.points) check_finite<4>(point);
  }
  for (const Node& node : nodes_) check_finite<4>(node);
}

void WorldState::check_bodies(std::size_t num_terrain) const {
  for (const TerrainBody& body : terrain_bodies_) {
    if (static_cast<std::uint32_t>(body.index) >= num_terrain) {
      refuse("terrain", body.index, "is none");
    }
  }
  for (const Joint& joint : joints_) {
    if (joint.limit_state < e_inactiveLimit || joint.limit_state > e_equalLimits) {
      refuse("limit state", joint.limit_state, "is none");
    }
  }
}

/// Each contact must be between a part of the walker and a piece of terrain, without duplicates. An
/// edge must be fixture A, as in the contacts that Box2D creates.
void WorldState::check_contacts(std::size_t num_obstacles, std::size_t num_terrain) const {
  std::vector<std::pair<std::int32_t, std::int32_t>> pairs;
  pairs.reserve(contacts_.size());
  for (const Contact& contact : contacts_) {
    const auto index = static_cast<std::int64_t>(pairs.size());
    const auto a = static_cast<std::uint32_t>(contact.fixture_a);
    const auto b = static_cast<std::uint32_t>(contact.fixture_b);
    if (a >= num_terrain + kBodies || b >= num_terrain + kBodies) {
      refuse("contact", index, "is of no fixture");
    }
    const bool terrain_is_a = a < num_terrain;
    const std::uint32_t terrain = terrain_is_a ? a : b;
    if (terrain_is_a == (b < num_terrain) || (terrain >= num_obstacles && !terrain_is_a)) {
      refuse("contact", index, "is not one of a walker with terrain");
    }
    const bool is_touching = (contact.flags & b2Contact::e_touchingFlag) != 0;
    const bool has_manifold = contact.num_points != 0;
    if ((contact.flags & ~kContactFlags) != 0 || contact.num_points < 0 ||
        contact.num_points > b2_maxManifoldPoints || is_touching != has_manifold ||
        (has_manifold && contact.manifold_type != b2Manifold::e_faceA &&
         contact.manifold_type != b2Manifold::e_faceB)) {
      refuse("contact", index, "has a manifold that is none");
    }
    pairs.emplace_back(std::min(contact.fixture_a, contact.fixture_b),
                       std::max(contact.fixture_a, contact.fixture_b));
  }
  std::sort(pairs.begin(), pairs.end());
  if (std::adjacent_find(pairs.begin(), pairs.end()) != pairs.end()) {
    refuse_state("a contact comes twice");
  }
}

/// The nodes must be a binary tree whose leaves are the fixtures; all other nodes must be free.
void WorldState::check_tree(std::size_t num_fixtures) const {
  if (leaves_.size() != num_fixtures) {
    refuse_state(std::to_string(leaves_.size()) + " fixtures; must be " +
                 std::to_string(num_fixtures));
  }
  const auto node_at = [this](std::int32_t index) -> const Node& {
    if (static_cast<std::uint32_t>(index) >= nodes_.size()) refuse("node", index, "is none");
    return nodes_[static_cast<std::size_t>(index)];
  };
  std::vector<bool> is_leaf(nodes_.size());
  for (const std::int32_t leaf : leaves_) {
    if (node_at(leaf).height != 0 || is_leaf[static_cast<std::size_t>(leaf)]) {
      refuse("node", leaf, "is not the leaf of one fixture");
    }
    is_leaf[static_cast<std::size_t>(leaf)] = true;
  }
  const std::size_t num_used = 2 * num_fixtures - 1;
  if (node_at(root_).link != b2_nullNode) refuse("node", root_, "is no root");
  std::vector<std::int32_t> to_visit{root_};
  std::size_t num_visited = 0;
  while (!to_visit.empty()) {
    const std::int32_t index = to_visit.back();
    to_visit.pop_back();
    const Node& node = node_at(index);
    if (++num_visited > num_used) refuse_state("its tree has a ring");
    if (node.height == 0) {
      if (!is_leaf[static_cast<std::size_t>(index)] || node.child1 != b2_nullNode ||
          node.child2 != b2_nullNode) {
        refuse("node", index, "is not the leaf of one fixture");
      }
      continue;
    }
    const Node& child1 = node_at(node.child1);
    const Node& child2 = node_at(node.child2);
    if (child1.link != index || child2.link != index || node.child1 == node.child2 ||
        child1.height < 0 || child2.height < 0 ||
        node.height != 1 + std::max(child1.height, child2.height)) {
      refuse("node", index, "does not fit to its children");
    }
    to_visit.push_back(node.child1);
    to_visit.push_back(node.child2);
  }
  if (num_visited != num_used) refuse_state("its tree has not all fixtures");
  check_free_nodes(num_used);
}

void WorldState::check_free_nodes(std::size_t num_used) const {
  std::size_t num_free = 0;
  for (std::int32_t index = first_free_; index != b2_nullNode;
       index = nodes_[static_cast<std::size_t>(index)].link) {
    if (static_cast<std::uint32_t>(index) >= nodes_.size() ||
        nodes_[static_cast<std::size_t>(index)].height != -1 || ++num_free > nodes_.size()) {
      refuse("node", index, "is not free");
    }
  }
  if (num_used + num_free != nodes_.size()) refuse_state("its tree has lost nodes");
}

/// Overwrites the state of the bodies and fixtures that `build` made; recreates the contacts.
void WorldState::restore(Physics& physics) const {
  const WalkerParts parts = physics.parts();
  b2World& world = *parts.world;
  const std::vector<b2Fixture*> fixtures = fixtures_of(physics.terrain_, parts.bodies);
  restore_tree(world.m_contactManager.m_broadPhase, fixtures);
  restore_contacts(world, fixtures);  // wakes bodies

  const Body at_rest = terrain_at_rest();
  for (b2Body* body : physics.terrain_) set_body(*body, at_rest);
  for (const TerrainBody& saved : terrain_bodies_) {
    set_body(*physics.terrain_[static_cast<std::size_t>(saved.index)], saved.body);
  }
  for (std::size_t i = 0; i < bodies_.size(); ++i) set_body(*parts.bodies[i], bodies_[i]);
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    b2RevoluteJoint& joint = *parts.joints[i];
    const Joint& saved = joints_[i];
    joint.m_impulse.Set(saved.impulse[0], saved.impulse[1], saved.impulse[2]);
    joint.m_motorImpulse = saved.motor_impulse;
    joint.m_motorSpeed = saved.motor_speed;
    joint.m_maxMotorTorque = saved.max_motor_torque;
    joint.m_limitState = static_cast<b2LimitState>(saved.limit_state);
  }
  world.m_inv_dt0 = inverse_dt_;
  world.m_flags = b2World::e_clearForces;  // no new fixture, not locked
  physics.contacts_.hull_has_touched = hull_has_touched_ != 0;
  for (std::size_t leg = 0; leg < leg_touches_.size(); ++leg) {
    physics.contacts_.leg_touches[leg] = leg_touches_[leg] != 0;
  }
}

void WorldState::restore_tree(b2BroadPhase& broad_phase,
                              const std::vector<b2Fixture*>& fixtures) const {
  b2DynamicTree& tree = broad_phase.m_tree;
  const auto capacity = static_cast<int32>(nodes_.size());
  if (tree.m_nodeCapacity != capacity) {
    b2Free(tree.m_nodes);
    tree.m_nodes =
        static_cast<b2TreeNode*>(b2Alloc(capacity * static_cast<int32>(sizeof(b2TreeNode))));
    tree.m_nodeCapacity = capacity;
  }
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const Node& saved = nodes_[i];
    b2TreeNode& node = tree.m_nodes[i];
    node.aabb.lowerBound = saved.low;
    node.aabb.upperBound = saved.high;
    node.userData = nullptr;
    node.parent = saved.link;
    node.child1 = saved.child1;
    node.child2 = saved.child2;
    node.height = saved.height;
  }
  for (std::size_t i = 0; i < fixtures.size(); ++i) {
    b2FixtureProxy& proxy = fixtures[i]->m_proxies[0];
    proxy.proxyId = leaves_[i];
    tree.m_nodes[leaves_[i]].userData = &proxy;
  }
  tree.m_root = root_;
  tree.m_freeList = first_free_;
  tree.m_nodeCount = static_cast<int32>(2 * fixtures.size() - 1);
  broad_phase.m_moveCount = 0;
}

/// Creates contacts from last to first, as Box2D prepends them to the lists of world and bodies.
void WorldState::restore_contacts(b2World& world, const std::vector<b2Fixture*>& fixtures) const {
  b2ContactManager& manager = world.m_contactManager;
  b2ContactListener* const listener = std::exchange(manager.m_contactListener, nullptr);
  while (manager.m_contactList != nullptr) manager.Destroy(manager.m_contactList);
  manager.m_contactListener = listener;
  const auto proxy_at = [&fixtures](std::int32_t index) {
    return &fixtures[static_cast<std::size_t>(index)]->m_proxies[0];
  };
  std::for_each(contacts_.rbegin(), contacts_.rend(), [&](const Contact& saved) {
    manager.AddPair(proxy_at(saved.fixture_a), proxy_at(saved.fixture_b));
    b2Contact& contact = *manager.m_contactList;
    contact.m_flags = saved.flags;
    contact.m_toi = 1;  // Box2D leaves it uninitialised
    b2Manifold& manifold = contact.m_manifold;
    manifold.pointCount = saved.num_points;
    manifold.type = static_cast<b2Manifold::Type>(saved.manifold_type);
    manifold.localNormal = saved.normal;
    manifold.localPoint = saved.point;
    for (std::size_t i = 0; i < saved.points.size(); ++i) {
      const ContactPoint& point = saved.points[i];
      b2ManifoldPoint& restored = manifold.points[i];
      restored.localPoint = point.place;
      restored.normalImpulse = point.normal_impulse;
      restored.tangentImpulse = point.tangent_impulse;
      restored.id.key = point.id;
    }
  });
}

}  // namespace walker::bipedal_walker
