// Depth, camera pose and focal length of images against ray casting.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "pose_algebra.h"
#include "robots/mujoco/model_file.h"
#include "robots/mujoco/player.h"
#include "stepper.h"
#include "walker_sim/renderer.h"

namespace walker::mujoco {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kFloor = 0;  // z of the built-in models' floor [m]

double dot(const Vector3& a, const Vector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// a + scale * b
Vector3 sum(const Vector3& a, const Vector3& b, double scale) {
  return {a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2]};
}

/// The direction may have any length; it is the unit of distances along the ray.
struct Ray {
  Vector3 origin;
  Vector3 direction;
};

/// Smaller root of a t^2 + 2 b t + c; infinity if there is none.
double first_root(double a, double b, double c) {
  const double discriminant = b * b - a * c;
  return discriminant < 0 ? kInfinity : (-b - std::sqrt(discriminant)) / a;
}

double distance_to_sphere(const Ray& ray, const Vector3& center, double radius) {
  const Vector3 arm = sum(ray.origin, center, -1);
  return first_root(dot(ray.direction, ray.direction), dot(arm, ray.direction),
                    dot(arm, arm) - radius * radius);
}

/// Distance to a capsule along the z axis of its frame.
double distance_to_capsule(const Ray& ray, const Pose& pose, double radius, double half_length) {
  const Vector3 axis = rotated(pose.orientation, {0, 0, 1});
  const Vector3 arm = sum(ray.origin, pose.position, -1);
  const Vector3 across = sum(ray.direction, axis, -dot(ray.direction, axis));
  const Vector3 arm_across = sum(arm, axis, -dot(arm, axis));
  const double side = first_root(dot(across, across), dot(arm_across, across),
                                 dot(arm_across, arm_across) - radius * radius);
  if (std::abs(dot(sum(arm, ray.direction, side), axis)) <= half_length) return side;
  return std::min(distance_to_sphere(ray, transformed(pose, {0, 0, half_length}), radius),
                  distance_to_sphere(ray, transformed(pose, {0, 0, -half_length}), radius));
}

double distance_to_floor(const Ray& ray) {
  const double distance = (kFloor - ray.origin[2]) / ray.direction[2];
  return distance > 0 ? distance : kInfinity;
}

double distance_to_walker(const Ray& ray, const std::vector<Link>& links, const Sensors& sensors) {
  double nearest = kInfinity;
  for (std::size_t i = 0; i < links.size(); ++i) {
    for (const Solid& solid : links[i].solids) {
      nearest =
          std::min(nearest, distance_to_capsule(ray, composed(sensors.link_poses[i], solid.pose),
                                                solid.size[0], solid.size[1]));
    }
  }
  return nearest;
}

/// Ray-cast depths at a pixel's corners, edges and centre [m].
struct Pixel {
  double least = kInfinity;
  double most = 0;
  double middle = 0;
  bool has_walker = false;
};

/// Rendered and ray-cast depths of an image. Columns and rows start at the image's corner.
struct Comparison {
  const Camera& camera;
  const Image& image;
  const std::vector<Link>& links;
  const Sensors& sensors;

  /// The direction has depth 1 m, so distances along the ray are depths.
  Ray ray(double column, double row) const {
    const Vector3 direction{(column - camera.width / 2.0) / camera.focal_length,
                            (row - camera.height / 2.0) / camera.focal_length, 1};
    return {image.camera_pose.position, rotated(image.camera_pose.orientation, direction)};
  }

  double drawn(std::uint32_t column, std::uint32_t row) const {
    return double{image.depth.at(std::size_t{row} * image.width + column)};
  }

  Pixel cast(std::uint32_t column, std::uint32_t row) const {
    Pixel pixel;
    for (const double right : {0.0, 1.0, 0.5}) {
      for (const double down : {0.0, 1.0, 0.5}) {
        const Ray line = ray(column + right, row + down);
        const double walker = distance_to_walker(line, links, sensors);
        const double nearest = std::min(walker, distance_to_floor(line));
        pixel.least = std::min(pixel.least, nearest);
        pixel.most = std::max(pixel.most, nearest);
        pixel.middle = nearest;  // the last ray is the centre's
        pixel.has_walker = pixel.has_walker || walker < kInfinity;
      }
    }
    return pixel;
  }
};

/// A camera. With multisampling, a rendered depth may be that of any point in the pixel.
struct View {
  const char* name;
  Parameters camera;
  bool multisampled;
};

class RendererDepthTest : public testing::TestWithParam<View> {
 protected:
  /// v5 with two more cameras: one with a narrow view, fixed in the world, one aimed at the torso.
  std::string model() const {
    std::string text = replaced(
        builtin_text("walker2d_v5.xml"), "<worldbody>",
        "<worldbody>\n<camera name=\"narrow\" pos=\"-1 -6 2\" xyaxes=\"1 0 0 0 0.3 1\" "
        "fovy=\"25\"/>"
        "\n<camera name=\"turning\" pos=\"2 -3 1.5\" mode=\"targetbody\" target=\"torso\"/>");
    if (!GetParam().multisampled) {
      text = replaced(text, "<worldbody>",
                      "<visual><quality offsamples=\"0\"/></visual>\n<worldbody>");
    }
    return text;
  }

