#include "rviz_plugins/world_editor.h"

#include <algorithm>
#include <cmath>
#include <exception>

#include <QSignalBlocker>
#include <QVBoxLayout>

namespace walker {
namespace {

constexpr int kPositions = 1000;  // of a slider

/// Returns the ends of a slider: the limits, or if these are far away, twice the range.
std::pair<double, double> ends_of(const WorldParameter& parameter, const WorldRange& range) {
  const double size = std::max({std::abs(range.low), std::abs(range.high), 0.1});
  return {std::max(parameter.minimum, std::min(0.0, 2 * std::min(range.low, -size))),
          std::min(parameter.maximum, std::max(0.0, 2 * std::max(range.high, size)))};
}

QString text_of(double number) { return QString::number(number, 'g', 4); }

QString text_of(const WorldRange& range, const std::string& unit) {
  QString text = text_of(range.low);
  if (!range.is_number()) text += " to " + text_of(range.high);
  return unit.empty() ? text : text + " " + QString::fromStdString(unit);
}

bool is_applicable(const std::string& id, const std::string& preset) {
  try {
    check_world(id, load_world(preset));
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

}  // namespace

WorldEditor::WorldEditor(QWidget* parent)
    : QWidget(parent), preset_(new QComboBox), grid_(new QGridLayout), more_(new QComboBox) {
  auto* const column = new QVBoxLayout(this);
  column->setContentsMargins(0, 0, 0, 0);
  column->addWidget(preset_);
  column->addLayout(grid_);
  column->addWidget(more_);
  grid_->setColumnStretch(1, 1);
  preset_->setToolTip("World of the next reset and of those after it");
  more_->setToolTip("Adds a parameter to the world");
  QObject::connect(preset_, QOverload<int>::of(&QComboBox::currentIndexChanged), this,
                   [this](int) { choose_preset(); });
  QObject::connect(more_, QOverload<int>::of(&QComboBox::activated), this,
                   [this](int index) { add_parameter(index); });
  set_environment("");
}

void WorldEditor::set_environment(const std::string& id) {
  if (id == id_ && preset_->count() != 0) return;
  id_ = id;
  parameters_.clear();
  const QSignalBlocker blocker(preset_);
  preset_->clear();
  preset_->addItem("The server's own world");
  if (!id.empty()) {
    parameters_ = world_parameters(id);
    for (const std::string& preset : world_presets()) {
      if (is_applicable(id, preset)) preset_->addItem(QString::fromStdString(preset));
    }
  }
  choose_preset();
}

const WorldParameter* WorldEditor::find(const std::string& name) const {
  const auto found = std::find_if(parameters_.begin(), parameters_.end(),
                                  [&](const WorldParameter& each) { return each.name == name; });
  return found == parameters_.end() ? nullptr : &*found;
}

void WorldEditor::choose_preset() {
  remove_rows();
  if (preset_->currentIndex() > 0) {
    for (const auto& [name, range] : load_world(preset_->currentText().toStdString())) {
      if (const WorldParameter* const parameter = find(name)) add_row(*parameter, range, false);
    }
  }
  offer_parameters();
}

void WorldEditor::remove_rows() {
  for (auto& [name, row] : rows_) {
    delete row.name;
    delete row.slider;
    delete row.value;
  }
  rows_.clear();
  last_ = preset_;
}

void WorldEditor::offer_parameters() {
  more_->clear();
  more_->addItem("Add a parameter…");
  for (const WorldParameter& parameter : parameters_) {
    if (rows_.count(parameter.name) == 0) more_->addItem(QString::fromStdString(parameter.name));
  }
  more_->setVisible(more_->count() > 1);
}

void WorldEditor::add_parameter(int index) {
  const WorldParameter* const parameter = find(more_->itemText(index).toStdString());
  if (parameter == nullptr) return;
  const double absent = std::clamp(0.0, parameter->minimum, parameter->maximum);
  const double first = std::isnan(parameter->default_value) ? absent : parameter->default_value;
  add_row(*parameter, {first, first}, true);
  offer_parameters();
}

void WorldEditor::add_row(const WorldParameter& parameter, const WorldRange& range, bool is_own) {
  const auto [low, high] = ends_of(parameter, range);
  Row& row = rows_[parameter.name];
  row = {parameter,
         range,
         low,
         high,
         is_own,
         new QLabel(QString::fromStdString(parameter.name)),
         new QSlider(Qt::Horizontal),
         new QLabel(text_of(range, parameter.unit))};
  const double middle = (range.low + range.high) / 2;
  row.slider->setRange(0, kPositions);
  row.slider->setMinimumWidth(70);
  row.slider->setValue(static_cast<int>(std::lround(kPositions * (middle - low) / (high - low))));
  row.name->setToolTip(QString::fromStdString(parameter.description));
  row.slider->setToolTip(row.name->toolTip());
  const int line = grid_->rowCount();
  grid_->addWidget(row.name, line, 0);
  grid_->addWidget(row.slider, line, 1);
  grid_->addWidget(row.value, line, 2);
  setTabOrder(last_, row.slider);
  last_ = row.slider;
  QObject::connect(row.slider, &QSlider::valueChanged, this,
                   [this, &row](int position) { set_number(row, position); });
}

void WorldEditor::set_number(Row& row, int position) {
  double number = row.low + (row.high - row.low) * position / kPositions;
  if (row.parameter.is_whole) number = std::round(number);
  row.range = {number, number};
  row.is_own = true;
  row.value->setText(text_of(row.range, row.parameter.unit));
}

walker_sim::World WorldEditor::world() const {
  walker_sim::World world;
  if (preset_->currentIndex() > 0) world.preset = preset_->currentText().toStdString();
  for (const auto& [name, row] : rows_) {
    if (!row.is_own) continue;
    walker_sim::WorldParameter& parameter = world.parameters.emplace_back();
    parameter.name = name;
    parameter.low = row.range.low;
    parameter.high = row.range.high;
  }
  return world;
}

}  // namespace walker
