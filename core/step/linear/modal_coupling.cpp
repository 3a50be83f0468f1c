#include "core/step/linear/modal_coupling.hpp"

#include <algorithm>
#include <array>

#include "core/step/loads/field.hpp"
#include "core/step/loads/history.hpp"
#include "core/step/loads/loads.hpp"
#include "core/step/vector.hpp"

namespace freeflex {
namespace {

/// Returns the force of a feedback [N]: f = F_q q + F_v q' + F_Q Q   (THEORY 8.28).
Vec3 feedback_force(const PlanFeedback& feedback, std::size_t n, const double* q, const double* q_dot,
                    const double* Q) noexcept {
  Vec3 force = freeflex::add(contract_rows(feedback.q_rows.data(), q, n),
                             contract_rows(feedback.q_dot_rows.data(), q_dot, n));
  if (!feedback.Q_rows.empty()) force = freeflex::add(force, contract_rows(feedback.Q_rows.data(), Q, n));
  return force;
}

bool has_dependent_loads(const PlanHistory& history) noexcept {
  return !history.followers.empty() || !history.torques.empty();
}

using Coordinates = std::array<double, PlanStiffening::kMostModes>;
/// Gathers the coordinates that a stiffness has.
void gather(const PlanStiffening& stiffening, const double* q, Coordinates& in) noexcept {
  for (std::size_t u = 0; u < stiffening.modes.size(); ++u) in[u] = q[index(stiffening.modes[u])];
}

/// Returns the length of a column of PlanModalCoupling::columns.
std::size_t stride_of(const PlanModalCoupling& coupling) noexcept { return pad(2 * coupling.modes.size()); }

}  // namespace

bool has_dependent_loads(const StepPlan& plan) noexcept {
  if (!plan.feedbacks.empty()) return true;
  for (const PlanHistory& history : plan.histories)
    if (has_dependent_loads(history)) return true;
  return false;
}

void add(const DependentLoad& dependent, RigidLoad& load) noexcept {
  load.force_B = freeflex::add(load.force_B, dependent.force_B);
  load.torque_B = freeflex::add(load.torque_B, dependent.torque_B);
}

void add(const DependentStep& dependent, RigidLoads& loads) noexcept {
  const DependentLoad &start = dependent.start, &end = dependent.end;
  add(start, loads.start);
  add({scale(0.5, freeflex::add(start.force_B, end.force_B)),
       scale(0.5, freeflex::add(start.torque_B, end.torque_B))},
      loads.later->middle);
  add(end, loads.later->end);
}

void stiffen(const PlanHistory& history, double amplitude, const Mat3& R_WB, const double* q,
             double* Q) noexcept {
  const PlanStiffening& stiffening = history.stiffening;
  if (stiffening.modes.empty()) return;
  std::array<double, PlanStiffening::kMotors + 1> coefficients{amplitude};
  if (stiffening.components.size() > 1)  // a load in world axes
    for (std::size_t k = 0; k < R_WB.size(); ++k) coefficients[k] = amplitude * R_WB[k];
  coefficients[PlanStiffening::kMotors] = amplitude;
  Coordinates in{};
  gather(stiffening, q, in);
  const double* row = stiffening.rows.data();
  const std::size_t n = stiffening.modes.size(), padded = pad(n);
  for (const std::int32_t component : stiffening.components)
    for (std::size_t l = 0; l < n; ++l, row += padded)
      Q[index(stiffening.modes[l])] -= coefficients[index(component)] * dot_lanes(row, in.data(), padded);
}

void stiffen_by_commands(const StepPlan& plan, const LoadPattern& commands, const Mat3& R_WB, const double* q,
                         double* Q) noexcept {
  const PlanStiffening& stiffening = plan.command_stiffening;
  if (stiffening.modes.empty()) return;
  bool acts = commands.has_world || commands.has_body;
  for (const double torque : commands.wheel_torques) acts |= torque != 0.0;
  if (!acts) return;
  Coordinates in{};
  gather(stiffening, q, in);
  const CommandComponents components(plan);
  const std::size_t n = stiffening.modes.size(), padded = pad(n);
  for (std::size_t k = 0; k < stiffening.components.size(); ++k) {
    const double c = command_coefficient(components, commands.sums, R_WB, index(stiffening.components[k]));
    if (c == 0.0) continue;
    const double* row = stiffening.rows.data() + k * n * padded;
    for (std::size_t l = 0; l < n; ++l, row += padded)
      Q[index(stiffening.modes[l])] -= c * dot_lanes(row, in.data(), padded);
  }
}

FieldStiffness stiffen_by_fields(const StepPlan& plan, const Mat3& R_WB, const Vec3& H_B,
                                 std::span<const double> wheels, const Vec3& p_W, const double* q,
                                 double* Q) noexcept {
  const PlanStiffening& stiffening = plan.field_stiffening;
  if (stiffening.modes.empty()) return {};
  Vec3 H = H_B;
  for (std::size_t k = 0; k < wheels.size(); ++k) H = add_scaled(H, -wheels[k], plan.wheels[k].axis);
  const Vec3 w = multiply(plan.inverse_inertia, H);
  const std::array<double, 6> S = field_of(plan, R_WB, w, p_W);
  double change = 0.0;
  for (std::size_t k = 0; k < stiffening.components.size(); ++k) {
    const double component = S[index(stiffening.components[k])];
    change += (component < 0.0 ? -component : component) * stiffening.shares[k];
  }
  if (change < PlanStiffening::kNegligible) return {};
  Coordinates in{};
  gather(stiffening, q, in);
  std::array<double, 6> e{};  // q^T E_k q / 2
  const double* row = stiffening.rows.data();
  const std::size_t n = stiffening.modes.size(), padded = pad(n);
  for (const std::int32_t component : stiffening.components)
    for (std::size_t l = 0; l < n; ++l, row += padded) {
      const double force = dot_lanes(row, in.data(), padded);
      if (Q != nullptr) Q[index(stiffening.modes[l])] -= S[index(component)] * force;
      e[index(component)] += 0.5 * in[l] * force;
    }
  FieldStiffness field;
  for (std::size_t k = 0; k < e.size(); ++k) field.energy += S[k] * e[k];
  // derivative of the energy with respect to w
  const Vec3 slope{2.0 * w[0] * (e[1] + e[2]) - w[1] * e[3] - w[2] * e[4],
                   2.0 * w[1] * (e[0] + e[2]) - w[0] * e[3] - w[2] * e[5],
                   2.0 * w[2] * (e[0] + e[1]) - w[0] * e[4] - w[1] * e[5]};
  // far beyond small displacements, more than the whole inertia would be taken away
  constexpr double kLargestShare = 0.5;
  const Vec3 faster = multiply(plan.inverse_inertia, slope);
  const double square = dot(faster, faster), most = kLargestShare * kLargestShare * dot(w, w);
  field.w_B = square > most ? scale(__builtin_sqrt(most / square), faster) : faster;
  return field;
}

DependentLoad follow(const StepPlan& plan, const double* q, std::int64_t tick, bool at_end,
                     double* Q) noexcept {
  const std::size_t n = index(plan.num_padded);
  DependentLoad sum;
  for (const PlanHistory& history : plan.histories) {
    if (!has_dependent_loads(history)) continue;
    const double amplitude =
        at_end ? amplitude_left(history, plan.period, tick + 1) : amplitude_right(history, plan.period, tick);
    stiffen(history, amplitude, {}, q, Q);  // only loads in local axes have a stiffness here
    for (const PlanFollower& follower : history.followers) {
      const Vec3 theta = contract_rows(follower.rotation_rows.data(), q, n);
      const Vec3 force = scale(amplitude, cross(theta, follower.force_B));
      combine_rows(point_rows(plan, follower.row), force, true, n, Q);
      sum.force_B = freeflex::add(sum.force_B, force);
      sum.torque_B = freeflex::add(sum.torque_B, cross(follower.r, force));
    }
    // torques in local axes: theta x T   (THEORY 16.14)
    for (const PlanTorque& each : history.torques) {
      const double* rows = rotation_rows(plan, each.attitude_index);
      const Vec3 torque = scale(amplitude, cross(contract_rows(rows, q, n), each.torque_B));
      combine_rows(rows, torque, true, n, Q);
      sum.torque_B = freeflex::add(sum.torque_B, torque);
    }
  }
  return sum;
}

DependentLoad feed_back(const StepPlan& plan, const double* q, const double* q_dot,
                        const double* Q) noexcept {
  DependentLoad sum;
  for (const PlanFeedback& feedback : plan.feedbacks) {
    const Vec3 force = feedback_force(feedback, index(plan.num_padded), q, q_dot, Q);
    sum.force_B = freeflex::add(sum.force_B, force);
    sum.torque_B = freeflex::add(sum.torque_B, cross(feedback.r, force));
  }
  return sum;
}

Vec3 feedback_on_displaced_points(const StepPlan& plan, const double* q, const double* q_dot,
                                  const double* Q) noexcept {
  const std::size_t n = index(plan.num_padded);
  Vec3 moment{};
  for (const PlanFeedback& feedback : plan.feedbacks) {
    const Vec3 V = contract_rows(point_rows(plan, feedback.row), q, n);
    moment = freeflex::add(moment, cross(V, feedback_force(feedback, n, q, q_dot, Q)));
  }
  return moment;
}

DependentStep feed_back_over_step(const StepPlan& plan, const double* q, const double* q_dot,
                                  const double* Q0, const double* Q1) noexcept {
  const PlanModalCoupling& coupling = plan.modal_coupling;
  if (coupling.load_columns.empty()) return {};
  alignas(64) std::array<double, PlanModalCoupling::kLoadRows> sum{};
  const double* column = coupling.load_columns.data();
  const auto add_columns = [&](const auto& value_of) {
    for (const std::int32_t mode : coupling.modes) {
      combine_one(column, value_of(index(mode)), true, sum.size(), sum.data());
      column += sum.size();
    }
  };
  add_columns([&](std::size_t l) { return q[l]; });
  add_columns([&](std::size_t l) { return q_dot[l]; });
  add_columns([&](std::size_t l) { return Q0[l]; });
  add_columns([&](std::size_t l) { return Q1[l] - Q0[l]; });
  return {{{sum[0], sum[1], sum[2]}, {sum[3], sum[4], sum[5]}},
          {{sum[6], sum[7], sum[8]}, {sum[9], sum[10], sum[11]}}};
}

void add_modal_coupling_forces(const StepPlan& plan, const double* q, const double* q_dot, Array& scratch,
                               double* Q) noexcept {
  const std::size_t n = index(plan.num_padded);
  // each feedback responds to the loads that are in Q on entry, but not to the loads that other feedbacks add
  // in this function
  const double* applied = Q;
  if (plan.feedbacks.size() > 1) {
    std::copy_n(Q, n, scratch.begin());
    applied = scratch.data();
  }
  for (const PlanFeedback& feedback : plan.feedbacks)
    combine_rows(point_rows(plan, feedback.row), feedback_force(feedback, n, q, q_dot, applied), true, n, Q);
  for (std::size_t k = 0; k < index(plan.modal_coupling.num_damping); ++k) {
    const double* row = plan.modal_coupling.damping_rows.data() + k * n;
    combine_one(row, -dot_lanes(row, q_dot, n), true, n, Q);
  }
}

DependentLoad apply_half_impulse(const StepPlan& plan, const double* q, const double* q_dot, Array& scratch,
                                 double* q_dot_out) noexcept {
  const PlanModalCoupling& coupling = plan.modal_coupling;
  const std::size_t n = index(plan.num_padded), num_impulses = index(coupling.num_impulses);
  // All impulses are computed from the rates before any impulse acts.
  for (std::size_t k = 0; k < num_impulses; ++k)
    scratch[k] = dot_lanes(coupling.impulse_q_rows.data() + k * n, q, n) +
                 dot_lanes(coupling.impulse_q_dot_rows.data() + k * n, q_dot, n);
  if (q_dot_out != q_dot) std::copy_n(q_dot, n, q_dot_out);
  for (std::size_t k = 0; k < num_impulses; ++k)
    combine_one(coupling.impulse_out.data() + k * n, scratch[k], true, n, q_dot_out);
  DependentLoad load;
  const double* impulse = scratch.data() + coupling.num_damping;
  for (const PlanFeedback& feedback : plan.feedbacks) {
    const Vec3 force = scale(2.0 / plan.period, {impulse[0], impulse[1], impulse[2]});
    load.force_B = freeflex::add(load.force_B, force);
    load.torque_B = freeflex::add(load.torque_B, cross(feedback.r, force));
    impulse += 3;
  }
  return load;
}

bool advance_coupled_modes(const StepPlan& plan, const ModalState& from, const double* Q0, const double* Q1,
                           Array& scratch, const ModalResult& to) noexcept {
  const PlanModalCoupling& coupling = plan.modal_coupling;
  const std::size_t num_modes = coupling.modes.size(), stride = stride_of(coupling);
  double* const sum = scratch.data();
  std::fill_n(sum, stride, 0.0);
  const double* column = coupling.columns.data();
  const auto add_columns = [&](const auto& value_of) {
    for (const std::int32_t mode : coupling.modes) {
      combine_one(column, value_of(index(mode)), true, stride, sum);
      column += stride;
    }
  };
  add_columns([&](std::size_t l) { return from.q[l]; });
  add_columns([&](std::size_t l) { return from.q_dot[l]; });
  add_columns([&](std::size_t l) { return Q0[l]; });
  add_columns([&](std::size_t l) { return Q1[l] - Q0[l]; });
  double check = 0.0;
  for (std::size_t k = 0; k < num_modes; ++k) {
    const std::size_t l = index(coupling.modes[k]);
    to.q[l] = sum[k];
    to.q_dot[l] = sum[num_modes + k];
    to.q_low[l] = to.q_dot_low[l] = 0.0;
    check += (sum[k] - sum[k]) + (sum[num_modes + k] - sum[num_modes + k]);
  }
  return check == 0.0;
}

bool advance_linear(const StepPlan& plan, const ModalState& from, const double* Q0, const double* Q1,
                    Array& q_dot_after_impulse, Array& scratch, const ModalResult& to,
                    DependentLoad& last_impulse) noexcept {
  const std::size_t n = index(plan.num_moving);
  if (plan.modal_coupling.path == PlanModalCoupling::Path::kNone)
    return advance_modes(plan.propagator, n, from, Q0, Q1, to);
  if (plan.modal_coupling.path == PlanModalCoupling::Path::kExact) {
    const bool is_finite = advance_modes(plan.propagator, n, from, Q0, Q1, to);
    return advance_coupled_modes(plan, from, Q0, Q1, scratch, to) && is_finite;
  }
  // Apply a splitting impulse, advance the modes, and apply a second splitting impulse   (THEORY 8.38)
  apply_half_impulse(plan, from.q, from.q_dot, scratch, q_dot_after_impulse.data());
  const bool is_finite = advance_modes(
      plan.propagator, n, {from.q, from.q_low, q_dot_after_impulse.data(), from.q_dot_low}, Q0, Q1, to);
  last_impulse = apply_half_impulse(plan, to.q, to.q_dot, scratch, to.q_dot);
  return is_finite;
}

std::size_t modal_coupling_scratch_size(const StepPlan& plan) noexcept {
  return std::max(
      {stride_of(plan.modal_coupling), index(plan.num_padded), index(plan.modal_coupling.num_impulses)});
}

}  // namespace freeflex
