#include "robots/bipedal_walker/observation_builder.h"

#include <algorithm>
#include <cmath>

#include "base/checks.h"
#include "base/unwrapped_angle.h"
#include "robots/bipedal_walker/observation.h"
#include "robots/bipedal_walker/specification.h"

namespace walker::bipedal_walker {
namespace {

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
    observed.hull_velocity = velocity_of_center(measurements, observed);
    std::copy_n(measurements.joint_position.begin(), kJointCount, observed.joint_position.begin());
    std::copy_n(measurements.joint_velocity.begin(), kJointCount, observed.joint_velocity.begin());
    std::transform(measurements.contacts.begin(), measurements.contacts.end(),
                   observed.leg_touches.begin(), [](std::uint8_t touches) { return touches != 0; });
    std::transform(measurements.ranges.begin(), measurements.ranges.end(),
                   observed.ray_fraction.begin(),
                   [](double range) { return std::min(range / kLidarRange, 1.0); });
    write_observation(observed, observation);
  }

 private:
  /// Converts the hull origin's velocity in hull axes to the centre of mass's in world axes.
  std::array<double, 2> velocity_of_center(const Measurements& measurements,
                                           const Observed& observed) const {
    const Vector3& center = specification_->links.front().center_of_mass;
    const double turning = observed.hull_angular_velocity;
    const double along = measurements.linear_velocity[0] - turning * center[2];
    const double across = measurements.linear_velocity[2] + turning * center[0];
    const double sine = std::sin(observed.hull_angle);
    const double cosine = std::cos(observed.hull_angle);
    return {cosine * along - sine * across, sine * along + cosine * across};
  }

  std::shared_ptr<const Specification> specification_;
  UnwrappedAngle hull_angle_;
};

}  // namespace

std::unique_ptr<ObservationBuilder> make_observation_builder(const Options& options) {
  return std::make_unique<Builder>(make_specification(options));
}

}  // namespace walker::bipedal_walker
