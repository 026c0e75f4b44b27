#include "rviz_plugins/walker_panel.h"

#include <array>
#include <optional>

#include <QGroupBox>
#include <QHBoxLayout>
#include <QPainter>
#include <QRegularExpressionValidator>
#include <QSignalBlocker>
#include <QTimer>
#include <QVBoxLayout>
#include <pluginlib/class_list_macros.hpp>

#include "base/limits.h"

namespace walker {
namespace {

constexpr int kRefreshPeriod = 100;  // [ms]
constexpr const char* kServer = "walker_sim";

enum class Sign { reset, pause, run, step };

// Colours of the buttons' icons.
const QColor kResetColor(20, 120, 110);
const QColor kPauseColor(200, 110, 0);
const QColor kStepColor(90, 70, 170);

QIcon icon_of(Sign sign) {
  QPixmap picture(16, 16);
  picture.fill(Qt::transparent);
  QPainter painter(&picture);
  painter.setRenderHint(QPainter::Antialiasing);
  painter.setPen(Qt::NoPen);
  const auto triangle = [&painter](double left, double width) {
    const std::array<QPointF, 3> corners{QPointF(left, 1), {left + width, 8}, {left, 15}};
    painter.drawPolygon(corners.data(), 3);
  };
  switch (sign) {
    case Sign::reset:
      painter.setBrush(kResetColor);
      painter.drawRect(1, 1, 4, 14);
      painter.drawPolygon(QPolygonF({QPointF(15, 1), {5, 8}, {15, 15}}));
      break;
    case Sign::pause:
      painter.setBrush(kPauseColor);
      painter.drawRect(2, 1, 5, 14);
      painter.drawRect(9, 1, 5, 14);
      break;
    case Sign::run:
      painter.setBrush(kPauseColor);
      triangle(2, 12);
      break;
    case Sign::step:
      painter.setBrush(kStepColor);
      triangle(1, 9);
      painter.drawRect(11, 1, 4, 14);
      break;
  }
  return {picture};
}

/// Puts widgets beside each other, the second of three as wide as possible.
template <typename... Widgets>
QLayout* row_of(Widgets*... widgets) {
  auto* const row = new QHBoxLayout;
  (row->addWidget(widgets), ...);
  if (sizeof...(widgets) == 3) row->setStretch(1, 1);
  return row;
}

void show_line(QLabel* label, const QString& text, const char* color) {
  label->setText(text);
  label->setToolTip(text);
  label->setStyleSheet(QString("color: %1").arg(color));
}

}  // namespace

WalkerPanel::WalkerPanel(QWidget* parent)
    : rviz::Panel(parent),
      server_(new QLineEdit(kServer)),
      state_(new QLabel),
      seed_(new QLineEdit),
      reset_(new QPushButton(icon_of(Sign::reset), "Reset")),
      pause_(new QPushButton(icon_of(Sign::pause), "Pause")),
      step_(new QPushButton(icon_of(Sign::step), "Step")),
      factor_(new QDoubleSpinBox),
      measured_(new QLabel),
      world_(new WorldEditor),
      plot_(new ReturnPlot),
      answer_(new QLabel) {
  auto* const worlds = new QGroupBox("World from the next reset on");
  (new QVBoxLayout(worlds))->addWidget(world_);
  auto* const column = new QVBoxLayout(this);
  column->addWidget(server_);
  column->addWidget(state_);
  column->addLayout(row_of(new QLabel("Seed"), seed_, reset_));
  column->addLayout(row_of(pause_, step_));
  column->addLayout(row_of(new QLabel("Real-time factor"), factor_, measured_));
  column->addWidget(worlds);
  column->addWidget(plot_, 1);
  column->addWidget(answer_);
  describe_widgets();
  connect_widgets();
  link_.connect(kServer);
  refresh();
}

void WalkerPanel::describe_widgets() {
  state_->setWordWrap(true);
  answer_->setWordWrap(true);
  server_->setToolTip("Name of the server's node");
  seed_->setPlaceholderText("continues");
  seed_->setToolTip("Seed of the reset; empty: the generator continues");
  seed_->setValidator(new QRegularExpressionValidator(QRegularExpression("[0-9]{0,20}"), seed_));
  reset_->setToolTip("Begins an episode");
  step_->setToolTip("Makes one step with an action of zeros; paused, or in lock-step");
  factor_->setRange(0, kMaxRealTimeFactor);
  factor_->setSpecialValueText("unlimited");
  factor_->setSingleStep(0.25);
  factor_->setValue(1);
  factor_->setKeyboardTracking(false);
  factor_->setToolTip(
      "Simulation time over wall time; 0: as fast as it goes; -: the callers of ~step or another "
      "node's /clock set the pace");
  measured_->setToolTip("As measured since the last report");
}

void WalkerPanel::connect_widgets() {
  connect(server_, &QLineEdit::editingFinished, this, [this] {
    link_.connect(server_->text().toStdString());
    Q_EMIT configChanged();
  });
  connect(reset_, &QPushButton::clicked, this, [this] { reset(); });
  connect(seed_, &QLineEdit::returnPressed, this, [this] { reset(); });
  connect(pause_, &QPushButton::clicked, this, [this] { link_.set_paused(!is_paused_); });
  connect(step_, &QPushButton::clicked, this, [this] { link_.step(); });
  connect(factor_, QOverload<double>::of(&QDoubleSpinBox::valueChanged), this,
          [this](double factor) { link_.set_real_time_factor(factor); });
  auto* const timer = new QTimer(this);
  connect(timer, &QTimer::timeout, this, [this] { refresh(); });
  timer->start(kRefreshPeriod);
}

void WalkerPanel::reset() {
  std::optional<std::uint64_t> seed;
  if (!seed_->text().isEmpty()) {
    bool is_number = false;
    seed = seed_->text().toULongLong(&is_number);
    if (!is_number) {
      show_line(answer_, "the seed must be at most 2^64 - 1", "#b02020");
      return;
    }
  }
  link_.reset(seed, world_->world());
}

void WalkerPanel::refresh() {
  const ServerView view = link_.view();
  show_state(view);
  world_->show_server(view.spec.id, view.worlds, view.spec.world);
  plot_->show_curves(view.present, view.previous);
  if (view.num_answers == num_answers_) return;
  num_answers_ = view.num_answers;
  show_line(answer_, QString::fromStdString(view.answer), view.is_refused ? "#b02020" : "#206020");
}

void WalkerPanel::show_state(const ServerView& view) {
  const bool is_there = view.trouble.empty();
  for (QWidget* widget : std::initializer_list<QWidget*>{seed_, reset_, pause_, step_, world_}) {
    widget->setEnabled(is_there);
  }
  const bool sets_pace = view.wanted_factor.has_value();
  factor_->setEnabled(is_there && sets_pace);
  factor_->setSpecialValueText(sets_pace ? "unlimited" : "-");
  if (!is_there) {
    show_line(state_, QString::fromStdString(view.trouble), "#b02020");
    measured_->clear();
    return;
  }
  is_paused_ = view.is_paused;
  pause_->setIcon(icon_of(is_paused_ ? Sign::run : Sign::pause));
  pause_->setText(is_paused_ ? "Run" : "Pause");
  const std::string& mode = view.spec.mode;
  show_line(state_, QString::fromStdString(view.spec.id + ", " + (is_paused_ ? "paused" : mode)),
            "#206020");
  measured_->setText(QString::number(view.factor, 'f', 2));
  if (sets_pace && factor_->hasFocus()) return;
  const QSignalBlocker blocker(factor_);
  factor_->setValue(view.wanted_factor.value_or(0));
}

void WalkerPanel::load(const rviz::Config& config) {
  rviz::Panel::load(config);
  QString server;
  if (!config.mapGetString("Server", &server) || server == server_->text()) return;
  server_->setText(server);
  link_.connect(server.toStdString());
}

void WalkerPanel::save(rviz::Config config) const {
  rviz::Panel::save(config);
  config.mapSetValue("Server", server_->text());
}

}  // namespace walker

PLUGINLIB_EXPORT_CLASS(walker::WalkerPanel, rviz::Panel)
