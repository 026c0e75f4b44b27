#include "robots/bipedal_walker/observation.h"

#include <algorithm>
#include <cmath>

#include "base/checks.h"
#include "base/range_finder.h"
#include "base/unwrapped_angle.h"

namespace walker::bipedal_walker {
namespace {

using RayEnds = std::array<b2Vec2, kLidarRays>;

/// Far above the rounding errors of ground and rays [m].
constexpr auto kMargin = static_cast<float>(kTerrainStep);

b2Vec2 to_vector(const Point& point) {
  return {static_cast<float>(point.x), static_cast<float>(point.y)};
}

void keep_nearest(float fraction, RayHit& ray) {
  if (fraction <= ray.fraction) ray = {fraction, true};
}

/// Intersects the edge's line, normal.q = normal.from, with each ray, q = origin + t d. Performs
/// the operations of b2EdgeShape::RayCast.
void intersect_edge(const b2Vec2& from, const b2Vec2& to, const b2Vec2& origin, const RayEnds& ends,
                    LidarScan& scan) {
  const b2Vec2 edge = to - from;
  const float edge_squared = b2Dot(edge, edge);
  b2Vec2 normal(edge.y, -edge.x);
  normal.Normalize();
  const float numerator = b2Dot(normal, from - origin);
  for (std::size_t i = 0; i < ends.size(); ++i) {
    if (ends[i].x < from.x - kMargin) continue;
    const b2Vec2 direction = ends[i] - origin;
    const float denominator = b2Dot(normal, direction);
    if (denominator == 0) continue;
    const float t = numerator / denominator;
    if (t < 0 || scan[i].fraction < t) continue;
    const b2Vec2 hit = origin + t * direction;
    const float along = b2Dot(hit - from, edge) / edge_squared;
    if (along < 0 || 1 < along) continue;
    keep_nearest(t, scan[i]);
  }
}

void intersect_obstacle(const b2Fixture& obstacle, float left, const b2Vec2& origin,
                        const RayEnds& ends, LidarScan& scan) {
  for (std::size_t i = 0; i < ends.size(); ++i) {
    if (ends[i].x < left - kMargin) continue;
    const b2RayCastInput input{origin, ends[i], scan[i].fraction};
    b2RayCastOutput output;
    if (obstacle.RayCast(&output, input, 0)) keep_nearest(output.fraction, scan[i]);
  }
}

/// Rounds to float32, as Gymnasium stores the state.
double rounded(double value) { return static_cast<double>(static_cast<float>(value)); }

/// Converts the hull origin's velocity in hull axes to the centre of mass's in world axes.
std::array<double, 2> velocity_of_center(const Observed& observed, const Point& center,
                                         const std::array<double, 2>& velocity) {
  const double turning = observed.hull_angular_velocity;
  const double along = velocity[0] - turning * center.y;
  const double across = velocity[1] + turning * center.x;
  const double sine = std::sin(observed.hull_angle);
  const double cosine = std::cos(observed.hull_angle);
  return {cosine * along - sine * across, sine * along + cosine * across};
}

class Builder : public ObservationBuilder {
 public:
  explicit Builder(std::shared_ptr<const Specification> specification)
      : specification_(std::move(specification)) {}

  void reset() override { hull_angle_.reset(); }

  void build(const Measurements& measurements, double* observation) override {
    check_measurements(measurements, *specification_);
    Observed observed{};
    // Rotation about -y. Roll and yaw, which a real robot also has, are outside Box2D's plane.
    const Quaternion& q = measurements.orientation;
    observed.hull_angle = hull_angle_.follow(2 * std::atan2(-q[1], q[3]));
    observed.hull_angular_velocity = -measurements.angular_velocity[1];
    const Vector3& center = specification_->links.front().center_of_mass;
    const Vector3& velocity = measurements.linear_velocity;
    observed.hull_velocity =
        velocity_of_center(observed, {center[0], center[2]}, {velocity[0], velocity[2]});
    std::copy_n(measurements.joint_position.begin(), kJointCount, observed.joint_position.begin());
    std::copy_n(measurements.joint_velocity.begin(), kJointCount, observed.joint_velocity.begin());
    std::transform(measurements.contacts.begin(), measurements.contacts.end(),
                   observed.leg_touches.begin(), [](std::uint8_t touches) { return touches != 0; });
    write_fractions(measurements.ranges.data(), measurements.ranges.size(),
                    maximum_range_of(measurements, specification_->range_finder),
                    observed.ray_fraction.data());
    write_observation(observed, observation);
  }

