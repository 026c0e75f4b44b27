// Physics stepped by MuJoCo's library, and a pool of its mjData.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "robots/mujoco/physics.h"

namespace walker::mujoco {

class LibraryPhysics : public Physics {
 public:
  /// @param fallback_reason reason why no kernel is used, for `stepper`; may be empty
  explicit LibraryPhysics(ModelPointer model, std::string fallback_reason = "");

  const mjData& data() const { return *data_; }

  const mjModel& model() const override { return *model_; }
  const double* position() const override { return data_->qpos; }
  const double* velocity() const override { return data_->qvel; }
  void reset(const double* position, const double* velocity) override;
  void step(const double* control, int count) override;
  void measure(const std::function<void(const mjData&)>& look) const override;
  void save(double* values) const override;
  void load(const double* values) override;
  std::string stepper() const override;

 private:
  ModelPointer model_;
  DataPointer data_;
  std::string fallback_reason_;
};

/// @throws std::runtime_error if the allocation fails
DataPointer make_data(const mjModel& model);

/// Runs mj_forward on a state in the format of `Physics::save`. The accelerations at its positions
/// and velocities become its qacc_warmstart, from which a later step starts the solver.
void forward(const mjModel& model, double* state);

/// Makes engine steps, then checks the result as the next step would.
/// @param control nu values
void advance(const mjModel& model, mjData& data, const double* control, int count);

/// @throws std::runtime_error with MuJoCo's warning if a bad state occurred since the last reset
void check_warnings(const mjData& data);

/// Pool of mjData of one model. Its size is the maximum number of simultaneous loans, independent
/// of the number of worlds. Thread-safe.
class DataPool {
 public:
  explicit DataPool(ModelPointer model);

  /// Returns the pool that all users of this model share.
  static std::shared_ptr<DataPool> of(const ModelPointer& model);

  const mjModel& model() const { return *model_; }

  /// Borrows an mjData, with the contents that the last borrower left, until destruction.
  class Loan {
   public:
    explicit Loan(DataPool& pool);
    Loan(const Loan&) = delete;
    Loan& operator=(const Loan&) = delete;
    ~Loan();

    mjData& data() const { return *data_; }

   private:
    DataPool& pool_;
    DataPointer data_;
  };

 private:
  ModelPointer model_;
  std::mutex mutex_;
  std::size_t num_made_ = 0;
  std::vector<DataPointer> unused_;
};

}  // namespace walker::mujoco
