#include "rviz_plugins/return_plot.h"

#include <algorithm>

#include <QPainter>
#include <QPolygonF>

namespace walker {
namespace {

constexpr int kMargin = 6;  // [pixel]

/// Returns the rectangle of steps and returns that has all points, with 0 in it.
QRectF bounds_of(const ReturnCurve& one, const ReturnCurve& other) {
  double steps = 0;
  double low = 0;
  double high = 0;
  for (const ReturnCurve* curve : {&one, &other}) {
    for (const QPointF& point : curve->points()) {
      steps = std::max(steps, point.x());
      low = std::min(low, point.y());
      high = std::max(high, point.y());
    }
  }
  if (low == high) high = 1;
  return {QPointF(0, low), QPointF(steps, high)};
}

}  // namespace

ReturnPlot::ReturnPlot(QWidget* parent) : QWidget(parent) {
  setMinimumHeight(90);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Expanding);
  setToolTip("Return of the present episode; gray: of the previous one");
}

void ReturnPlot::show_curves(const ReturnCurve& present, const ReturnCurve& previous) {
  present_ = present;
  previous_ = previous;
  update();
}

void ReturnPlot::paintEvent(QPaintEvent* /*event*/) {
  QPainter painter(this);
  painter.setRenderHint(QPainter::Antialiasing);
  const QColor text = palette().color(QPalette::Text);
  const QColor faint = palette().color(QPalette::Mid);
  painter.fillRect(rect(), palette().color(QPalette::Base));
  painter.setPen(faint);
  painter.drawRect(rect().adjusted(0, 0, -1, -1));

  const int line = painter.fontMetrics().height();
  const QRectF area = rect().adjusted(kMargin, kMargin + line, -kMargin, -kMargin - line);
  const QRectF bounds = bounds_of(present_, previous_);
  const auto place = [&](const QPointF& point) {
    return QPointF(area.left() + area.width() * (point.x() / std::max(bounds.width(), 1.0)),
                   area.bottom() - area.height() * (point.y() - bounds.top()) / bounds.height());
  };
  painter.drawLine(place({0, 0}), place({bounds.right(), 0}));
  const auto draw = [&](const ReturnCurve& curve, const QPen& pen) {
    QPolygonF polyline;
    for (const QPointF& point : curve.points()) polyline << place(point);
    painter.setPen(pen);
    painter.drawPolyline(polyline);
  };
  draw(previous_, QPen(faint, 1.5));
  draw(present_, QPen(QColor(215, 90, 30), 2));

  painter.setPen(text);
  const QRect inner = rect().adjusted(kMargin, 2, -kMargin, -2);
  painter.drawText(inner, Qt::AlignTop | Qt::AlignLeft,
                   "Return, up to " + QString::number(bounds.bottom(), 'f', 1));
  painter.drawText(inner, Qt::AlignBottom | Qt::AlignRight,
                   QString::number(bounds.right()) + (bounds.right() == 1 ? " step" : " steps"));
  if (bounds.top() < 0) {
    painter.drawText(inner, Qt::AlignBottom | Qt::AlignLeft,
                     "down to " + QString::number(bounds.top(), 'f', 1));
  }
  if (!present_.points().empty()) {
    painter.setPen(QColor(190, 70, 20));
    painter.drawText(inner, Qt::AlignTop | Qt::AlignRight,
                     QString::number(present_.points().back().y(), 'f', 2));
  }
}

}  // namespace walker
