// Choice of a world: a preset, and sliders for its numbers.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <QComboBox>
#include <QGridLayout>
#include <QLabel>
#include <QSlider>
#include <QWidget>

#include "walker_sim/World.h"
#include "walker_sim/world.h"

namespace walker {

class WorldEditor : public QWidget {
 public:
  explicit WorldEditor(QWidget* parent = nullptr);

  /// Offers what the environment can apply. Keeps the choice if the id stays the same.
  void set_environment(const std::string& id);

  /// The chosen world; empty: the server's own. A slider that was moved replaces the preset's range
  /// by its number.
  walker_sim::World world() const;

 private:
  /// One parameter.
  struct Row {
    WorldParameter parameter;
    WorldRange range;  // of the preset, or the number that was set
    double low, high;  // ends of the slider
    bool is_own;       // differs from the preset
    QLabel* name;
    QSlider* slider;
    QLabel* value;
  };

  void choose_preset();
  void add_parameter(int index);
  void add_row(const WorldParameter& parameter, const WorldRange& range, bool is_own);
  void set_number(Row& row, int position);
  void remove_rows();
  void offer_parameters();
  const WorldParameter* find(const std::string& name) const;

  std::string id_;
  std::vector<WorldParameter> parameters_;  // of the environment
  std::map<std::string, Row> rows_;         // by name
  QComboBox* preset_;
  QGridLayout* grid_;
  QComboBox* more_;
  QWidget* last_ = nullptr;  // before `more_`
};

}  // namespace walker
