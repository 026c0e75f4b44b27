// Objects of a model that its users share or borrow.
#pragma once

#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "robots/mujoco/engine.h"

namespace walker::mujoco {

/// Returns the object that all users of this model share. Thread-safe.
/// @tparam T constructed from the ModelPointer
template <typename T>
std::shared_ptr<T> shared_by_users_of(const ModelPointer& model) {
  static std::mutex mutex;
  static std::map<const mjModel*, std::weak_ptr<T>> all;
  const std::lock_guard<std::mutex> lock(mutex);
  for (auto each = all.begin(); each != all.end();) {
    each = each->second.expired() ? all.erase(each) : std::next(each);
  }
  std::weak_ptr<T>& known = all[model.get()];
  std::shared_ptr<T> object = known.lock();
  if (!object) known = object = std::make_shared<T>(model);
  return object;
}

/// Pool of objects made from one model. Its size is the maximum number of simultaneous loans,
/// independent of the number of instances. Thread-safe.
/// @tparam T constructed from a `const mjModel&`
template <typename T>
class ModelPool {
 public:
  explicit ModelPool(ModelPointer model) : model_(std::move(model)) {}

  /// Borrows an object, as the last borrower left it, until destruction.
  class Loan {
   public:
    explicit Loan(ModelPool& pool) : pool_(pool) {
      {
        const std::lock_guard<std::mutex> lock(pool_.mutex_);
        if (!pool_.unused_.empty()) {
          object_ = std::move(pool_.unused_.back());
          pool_.unused_.pop_back();
        }
      }
      if (object_) return;
      object_ = std::make_unique<T>(*pool_.model_);
      const std::lock_guard<std::mutex> lock(pool_.mutex_);
      pool_.unused_.reserve(++pool_.num_made_);  // so that the destructor cannot fail
    }
    Loan(const Loan&) = delete;
    Loan& operator=(const Loan&) = delete;
    ~Loan() {
      const std::lock_guard<std::mutex> lock(pool_.mutex_);
      pool_.unused_.push_back(std::move(object_));
    }

    T& operator*() const { return *object_; }
    T* operator->() const { return object_.get(); }

   private:
    ModelPool& pool_;
    std::unique_ptr<T> object_;
  };

 private:
  ModelPointer model_;
  std::mutex mutex_;
  std::size_t num_made_ = 0;
  std::vector<std::unique_ptr<T>> unused_;
};

}  // namespace walker::mujoco
