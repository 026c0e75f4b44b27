// MuJoCo's walkers on lines of ground, and their contacts.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "robots/mujoco/physics.h"
#include "robots/mujoco/world_physics.h"

namespace walker::mujoco {

using State = std::vector<double>;
using Line = std::shared_ptr<const GroundLine>;

inline Line line_of(const std::vector<Point>& points) {
  return std::make_shared<GroundLine>(points);
}

/// A model's walker on a line of ground.
class PhysicsOnLine : public LibraryPhysics {
 public:
  PhysicsOnLine(const ModelPointer& model, Line line)
      : LibraryPhysics(WorldModels(model).model_of(physics_of({{"ground_roughness", 1}}))),
        line_(std::move(line)) {
    set_ground(line_.get());
  }

 private:
  Line line_;
};

inline std::unique_ptr<LibraryPhysics> on_line(const ModelPointer& model, const Line& line) {
  return std::make_unique<PhysicsOnLine>(model, line);
}

inline std::vector<mjContact> contacts_of(const LibraryPhysics& physics) {
  std::vector<mjContact> contacts;
  physics.measure(
      [&](const mjData& data) { contacts.assign(data.contact, data.contact + data.ncon); });
  return contacts;
}

/// Returns what a contact is to the solver.
inline State numbers_of(const mjContact& contact) {
  State numbers{contact.dist, contact.includemargin};
  for (const int number : {contact.dim, contact.geom1, contact.geom2, contact.exclude}) {
    numbers.push_back(number);
  }
  const auto add = [&numbers](const mjtNum* values, int size) {
    numbers.insert(numbers.end(), values, values + size);
  };
  add(contact.pos, 3);
  add(contact.frame, 9);
  add(contact.friction, 5);
  add(contact.solref, mjNREF);
  add(contact.solimp, mjNIMP);
  for (double& number : numbers) number += 0.0;  // -0 acts as 0
  return numbers;
}

}  // namespace walker::mujoco
