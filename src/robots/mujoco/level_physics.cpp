#include "robots/mujoco/level_physics.h"

#include <mujoco/mjxmacro.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <type_traits>
#include <utility>

#include "robots/mujoco/internal_edges.h"
#include "robots/mujoco/planar_model.h"

namespace walker::mujoco {
namespace {

constexpr double kCell = 0.25;     // interval of the trunk's x with the same boxes [m]
constexpr double kMaxSpeed = 25;   // of a geom, at which it does not miss a box [m/s]
constexpr double kFarDown = 1000;  // from the floor's place to where a level moves it [m]

/// Upper bound: slopes are a column long, stumps a column apart, and treads no shorter than one.
constexpr double kBoxesPerMeter = 15;

// Room that an mjData needs for the contacts with the boxes near a robot.
constexpr int kMoreContacts = 32;
constexpr int kStackPerRow = 200;  // [mjtNum]

bool is_upright(const mjtNum* quaternion) {
  constexpr double kAligned = 1 - 1e-9;
  std::array<mjtNum, 9> rotation{};
  mju_quat2Mat(rotation.data(), quaternion);
  return rotation[8] > kAligned;
}

int signature_of(const mjModel& model, int geom1, int geom2) {
  const auto [first, second] = std::minmax(model.geom_bodyid[geom1], model.geom_bodyid[geom2]);
  return ((first + 1) << 16) + second + 1;
}

/// Whether the engine looks for contacts between these geoms, of which one is the floor.
bool are_found(const mjModel& m, int floor, int geom) {
  const int signature = signature_of(m, floor, geom);
  const bool are_excluded = std::find(m.exclude_signature, m.exclude_signature + m.nexclude,
                                      signature) != m.exclude_signature + m.nexclude;
  const bool match = (m.geom_contype[floor] & m.geom_conaffinity[geom]) != 0 ||
                     (m.geom_contype[geom] & m.geom_conaffinity[floor]) != 0;
  return m.opt.collision != mjCOL_PAIR && match && !are_excluded;
}

/// Returns the index of the predefined pair of these geoms; -1 without one.
int find_pair(const mjModel& m, int geom1, int geom2) {
  if (m.opt.collision == mjCOL_DYNAMIC) return -1;
  for (int pair = 0; pair < m.npair; ++pair) {
    const auto [a, b] = std::minmax(m.pair_geom1[pair], m.pair_geom2[pair]);
    if (std::minmax(geom1, geom2) == std::pair<const int&, const int&>(a, b)) return pair;
  }
  return -1;
}

/// Returns the share of the first of two geoms in their contact's parameters, by their `solmix`.
mjtNum weight_of(mjtNum first, mjtNum second) {
  if (first >= mjMINVAL && second >= mjMINVAL) return first / (first + second);
  if (first < mjMINVAL && second < mjMINVAL) return 0.5;
  return first < mjMINVAL ? 0 : 1;
}

/// Returns an upper bound of the distance of the geom's farthest point from the trunk's origin, in
/// any pose. Consecutive anchors of the joints between them, and the last anchor and the geom, have
/// constant distances.
double reach_of(const mjModel& model, const mjData& data, int geom) {
  const int trunk = model.jnt_bodyid[kBaseX];
  const mjtNum* end = at(data.geom_xpos, geom, 3);
  double reach = model.geom_rbound[geom];
  int body = carrier_of(model, model.geom_bodyid[geom]);
  for (; body != trunk; body = carrier_of(model, model.body_parentid[body])) {
    const mjtNum* const anchor = at(data.xanchor, model.body_jntadr[body], 3);
    reach += mju_dist3(anchor, end);
    end = anchor;
  }
  return reach + mju_dist3(at(data.xpos, trunk, 3), end);
}

/// Returns half the geom's length along an axis of the world, an upper bound. [m]
double half_length(const mjModel& model, const mjData& data, int geom, int axis) {
  if (model.geom_type[geom] != mjGEOM_CAPSULE) return model.geom_rbound[geom];
  const mjtNum* const size = at(model.geom_size, geom, 3);
  return size[0] + std::abs(at(data.geom_xmat, geom, 9)[3 * axis + 2]) * size[1];
}

DataPointer data_at_reference(const mjModel& model) {
  DataPointer data = make_data(model);
  mj_kinematics(&model, data.get());
  return data;
}

ModelPointer model_of(const std::shared_ptr<LevelModel>& level) { return {level, &level->model()}; }

}  // namespace

int floor_of(const mjModel& model) {
  for (int geom = 0; geom < model.ngeom; ++geom) {
    if (model.geom_type[geom] == mjGEOM_PLANE && model.geom_bodyid[geom] == 0 &&
        is_upright(at(model.geom_quat, geom, 4))) {
      return geom;
    }
  }
  return -1;
}

std::string level_refusal(const mjModel& model) {
  const int floor = floor_of(model);
  if (floor < 0) return "the model has no floor, a level plane of the world's body";
  if (floor_contacts(model).empty()) return "no limb of the model touches its floor";
  return "";
}

std::vector<FloorContact> floor_contacts(const mjModel& model) {
  const int floor = floor_of(model);
  std::vector<FloorContact> contacts;
  if (floor < 0) return contacts;
  for (int geom = 0; geom < model.ngeom; ++geom) {
    if (carrier_of(model, model.geom_bodyid[geom]) == 0) continue;
    const int pair = find_pair(model, floor, geom);
    if (pair >= 0 || are_found(model, floor, geom)) {
      contacts.push_back({geom, pair});
    }
  }
  return contacts;
}

LevelModel::LevelModel(ModelPointer source) : source_(std::move(source)), model_(*source_) {
  const mjModel& m = *source_;
  const int floor = floor_of(m);
  const std::vector<FloorContact> contacts = floor_contacts(m);
  if (contacts.empty()) throw std::logic_error("a level needs a floor");
  const DataPointer data = data_at_reference(m);
  origin_ = {at(m.body_pos, m.jnt_bodyid[kBaseX], 3)[0], at(m.geom_pos, floor, 3)[2]};
  motion_ = kMaxSpeed * m.opt.timestep;
  reach_ = kSensing;
  int max_dim = 1;
  for (const FloorContact& contact : contacts) {
    pairs_.push_back(pair_with_floor(contact, floor));
    max_dim = std::max(max_dim, pairs_.back().dim);
    reach_ = std::max(reach_, reach_of(m, *data, contact.geom) + motion_ + pairs_.back().margin);
    // A box that is wider than a geom gives it no contacts with the box's sides.
    const double y = std::abs(at(data->geom_xpos, contact.geom, 3)[1]);
    half_width_ = std::max(half_width_, 1.5 * (y + half_length(m, *data, contact.geom, 1)));
  }
  const int num_with_floor = static_cast<int>(pairs_.size());
  for (int pair = 0; pair < m.npair && m.opt.collision != mjCOL_DYNAMIC; ++pair) {
    if (m.pair_geom1[pair] != floor && m.pair_geom2[pair] != floor) pairs_.push_back(pair_of(pair));
  }
  std::stable_sort(pairs_.begin(), pairs_.end(),
                   [](const Pair& a, const Pair& b) { return a.signature < b.signature; });
  const int num_others = static_cast<int>(pairs_.size()) - num_with_floor;
  max_boxes_ = static_cast<int>(std::ceil(kBoxesPerMeter * (2 * reach_ + kCell)));
  const int num_rows = num_others + num_with_floor * max_boxes_;
  rows_.resize(static_cast<std::size_t>(num_rows));
  boxes_.reserve(static_cast<std::size_t>(max_boxes_));
  extend_arrays(num_rows);
  replace_floor(floor);
  if (m.opt.collision == mjCOL_DYNAMIC) model_.opt.collision = mjCOL_ALL;
  const int more_rows = kMoreContacts * std::max(2 * (max_dim - 1), 1);
  model_.nconmax += kMoreContacts;
  model_.njmax += more_rows;
  model_.nstack += kStackPerRow * more_rows;
  stepped_ = model_;
}

/// Gives the arrays of geoms and pairs room for the boxes and the pairs with them.
// MuJoCo's macro lists all arrays. NOLINTNEXTLINE(readability-function-size)
void LevelModel::extend_arrays(int num_rows) {
  const auto extend = [this](auto*& array, int rows, int more_rows, int width) {
    using Value = std::remove_reference_t<decltype(*array)>;
    const std::size_t size = sizeof(Value) * static_cast<std::size_t>(width);
    const std::size_t old_bytes = size * static_cast<std::size_t>(rows);
    const std::size_t bytes = old_bytes + size * static_cast<std::size_t>(more_rows);
    std::byte* const extended = arrays_.emplace_back(new std::byte[bytes]()).get();
    if (old_bytes != 0) std::memcpy(extended, array, old_bytes);
    array = reinterpret_cast<Value*>(extended);
  };
  const mjModel& m = *source_;
  MJMODEL_POINTERS_PREAMBLE((&m))
#define X(type, name, nr, nc)                                                      \
  if (std::string_view(#nr) == "ngeom") extend(model_.name, m.nr, max_boxes_, nc); \
  if (std::string_view(#nr) == "npair") extend(model_.name, m.nr, num_rows, nc);
  MJMODEL_POINTERS
#undef X
}

/// Moves the floor far down, and gives its properties to the boxes' geoms, which no filter of the
/// engine's may find: `body_geomnum` does not count them.
void LevelModel::replace_floor(int floor) {
  at(model_.geom_pos, floor, 3)[2] -= kFarDown;
  model_.geom_sameframe[floor] = 0;
  for (int geom = source_->ngeom; geom < source_->ngeom + max_boxes_; ++geom) {
    model_.geom_type[geom] = mjGEOM_BOX;
    model_.geom_condim[geom] = model_.geom_condim[floor];
    model_.geom_dataid[geom] = -1;
    model_.geom_matid[geom] = -1;
    model_.geom_group[geom] = model_.geom_group[floor];
    at(model_.geom_rgba, geom, 4)[3] = 1;  // a ray does not hit transparent geoms
    std::copy_n(at(model_.geom_friction, floor, 3), 3, at(model_.geom_friction, geom, 3));
  }
}

LevelModel::Pair LevelModel::pair_of(int pair) const {
  const mjModel& m = *source_;
  Pair made{};
  made.dim = m.pair_dim[pair];
  made.geom = m.pair_geom1[pair];
  made.other = m.pair_geom2[pair];
  made.signature = m.pair_signature[pair];
  std::copy_n(at(m.pair_solref, pair, mjNREF), mjNREF, made.solref.begin());
  std::copy_n(at(m.pair_solimp, pair, mjNIMP), mjNIMP, made.solimp.begin());
  made.margin = m.pair_margin[pair];
  made.gap = m.pair_gap[pair];
  std::copy_n(at(m.pair_friction, pair, 5), 5, made.friction.begin());
  return made;
}

/// Returns the parameters of a contact that the engine finds, as mj_collideGeoms does.
LevelModel::Pair LevelModel::found_pair(int geom, int floor) const {
  const mjModel& m = *source_;
  const int first = m.geom_priority[geom] > m.geom_priority[floor] ? geom : floor;
  const int second = m.geom_priority[geom] < m.geom_priority[floor] ? floor : geom;
  Pair made{};
  made.dim = std::max(m.geom_condim[first], m.geom_condim[second]);
  made.margin = std::max(m.geom_margin[floor], m.geom_margin[geom]);
  made.gap = std::max(m.geom_gap[floor], m.geom_gap[geom]);
  std::array<mjtNum, 3> friction{};
  std::transform(at(m.geom_friction, first, 3), at(m.geom_friction, first + 1, 3),
                 at(m.geom_friction, second, 3), friction.begin(),
                 [](mjtNum a, mjtNum b) { return std::max(a, b); });
  made.friction = {friction[0], friction[0], friction[1], friction[2], friction[2]};
  const mjtNum weight = weight_of(m.geom_solmix[first], m.geom_solmix[second]);
  const auto mixed = [weight](mjtNum a, mjtNum b) { return weight * a + (1 - weight) * b; };
  const mjtNum* const reference = at(m.geom_solref, first, mjNREF);
  const mjtNum* const other_reference = at(m.geom_solref, second, mjNREF);
  const bool are_mixed = reference[0] > 0 && other_reference[0] > 0;
  std::transform(reference, reference + mjNREF, other_reference, made.solref.begin(),
                 [&](mjtNum a, mjtNum b) { return are_mixed ? mixed(a, b) : std::min(a, b); });
  const mjtNum* const impedance = at(m.geom_solimp, first, mjNIMP);
  std::transform(impedance, impedance + mjNIMP, at(m.geom_solimp, second, mjNIMP),
                 made.solimp.begin(), mixed);
  return made;
}

LevelModel::Pair LevelModel::pair_with_floor(const FloorContact& contact, int floor) const {
  Pair made = contact.pair >= 0 ? pair_of(contact.pair) : found_pair(contact.geom, floor);
  made.geom = contact.geom;
  made.other = -1;
  made.signature = signature_of(*source_, floor, contact.geom);
  return made;
}

mjModel LevelModel::largest() const {
  mjModel largest = model_;
  largest.ngeom = source_->ngeom + max_boxes_;
  return largest;
}

/// Most rows hold the same pair as in the step before, with another box.
void LevelModel::write_pair(int row, const Pair& pair, int geom) {
  model_.pair_geom2[row] = geom;
  const Pair*& held = rows_[static_cast<std::size_t>(row)];
  if (held == &pair) return;
  held = &pair;
  model_.pair_dim[row] = pair.dim;
  model_.pair_geom1[row] = pair.geom;
  model_.pair_signature[row] = pair.signature;
  std::copy(pair.solref.begin(), pair.solref.end(), at(model_.pair_solref, row, mjNREF));
  std::copy(pair.solimp.begin(), pair.solimp.end(), at(model_.pair_solimp, row, mjNIMP));
  model_.pair_margin[row] = pair.margin;
  model_.pair_gap[row] = pair.gap;
  std::copy(pair.friction.begin(), pair.friction.end(), at(model_.pair_friction, row, 5));
}

void LevelModel::write_box(int geom, const GroundBox& box) {
  const std::array<mjtNum, 3> size{box.half_size[0], half_width_, box.half_size[1]};
  std::copy(size.begin(), size.end(), at(model_.geom_size, geom, 3));
  model_.geom_rbound[geom] = mju_norm3(size.data());
  set_max_tilt(model_, geom, box.max_tilt[0], box.max_tilt[1]);
  mjtNum* const position = at(model_.geom_pos, geom, 3);
  position[0] = origin_[0] + box.center[0];
  position[1] = 0;
  position[2] = origin_[1] + box.center[1];
  // Half the angle about -y, by square roots, which every machine rounds alike.
  mjtNum* const quaternion = at(model_.geom_quat, geom, 4);
  quaternion[0] = std::sqrt((1 + box.direction[0]) / 2);
  quaternion[1] = 0;
  quaternion[2] = box.direction[1] == 0 ? 0 : -box.direction[1] / (2 * quaternion[0]);
  quaternion[3] = 0;
}

void LevelModel::forget() {
  cell_ = kNowhere;
  boxes_.clear();
  model_.ngeom = source_->ngeom;
  model_.npair = stepped_.npair = 0;
}

void LevelModel::place(const BoxGround& ground, mjData& data) {
  // The ground's coordinates are the slides' distances from their first positions.
  const double x = data.qpos[kBaseX] - source_->qpos0[kBaseX];
  const double cell = std::floor(x / kCell);
  if (cell != cell_ && std::isfinite(cell)) {
    cell_ = cell;
    place_boxes(ground, cell * kCell);
    mj_kinematics(&model_, &data);
  } else {
    mj_kinematics(&stepped_, &data);
  }
  place_pairs(data);
}

/// @param x of the cell's left end
void LevelModel::place_boxes(const BoxGround& ground, double x) {
  boxes_.clear();
  for (const GroundBox& box : ground.boxes()) {
    if (box.left > x + kCell + reach_) break;
    if (box.right < x - reach_) continue;
    if (boxes_.size() == static_cast<std::size_t>(max_boxes_))
      throw std::logic_error("too many obstacles near the robot");
    write_box(source_->ngeom + static_cast<int>(boxes_.size()), box);
    boxes_.push_back(&box);
  }
  model_.ngeom = source_->ngeom + static_cast<int>(boxes_.size());
}

void LevelModel::place_pairs(const mjData& data) {
  int row = 0;
  for (const Pair& pair : pairs_) {
    if (pair.other >= 0) {
      write_pair(row++, pair, pair.other);
      continue;
    }
    const mjtNum* const position = at(data.geom_xpos, pair.geom, 3);
    const double distance = motion_ + pair.margin;
    const double across = half_length(*source_, data, pair.geom, 0) + distance;
    const double left = position[0] - origin_[0] - across;
    const double right = position[0] - origin_[0] + across;
    const double bottom =
        position[2] - origin_[1] - half_length(*source_, data, pair.geom, 2) - distance;
    for (std::size_t i = 0; i < boxes_.size() && boxes_[i]->left <= right; ++i) {
      if (boxes_[i]->right >= left && boxes_[i]->top >= bottom) {
        write_pair(row++, pair, source_->ngeom + static_cast<int>(i));
      }
    }
  }
  model_.npair = stepped_.npair = row;
}

LevelPhysics::LevelPhysics(std::shared_ptr<LevelModel> level)
    : LibraryPhysics(model_of(level), make_data(level->largest())), level_(std::move(level)) {}

void LevelPhysics::set_ground(std::shared_ptr<const BoxGround> ground) {
  ground_ = std::move(ground);
  level_->forget();
}

void LevelPhysics::set_model(ModelPointer source) {
  if (source == level_->source()) return;
  level_ = std::make_shared<LevelModel>(std::move(source));
  LibraryPhysics::set_model(model_of(level_));
}

void LevelPhysics::reset(const double* position, const double* velocity) {
  mjData& data = mutable_data();
  mj_resetData(&model(), &data);
  level_->forget();  // the boxes' poses are reset too
  std::copy_n(position, model().nq, data.qpos);
  std::copy_n(velocity, model().nv, data.qvel);
  level_->place(*ground_, data);
  mj_forward(&model(), &data);
}

void LevelPhysics::step(const double* control, const ExternalForces& forces, int count) {
  for (int i = 0; i < count; ++i) {
    advance(level_->stepped(), mutable_data(), control, forces, 1);
    level_->place(*ground_, mutable_data());
  }
  check_warnings(data());
}

void LevelPhysics::load(const double* values) {
  LibraryPhysics::load(values);
  level_->forget();
  level_->place(*ground_, mutable_data());
}

}  // namespace walker::mujoco
