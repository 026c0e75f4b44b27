// Plot of the return over the steps of an episode.
#pragma once

#include <QWidget>

#include "rviz_plugins/return_curve.h"

namespace walker {

/// Draws the present episode's curve in front of the previous one's.
class ReturnPlot : public QWidget {
 public:
  explicit ReturnPlot(QWidget* parent = nullptr);

  void show_curves(const ReturnCurve& present, const ReturnCurve& previous);

  QSize sizeHint() const override { return {240, 160}; }

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  ReturnCurve present_, previous_;
};

}  // namespace walker
