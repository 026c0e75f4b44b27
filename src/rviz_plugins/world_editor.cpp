#include "rviz_plugins/world_editor.h"

#include <algorithm>
#include <cmath>
#include <utility>

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
  if (range.is_log_uniform) text += " (log)";
  return unit.empty() ? text : text + " " + QString::fromStdString(unit);
}

World to_world(const std::vector<walker_sim::WorldParameter>& parameters) {
  World world;
  for (const auto& [name, low, high, log_uniform] : parameters) {
    world[name] = {low, high, log_uniform != 0};
  }
  return world;
}

bool has(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Whether `world` has all parameters of `base`.
bool extends(const World& world, const World& base) {
  return std::all_of(base.begin(), base.end(),
                     [&](const auto& each) { return world.count(each.first) != 0; });
}

}  // namespace

WorldEditor::WorldEditor(QWidget* parent)
    : QWidget(parent),
      preset_(new QComboBox),
      until_then_(new QLabel),
      grid_(new QGridLayout),
      more_(new QComboBox) {
  auto* const column = new QVBoxLayout(this);
  column->setContentsMargins(0, 0, 0, 0);
  column->addWidget(preset_);
  column->addLayout(grid_);
  column->addWidget(more_);
  column->addWidget(until_then_);
  grid_->setColumnStretch(1, 1);
  preset_->setToolTip("World of the next reset and of those after it");
  until_then_->setWordWrap(true);
  more_->setToolTip("Adds a parameter to the world");
  QObject::connect(preset_, QOverload<int>::of(&QComboBox::currentIndexChanged), this,
                   [this](int) { choose_preset(); });
  QObject::connect(more_, QOverload<int>::of(&QComboBox::activated), this,
                   [this](int index) { add_parameter(index); });
  offer_presets();
  show_present();
}

void WorldEditor::show_server(const std::string& id, const walker_sim::GetWorlds::Response& worlds,
                              const walker_sim::World& present) {
  const World held = to_world(present.parameters);
  const bool is_other = id != id_ || worlds != worlds_;
  const bool shows_present = chosen() == present_;
  if (is_other) {
    id_ = id;
    worlds_ = worlds;
    launch_ = to_world(worlds.launch.parameters);
    parameters_.clear();
    if (!id.empty()) parameters_ = world_parameters(id);
    parameters_.erase(
        std::remove_if(parameters_.begin(), parameters_.end(),
                       [&](const auto& each) { return !has(worlds.parameters, each.name); }),
        parameters_.end());
    offer_presets();
  }
  if (is_other || held != present_) {
    present_ = held;
    if (is_other || shows_present) show_present();
  }
  show_difference();
}

void WorldEditor::offer_presets() {
  const QSignalBlocker blocker(preset_);
  preset_->clear();
  preset_->addItem("The server's own world");
  for (const std::string& name : world_presets()) {
    if (has(worlds_.presets, name)) preset_->addItem(QString::fromStdString(name));
  }
}

/// Returns the world of the combo box's item.
World WorldEditor::preset(int index) const {
  return index <= 0 ? launch_ : load_world(preset_->itemText(index).toStdString());
}

/// Chooses the world of the launch or the preset that the server has, or the one that it extends.
void WorldEditor::show_present() {
  int index = 0;
  while (index < preset_->count() && preset(index) != present_) ++index;
  if (index == preset_->count()) {
    // Any world extends Gymnasium's.
    index = extends(present_, launch_) ? 0 : preset_->findText(kGymnasiumsWorld);
  }
  const QSignalBlocker blocker(preset_);
  preset_->setCurrentIndex(index);
  show_rows(present_);
}

void WorldEditor::choose_preset() { show_rows(preset(preset_->currentIndex())); }

void WorldEditor::show_rows(const World& world) {
  remove_rows();
  for (const auto& [name, range] : world) {
    if (const WorldParameter* const parameter = find(name)) add_row(*parameter, range);
  }
  offer_parameters();
}

/// Says which world the server has as long as another one is chosen.
void WorldEditor::show_difference() {
  until_then_->setVisible(chosen() != present_);
  until_then_->setText("Until then: " + (present_.empty()
                                             ? QString("Gymnasium's world")
                                             : QString::fromStdString(to_string(present_))));
}

const WorldParameter* WorldEditor::find(const std::string& name) const {
  const auto found = std::find_if(parameters_.begin(), parameters_.end(),
                                  [&](const WorldParameter& each) { return each.name == name; });
  return found == parameters_.end() ? nullptr : &*found;
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
    // A row sets a number, beside which the interval of changes would be refused.
    if (rows_.count(parameter.name) != 0 || parameter.name == kChangeInterval) continue;
    more_->addItem(QString::fromStdString(parameter.name));
  }
  more_->setVisible(more_->count() > 1);
}

void WorldEditor::add_parameter(int index) {
  const WorldParameter* const parameter = find(more_->itemText(index).toStdString());
  if (parameter == nullptr) return;
  const double absent = std::clamp(0.0, parameter->minimum, parameter->maximum);
  const double first = std::isnan(parameter->default_value) ? absent : parameter->default_value;
  add_row(*parameter, {first, first});
  offer_parameters();
}

void WorldEditor::add_row(const WorldParameter& parameter, const WorldRange& range) {
  const auto [low, high] = ends_of(parameter, range);
  Row& row = rows_[parameter.name];
  row = {parameter,
         range,
         low,
         high,
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
  row.value->setText(text_of(row.range, row.parameter.unit));
}

World WorldEditor::chosen() const {
  World world;
  for (const auto& [name, row] : rows_) world[name] = row.range;
  return world;
}

walker_sim::World WorldEditor::world() const {
  if (chosen() == present_) return {};  // what another node has set since the last look stays
  walker_sim::World world;
  world.preset = kGymnasiumsWorld;
  for (const auto& [name, range] : chosen()) {
    walker_sim::WorldParameter& parameter = world.parameters.emplace_back();
    parameter.name = name;
    parameter.low = range.low;
    parameter.high = range.high;
    parameter.log_uniform = static_cast<std::uint8_t>(range.is_log_uniform);
  }
  return world;
}

}  // namespace walker
