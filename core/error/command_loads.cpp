#include "core/error/command_loads.hpp"

#include "core/step/linear/kernels.hpp"
#include "core/step/loads/slots.hpp"
#include "core/step/vector.hpp"

namespace freeflex {
namespace {

constexpr Mat3 kUnit = {1, 0, 0, 0, 1, 0, 0, 0, 1};

bool has_load(const Vec3& force, const Vec3& torque) noexcept { return !is_zero(force) || !is_zero(torque); }

/// Adds to `arms` the torques of the force share * load, which acts on one point, when an elastic coordinate
/// displaces the point.
void add_arms(const StepPlan& plan, const PlanPoint& point, const Mat3& share, const Vec3& load_W,
              const Vec3& load_B, Array& arms) noexcept {
  const double* rows = point_rows(plan, point.row);
  const std::size_t n = index(plan.num_padded);
  const Vec3 force_B = multiply(share, load_B);
  for (std::size_t c = 0; c < arms.size() / kArmSize; ++c) {
    const Vec3 b = {rows[c], rows[n + c], rows[2 * n + c]};
    const Vec3 torque = cross(b, force_B);
    double* const arm = arms.data() + c * kArmSize;
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3 axis{};
      axis[k] = 1.0;
      const Vec3 lever = multiply_transposed(share, cross(axis, b));
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t d = 0; d < 3; ++d) arm[9 * k + 3 * a + d] += lever[a] * load_W[d];
      arm[27 + k] += torque[k];
    }
  }
}

}  // namespace

std::size_t num_armed(const PlanUnmodelled& unmodelled) noexcept {
  return unmodelled.inertia_rows.size() / 6;
}

double size_of_forces(const SumsOnPoints& sums) noexcept {
  double size = 0.0;
  for (const auto* v : {&sums.force_W, &sums.force_B, &sums.group_force_W, &sums.group_force_B})
    for (const Vec3& force : *v)
      for (const double component : force) size += component < 0.0 ? -component : component;
  return size;
}

// Adds b_il x F_i for each load F_i. World loads are stored in the layout of LoadPattern::moment_W
// (THEORY X148).
void set_arms(const StepPlan& plan, std::size_t num_shadowed, const SumsOnPoints& sums,
              Array& arms) noexcept {
  arms.assign(num_shadowed * kArmSize, 0.0);
  if (num_shadowed == 0) return;
  for (const std::int32_t i : sums.points) {
    const PlanPoint& point = plan.points[index(i)];
    const std::size_t at = load_index(plan, i);
    const Vec3 &W = sums.force_W[at], &B = sums.force_B[at];
    if (has_load(W, B)) add_arms(plan, point, kUnit, W, B, arms);
  }
  for (std::size_t k = 0; k < plan.groups.size(); ++k) {
    const PlanGroup& group = plan.groups[k];
    const bool has_force = has_load(sums.group_force_W[k], sums.group_force_B[k]),
               has_torque = has_load(sums.group_torque_W[k], sums.group_torque_B[k]);
    if (!has_force && !has_torque) continue;
    for (const std::int32_t carrier : carriers_of_group(plan, k)) {
      const PlanPoint& point = mass_point(plan, carrier);
      const double share = point.mass / group.mass;
      if (has_force)
        add_arms(plan, point, {share, 0, 0, 0, share, 0, 0, 0, share}, sums.group_force_W[k],
                 sums.group_force_B[k], arms);
      // the force m_i (J_g^-1 T_g) x d_i as a matrix times T_g, one column for each component of T_g
      // (THEORY 8.8)
      const Vec3 d = sub(point.r, group.centre);
      Mat3 share_of_torque{};
      for (std::size_t a = 0; a < 3; ++a) {
        const Mat3& J = group.inverse_inertia;
        const Vec3 f = scale(point.mass, cross({J[a], J[3 + a], J[6 + a]}, d));
        for (std::size_t e = 0; e < 3; ++e) share_of_torque[3 * e + a] = f[e];
      }
      if (has_torque)
        add_arms(plan, point, share_of_torque, sums.group_torque_W[k], sums.group_torque_B[k], arms);
    }
  }
}

CommandLoads::CommandLoads(const StepPlan& plan, const PlanUnmodelled& unmodelled)
    : plan_(plan), num_armed_(num_armed(unmodelled)), sums_(make_load_sums(plan)) {
  arms_.resize(num_armed_ * kArmSize);
}

void CommandLoads::update(const State& state) noexcept {
  if (changes_ == state.num_slot_changes) return;
  changes_ = state.num_slot_changes;
  freeflex::clear(sums_);
  add_slots(plan_, std::span(state.slots).first(index(state.num_slots)), sums_);
  set_arms(plan_, num_armed_, sums_, arms_);
  size_ = size_of_forces(sums_);
}

}  // namespace freeflex
