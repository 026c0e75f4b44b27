#include "robots/bipedal_walker/renderer.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>

#include "robots/bipedal_walker/canvas.h"
#include "robots/bipedal_walker/constants.h"
#include "robots/bipedal_walker/specification.h"

namespace walker::bipedal_walker {
namespace {

using Edge = Canvas::Edge;
using Points = std::vector<std::array<double, 2>>;  // x, z [m]

// Constants of Gymnasium's `render`, in pixels of a picture 400 pixels high unless noted.
constexpr double kHullFromLeft = kViewportWidth / kScale / 5;  // [m]
constexpr double kPennantHeight = 10;
constexpr double kPennantLength = 25;
constexpr std::uint32_t kRayPeriod = 100;  // pictures per cycle of rays

constexpr double kCameraDistance = 10;  // [m]

const Color kNothing = rgb(0, 0, 0);
const Color kSky = rgb(215, 215, 255);
const Color kRay = rgb(255, 0, 0);
const Color kPole = rgb(0, 0, 0);
const Color kObstacleOutline = rgb(153, 153, 153);
const Color kHullOutline = rgb(76, 76, 127);
const Color kLeg1Outline = rgb(127, 76, 101);
const Color kLeg2Outline = rgb(77, 26, 51);

std::array<double, 2> to_world(const Pose& link, const std::array<double, 2>& point) {
  // Sine and cosine of half the rotation about y.
  const double s = link.orientation[1];
  const double c = link.orientation[3];
  const double sine = 2 * s * c;
  const double cosine = c * c - s * s;
  return {link.position[0] + cosine * point[0] + sine * point[1],
          link.position[2] - sine * point[0] + cosine * point[1]};
}

class SideView : public Renderer {
 public:
  SideView(std::uint32_t width, std::uint32_t height)
      : scale_(kScale * height / kViewportHeight), zoom_(height / kViewportHeight) {
    camera_.width = width;
    camera_.height = height;
  }

  const Camera& camera() const override { return camera_; }

  void render(const StateCapture& captured, const Channels& channels, Image& image) override {
    if (channels.depth) {
      throw std::invalid_argument("depth: BipedalWalker's renderer draws only color");
    }
    if (!canvas_) canvas_.emplace(camera_.width, camera_.height, std::max(zoom_, 1.0));
    check(captured);
    follow(captured.sensors.link_poses[0].position[0]);
    image.width = camera_.width;
    image.height = camera_.height;
    image.rgb.clear();
    image.depth.clear();
    image.camera_pose = camera_pose();
    if (!channels.color) return;
    draw(captured);
    canvas_->read(image.rgb);
  }

 private:
  static void check(const StateCapture& captured) {
    const std::size_t links = captured.sensors.link_poses.size();
    const std::size_t rays = captured.sensors.ranges.size();
    const std::size_t our_links = common_specification().links.size();
    if (links == our_links && rays == kLidarRays) return;
    throw std::invalid_argument("capture with " + std::to_string(links) + " links and " +
                                std::to_string(rays) + " rays; must have, as BipedalWalker, " +
                                std::to_string(our_links) + " and " + std::to_string(kLidarRays));
  }

  /// Scrolls so that a hull at x [m] is kHullFromLeft from the left edge.
  void follow(double x) {
    scroll_ = std::isfinite(x) ? x - kHullFromLeft : 0;
    left_ = std::trunc(std::max(0.0, scroll_) * scale_);
  }

  Pose camera_pose() const {
    const double half = std::sqrt(0.5);
    return {{(left_ + camera_.width / 2.0) / scale_, -kCameraDistance, camera_.height / scale_ / 2},
            {-half, 0, 0, half}};
  }

  /// Draws from back to front, as Gymnasium does.
  void draw(const StateCapture& captured) {
    draw_sky();
    // Parallax: clouds scroll at half the speed.
    for (const ScenePolygon& cloud : captured.scene.clouds) draw_scenery(cloud, scroll_ / 2);
    for (const ScenePolygon& ground : captured.scene.ground) draw_scenery(ground, scroll_);
    draw_ray(captured);
    draw_surfaces(captured.scene);
    for (auto i = captured.scene.obstacles.rbegin(); i != captured.scene.obstacles.rend(); ++i) {
      draw_solid(i->points, i->color, kObstacleOutline);
    }
    for (std::size_t link = 1; link <= kJointCount; ++link) {
      draw_link(captured, link, link < 3 ? kLeg1Outline : kLeg2Outline);
    }
    draw_link(captured, 0, kHullOutline);
    for (const Flag& flag : captured.scene.flags) draw_flag(flag);
  }

  /// Draws Gymnasium's sky. If the hull is left of x = 4 m, the picture stays at the world's origin
  /// but the sky keeps scrolling, so the right of the picture, which it does not cover, is black.
  void draw_sky() {
    canvas_->clear(kSky);
    if (scroll_ >= 0) return;
    const double end = std::trunc(scroll_ * scale_ + camera_.width) + 1;
    const double right = camera_.width;
    const double bottom = camera_.height;
    polygon_ = {{end, 0}, {right, 0}, {right, bottom}, {end, bottom}};
    canvas_->fill(polygon_, kNothing);
  }

