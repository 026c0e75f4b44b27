#include "robots/mujoco/scratch.h"

#include <iterator>
#include <map>
#include <utility>

#include "robots/mujoco/library_physics.h"

namespace walker::mujoco {

Scratch::Scratch(ModelPointer model) : model_(std::move(model)) {}

std::shared_ptr<Scratch> Scratch::of(const ModelPointer& model) {
  static std::mutex mutex;
  static std::map<const mjModel*, std::weak_ptr<Scratch>> all;
  const std::lock_guard<std::mutex> lock(mutex);
  for (auto each = all.begin(); each != all.end();) {
    each = each->second.expired() ? all.erase(each) : std::next(each);
  }
  std::weak_ptr<Scratch>& known = all[model.get()];
  std::shared_ptr<Scratch> scratch = known.lock();
  if (!scratch) {
    scratch = std::make_shared<Scratch>(model);
    known = scratch;
  }
  return scratch;
}

Scratch::Loan::Loan(Scratch& scratch) : scratch_(scratch) {
  {
    const std::lock_guard<std::mutex> lock(scratch_.mutex_);
    if (!scratch_.unused_.empty()) {
      data_ = std::move(scratch_.unused_.back());
      scratch_.unused_.pop_back();
    }
  }
  if (data_) return;
  data_ = make_data(scratch_.model());
  const std::lock_guard<std::mutex> lock(scratch_.mutex_);
  scratch_.unused_.reserve(++scratch_.num_made_);  // so that the destructor cannot fail
}

Scratch::Loan::~Loan() {
  const std::lock_guard<std::mutex> lock(scratch_.mutex_);
  scratch_.unused_.push_back(std::move(data_));
}

}  // namespace walker::mujoco
