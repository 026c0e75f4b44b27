// The return of an episode as a curve with a bounded number of points.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <QPointF>

namespace walker {

class ReturnCurve {
 public:
  static constexpr std::size_t kMaxPoints = 1000;

  /// @param step since the reset, increasing
  void add(std::uint32_t step, double episode_return) {
    const QPointF point(step, episode_return);
    if (last_goes_) points_.pop_back();
    points_.push_back(point);
    last_goes_ = step < next_;
    if (!last_goes_) next_ = step + stride_;
    if (points_.size() < kMaxPoints) return;
    stride_ *= 2;
    std::size_t kept = 0;
    for (std::size_t i = 0; i + 1 < points_.size(); i += 2) points_[kept++] = points_[i];
    points_[kept++] = points_.back();
    points_.resize(kept);
  }

  /// x: step, y: return. The last point is that of the last step.
  const std::vector<QPointF>& points() const { return points_; }

 private:
  std::vector<QPointF> points_;
  std::uint32_t stride_ = 1;  // steps between points
  std::uint32_t next_ = 0;    // step of the next point that stays
  bool last_goes_ = false;    // the last point is only that of the last step
};

}  // namespace walker