 private:
  std::shared_ptr<const Specification> specification_;
  UnwrappedAngle hull_angle_;
};

}  // namespace

void add(const SensorNoise& noise, const b2Vec2& center, const LidarScan& scan, double range,
         Observed& observed) {
  for (std::size_t i = 0; i < noise.joint_position.size(); ++i) {
    observed.joint_position[i] += noise.joint_position[i];
  }
  for (std::size_t i = 0; i < noise.joint_velocity.size(); ++i) {
    observed.joint_velocity[i] += noise.joint_velocity[i];
  }
  // Sensors measure the origin's velocity, from which a robot computes the centre's by attitude and
  // angular velocity. Differences are added, so that without noise no bit changes.
  const Point arm{double{center.x}, double{center.y}};
  const auto before = velocity_of_center(observed, arm, {0, 0});
  observed.hull_angle -= noise.pitch;  // about -y
  observed.hull_angular_velocity -= noise.angular_velocity;
  const auto after = velocity_of_center(observed, arm, {0, 0});
  for (std::size_t k = 0; k < 2; ++k) {
    observed.hull_velocity[k] += noise.linear_velocity[k] + (after[k] - before[k]);
  }
  for (std::size_t i = 0; i < noise.ranges.size(); ++i) {
    if (!scan[i].hit) continue;
    const double noisy = double{scan[i].fraction} * range + noise.ranges[i];
    observed.ray_fraction[i] = std::clamp(noisy, 0.0, range) / range;
  }
}

/// This does not search the world's tree: the ground is sorted from left to right, so the few
/// pieces that rays can hit are known. The nearest hit does not depend on their order.
void cast_lidar(const Physics& physics, const Ground& ground, double range, LidarScan& scan) {
  // The rays' directions: forward, down. Computed by the C library's sine, as in Gymnasium.
  static const auto kRays = [] {
    std::array<std::array<double, 2>, kLidarRays> rays{};
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const double angle = 1.5 * static_cast<double>(i) / 10.0;
      rays[i] = {std::sin(angle), std::cos(angle)};
    }
    return rays;
  }();
  const b2Vec2 origin = physics.hull().GetPosition();
  RayEnds ends;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const auto [forward, down] = kRays[i];
    // Summed in double and rounded once, as Gymnasium does.
    ends[i] = b2Vec2(static_cast<float>(double{origin.x} + forward * range),
                     static_cast<float>(double{origin.y} - down * range));
    // Box2D's own assertion, which fails for rays of zero length and for NaN.
    b2Assert((ends[i] - origin).LengthSquared() > 0);
  }
  scan = {};
  const float left = origin.x - kMargin;
  const float right = ends.back().x + kMargin;  // ends are in ascending order of x

  const auto edge_below = [&](float x) {
    constexpr double kLastEdge = kTerrainLength - 2;
    const double index = std::floor(double{x} / kTerrainStep);
    return static_cast<std::size_t>(std::clamp(index, 0.0, kLastEdge));
  };
  for (std::size_t i = edge_below(left); i <= edge_below(right); ++i) {
    intersect_edge(to_vector(ground.points[i]), to_vector(ground.points[i + 1]), origin, ends,
                   scan);
  }
  for (std::size_t i = 0; i < ground.obstacles.size(); ++i) {
    const std::array<Point, 4>& corners = ground.obstacles[i];  // left and right first
    if (corners[1].x < double{left} || corners[0].x > double{right}) continue;
    intersect_obstacle(physics.obstacle(i), static_cast<float>(corners[0].x), origin, ends, scan);
  }
}

Observed observed_in(const Physics& physics) {
  const b2Body& hull = physics.hull();
  const b2Vec2 velocity = hull.GetLinearVelocity();  // centre of mass
  Observed observed{};
  observed.hull_angle = double{hull.GetAngle()};
  observed.hull_angular_velocity = double{hull.GetAngularVelocity()};
  observed.hull_velocity = {double{velocity.x}, double{velocity.y}};
  for (std::size_t i = 0; i < kJointCount; ++i) {
    observed.joint_position[i] = double{physics.joint(i).GetJointAngle()};
    observed.joint_velocity[i] = double{physics.joint(i).GetJointSpeed()};
  }
  for (std::size_t leg = 0; leg < 2; ++leg) observed.leg_touches[leg] = physics.leg_touches(leg);
  return observed;
}

void write_observation(const Observed& observed, double* observation) {
  const auto [forward, up] = observed.hull_velocity;
  observation[kHullAngle] = rounded(observed.hull_angle);
  observation[kHullAngularVelocity] =
      rounded(2.0 * observed.hull_angular_velocity / kStepsPerSecond);
  observation[kHorizontalSpeed] =
      rounded(0.3 * forward * (kViewportWidth / kScale) / kStepsPerSecond);
  observation[kVerticalSpeed] = rounded(0.3 * up * (kViewportHeight / kScale) / kStepsPerSecond);
  for (std::size_t leg = 0; leg < 2; ++leg) {
    const std::size_t hip = 2 * leg;
    const std::size_t knee = hip + 1;
    double* part = observation + (leg == 0 ? kFirstLeg : kSecondLeg);
    part[0] = rounded(observed.joint_position[hip]);
    part[1] = rounded(observed.joint_velocity[hip] / kHipSpeed);
    part[2] = rounded(observed.joint_position[knee] + 1.0);
    part[3] = rounded(observed.joint_velocity[knee] / kKneeSpeed);
    part[4] = observed.leg_touches[leg] ? 1.0 : 0.0;
  }
  std::transform(observed.ray_fraction.begin(), observed.ray_fraction.end(),
                 observation + kFirstRay, rounded);
}

std::unique_ptr<ObservationBuilder> make_observation_builder(const std::string& id,
                                                             const Parameters& parameters) {
  return std::make_unique<Builder>(make_specification(id, parameters));
}

}  // namespace walker::bipedal_walker
