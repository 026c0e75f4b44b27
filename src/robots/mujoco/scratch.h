// MuJoCo's data for whoever needs them for a moment.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "robots/mujoco/engine.h"

namespace walker::mujoco {

/// Of one model. As many as are ever in use at the same time, whatever the number of worlds.
/// Thread-safe.
class Scratch {
 public:
  explicit Scratch(ModelPointer model);

  /// The scratch of all who hold this model.
  static std::shared_ptr<Scratch> of(const ModelPointer& model);

  const mjModel& model() const { return *model_; }

  /// Data as the last borrower left them, given back at the end.
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
