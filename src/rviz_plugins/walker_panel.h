// Panel of rviz that controls a server.
#pragma once

#include <rviz/panel.h>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>

#include "rviz_plugins/return_plot.h"
#include "rviz_plugins/server_link.h"
#include "rviz_plugins/world_editor.h"

namespace walker {

/// Reset with a seed and a world, pause, single steps, pace, and the return of the episode. All
/// calls are made by `ServerLink`; a timer shows what it has found.
class WalkerPanel : public rviz::Panel {
 public:
  explicit WalkerPanel(QWidget* parent = nullptr);

  void load(const rviz::Config& config) override;
  void save(rviz::Config config) const override;

 private:
  void describe_widgets();
  void connect_widgets();
  void reset();
  void refresh();
  void show_state(const ServerView& view);

  ServerLink link_;
  bool is_paused_ = false;
  std::uint64_t num_answers_ = 0;  // that are shown
  QLineEdit* server_;
  QLabel* state_;
  QLineEdit* seed_;
  QPushButton* reset_;
  QPushButton* pause_;
  QPushButton* step_;
  QDoubleSpinBox* factor_;
  QLabel* measured_;
  WorldEditor* world_;
  ReturnPlot* plot_;
  QLabel* answer_;
};

}  // namespace walker
