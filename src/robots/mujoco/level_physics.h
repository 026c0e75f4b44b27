// A world with a level, stepped by MuJoCo's library.
#pragma once

#include <memory>

#include "robots/mujoco/level_model.h"
#include "robots/mujoco/physics.h"

namespace walker::mujoco {

class LevelPhysics : public LibraryPhysics {
 public:
  /// @param source with a floor, of `load_planar_model` or `WorldModels`
  explicit LevelPhysics(const ModelPointer& source)
      : LevelPhysics(std::make_shared<LevelModel>(source)) {}

  /// Replaces the course. The next call must be `reset` or `load`.
  void set_course(std::shared_ptr<const Course> course);

  void set_model(ModelPointer source) override;
  void reset(const double* position, const double* velocity) override;
  void step(const double* control, const ExternalForces& forces, int count) override;
  void load(const double* values) override;

 private:
  explicit LevelPhysics(std::shared_ptr<LevelModel> level);

  std::shared_ptr<LevelModel> level_;
  std::shared_ptr<const Course> course_;
};

}  // namespace walker::mujoco
