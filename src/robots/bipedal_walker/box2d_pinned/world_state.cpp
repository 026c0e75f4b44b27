// The state that a world carries from one step to the next. Compiled with -fno-access-control: most
// of it is private to Box2D's classes.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <tuple>
#include <utility>

#include "robots/bipedal_walker/physics.h"

namespace walker::bipedal_walker {
namespace {

// Structs without padding, which are written and read as raw bytes.

struct SavedBody {
  b2Vec2 c0, c;  // these and the next three: b2Sweep
  float a0, a, alpha0;
  b2Transform transform;
  b2Vec2 velocity;
  float angular_velocity;
  b2Vec2 force;
  float torque;
  float sleep_time;
  std::uint32_t is_awake;
};

struct SavedGround {
  std::int32_t index;
  SavedBody body;
};

struct SavedJoint {
  b2Vec3 impulse;
  float motor_impulse;
  float motor_speed;
  float max_motor_torque;
  std::int32_t limit_state;
};

/// Unused fields of a manifold are 0, so that equal states have equal bytes.
struct SavedContact {
  std::int32_t fixture_a, fixture_b;  // indices: ground, then the walker
  std::uint32_t flags;
  std::int32_t manifold_type;
  std::int32_t num_points;
  b2Vec2 normal;
  b2Vec2 point;
  std::array<b2ManifoldPoint, b2_maxManifoldPoints> points;
};

struct SavedNode {
  b2AABB box;
  std::int32_t link;  // parent; of a free node: the next free one
  std::int32_t child1, child2;
  std::int32_t height;  // -1: free
};

constexpr std::size_t kWord = 4;
static_assert(sizeof(SavedBody) == 19 * kWord && sizeof(SavedGround) == 20 * kWord &&
              sizeof(SavedJoint) == 7 * kWord && sizeof(SavedContact) == 19 * kWord &&
              sizeof(SavedNode) == 8 * kWord);

/// Flags of a contact that persist between steps. A step clears the others when it begins.
constexpr std::uint32_t kContactFlags = b2Contact::e_touchingFlag | b2Contact::e_enabledFlag |
                                        b2Contact::e_filterFlag | b2Contact::e_bulletHitFlag;

auto numbers_of(b2Body& body) {
  b2Sweep& sweep = body.m_sweep;
  return std::tie(sweep.c0, sweep.c, sweep.a0, sweep.a, sweep.alpha0, body.m_xf,
                  body.m_linearVelocity, body.m_angularVelocity, body.m_force, body.m_torque,
                  body.m_sleepTime);
}

auto numbers_of(SavedBody& body) {
  return std::tie(body.c0, body.c, body.a0, body.a, body.alpha0, body.transform, body.velocity,
                  body.angular_velocity, body.force, body.torque, body.sleep_time);
}

SavedBody saved(b2Body& body) {
  SavedBody saved;
  numbers_of(saved) = numbers_of(body);
  saved.is_awake = body.IsAwake() ? 1 : 0;
  return saved;
}

void restore(SavedBody saved, b2Body& body) {
  numbers_of(body) = numbers_of(saved);
  body.m_flags = static_cast<uint16>(body.m_flags & ~(b2Body::e_awakeFlag | b2Body::e_islandFlag));
  if (saved.is_awake != 0) body.m_flags |= b2Body::e_awakeFlag;
}

template <typename Struct>
Struct all_zero() {
  Struct zero;
  std::memset(static_cast<void*>(&zero), 0, sizeof zero);
  return zero;
}

SavedBody ground_at_rest() {
  auto body = all_zero<SavedBody>();
  body.transform.q.c = 1;
  body.is_awake = 1;
  return body;
}

SavedContact saved(const b2Contact& contact, std::int32_t fixture_a, std::int32_t fixture_b) {
  const b2Manifold& manifold = contact.m_manifold;
  auto state = all_zero<SavedContact>();
  state.fixture_a = fixture_a;
  state.fixture_b = fixture_b;
  state.flags = contact.m_flags & kContactFlags;
  state.num_points = manifold.pointCount;
  if (manifold.pointCount == 0) return state;
  state.manifold_type = manifold.type;
  state.normal = manifold.localNormal;
  state.point = manifold.localPoint;
  std::copy_n(manifold.points, manifold.pointCount, state.points.begin());
  return state;
}

SavedNode saved(const b2TreeNode& node) {
  if (node.height < 0) return {{b2Vec2(0, 0), b2Vec2(0, 0)}, node.next, 0, 0, -1};
  return {node.aabb, node.parent, node.child1, node.child2, node.height};
}

/// Returns the fixtures in the order of a state's indices: ground, then the walker's parts.
std::vector<b2Fixture*> fixtures_of(const std::vector<b2Body*>& ground, const WalkerParts& parts) {
  std::vector<b2Fixture*> fixtures;
  fixtures.reserve(ground.size() + parts.bodies.size());
  for (b2Body* body : ground) fixtures.push_back(body->m_fixtureList);
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

/// Rejects numbers beyond the bound, also NaN, among the first kCount floats of a struct.
template <std::size_t kCount, typename Struct>
void check_floats(const Struct& given) {
  std::array<float, kCount> numbers;
  static_assert(sizeof numbers <= sizeof given);
  std::memcpy(numbers.data(), &given, sizeof numbers);
  const auto is_within = [](float n) { return std::abs(n) <= kMaxSaved; };
  if (std::all_of(numbers.begin(), numbers.end(), is_within)) return;
  refuse_state("the numbers of its world must be finite, and at most 1e8");
}

class SavedWorld {
 public:
  /// Reads a state and validates every index, which `restore` relies on.
  SavedWorld(StateReader& reader, const Ground& ground) {
    for (std::uint8_t& touches : touches_) touches = reader.flag() ? 1 : 0;
    inverse_dt_ = reader.number<float>();
    reader.numbers(bodies_.data(), bodies_.size());
    read(reader, ground_bodies_);
    reader.numbers(joints_.data(), joints_.size());
    read(reader, contacts_);
    read(reader, leaves_);
    root_ = reader.number<std::int32_t>();
    first_free_ = reader.number<std::int32_t>();
    read(reader, nodes_);

    const std::size_t num_obstacles = ground.obstacles.size();
    const std::size_t num_ground = num_obstacles + ground.points.size() - 1;
    check_numbers();
    for (const SavedGround& body : ground_bodies_) {
      if (static_cast<std::uint32_t>(body.index) >= num_ground) {
        refuse("terrain", body.index, "does not exist");
      }
    }
    for (const SavedJoint& joint : joints_) {
      if (joint.limit_state < e_inactiveLimit || joint.limit_state > e_equalLimits) {
        refuse("limit state", joint.limit_state, "does not exist");
      }
    }
    check_contacts(num_obstacles, num_ground);
    check_tree(num_ground + kBodies);
  }

  /// Overwrites the state of the bodies and fixtures that `build` made; recreates the contacts.
  void restore(const WalkerParts& parts, const std::vector<b2Body*>& ground) const {
    b2World& world = *parts.world;
    const std::vector<b2Fixture*> fixtures = fixtures_of(ground, parts);
    restore_tree(world.m_contactManager.m_broadPhase, fixtures);
    restore_contacts(world.m_contactManager, fixtures);  // wakes bodies

    const SavedBody at_rest = ground_at_rest();
    for (b2Body* body : ground) bipedal_walker::restore(at_rest, *body);
    for (const auto& [index, body] : ground_bodies_) {
      bipedal_walker::restore(body, *ground[static_cast<std::size_t>(index)]);
    }
    for (std::size_t i = 0; i < kBodies; ++i) {
      bipedal_walker::restore(bodies_[i], *parts.bodies[i]);
    }
    for (std::size_t i = 0; i < kJoints; ++i) {
      b2RevoluteJoint& joint = *parts.joints[i];
      joint.m_impulse = joints_[i].impulse;
      joint.m_motorImpulse = joints_[i].motor_impulse;
      joint.m_motorSpeed = joints_[i].motor_speed;
      joint.m_maxMotorTorque = joints_[i].max_motor_torque;
      joint.m_limitState = static_cast<b2LimitState>(joints_[i].limit_state);
    }
    world.m_inv_dt0 = inverse_dt_;
    world.m_flags = b2World::e_clearForces;  // no new fixture, not locked
  }

  bool touches(std::size_t part) const { return touches_[part] != 0; }

 private:
  /// Rejects numbers beyond kMaxSaved. Non-finite ones make Box2D's searches for an impact very
  /// slow.
  void check_numbers() const {
    constexpr std::size_t kBodyFloats = 18;  // all before `is_awake`
    constexpr std::size_t kJointFloats = 6;  // all before `limit_state`
    check_floats<1>(inverse_dt_);
    for (const SavedBody& body : bodies_) check_floats<kBodyFloats>(body);
    for (const SavedGround& ground : ground_bodies_) check_floats<kBodyFloats>(ground.body);
    for (const SavedJoint& joint : joints_) check_floats<kJointFloats>(joint);
    for (const SavedContact& contact : contacts_) {
      check_floats<2>(contact.normal);
      check_floats<2>(contact.point);
      for (const b2ManifoldPoint& point : contact.points) check_floats<4>(point);
    }
    for (const SavedNode& node : nodes_) check_floats<4>(node);
  }

  /// Each contact must be between a part of the walker and a piece of ground, without duplicates.
  /// An edge must be fixture A, as in the contacts that Box2D creates.
  void check_contacts(std::size_t num_obstacles, std::size_t num_ground) const {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
    pairs.reserve(contacts_.size());
    for (const SavedContact& contact : contacts_) {
      const auto index = static_cast<std::int64_t>(pairs.size());
      const auto a = static_cast<std::uint32_t>(contact.fixture_a);
      const auto b = static_cast<std::uint32_t>(contact.fixture_b);
      if (a >= num_ground + kBodies || b >= num_ground + kBodies) {
        refuse("contact", index, "has no such fixture");
      }
      const bool ground_is_a = a < num_ground;
      const bool ground_is_b = b < num_ground;
      if (ground_is_a == ground_is_b || (ground_is_b && b >= num_obstacles)) {
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

  const SavedNode& node_at(std::int32_t index) const {
    if (static_cast<std::uint32_t>(index) >= nodes_.size()) refuse("node", index, "does not exist");
    return nodes_[static_cast<std::size_t>(index)];
  }

  /// The nodes must be a binary tree whose leaves are the fixtures, and a list of free nodes. There
  /// is no cycle if a parent is higher than its children.
  void check_tree(std::size_t num_fixtures) const {
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
  void check_node(std::int32_t index, bool is_leaf) const {
    const SavedNode& node = node_at(index);
    if ((node.link == b2_nullNode) != (index == root_)) refuse("node", index, "is not in the tree");
    if (node.link != b2_nullNode) {
      const SavedNode& parent = node_at(node.link);
      if (parent.height <= node.height || (parent.child1 != index && parent.child2 != index)) {
        refuse("node", index, "does not match its parent");
      }
    }
    if (node.height == 0) {
      if (is_leaf && node.child1 == b2_nullNode && node.child2 == b2_nullNode) return;
      refuse("node", index, "is not the leaf of one fixture");
    }
    const SavedNode& child1 = node_at(node.child1);
    const SavedNode& child2 = node_at(node.child2);
    if (child1.link != index || child2.link != index || node.child1 == node.child2 ||
        child1.height < 0 || child2.height < 0 ||
        node.height != 1 + std::max(child1.height, child2.height)) {
      refuse("node", index, "does not match its children");
    }
  }

  void restore_tree(b2BroadPhase& broad_phase, const std::vector<b2Fixture*>& fixtures) const {
    b2DynamicTree& tree = broad_phase.m_tree;
    const auto capacity = static_cast<int32>(nodes_.size());
    if (tree.m_nodeCapacity != capacity) {
      b2Free(tree.m_nodes);
      tree.m_nodes =
          static_cast<b2TreeNode*>(b2Alloc(capacity * static_cast<int32>(sizeof(b2TreeNode))));
      tree.m_nodeCapacity = capacity;
    }
    std::transform(nodes_.begin(), nodes_.end(), tree.m_nodes, [](const SavedNode& node) {
      return b2TreeNode{node.box, nullptr, {node.link}, node.child1, node.child2, node.height};
    });
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
  void restore_contacts(b2ContactManager& manager, const std::vector<b2Fixture*>& fixtures) const {
    b2ContactListener* const listener = std::exchange(manager.m_contactListener, nullptr);
    while (manager.m_contactList != nullptr) manager.Destroy(manager.m_contactList);
    manager.m_contactListener = listener;
    const auto proxy_at = [&fixtures](std::int32_t index) {
      return &fixtures[static_cast<std::size_t>(index)]->m_proxies[0];
    };
    std::for_each(contacts_.rbegin(), contacts_.rend(), [&](const SavedContact& state) {
      manager.AddPair(proxy_at(state.fixture_a), proxy_at(state.fixture_b));
      b2Contact& contact = *manager.m_contactList;
      contact.m_flags = state.flags;
      contact.m_toi = 1;  // Box2D leaves it uninitialised
      contact.m_manifold = {{state.points[0], state.points[1]},
                            state.normal,
                            state.point,
                            static_cast<b2Manifold::Type>(state.manifold_type),
                            state.num_points};
    });
  }

  std::array<std::uint8_t, 3> touches_{};  // hull, lower legs
  float inverse_dt_ = 0;                   // 1 / dt of the last step
  std::array<SavedBody, kBodies> bodies_{};
  std::vector<SavedGround> ground_bodies_;  // those that are not at rest
  std::array<SavedJoint, kJoints> joints_{};
  std::vector<SavedContact> contacts_;  // in the world's order
  std::vector<std::int32_t> leaves_;    // tree node of each fixture
  std::int32_t root_ = 0;
  std::int32_t first_free_ = 0;
  std::vector<SavedNode> nodes_;
};

}  // namespace

void Physics::save(StateWriter& writer) const {
  // parts() is not const because it returns pointers to non-const.
  const WalkerParts parts = const_cast<Physics&>(*this).parts();
  writer.number(std::uint8_t{contacts_.hull_has_touched});
  for (const bool touches : contacts_.leg_touches) writer.number(std::uint8_t{touches});
  writer.number(world_.m_inv_dt0);
  for (b2Body* body : parts.bodies) writer.number(saved(*body));
  const SavedBody at_rest = ground_at_rest();
  std::vector<SavedGround> disturbed;
  for (std::size_t i = 0; i < ground_.size(); ++i) {
    const SavedBody body = saved(*ground_[i]);
    // Compares bytes: 0 and -0 differ. NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
    if (std::memcmp(&body, &at_rest, sizeof body) == 0) continue;
    disturbed.push_back({static_cast<std::int32_t>(i), body});
  }
  write(disturbed, writer);
  for (const b2RevoluteJoint* joint : parts.joints) {
    writer.number(SavedJoint{joint->m_impulse, joint->m_motorImpulse, joint->m_motorSpeed,
                             joint->m_maxMotorTorque, joint->m_limitState});
  }

  const b2DynamicTree& tree = world_.m_contactManager.m_broadPhase.m_tree;
  const std::vector<b2Fixture*> fixtures = fixtures_of(ground_, parts);
  std::vector<std::int32_t> leaves(fixtures.size());
  std::vector<std::int32_t> fixture_of_leaf(static_cast<std::size_t>(tree.m_nodeCapacity));
  for (std::size_t i = 0; i < fixtures.size(); ++i) {
    leaves[i] = fixtures[i]->m_proxies[0].proxyId;
    fixture_of_leaf[static_cast<std::size_t>(leaves[i])] = static_cast<std::int32_t>(i);
  }
  const auto index_of = [&](const b2Fixture& fixture) {
    return fixture_of_leaf[static_cast<std::size_t>(fixture.m_proxies[0].proxyId)];
  };
  std::vector<SavedContact> contacts;
  for (const b2Contact* contact = world_.GetContactList(); contact != nullptr;
       contact = contact->m_next) {
    contacts.push_back(
        saved(*contact, index_of(*contact->m_fixtureA), index_of(*contact->m_fixtureB)));
  }
  write(contacts, writer);
  write(leaves, writer);

  writer.number(std::int32_t{tree.m_root});
  writer.number(std::int32_t{tree.m_freeList});
  std::vector<SavedNode> nodes(static_cast<std::size_t>(tree.m_nodeCapacity));
  std::transform(tree.m_nodes, tree.m_nodes + tree.m_nodeCapacity, nodes.begin(),
                 [](const b2TreeNode& node) { return saved(node); });
  write(nodes, writer);
}

std::function<void(Physics&)> Physics::read_state(StateReader& reader, const Ground& ground) {
  return [world = SavedWorld(reader, ground)](Physics& physics) {
    world.restore(physics.parts(), physics.ground_);
    physics.contacts_.hull_has_touched = world.touches(0);
    physics.contacts_.leg_touches = {world.touches(1), world.touches(2)};
  };
}

}  // namespace walker::bipedal_walker
