// mjData borrowed for short computations.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "robots/mujoco/engine.h"

namespace walker::mujoco {

/// Pool of mjData of one model. Its size is the maximum number of simultaneous loans, independent
/// of the number of worlds. Thread-safe.
class Scratch {
 public:
  explicit Scratch(ModelPointer model);

  /// Returns the pool that all users of this model share.
  static std::shared_ptr<Scratch> of(const ModelPointer& model);

  const mjModel& model() const { return *model_; }

  /// Borrows an mjData, with the contents that the last borrower left, until destruction.
  class Loan {
   public:
    explicit Loan(Scratch& scratch);
    Loan(const Loan&) = delete;
    Loan& operator=(const Loan&) = delete;
    ~Loan();

    mjData& data() const { return *data_; }

   private:
    Scratch& scratch_;
    DataPointer data_;
  };

 private:
  ModelPointer model_;
  std::mutex mutex_;
  std::size_t num_made_ = 0;
  std::vector<DataPointer> unused_;
};

}  // namespace walker::mujoco
