// Compiled with -fno-access-control: most of the state is private to Box2D's classes.
#include "robots/bipedal_walker/world_state.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "robots/bipedal_walker/physics.h"

namespace walker::bipedal_walker {
namespace {

using Body = WorldState::Body;
using Joint = WorldState::Joint;
using Contact = WorldState::Contact;
using Node = WorldState::Node;

/// Flags of a contact that persist between steps. A step clears the others when it begins.
constexpr std::uint32_t kContactFlags = b2Contact::e_touchingFlag | b2Contact::e_enabledFlag |
                                        b2Contact::e_filterFlag | b2Contact::e_bulletHitFlag;

// Each copy_... function lists the numbers of an object of Box2D and of its state, and calls
// `copy` for each pair: kSave or kRestore.
constexpr auto kSave = [](const auto& engine, auto& state) { state = engine; };
constexpr auto kRestore = [](auto& engine, const auto& state) { engine = state; };

template <typename Engine, typename State, typename Copy>
void copy_body(Engine& body, State& state, const Copy& copy) {
  copy(body.m_sweep.c0, state.c0);
  copy(body.m_sweep.c, state.c);
  copy(body.m_sweep.a0, state.a0);
  copy(body.m_sweep.a, state.a);
  copy(body.m_sweep.alpha0, state.alpha0);
  copy(body.m_xf, state.transform);
  copy(body.m_linearVelocity, state.velocity);
  copy(body.m_angularVelocity, state.angular_velocity);
  copy(body.m_force, state.force);
  copy(body.m_torque, state.torque);
  copy(body.m_sleepTime, state.sleep_time);
}

template <typename Engine, typename State, typename Copy>
void copy_joint(Engine& joint, State& state, const Copy& copy) {
  copy(joint.m_impulse, state.impulse);
  copy(joint.m_motorImpulse, state.motor_impulse);
  copy(joint.m_motorSpeed, state.motor_speed);
  copy(joint.m_maxMotorTorque, state.max_motor_torque);
}

template <typename Engine, typename State, typename Copy>
void copy_manifold(Engine& manifold, State& state, const Copy& copy) {
  copy(manifold.localNormal, state.normal);
  copy(manifold.localPoint, state.point);
  for (std::size_t i = 0; i < static_cast<std::size_t>(state.num_points); ++i) {
    copy(manifold.points[i], state.points[i]);
  }
}

template <typename Engine, typename State, typename Copy>
void copy_node(Engine& node, State& state, const Copy& copy) {
  copy(node.aabb, state.box);
  copy(node.parent, state.link);
  copy(node.child1, state.child1);
  copy(node.child2, state.child2);
  copy(node.height, state.height);
}

Body save_body(const b2Body& body) {
  Body state;
  copy_body(body, state, kSave);
  state.is_awake = body.IsAwake() ? 1 : 0;
  return state;
}

void restore_body(b2Body& body, const Body& state) {
  copy_body(body, state, kRestore);
  body.m_flags = static_cast<uint16>(body.m_flags & ~(b2Body::e_awakeFlag | b2Body::e_islandFlag));
  if (state.is_awake != 0) body.m_flags |= b2Body::e_awakeFlag;
}

template <typename Struct>
Struct all_zero() {
  Struct zero;
  std::memset(static_cast<void*>(&zero), 0, sizeof zero);
  return zero;
}

Body terrain_at_rest() {
  Body body = all_zero<Body>();
  body.transform.q.c = 1;
  body.is_awake = 1;
  return body;
}

/// Compares bytes: 0 and -0 differ.
bool is_same(const Body& a, const Body& b) {
  // A struct without padding. NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
  return std::memcmp(&a, &b, sizeof a) == 0;
}

Contact save_contact(const b2Contact& contact, std::int32_t fixture_a, std::int32_t fixture_b) {
  const b2Manifold& manifold = contact.m_manifold;
  auto state = all_zero<Contact>();
  state.fixture_a = fixture_a;
  state.fixture_b = fixture_b;
  state.flags = contact.m_flags & kContactFlags;
  state.num_points = manifold.pointCount;
  if (manifold.pointCount == 0) return state;
  state.manifold_type = manifold.type;
  copy_manifold(manifold, state, kSave);
  return state;
}

/// Returns the fixtures in the order of a state's indices: terrain, then the walker's parts.
std::vector<b2Fixture*> fixtures_of(const std::vector<b2Body*>& terrain, const WalkerParts& parts) {
  std::vector<b2Fixture*> fixtures;
  fixtures.reserve(terrain.size() + parts.bodies.size());
  for (b2Body* body : terrain) fixtures.push_back(body->m_fixtureList);
  for (b2Body* body : parts.bodies) fixtures.push_back(body->m_fixtureList);
  return fixtures;
}

template <typename Element>
void write(const std::vector<Element>& elements, StateWriter& writer) {
  writer.number(static_cast<std::uint32_t>(elements.size()));
  writer.numbers(elements.data(), elements.size());
}

template <typename Element>
void read(StateReader& reader, std::vector<Element>& elements) {
  elements.resize(reader.count(sizeof(Element)));
  reader.numbers(elements.data(), elements.size());
}

[[noreturn]] void refuse(const char* what, std::int64_t index, const char* why) {
  refuse_state(std::string(what) + " " + std::to_string(index) + " " + why);
}

/// Rejects non-finite numbers among the first kCount floats of a struct.
template <std::size_t kCount, typename Struct>
void check_finite(const Struct& given) {
  std::array<float, kCount> numbers;
  static_assert(sizeof numbers <= sizeof given);
  std::memcpy(numbers.data(), &given, sizeof numbers);
  if (std::all_of(numbers.begin(), numbers.end(), [](float n) { return std::isfinite(n); })) return;
  refuse_state("a number of its world is not finite");
}

}  // namespace

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
  for (const b2Body* body : parts.bodies) writer.number(save_body(*body));
  const Body at_rest = terrain_at_rest();
  std::vector<TerrainBody> disturbed;
  for (std::size_t i = 0; i < physics.terrain_.size(); ++i) {
    const Body state = save_body(*physics.terrain_[i]);
    if (!is_same(state, at_rest)) disturbed.push_back({static_cast<std::int32_t>(i), state});
  }
  write(disturbed, writer);
  for (const b2RevoluteJoint* joint : parts.joints) {
    Joint state;
    copy_joint(*joint, state, kSave);
    state.limit_state = joint->m_limitState;
    writer.number(state);
  }

