#include "core/error/budget.hpp"

#include <algorithm>
#include <limits>

#include "core/step/coupled/coupled.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/readout.hpp"
#include "core/step/vector.hpp"

namespace freeflex {
namespace {

/// Copies the active slots of a state to a shadow. In the shadow the slots never expire. They change only
/// when take_slots copies them again.
void take_slots(const State& from, State& to) noexcept {
  std::copy_n(from.slots.begin(), from.num_slots, to.slots.begin());
  for (std::int32_t i = 0; i < from.num_slots; ++i) {
    to.slots[index(i)].end_tick = std::numeric_limits<std::int64_t>::max();
    to.slots[index(i)].command.lease_ticks = 0;
  }
  to.num_slots = from.num_slots;
  to.slots_changed = true;
}

/// Computes elastic coordinates of displacements V (num_points): q_l = sum_i m_i b_il . V_i / M
/// (THEORY 4.25).
void to_modes(const StepPlan& plan, std::span<const Vec3> V, std::span<Vec3> weighted, Array& q,
              Array& unused) noexcept {
  for (std::size_t i = 0; i < V.size(); ++i) weighted[i] = scale(plan.points[i].mass / plan.mass, V[i]);
  project_points(plan, weighted, weighted, q.data(), unused.data());
}

/// Sets a shadow to the motion of the state.
void put_shadow(const StepPlan& plan, const State& state, const PlanShadow& shadow, Budget& budget, State& to,
                Workspace& workspace) noexcept {
  to.tick = state.tick * shadow.substeps;
  to.epoch_start_tick = state.epoch_start_tick * shadow.substeps;
  static_cast<Frame&>(to) = state;
  to.wheel_momentum = state.wheel_momentum;
  to.wheel_momentum_low = state.wheel_momentum_low;
  if (state.tick == state.epoch_start_tick) {
    // use the initial state of the shadow's plan, because the plan of the state may omit some of the excited
    // modes
    to.q = shadow.plan.initial.q;
    to.q_dot = shadow.plan.initial.q_dot;
  } else if (!budget.points_give_modes) {
    // if the scene has bodies, the plan and its shadows have the same modes
    std::copy(state.q.begin(), state.q.begin() + plan.num_elastic, to.q.begin());
    std::copy(state.q_dot.begin(), state.q_dot.begin() + plan.num_elastic, to.q_dot.begin());
  } else {
    to_modes(shadow.plan, budget.V, budget.scratch, to.q, workspace.next_q);
    to_modes(shadow.plan, budget.V_dot, budget.scratch, to.q_dot, workspace.next_q);
  }
  std::fill(to.q_low.begin(), to.q_low.end(), 0.0);
  std::fill(to.q_dot_low.begin(), to.q_dot_low.end(), 0.0);
  // the step will compute the loads of this tick again
  std::fill(to.Q.begin(), to.Q.end(), 0.0);
  if (is_coupled(shadow.plan)) set_coupled_motion(shadow.plan, angular_velocity(plan, state), to);
  take_slots(state, to);
}

/// Returns the distance between two states. Here x = r + V, and a star marks `other`:
///   position: (mean_i |p_WB + R_WB x_i - p_WB* - R_WB* x_i*|^2)^(1/2)   (THEORY 12.23)
///   attitude: 2 sin(phi / 2), phi the angle of R_WB^T R_WB*   (THEORY 12.24)
///   elastic: |V - V*| / |V*|   (THEORY 12.25)
ErrorSize distance(const StepPlan& plan, const State& state, const StepPlan& other_plan, const State& other,
                   Budget& budget) noexcept {
  contract_points(plan, state.q.data(), state.q.data(), budget.V, budget.scratch);
  contract_points(other_plan, other.q.data(), other.q.data(), budget.V_other, budget.scratch);
  const Mat3 R = rotation_matrix(state.q_WB), R_other = rotation_matrix(other.q_WB);
  const Vec3 shift = sub(state.p_WB, other.p_WB);
  double position = 0.0, elastic = 0.0, size = 0.0;
  for (std::size_t i = 0; i < budget.V.size(); ++i) {
    const Vec3 &V = budget.V[i], &V_other = budget.V_other[i], d = sub(V, V_other);
    const Vec3 x = add(plan.points[i].r, V);
    // R_WB x - R_WB* x* is computed as (R_WB - R_WB*) x + R_WB* (V - V*), which avoids subtracting two large
    // numbers
    const Vec3 by_rotation = sub(multiply(R, x), multiply(R_other, x));
    const Vec3 off = add(add(shift, by_rotation), multiply(R_other, d));
    position += dot(off, off);
    elastic += dot(d, d);
    size += dot(V_other, V_other);
  }
  ErrorSize error;
  error.position = __builtin_sqrt(position / static_cast<double>(budget.V.size()));
  error.displacement = __builtin_sqrt(elastic / static_cast<double>(budget.V.size()));
  if (elastic > 0.0) error.elastic = __builtin_sqrt(elastic / size);
  const Quat &q = state.q_WB, &o = other.q_WB;
  const Quat relative = multiply({q[0], -q[1], -q[2], -q[3]}, o);
  error.attitude =
      2.0 * __builtin_sqrt(relative[1] * relative[1] + relative[2] * relative[2] + relative[3] * relative[3]);
  return error;
}

// [rad] largest phase of a mode in one step for which the step resolves the effect of the spin on its
// vibration (THEORY 12.27)
constexpr double kResolved = 2.0;

/// Adds this tick to the sums of q_l^2 over all modes, and of (q_l' / omega_l)^2 over the modes whose
/// vibration the best shadow does not resolve (THEORY 12.27).
void gather_motion(const StepPlan& best, const State& state, double spin, double period,
                   Budget& budget) noexcept {
  const double slow = kResolved * best.coupled.num_substeps / best.period;
  for (std::size_t l = 0; l < index(best.num_elastic); ++l) {
    const double q = state.q[l], rate = state.q_dot[l], omega = best.omega[l];
    budget.all_motion += q * q;
    if (omega > slow) budget.fast_motion += (rate / omega) * (rate / omega);
  }
  budget.rotation += spin * period;
}

ErrorSize scaled(double factor, const ErrorSize& error) noexcept {
  return {factor * error.position, factor * error.attitude, factor * error.elastic,
          factor * error.displacement};
}

/// Sets all shadows to the motion of the state.
void restart(const Plan& plan, const State& state, Budget& budget) noexcept {
  contract_points(plan, state.q.data(), state.q_dot.data(), budget.V, budget.V_dot);
  for (std::size_t k = 0; k < budget.shadows.size(); ++k)
    put_shadow(plan, state, plan.budget.shadows[k], budget, budget.shadows[k].state,
               budget.shadows[k].workspace);
  budget.is_lost = false;
  budget.rotation = budget.fast_motion = budget.all_motion = 0.0;
  budget.sync_tick = budget.tick = state.tick;
  budget.epoch = state.epoch;
}

/// Returns true if the shadows belong to this state.
bool is_current(const State& state, const Budget& budget) noexcept {
  return budget.tick == state.tick && budget.epoch == state.epoch;
}

/// Advances the shadows by the tick that the state has just made.
/// \param slots_changed  true: in this tick a command took effect or a slot ended
void follow_step(const Plan& plan, const State& state, bool slots_changed, Budget& budget) noexcept {
  budget.tick = state.tick;
  StepReport report;
  for (std::size_t k = 0; k < budget.shadows.size() && !budget.is_lost; ++k) {
    const PlanShadow& shadow = plan.budget.shadows[k];
    auto& [shadow_state, workspace] = budget.shadows[k];
    if (slots_changed) take_slots(state, shadow_state);
    for (std::int32_t s = 0; s < shadow.substeps; ++s) {
      step(shadow.plan, shadow_state, {}, workspace, report);
      budget.is_lost = budget.is_lost || report.status != StepStatus::kOk;
    }
  }
  if (budget.is_lost) return;
  const Vec3 w = angular_velocity(plan, state);
  gather_motion(plan.budget.shadows.front().plan, budget.shadows.front().state, __builtin_sqrt(dot(w, w)),
                plan.period, budget);
}

/// Returns true if the points carry all of the mass, so that sum m b.b = M for each mode (THEORY 4.3). The
/// displacements of points then determine the elastic coordinates   (THEORY 4.25).
bool do_points_give_modes(const StepPlan& plan) {
  constexpr double kRounding = 1e-6;
  for (std::size_t l = 0; l < index(plan.num_elastic); ++l) {
    double sum = 0.0;
    for (const PlanPoint& point : plan.points)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double b = point_rows(plan, point.row)[axis * index(plan.num_padded) + l];
        sum += point.mass * b * b;
      }
    if (sum < (1.0 - kRounding) * plan.mass || sum > (1.0 + kRounding) * plan.mass) return false;
  }
  return true;
}

}  // namespace