  /// @param begin left edge of the picture in the polygon's coordinates [m]
  void draw_scenery(const ScenePolygon& scenery, double begin) {
    if (!is_between(scenery.points, begin, begin + camera_.width / scale_)) return;
    const double shift = (scroll_ - begin) * scale_;
    polygon_.clear();
    for (const auto& [x, z] : scenery.points) {
      polygon_.push_back(whole(x * scale_ + shift, z * scale_));
    }
    draw_body(scenery.color);
  }

  void draw_ray(const StateCapture& captured) {
    // Sweeps through the rays forward and backward, then draws none until the cycle ends.
    const RangeFinder& finder = common_specification().range_finder;
    const std::size_t picture = (captured.step + 1) % kRayPeriod;
    if (picture >= 2 * finder.num_rays) return;
    const std::size_t ray = picture < finder.num_rays ? picture : 2 * finder.num_rays - 1 - picture;
    const double reach = captured.sensors.maximum_range;  // 0: not captured
    const double range =
        std::min(captured.sensors.ranges[ray], reach > 0 ? reach : finder.maximum_range);
    const double angle = finder.angle_minimum + finder.angle_increment * static_cast<double>(ray);
    const Vector3& from = captured.sensors.link_poses[0].position;
    canvas_->draw_line(whole(from[0] * scale_, from[2] * scale_),
                       whole((from[0] + std::cos(angle) * range) * scale_,
                             (from[2] + std::sin(angle) * range) * scale_),
                       kRay, Edge::hard);
  }

  void draw_surfaces(const Scene& scene) {
    for (std::size_t i = std::min(scene.ground.size(), scene.surface_colors.size()); i-- > 0;) {
      const Points& points = scene.ground[i].points;
      if (!is_between(points, left_ / scale_, (left_ + camera_.width) / scale_)) continue;
      canvas_->draw_line(exact(points[0][0] * scale_, points[0][1] * scale_),
                         exact(points[1][0] * scale_, points[1][1] * scale_),
                         scene.surface_colors[i], Edge::smooth);
    }
  }

  void draw_link(const StateCapture& captured, std::size_t index, const Color& outline) {
    const Link& link = common_specification().links[index];
    for (const Prism& prism : link.prisms) {
      corners_.clear();
      for (const auto& vertex : prism.vertices) {
        corners_.push_back(to_world(captured.sensors.link_poses[index], vertex));
      }
      draw_solid(corners_, link.color, outline);
    }
  }

  void draw_flag(const Flag& flag) {
    const double x = flag.x * scale_;
    const double top = (flag.z + flag.height) * scale_;
    canvas_->draw_line(exact(x, flag.z * scale_), exact(x, top), kPole, Edge::smooth);
    polygon_ = {whole(x, top), whole(x, top - kPennantHeight * zoom_),
                whole(x + kPennantLength * zoom_, top - kPennantHeight / 2 * zoom_)};
    canvas_->fill(polygon_, flag.color);
    canvas_->outline(polygon_, kPole, Edge::hard);
  }

  /// Draws the shape of a Box2D body, whose single precision decides between neighbouring pixels.
  void draw_solid(const Points& points, const Color& color, const Color& outline) {
    polygon_.clear();
    for (const auto& [x, z] : points) {
      polygon_.push_back(whole(double{static_cast<float>(x) * static_cast<float>(scale_)},
                               double{static_cast<float>(z) * static_cast<float>(scale_)}));
    }
    draw_body(color);
    canvas_->outline(polygon_, outline, Edge::hard);
    canvas_->outline(polygon_, outline, Edge::smooth);
  }

  /// Fills polygon_ with smooth edges.
  void draw_body(const Color& color) {
    canvas_->fill(polygon_, color);
    canvas_->outline(polygon_, color, Edge::smooth);
  }

  static bool is_between(const Points& points, double begin, double end) {
    const auto [first, last] = std::minmax_element(
        points.begin(), points.end(), [](const auto& a, const auto& b) { return a[0] < b[0]; });
    return first != points.end() && (*last)[0] >= begin && (*first)[0] <= end;
  }

  /// Centre of the pixel at x to the right of and z above the world's origin [pixels].
  Pixel exact(double x, double z) const { return {x - left_ + 0.5, camera_.height - z - 0.5}; }

  /// The same for truncated x and z, as pygame draws most shapes.
  Pixel whole(double x, double z) const { return exact(std::trunc(x), std::trunc(z)); }

  Camera camera_;
  double scale_;  // pixels per metre
  double zoom_;   // height over Gymnasium's
  std::optional<Canvas> canvas_;

  double scroll_ = 0;           // Gymnasium's left edge [m]
  double left_ = 0;             // the picture's left edge, at least 0 [pixels]
  std::vector<Pixel> polygon_;  // scratch
  Points corners_;              // scratch
};

}  // namespace

std::unique_ptr<Renderer> make_renderer(const Parameters& camera) {
  const auto pixels = [&camera](const char* name) {
    return static_cast<std::uint32_t>(std::get<std::int64_t>(camera.at(name)));
  };
  return std::make_unique<SideView>(pixels("width"), pixels("height"));
}

}  // namespace walker::bipedal_walker