  const b2DynamicTree& tree = world.m_contactManager.m_broadPhase.m_tree;
  const std::vector<b2Fixture*> fixtures = fixtures_of(physics.terrain_, parts);
  std::vector<std::int32_t> leaves;
  leaves.reserve(fixtures.size());
  std::vector<std::int32_t> fixture_of_leaf(static_cast<std::size_t>(tree.m_nodeCapacity));
  for (const b2Fixture* fixture : fixtures) {
    const std::int32_t leaf = fixture->m_proxies[0].proxyId;
    fixture_of_leaf[static_cast<std::size_t>(leaf)] = static_cast<std::int32_t>(leaves.size());
    leaves.push_back(leaf);
  }
  const auto index_of = [&](const b2Fixture& fixture) {
    return fixture_of_leaf[static_cast<std::size_t>(fixture.m_proxies[0].proxyId)];
  };
  std::vector<Contact> contacts;
  for (const b2Contact* contact = world.GetContactList(); contact != nullptr;
       contact = contact->m_next) {
    contacts.push_back(
        save_contact(*contact, index_of(*contact->m_fixtureA), index_of(*contact->m_fixtureB)));
  }
  write(contacts, writer);
  write(leaves, writer);

  writer.number(std::int32_t{tree.m_root});
  writer.number(std::int32_t{tree.m_freeList});
  std::vector<Node> nodes(static_cast<std::size_t>(tree.m_nodeCapacity));
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const b2TreeNode& node = tree.m_nodes[i];
    if (node.height < 0) {
      nodes[i] = {{b2Vec2(0, 0), b2Vec2(0, 0)}, node.next, 0, 0, -1};
    } else {
      copy_node(node, nodes[i], kSave);
    }
  }
  write(nodes, writer);
}