Budget make_budget(const Plan& plan) {
  Budget budget;
  for (const PlanShadow& shadow : plan.budget.shadows)
    budget.shadows.push_back({make_state(shadow.plan), make_workspace(shadow.plan)});
  if (!budget.shadows.empty()) budget.points_give_modes = do_points_give_modes(plan);
  if (!budget.shadows.empty())
    for (auto* v : {&budget.V, &budget.V_dot, &budget.V_other, &budget.scratch})
      v->resize(plan.points.size());
  return budget;
}

void step(const Plan& plan, State& state, const Inputs& inputs, Workspace& workspace, Budget& budget,
          StepReport& report) noexcept {
  if (budget.shadows.empty()) return step(plan, state, inputs, workspace, report);
  const bool is_over = state.tick - budget.sync_tick >= plan.budget.horizon_ticks;
  if (is_over || !is_current(state, budget)) restart(plan, state, budget);
  step(plan, state, inputs, workspace, report);
  if (report.status != StepStatus::kOk) return;
  follow_step(plan, state, !inputs.commands.empty() || report.num_expiries > 0, budget);
}

BudgetReading read_budget(const Plan& plan, const State& state, Budget& budget) noexcept {
  BudgetReading reading;
  if (budget.shadows.empty()) return reading;
  if (!is_current(state, budget)) restart(plan, state, budget);
  reading.age = static_cast<double>(state.tick - budget.sync_tick) * plan.period;
  reading.is_lost = budget.is_lost;
  // Phi (fast_motion / all_motion)^(1/2), where Phi is the rotation and the root is at most 1
  // (THEORY 12.27)
  if (budget.fast_motion > 0.0)
    reading.unresolved =
        budget.rotation * __builtin_sqrt(std::min(1.0, budget.fast_motion / budget.all_motion));
  if (budget.is_lost) return reading;
  const auto find = [&](PlanShadow::Kind kind) -> std::ptrdiff_t {
    for (std::size_t k = 0; k < budget.shadows.size(); ++k)
      if (plan.budget.shadows[k].kind == kind) return static_cast<std::ptrdiff_t>(k);
    return -1;
  };
  const std::ptrdiff_t best = find(PlanShadow::Kind::kBest), fine = find(PlanShadow::Kind::kFine),
                       full = find(PlanShadow::Kind::kFull);
  const auto plan_at = [&](std::ptrdiff_t k) -> const StepPlan& {
    return k < 0 ? plan : plan.budget.shadows[index(k)].plan;
  };
  const auto state_at = [&](std::ptrdiff_t k) -> const State& {
    return k < 0 ? state : budget.shadows[index(k)].state;
  };
  const auto between = [&](std::ptrdiff_t a, std::ptrdiff_t b) {
    return distance(plan_at(a), state_at(a), plan_at(b), state_at(b), budget);
  };
  // 1.25 distance(state, best)   (THEORY 12.26)
  reading.total = scaled(kCover, between(-1, best));
  if (full >= 0) reading.truncation = between(-1, full);
  // without a fine shadow, the plan is already on the best rung: the best shadow serves as the fine one, and
  // there is no model error
  reading.integration = between(full, fine >= 0 ? fine : best);
  if (fine >= 0) reading.model = between(fine, best);
  return reading;
}

}  // namespace freeflex
