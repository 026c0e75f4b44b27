// A world with a level: the robot's model with the boxes of a ground near the robot, stepped by
// MuJoCo's library.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "robots/mujoco/box_ground.h"
#include "robots/mujoco/physics.h"

namespace walker::mujoco {

/// Returns the geom that a level replaces: the first plane of the world's body with an upward
/// normal; -1: the model has none.
int floor_of(const mjModel& model);

/// Returns why a level cannot replace the model's floor; empty: it can.
std::string level_refusal(const mjModel& model);

/// A geom that touches the floor.
struct FloorContact {
  int geom;
  int pair;  ///< predefined pair with the floor; -1: the engine would find it
};

/// Returns the geoms that touch the floor, in the order of their bodies.
std::vector<FloorContact> floor_contacts(const mjModel& model);

/// A model in which a ground's boxes near the robot have replaced the floor, which is moved far
/// down. Which boxes it has, and which of them can touch which geoms, depends on
/// MuJoCo's qpos alone, and farther ones touch nothing. So results do not depend on the path to a
/// state.
///
/// Boxes are geoms of the world's body that only predefined pairs let touch. They have the floor's
/// friction and softness. The model shares with its source the arrays that it does not replace, as
/// `WorldModels`' do.
class LevelModel {
 public:
  /// @param source of `load_planar_model` or `WorldModels`, with a floor
  explicit LevelModel(ModelPointer source);

  const ModelPointer& source() const { return source_; }

  /// The model of measurements and pictures, with as many geoms as `place` has put there.
  const mjModel& model() const { return model_; }

  /// As `model()`, with a smaller `ngeom`, for steps: the engine then does not compute the boxes'
  /// poses again in each stage; they never change. Contact pairs still refer to the boxes.
  const mjModel& stepped() const { return stepped_; }

  /// The model with all boxes that it can have, for `make_data`.
  mjModel largest() const;

  /// Puts the boxes near the robot into the model, and the pairs that can touch within a step.
  /// @param data with the current qpos; receives the poses of its kinematics
  void place(const BoxGround& ground, mjData& data);

  /// Makes the next `place` replace all boxes.
  void forget();

 private:
  struct Pair {
    int dim;
    int geom;
    int signature;
    std::array<mjtNum, mjNREF> solref;
    std::array<mjtNum, mjNIMP> solimp;
    mjtNum margin;
    mjtNum gap;
    std::array<mjtNum, 5> friction;
    int other;  ///< geom of a pair that the source has; -1: the boxes near the geom
  };

  static constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();

  void extend_arrays(int num_rows);
  void replace_floor(int floor);
  Pair found_pair(int geom, int floor) const;
  Pair pair_with_floor(const FloorContact& contact, int floor) const;
  Pair pair_of(int pair) const;
  void place_boxes(const BoxGround& ground, double x);
  void place_pairs(const mjData& data);
  void write_pair(int row, const Pair& pair, int geom);
  void write_box(int geom, const GroundBox& box);

  ModelPointer source_;
  mjModel model_;
  mjModel stepped_;
  std::vector<std::unique_ptr<std::byte[]>> arrays_;
  std::vector<Pair> pairs_;              // in the order of their signatures
  std::vector<const Pair*> rows_;        // what the rows of the model's pairs hold
  std::vector<const GroundBox*> boxes_;  // those in the model
  std::array<double, 2> origin_{};       // of the ground in the world: x, z [m]
  double half_width_ = 0;                // of the boxes along y [m]
  double reach_ = 0;                     // distance from the trunk of boxes in the model [m]
  int max_boxes_ = 0;                    // that can be within that distance
  double motion_ = 0;                    // of a geom within an engine step, upper bound [m]
  double cell_ = kNowhere;               // interval of the trunk's x, for which boxes were placed
};

class LevelPhysics : public LibraryPhysics {
 public:
  /// @param source with a floor, of `load_planar_model` or `WorldModels`
  explicit LevelPhysics(const ModelPointer& source)
      : LevelPhysics(std::make_shared<LevelModel>(source)) {}

  /// Replaces the ground. The next call must be `reset` or `load`.
  void set_ground(std::shared_ptr<const BoxGround> ground);

  void set_model(ModelPointer source) override;
  void reset(const double* position, const double* velocity) override;
  void step(const double* control, const ExternalForces& forces, int count) override;
  void load(const double* values) override;

 private:
  explicit LevelPhysics(std::shared_ptr<LevelModel> level);

  std::shared_ptr<LevelModel> level_;
  std::shared_ptr<const BoxGround> ground_;
};

}  // namespace walker::mujoco
