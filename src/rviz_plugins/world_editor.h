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

#include "walker_sim/GetWorlds.h"
#include "walker_sim/World.h"
#include "walker_sim/world.h"

namespace walker {

class WorldEditor : public QWidget {
 public:
  explicit WorldEditor(QWidget* parent = nullptr);

  /// Offers what the environment can apply, and shows the server's present world unless the user
  /// has chosen another one since it was last shown.
  /// @param id      of the environment; empty: unknown
  /// @param present world of the server's resets to come
  void show_server(const std::string& id, const walker_sim::GetWorlds::Response& worlds,
                   const walker_sim::World& present);

  /// The whole chosen world. A slider that was moved replaces a range by its number.
  walker_sim::World world() const;

 private:
  /// One parameter.
  struct Row {
    WorldParameter parameter;
    WorldRange range;  // of the world, or the number that was set
    double low, high;  // ends of the slider
    QLabel* name;
    QSlider* slider;
    QLabel* value;
  };

  void offer_presets();
  void show_present();
  void choose_preset();
  void show_rows(const World& world);
  void add_parameter(int index);
  void add_row(const WorldParameter& parameter, const WorldRange& range);
  void set_number(Row& row, int position);
  void remove_rows();
  void offer_parameters();
  void show_difference();
  World chosen() const;
  World preset(int index) const;
  const WorldParameter* find(const std::string& name) const;

  std::string id_;
  walker_sim::GetWorlds::Response worlds_;
  std::vector<WorldParameter> parameters_;  // that can be applied
  World launch_, present_;                  // the server's
  std::map<std::string, Row> rows_;         // by name
  QComboBox* preset_;
  QLabel* until_then_;
  QGridLayout* grid_;
  QComboBox* more_;
  QWidget* last_ = nullptr;  // before `more_`
};

}  // namespace walker
