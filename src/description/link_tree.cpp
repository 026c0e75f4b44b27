#include "description/link_tree.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace walker {
namespace {

/// Returns the first link of the trunk's branch that the joint belongs to. Joints are in action
/// order, which need not lead from the trunk outwards.
std::string branch_of(const Specification& specification, const Joint& joint) {
  const Joint* inner = &joint;
  for (std::size_t i = 0; i < specification.joints.size(); ++i) {
    if (inner->parent == specification.links.front().name) return inner->child;
    const auto next =
        std::find_if(specification.joints.begin(), specification.joints.end(),
                     [&](const Joint& other) { return other.child == inner->parent; });
    if (next == specification.joints.end()) {
      throw std::invalid_argument("joint " + inner->name + ": unknown parent " + inner->parent);
    }
    inner = &*next;
  }
  throw std::invalid_argument("joint " + joint.name + ": its parents form a cycle");
}

}  // namespace

std::map<std::string, Place> place_links(const Specification& specification) {
  constexpr double kGap = 0.02;  // between neighbours [m]
  constexpr double kSpacing = kTrunkDepth + kLimbDepth + 2 * kGap;
  const std::string& trunk = specification.links.front().name;
  std::map<std::string, Place> places{{trunk, {0, kTrunkDepth}}};
  std::vector<std::string> branches;  // first link of each
  for (const Joint& joint : specification.joints) {
    if (joint.parent == trunk) branches.push_back(joint.child);
  }
  const double first = static_cast<double>(branches.size() + 1) / 2 * kSpacing;
  for (const Joint& joint : specification.joints) {
    const auto branch =
        std::find(branches.begin(), branches.end(), branch_of(specification, joint));
    const auto number = static_cast<double>(branch - branches.begin() + 1);
    places[joint.child] = {first - number * kSpacing, kLimbDepth};
  }
  return places;
}

std::vector<std::string> turned_links(const Specification& specification) {
  std::vector<std::string> names;
  const auto is_taken = [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end() ||
           std::any_of(specification.links.begin(), specification.links.end(),
                       [&](const Link& link) { return link.name == name; });
  };
  for (const Joint& joint : specification.joints) {
    std::string name = joint.child;
    if (!is_identity(joint.child_frame)) {
      do name += "_hinge";
      while (is_taken(name));
    }
    names.push_back(name);
  }
  return names;
}

}  // namespace walker