WorldState WorldState::read(StateReader& reader, const Terrain& terrain) {
  WorldState state;
  for (std::uint8_t& touches : state.touches_) touches = reader.flag() ? 1 : 0;
  state.inverse_dt_ = reader.number<float>();
  reader.numbers(state.bodies_.data(), state.bodies_.size());
  bipedal_walker::read(reader, state.terrain_bodies_);
  reader.numbers(state.joints_.data(), state.joints_.size());
  bipedal_walker::read(reader, state.contacts_);
  bipedal_walker::read(reader, state.leaves_);
  state.root_ = reader.number<std::int32_t>();
  state.first_free_ = reader.number<std::int32_t>();
  bipedal_walker::read(reader, state.nodes_);

  const std::size_t num_obstacles = terrain.obstacles.size();
  const std::size_t num_terrain = num_obstacles + terrain.ground.size() - 1;
  state.check_numbers();
  for (const TerrainBody& body : state.terrain_bodies_) {
    if (static_cast<std::uint32_t>(body.index) >= num_terrain) {
      refuse("terrain", body.index, "does not exist");
    }
  }
  for (const Joint& joint : state.joints_) {
    if (joint.limit_state < e_inactiveLimit || joint.limit_state > e_equalLimits) {
      refuse("limit state", joint.limit_state, "does not exist");
    }
  }
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
    for (const b2ManifoldPoint& point : contact.points) check_finite<4>(point);
  }
  for (const Node& node : nodes_) check_finite<4>(node);
}

/// Each contact must be between a part of the walker and a piece of terrain, without duplicates. An
/// edge must be fixture A, as in the contacts that Box2D creates.
void WorldState::check_contacts(std::size_t num_obstacles, std::size_t num_terrain) const {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  pairs.reserve(contacts_.size());
  for (const Contact& contact : contacts_) {
    const auto index = static_cast<std::int64_t>(pairs.size());
    const auto a = static_cast<std::uint32_t>(contact.fixture_a);
    const auto b = static_cast<std::uint32_t>(contact.fixture_b);
    if (a >= num_terrain + kBodies || b >= num_terrain + kBodies) {
      refuse("contact", index, "has no such fixture");
    }
    const bool terrain_is_a = a < num_terrain;
    const bool terrain_is_b = b < num_terrain;
    if (terrain_is_a == terrain_is_b || (terrain_is_b && b >= num_obstacles)) {
      refuse("contact", index, "is not between the walker and terrain");
    }
    const bool is_touching = (contact.flags & b2Contact::e_touchingFlag) != 0;
    const bool has_manifold = contact.num_points != 0;
    if ((contact.flags & ~kContactFlags) != 0 || contact.num_points < 0 ||
        contact.num_points > b2_maxManifoldPoints || is_touching != has_manifold ||
        (has_manifold && contact.manifold_type != b2Manifold::e_faceA &&
         contact.manifold_type != b2Manifold::e_faceB)) {
      refuse("contact", index, "has an invalid manifold");
    }
    pairs.emplace_back(std::min(a, b), std::max(a, b));
  }
  std::sort(pairs.begin(), pairs.end());
  if (std::adjacent_find(pairs.begin(), pairs.end()) != pairs.end()) {
    refuse_state("two contacts are between the same fixtures");
  }
}

const WorldState::Node& WorldState::node_at(std::int32_t index) const {
  if (static_cast<std::uint32_t>(index) >= nodes_.size()) refuse("node", index, "does not exist");
  return nodes_[static_cast<std::size_t>(index)];
}

