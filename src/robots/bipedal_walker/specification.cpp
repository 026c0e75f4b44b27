#include "robots/bipedal_walker/specification.h"

#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <mutex>
#include <tuple>

#include "base/engine_release.h"
#include "robots/bipedal_walker/observation.h"
#include "robots/bipedal_walker/world_settings.h"

namespace walker::bipedal_walker {
namespace {

/// Gymnasium's colours: the hull violet, leg 1 a shade lighter than leg 2.
Color limb_color(std::size_t joint) {
  const double shade = joint == kHip1 || joint == kKnee1 ? 25 : -25;
  return rgb(153 + shade, 76 + shade, 127 + shade);
}

/// A link's frame in the frame of its body.
struct Frame {
  b2Vec2 origin{0, 0};  // [m]
  b2Rot rotation{0};

  b2Vec2 local(const b2Vec2& point) const { return b2MulT(rotation, point - origin); }
};

/// Link frames are at the joints and are parallel to the hull's frame at joint angles 0.
Frame frame_of(const Physics& physics, std::size_t joint) {
  return {physics.joint(joint).GetLocalAnchorB(), b2Rot(-frame_rotation(physics, joint))};
}

Link read_link(const std::string& name, const b2Body& body, const Frame& frame, Color color) {
  Link link;
  link.name = name;
  link.mesh = "bipedal_walker_" + name;  // scripts/dev/make_meshes writes the files
  link.mass = double{body.GetMass()};
  link.center_of_mass = to_vector3(frame.local(body.GetLocalCenter()));
  // Box2D returns the inertia about the body's origin, and only for the y axis.
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  link.inertia = {kUnknown, 0, kUnknown, 0, kUnknown, 0};
  link.inertia.yy =
      double{body.GetInertia()} - link.mass * double{body.GetLocalCenter().LengthSquared()};
  link.color = color;
  for (const b2Fixture* f = body.GetFixtureList(); f != nullptr; f = f->GetNext()) {
    const auto* polygon = static_cast<const b2PolygonShape*>(f->GetShape());
    Prism prism;
    for (int i = 0; i < polygon->m_count; ++i) {
      const b2Vec2 vertex = frame.local(polygon->m_vertices[i]);
      prism.vertices.push_back({double{vertex.x}, double{vertex.y}});
    }
    link.prisms.push_back(prism);
  }
  return link;
}

void read_walker(Specification& specification) {
  Generator generator(0);
  const auto physics = std::make_unique<Physics>();  // 100 KiB: too large for a stack
  physics->build(draw_ground(generator, false), 0);
  const std::array<const char*, kJointCount> joints{"hip_1", "knee_1", "hip_2", "knee_2"};
  specification.links.push_back(read_link(kLinks[0], physics->hull(), Frame{}, rgb(127, 51, 229)));
  for (std::size_t i = 0; i < kJointCount; ++i) {
    const b2RevoluteJoint& joint = physics->joint(i);
    const bool is_hip = i == kHip1 || i == kHip2;
    const Frame parent = is_hip ? Frame{} : frame_of(*physics, i - 1);
    specification.links.push_back(
        read_link(kLinks[i + 1], child_of(joint), frame_of(*physics, i), limb_color(i)));
    specification.joints.push_back(
        {joints[i], is_hip ? kLinks[0] : kLinks[i], kLinks[i + 1],
         to_vector3(parent.local(joint.GetLocalAnchorA())), Vector3{0, -1, 0},
         double{joint.GetLowerLimit()}, double{joint.GetUpperLimit()},
         double{joint.GetMaxMotorTorque()}, is_hip ? kHipSpeed : kKneeSpeed});
  }
}

void set_spaces(Specification& specification) {
  constexpr double kMaxSpeed = 5.0;
  const auto pi = double{static_cast<float>(M_PI)};
  // hull angle, three speeds, then two legs: hip angle, speed, knee angle, speed, contact
  specification.observation_low = {-pi,        -kMaxSpeed, -kMaxSpeed, -kMaxSpeed, -pi,
                                   -kMaxSpeed, -pi,        -kMaxSpeed, -0.0,       -pi,
                                   -kMaxSpeed, -pi,        -kMaxSpeed, -0.0};
  std::transform(specification.observation_low.begin(), specification.observation_low.end(),
                 std::back_inserter(specification.observation_high),
                 [](double low) { return low == 0 ? kMaxSpeed : -low; });
  specification.observation_low.resize(kObservationSize, -1.0);
  specification.observation_high.resize(kObservationSize, 1.0);
  specification.observation_dtype = "float32";
  specification.action_low.assign(kJointCount, -1.0);
  specification.action_high.assign(kJointCount, 1.0);
  specification.effort_per_action.assign(kJointCount, kMotorTorque);
}

void set_engine(Specification& specification) {
  specification.engine = "Box2D";
  specification.engine_version = std::to_string(b2_version.major) + "." +
                                 std::to_string(b2_version.minor) + "." +
                                 std::to_string(b2_version.revision) + " (pinned, box2d-py 2.3.8)";
  Dl_info where{};
  // b2_version is in the program or library that the engine is linked into.
  if (dladdr(&b2_version, &where) != 0 && where.dli_fname != nullptr) {
    specification.engine_path = where.dli_fname;
  }
}

}  // namespace

const Specification& common_specification() {
  static const Specification kCommon = [] {
    Specification specification;
    specification.dt = 1.0 / kStepsPerSecond;
    specification.gravity = to_vector3({0, kGravity});
    specification.reward_threshold = kRewardThreshold;
    specification.contact_links = {"lower_leg_1", "lower_leg_2"};
    // Ray 0 points straight down: -Y of the lidar frame, whose Y is up.
    specification.range_finder = {kLidarRays, -M_PI / 2, kLidarIncrement, kLidarRange};
    set_spaces(specification);
    set_engine(specification);
    read_walker(specification);
    return specification;
  }();
  return kCommon;
}

std::shared_ptr<const Specification> make_specification(const std::string& id,
                                                        const Parameters& parameters,
                                                        const std::string& stepper) {
  static std::mutex mutex;
  static std::map<std::tuple<std::string, Parameters, std::string>,
                  std::weak_ptr<const Specification>>
      specifications;
  const std::lock_guard<std::mutex> lock(mutex);
  std::weak_ptr<const Specification>& known = specifications[{id, parameters, stepper}];
  if (auto specification = known.lock()) return specification;
  auto specification = std::make_shared<Specification>(common_specification());
  specification->id = id;
  for (const char* name : {"hardcore", "reuse_world", "max_episode_steps"}) {
    specification->parameters.emplace_back(name, parameters.at(name));
  }
  specification->max_episode_steps =
      static_cast<std::uint32_t>(std::get<std::int64_t>(parameters.at("max_episode_steps")));
  specification->episodes_are_independent = !std::get<bool>(parameters.at("reuse_world"));
  if (!stepper.empty()) specification->engine_version += kSteppedBy + stepper;
  known = specification;
  return specification;
}

Clouds generate_clouds(Generator& generator) {
  Clouds clouds{};
  const double y = kViewportHeight / kScale * 3 / 4;
  for (Cloud& cloud : clouds) {
    const double x = generator.uniform(0, kTerrainLength) * kTerrainStep;
    for (std::size_t a = 0; a < cloud.size(); ++a) {
      const double angle = 3.14 * 2 * static_cast<double>(a) / 5;
      const double left = x + 15 * kTerrainStep * std::sin(angle);
      cloud[a].x = left + generator.uniform(0, 5 * kTerrainStep);
      const double low = y + 5 * kTerrainStep * std::cos(angle);
      cloud[a].y = low + generator.uniform(0, 5 * kTerrainStep);
    }
  }
  return clouds;
}

void describe_scene(const Ground& ground, const Clouds& clouds, Scene& scene) {
  scene = Scene{};
  for (std::size_t i = 0; i + 1 < ground.points.size(); ++i) {
    const Point& from = ground.points[i];
    const Point& to = ground.points[i + 1];
    scene.ground.push_back(
        {{{from.x, from.y}, {to.x, to.y}, {to.x, ground.bottom}, {from.x, ground.bottom}},
         rgb(102, 153, 76)});
    scene.surface_colors.push_back(rgb(76, i % 2 == 0 ? 255 : 204, 76));
  }
  const auto white = [](const auto& outline) {
    ScenePolygon polygon{{}, rgb(255, 255, 255)};
    for (const Point& point : outline) polygon.points.push_back({point.x, point.y});
    return polygon;
  };
  for (const auto& obstacle : ground.obstacles) scene.obstacles.push_back(white(obstacle));
  for (const Cloud& cloud : clouds) scene.clouds.push_back(white(cloud));
  scene.flags.push_back({3 * kTerrainStep, kTerrainHeight, kFlagHeight, rgb(230, 51, 0)});
}

Vector3 to_vector3(const b2Vec2& vector) { return {double{vector.x}, 0, double{vector.y}}; }

Pose to_pose(const b2Vec2& position, float angle) {
  const double half = double{angle} / 2;
  return {to_vector3(position), {0, -std::sin(half), 0, std::cos(half)}};
}

float frame_rotation(const Physics& physics, std::size_t joint) {
  const bool is_hip = joint == kHip1 || joint == kHip2;
  const float own = physics.joint(joint).GetReferenceAngle();
  return is_hip ? own : own + frame_rotation(physics, joint - 1);
}

Color rgb(double red, double green, double blue) {
  constexpr double kFull = 255;
  return {red / kFull, green / kFull, blue / kFull, 1};
}

const b2Body& child_of(const b2RevoluteJoint& joint) {
  return *const_cast<b2RevoluteJoint&>(joint).GetBodyB();  // Box2D offers no const accessor
}

}  // namespace walker::bipedal_walker