  Folder folder_;
  Parameters parameters_{{"xml_file", folder_.write("model.xml", model())},
                         {"terminate_when_unhealthy", false}};
};

TEST_P(RendererDepthTest, EqualsRayCasting) {
  constexpr double kTessellation = 3e-3;  // error of drawing capsules as prisms [m]
  constexpr double kFacing = 1e-2;        // maximum depth range within a pixel without an edge [m]
  constexpr double kNear = 12;            // up to here the depth buffer resolves 0.1 mm [m]
  Stepper walker("Walker2d-v5", parameters_);
  walker.reset(3);
  Actions actions("random", 3);
  std::vector<double> action;
  const auto renderer = make_renderer("Walker2d-v5", parameters_, GetParam().camera);
  for (std::uint32_t step = 1; step <= 24; ++step) {
    actions.draw(walker.observation, action);
    walker.step(action);
    if (step % 12 != 0) continue;
    StateCapture captured;
    capture(*walker.environment, step, captured);
    Image image;
    renderer->render(captured, {false, true}, image);
    const Comparison all{renderer->camera(), image, walker.environment->specification().links,
                         captured.sensors};
    std::array<int, 2> compared{};  // floor, walker
    for (std::uint32_t row = 0; row < image.height; ++row) {
      for (std::uint32_t column = 0; column < image.width; ++column) {
        const Pixel pixel = all.cast(column, row);
        if (pixel.most > kNear || (pixel.has_walker && pixel.most - pixel.least > kFacing))
          continue;
        const double tolerance = pixel.has_walker ? kTessellation : 1e-3;
        const bool anywhere = GetParam().multisampled;
        const double drawn = all.drawn(column, row);
        ASSERT_GE(drawn, (anywhere ? pixel.least : pixel.middle) - tolerance)
            << column << " " << row;
        ASSERT_LE(drawn, (anywhere ? pixel.most : pixel.middle) + tolerance)
            << column << " " << row;
        ++compared.at(pixel.has_walker ? 1 : 0);
      }
    }
    EXPECT_GT(compared[0], 10000);
    EXPECT_GT(compared[1], 100);
  }
}

constexpr std::int64_t kWidth = 400;
constexpr std::int64_t kHeight = 300;
const Parameters kSize{{"width", kWidth}, {"height", kHeight}};

Parameters sized(Parameters camera) {
  camera.insert(kSize.begin(), kSize.end());
  return camera;
}

INSTANTIATE_TEST_SUITE_P(
    Walker2d, RendererDepthTest,
    testing::Values(View{"track", sized({}), false}, View{"track_multisampled", sized({}), true},
                    View{"free", sized({{"camera_name", std::string()}}), false},
                    View{"free_from_behind",
                         sized({{"camera_name", std::string()}, {"azimuth", 30.0}}), false},
                    View{"narrow", sized({{"camera_id", std::int64_t{0}}}), false},
                    View{"turning", sized({{"camera_name", std::string("turning")}}), false}),
    [](const auto& test) { return std::string(test.param.name); });

StateCapture first_capture(const Parameters& parameters) {
  Stepper walker("Walker2d-v5", parameters);
  walker.reset(1);
  StateCapture captured;
  capture(*walker.environment, 0, captured);
  return captured;
}

/// The skybox is drawn around the camera, nearer than `far`; without it, the depth is `far`.
TEST(RendererDepth, SkyIsFar) {
  const Folder folder;
  const Parameters clear{
      {"xml_file", folder.write("clear.xml", without(builtin_text("walker2d_v5.xml"),
                                                     "<texture type=\"skybox\"", "/>"))}};
  const Parameters upwards = sized({{"camera_name", std::string()},
                                    {"lookat", std::vector<double>{0, 0, 10}},
                                    {"elevation", 40.0}});
  Image image;
  for (const bool has_sky : {true, false}) {
    const Parameters parameters = has_sky ? Parameters{} : clear;
    const auto renderer = make_renderer("Walker2d-v5", parameters, upwards);
    renderer->render(first_capture(parameters), {false, true}, image);
    const double far = renderer->camera().far;
    const auto [least, most] = std::minmax_element(image.depth.begin(), image.depth.end());
    EXPECT_GT(double{*least}, 0.5 * far);
    EXPECT_LE(double{*most}, far);
    EXPECT_EQ(*least == static_cast<float>(far), !has_sky);
  }
}

TEST(RendererDepth, DoesNotDependOnTheColor) {
  const auto renderer = make_renderer("Walker2d-v5");
  const StateCapture captured = first_capture({});
  Image depth;
  Image color;
  Image both;
  renderer->render(captured, {false, true}, depth);
  renderer->render(captured, {true, false}, color);
  renderer->render(captured, {true, true}, both);
  EXPECT_EQ(depth.depth, both.depth);
  EXPECT_EQ(color.rgb, both.rgb);
  EXPECT_TRUE(depth.rgb.empty());
  EXPECT_TRUE(color.depth.empty());
}

TEST(RendererDepth, IncludesTendons) {
  const Folder folder;
  const std::string sites = replaced(
      builtin_text("walker2d_v5.xml"), "<worldbody>",
      "<worldbody><site name=\"a\" pos=\"-1 -0.5 1\"/><site name=\"b\" pos=\"1 -0.5 1\"/>");
  const std::string rope = replaced(sites, "</worldbody>",
                                    "</worldbody><tendon><spatial width=\"0.1\"><site site=\"a\"/>"
                                    "<site site=\"b\"/></spatial></tendon>");
  std::array<float, 2> nearest{};
  for (const bool has_rope : {false, true}) {
    const Parameters parameters{{"xml_file", folder.write("rope.xml", has_rope ? rope : sites)}};
    Image image;
    make_renderer("Walker2d-v5", parameters)
        ->render(first_capture(parameters), {false, true}, image);
    const std::size_t middle = (std::size_t{image.height} / 2) * image.width + image.width / 2;
    nearest.at(has_rope ? 1 : 0) = image.depth.at(middle);
  }
  EXPECT_GT(nearest[0], 2.9F) << "the torso";
  EXPECT_NEAR(nearest[1], 2.4F, 0.01F) << "the rope: its axis is 0.5 m nearer, its radius 0.1 m";
}

}  // namespace
}  // namespace walker::mujoco