/// The nodes must be a binary tree whose leaves are the fixtures, and a list of free nodes. There
/// is no cycle if a parent is higher than its children.
void WorldState::check_tree(std::size_t num_fixtures) const {
  if (leaves_.size() != num_fixtures) {
    refuse_state(std::to_string(leaves_.size()) + " fixtures; must be " +
                 std::to_string(num_fixtures));
  }
  std::vector<bool> is_leaf(nodes_.size());
  for (const std::int32_t leaf : leaves_) {
    if (node_at(leaf).height != 0 || is_leaf[static_cast<std::size_t>(leaf)]) {
      refuse("node", leaf, "is not the leaf of one fixture");
    }
    is_leaf[static_cast<std::size_t>(leaf)] = true;
  }

  if (node_at(root_).height < 0) refuse("root", root_, "is free");
  std::size_t num_free = 0;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (nodes_[i].height < 0) {
      ++num_free;
    } else {
      check_node(static_cast<std::int32_t>(i), is_leaf[i]);
    }
  }

  std::size_t num_listed = 0;
  for (std::int32_t index = first_free_; index != b2_nullNode; index = node_at(index).link) {
    if (node_at(index).height != -1 || ++num_listed > num_free)
      refuse("node", index, "is not free");
  }
  if (num_listed != num_free) refuse_state("its list of free nodes is incomplete");
}

/// Compares a node of the tree with its parent and children.
void WorldState::check_node(std::int32_t index, bool is_leaf) const {
  const Node& node = node_at(index);
  if ((node.link == b2_nullNode) != (index == root_)) refuse("node", index, "is not in the tree");
  if (node.link != b2_nullNode) {
    const Node& parent = node_at(node.link);
    if (parent.height <= node.height || (parent.child1 != index && parent.child2 != index)) {
      refuse("node", index, "does not match its parent");
    }
  }
  if (node.height == 0) {
    if (is_leaf && node.child1 == b2_nullNode && node.child2 == b2_nullNode) return;
    refuse("node", index, "is not the leaf of one fixture");
  }
  const Node& child1 = node_at(node.child1);
  const Node& child2 = node_at(node.child2);
  if (child1.link != index || child2.link != index || node.child1 == node.child2 ||
      child1.height < 0 || child2.height < 0 ||
      node.height != 1 + std::max(child1.height, child2.height)) {
    refuse("node", index, "does not match its children");
  }
}

/// Overwrites the state of the bodies and fixtures that `build` made; recreates the contacts.
void WorldState::restore(Physics& physics) const {
  const WalkerParts parts = physics.parts();
  b2World& world = *parts.world;
  const std::vector<b2Fixture*> fixtures = fixtures_of(physics.terrain_, parts);
  restore_tree(world.m_contactManager.m_broadPhase, fixtures);
  restore_contacts(world, fixtures);  // wakes bodies

  const Body at_rest = terrain_at_rest();
  for (b2Body* body : physics.terrain_) restore_body(*body, at_rest);
  for (const TerrainBody& terrain : terrain_bodies_) {
    restore_body(*physics.terrain_[static_cast<std::size_t>(terrain.index)], terrain.body);
  }
  for (std::size_t i = 0; i < bodies_.size(); ++i) restore_body(*parts.bodies[i], bodies_[i]);
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    copy_joint(*parts.joints[i], joints_[i], kRestore);
    parts.joints[i]->m_limitState = static_cast<b2LimitState>(joints_[i].limit_state);
  }
  world.m_inv_dt0 = inverse_dt_;
  world.m_flags = b2World::e_clearForces;  // no new fixture, not locked
  physics.contacts_.hull_has_touched = touches_[0] != 0;
  physics.contacts_.leg_touches = {touches_[1] != 0, touches_[2] != 0};
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
    copy_node(tree.m_nodes[i], nodes_[i], kRestore);
    tree.m_nodes[i].userData = nullptr;
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
  std::for_each(contacts_.rbegin(), contacts_.rend(), [&](const Contact& state) {
    manager.AddPair(proxy_at(state.fixture_a), proxy_at(state.fixture_b));
    b2Contact& contact = *manager.m_contactList;
    contact.m_flags = state.flags;
    contact.m_toi = 1;  // Box2D leaves it uninitialised
    contact.m_manifold.pointCount = state.num_points;
    contact.m_manifold.type = static_cast<b2Manifold::Type>(state.manifold_type);
    copy_manifold(contact.m_manifold, state, kRestore);
  });
}

}  // namespace walker::bipedal_walker
