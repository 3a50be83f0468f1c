#include "core/step/coupled/coupled.hpp"

#include <algorithm>

#include "core/step/coupled/filtered.hpp"
#include "core/step/coupled/stage.hpp"
#include "core/step/coupled/strain_damping.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/linear/modal_coupling.hpp"
#include "core/step/massless/massless_motion.hpp"
#include "core/step/readout.hpp"
#include "core/step/rigid/kepler.hpp"
#include "core/step/rigid/tick_rotation.hpp"

namespace freeflex {
namespace {

/// Holds the rows of one of PlanCoupled::functions.
struct Function {
  const double *qq, *qv, *vq, *vv;
};
Function function_of(const StepPlan& plan, PlanCoupled::Function function) noexcept {
  const std::size_t n = index(plan.num_padded);
  const double* first = plan.coupled.functions.data() + PlanCoupled::kNumEntries * std::size_t{function} * n;
  return {first, first + n, first + 2 * n, first + 3 * n};
}

/// Points to the coordinates at the start of the step (num_padded).
struct Start {
  const double *q, *p;
};
using Stages = std::array<std::array<const double*, 2>, 4>;  // rates of q and p at each stage

/// Computes (q, p) at stage 2 or stage 3, which are both at the middle of the step   (THEORY 12.15):
///   Y_3 = exp(h L / 2) y + (h / 2) phi_1(h L / 2) N_1 + h phi_2(h L / 2) (N_2 - N_1)
/// Y_2 does not have the last term.
/// \param other  index of the stage whose rate is used as N_2; 0 for Y_2, so that the last term is zero
void half_stage(const StepPlan& plan, const Start& start, const Stages& N, std::size_t other,
                CoupledWorkspace& w) noexcept {
  const Function E = function_of(plan, PlanCoupled::kHalfStep), A = function_of(plan, PlanCoupled::kHalf1),
                 B = function_of(plan, PlanCoupled::kHalf2);
  const double *q = start.q, *p = start.p;
  const double *a = N[0][0], *b = N[0][1], *c = N[other][0], *d = N[other][1];
  for (std::size_t l = 0; l < index(plan.num_moving); ++l) {
    const double x = c[l] - a[l], y = d[l] - b[l];
    w.q[l] = q[l] + ((E.qq[l] * q[l] + E.qv[l] * p[l]) + (A.qq[l] * a[l] + A.qv[l] * b[l]) +
                     (B.qq[l] * x + B.qv[l] * y));
    w.p[l] = p[l] + ((E.vq[l] * q[l] + E.vv[l] * p[l]) + (A.vq[l] * a[l] + A.vv[l] * b[l]) +
                     (B.vq[l] * x + B.vv[l] * y));
  }
}

/// Computes (q, p) at the end of the step. If is_last is false, the result is stage 4   (THEORY 12.15):
///   Y_4 = exp(h L) y + h phi_1(h L) N_1 + 2 h phi_2(h L) (N_3 - N_1)
/// If is_last is true, it is the result of the step   (THEORY 12.16):
///   y^1 = exp(h L) y + h phi_1(h L) N_1 + h phi_2(h L) (-3 N_1 + 2 N_2 + 2 N_3 - N_4)
///         + 4 h phi_3(h L) (N_1 - N_2 - N_3 + N_4)
/// In the code, x is the factor of h phi_2, and y that of h phi_3.
void full_step(const StepPlan& plan, const Start& start, const Stages& N, bool is_last, double* q_out,
               double* p_out) noexcept {
  const Function E = function_of(plan, PlanCoupled::kStep), A = function_of(plan, PlanCoupled::kStep1),
                 B = function_of(plan, PlanCoupled::kStep2), C = function_of(plan, PlanCoupled::kStep3);
  const double *q = start.q, *p = start.p;
  for (std::size_t l = 0; l < index(plan.num_moving); ++l) {
    std::array<double, 2> x{}, y{};
    for (std::size_t k = 0; k < 2; ++k) {
      const double n1 = N[0][k][l], n3 = N[2][k][l];
      if (!is_last) {
        x[k] = 2.0 * (n3 - n1);
        continue;
      }
      const double n2 = N[1][k][l], n4 = N[3][k][l];
      x[k] = 2.0 * ((n2 - n1) + (n3 - n1)) - (n4 - n1);
      y[k] = 4.0 * (((n1 - n2) - n3) + n4);
    }
    const double a = N[0][0][l], b = N[0][1][l];
    q_out[l] = q[l] + ((E.qq[l] * q[l] + E.qv[l] * p[l]) + (A.qq[l] * a + A.qv[l] * b) +
                       (B.qq[l] * x[0] + B.qv[l] * x[1]) + (C.qq[l] * y[0] + C.qv[l] * y[1]));
    p_out[l] = p[l] + ((E.vq[l] * q[l] + E.vv[l] * p[l]) + (A.vq[l] * a + A.vv[l] * b) +
                       (B.vq[l] * x[0] + B.vv[l] * x[1]) + (C.vq[l] * y[0] + C.vv[l] * y[1]));
  }
}

/// Writes the momenta of the wheels at a stage time [N m s].
void wheel_momenta_at(const StepLoads& step_loads, std::span<const double> start, StageTime stage_time,
                      std::span<double> momentum) noexcept {
  for (std::size_t k = 0; k < momentum.size(); ++k)
    momentum[k] = step_loads.wheel_momentum(k, start[k], stage_time);
}

/// Returns what the difference of two rates changes the amplitudes in a step [m], rms over the mass. A fast
/// mode averages its rate, so its share falls with omega h.
double effect_of(const StepPlan& plan, double h, const std::array<const double*, 2>& rates,
                 const std::array<Array, 2>& others) noexcept {
  const std::size_t n = index(plan.num_elastic);
  std::size_t first = 0;
  while (first + 1 < n && plan.omega[first] == 0.0) ++first;
  const double lowest = plan.omega[first];
  double sum = 0.0;
  for (std::size_t l = 0; l < n; ++l) {
    const double omega = plan.omega[l] > lowest ? plan.omega[l] : lowest;
    const double share = omega * h > 1.0 ? 1.0 / (omega * h) : 1.0;
    const double by_q = share * (rates[0][l] - others[0][l]), by_p = share * (rates[1][l] - others[1][l]);
    sum += by_q * by_q + (omega > 0.0 ? by_p * by_p / (omega * omega) : h * h * by_p * by_p);
  }
  return h * __builtin_sqrt(sum);
}

/// Returns an estimate of the error of a step [m], rms over the mass: a sixth of what the difference between
/// the rates at the last stage and at the result changes the amplitudes   (THEORY 12.95). Sets w.start_q and
/// w.start_p to the curvilinear rates at the result, with which the next step begins if there is no filter.
/// \pre w.curve has the shapes of the result
double step_error(const StepPlan& plan, double h, CoupledWorkspace& w) noexcept {
  CoupledState& next = w.next;
  if (!is_curved(plan)) return effect_of(plan, h, {next.rate_q.data(), next.rate_p.data()}, w.rates[3]) / 6.0;
  std::copy(next.rate_q.begin(), next.rate_q.end(), w.start_q.begin());
  std::copy(next.rate_p.begin(), next.rate_p.end(), w.start_p.begin());
  curve_rates(plan, w.start_q.data(), w.start_p.data(), w.curve);
  if (!plan.coupled.curve.is_filtered) next.curved_rate_q = w.start_q, next.curved_rate_p = w.start_p;
  return effect_of(plan, h, {next.curved_rate_q.data(), next.curved_rate_p.data()}, w.rates[3]) / 6.0;
}

/// Advances the motion that the filter has left out: the linear modes under the difference between the rates
/// at the result, in w.start_q and w.start_p, and those at the filtered result   (THEORY 12.97). Returns its
/// size [m], rms over the mass.
double advance_left_out(const StepPlan& plan, const CoupledState& last, CoupledWorkspace& w) noexcept {
  const Function E = function_of(plan, PlanCoupled::kStep), A = function_of(plan, PlanCoupled::kStep1);
  CoupledState& next = w.next;
  double sum = 0.0;
  for (std::size_t l = 0; l < index(plan.num_moving); ++l) {
    const double q = last.left_out_q[l], p = last.left_out_p[l];
    const double a = w.start_q[l] - next.curved_rate_q[l], b = w.start_p[l] - next.curved_rate_p[l];
    next.left_out_q[l] = q + ((E.qq[l] * q + E.qv[l] * p) + (A.qq[l] * a + A.qv[l] * b));
    next.left_out_p[l] = p + ((E.vq[l] * q + E.vv[l] * p) + (A.vq[l] * a + A.vv[l] * b));
    const double omega = plan.omega[l], x = next.left_out_q[l], y = next.left_out_p[l];
    sum += x * x + (omega > 0.0 ? y * y / (omega * omega) : 0.0);
  }
  return __builtin_sqrt(sum);
}

/// Holds the rates of attitude and angular momentum at the four stages, in the axes that the body has at the
/// start of the step:
///   g' = (w + g x w + g (g.w)) / 2   (THEORY 7.7),   H' = G(g) L_B   (THEORY 7.9)
/// The second equation is (THEORY 12.12), H_B' = H_B x w + L_B, written in axes that do not rotate. Attitude
/// and angular momentum have no linear part L, so the method (THEORY 12.15) reduces to the classical
/// Runge-Kutta method, in which the mean rate is (k_1 + 2 k_2 + 2 k_3 + k_4) / 6.
struct AttitudeRates {
  Mat3 R_start;
  Vec3 H_start;  // [kg m^2/s] angular momentum at the start of the step
  std::array<Vec3, 4> g_rate{}, H_rate{}, force_W{};

  void add_stage(std::size_t k, const Vec3& g, const StageRate& rate) noexcept {
    const Vec3 half_w = scale(0.5, rate.w_B);
    g_rate[k] = add_scaled(add(half_w, cross(g, half_w)), dot(g, half_w), g);
    H_rate[k] = multiply(rotation_of_gibbs(g), rate.moment_B);
    force_W[k] = rate.force_W;
  }
  static Vec3 mean(const std::array<Vec3, 4>& k) noexcept {
    return scale(1.0 / 6.0, add(add(k[0], k[3]), scale(2.0, add(k[1], k[2]))));
  }
};

/// The state of one stage: coordinates and momenta along the path (linear or curvilinear), the Gibbs vector
/// of the rotation since the start of the step, the angular momentum in the axes of the start, and the time.
struct StagePoint {
  const double* q;
  const double* p;
  Vec3 g;
  Vec3 H;
  double t;  // [s] since the start of the step
  StageTime stage_time;
};

/// Returns the position [m] of the body frame at time t [s] of the step, for the attractor.
Vec3 position_at(const StepPlan& plan, const MotionState& state, double t) noexcept {
  if (!may_orbit_far(plan, state)) return add_scaled(state.p_WB, t, state.v_WB);
  return add(state.p_WB, fall(plan.attractor_mu, sub(state.p_WB, plan.attractor_W), state.v_WB, t).p);
}

/// Evaluates the rates at stage k.
void visit(const StepLoads& step_loads, const MotionState& state, std::size_t k, const StagePoint& at,
           AttitudeRates& attitude, Workspace& workspace) noexcept {
  const StepPlan& plan = step_loads.plan;
  CoupledWorkspace& w = workspace.coupled;
  const Mat3 G = rotation_of_gibbs(at.g);
  wheel_momenta_at(step_loads, state.wheel_momentum, at.stage_time, w.wheels);
  StageRate rate{w.rates[k][0].data(), w.rates[k][1].data()};
  const StageState stage{at.q,
                         at.p,
                         multiply_transposed(G, at.H),
                         multiply(attitude.R_start, G),
                         position_at(plan, state, at.t),
                         at.stage_time,
                         w.wheels};
  if (!is_curved(plan))
    evaluate(step_loads, stage, workspace, rate);
  else if (!plan.coupled.curve.is_filtered)
    evaluate_curved(step_loads, at.q, at.p, stage, workspace, rate);
  else
    evaluate_filtered(step_loads, at.q, at.p, stage, workspace, rate);
  attitude.add_stage(k, at.g, rate);
}

/// Sets the rates of the first stage to those that the last step ended with.
void take_last_rates(const StepPlan& plan, const MotionState& state, Stages& N,
                     AttitudeRates& attitude) noexcept {
  const CoupledState& last = state.coupled;
  const bool is_filtered = plan.coupled.curve.is_filtered;
  if (is_curved(plan))
    N[0] = {last.curved_rate_q.data(), last.curved_rate_p.data()};
  else
    N[0] = {last.rate_q.data(), last.rate_p.data()};
  StageRate rate{nullptr, nullptr};
  rate.w_B = is_filtered ? last.filtered_w_B : last.w_B;
  rate.moment_B = is_filtered ? last.filtered_moment_B : last.moment_B;
  rate.force_W = is_filtered ? last.filtered_force_W : state.force_W;
  attitude.add_stage(0, {}, rate);
}

/// Returns the start of the step, in curvilinear coordinates where the plan has them, and begins the joints
/// and the slow motion of the stages with those of the state.
Start begin_step(const StepPlan& plan, const MotionState& state, CoupledWorkspace& w) noexcept {
  Start start{state.q.data(), state.coupled.momentum.data()};
  if (is_curved(plan) && state.coupled.has_rates) {
    start = {state.coupled.curved_q.data(), state.coupled.curved_p.data()};
  } else if (is_curved(plan)) {
    to_curved(plan, start.q, start.p, w.start_q.data(), w.start_p.data(), w.curve);
    start = {w.start_q.data(), w.start_p.data()};
  }
  w.stage_joints = state.coupled.joints;
  w.ball_joints.is_open = false;
  if (!w.ball_joints.empty()) w.ball_joints.q = state.q;
  begin_joints(w.joints);
  begin_strain_damping(w);
  w.curve.slow_q = state.coupled.slow_q;
  w.curve.slow_p = state.coupled.slow_p;
  if (plan.coupled.curve.is_filtered) {
    w.slow_start = state.coupled.slow_q;
    for (std::size_t k = 0; k < w.slow_start.size(); ++k) w.slow_start[k] -= state.coupled.slow_change[k];
    w.slow_pace = pace_of_slow_motion(plan, w);
  }
  return start;
}

/// Advances the modes and the frame through the four stages   (THEORY 12.15, 12.16). The attitude of a stage
/// is R_WB^0 G(g) (THEORY 7.8).
Frame advance_stages(const StepLoads& step_loads, const MotionState& state, bool is_fresh,
                     Workspace& workspace) noexcept {
  const StepPlan& plan = step_loads.plan;
  CoupledWorkspace& w = workspace.coupled;
  const double h = step_loads.period();
  AttitudeRates attitude{rotation_matrix(state.q_WB), {}};
  attitude.H_start = multiply_transposed(attitude.R_start, state.H_W);
  Stages N{};
  for (std::size_t k = 0; k < 4; ++k) N[k] = {w.rates[k][0].data(), w.rates[k][1].data()};
  const Start start = begin_step(plan, state, w);
  const auto visit_stage = [&](std::size_t k, const StagePoint& at) {
    visit(step_loads, state, k, at, attitude, workspace);
  };
  if (is_fresh || !state.coupled.has_rates)
    visit_stage(0, {start.q, start.p, {}, attitude.H_start, 0.0, StageTime::kStart});
  else
    take_last_rates(plan, state, N, attitude);
  const auto H_at = [&](double t, std::size_t k) {
    return add_scaled(attitude.H_start, t, attitude.H_rate[k]);
  };
  if (plan.coupled.curve.is_filtered) {
    w.slow_start = w.curve.slow_q;
    for (std::size_t k = 0; k < w.slow_start.size(); ++k)
      w.curve.slow_q[k] += 0.5 * state.coupled.slow_change[k];
  }
  half_stage(plan, start, N, 0, w);
  visit_stage(1, {w.q.data(), w.p.data(), scale(0.5 * h, attitude.g_rate[0]), H_at(0.5 * h, 0), 0.5 * h,
                  StageTime::kMiddle});
  half_stage(plan, start, N, 1, w);
  visit_stage(2, {w.q.data(), w.p.data(), scale(0.5 * h, attitude.g_rate[1]), H_at(0.5 * h, 1), 0.5 * h,
                  StageTime::kMiddle});
  full_step(plan, start, N, false, w.q.data(), w.p.data());
  for (std::size_t k = 0; k < w.slow_start.size(); ++k)
    w.curve.slow_q[k] += w.curve.slow_q[k] - w.slow_start[k];
  visit_stage(3, {w.q.data(), w.p.data(), scale(h, attitude.g_rate[2]), H_at(h, 2), h, StageTime::kEnd});
  full_step(plan, start, N, true, workspace.next_q.data(), w.next.momentum.data());
  if (is_curved(plan)) {
    w.next.curved_q = workspace.next_q;
    w.next.curved_p = w.next.momentum;
    to_linear(plan, w.next.curved_q.data(), w.next.curved_p.data(), w.curve);
    std::copy(w.curve.q.begin(), w.curve.q.end(), workspace.next_q.begin());
    std::copy(w.curve.p.begin(), w.curve.p.end(), w.next.momentum.begin());
  }

  Frame frame = state;
  rotate_attitude(scale(h, AttitudeRates::mean(attitude.g_rate)), frame);
  const Vec3 H_gain = scale(h, multiply(attitude.R_start, AttitudeRates::mean(attitude.H_rate)));
  for (std::size_t i = 0; i < 3; ++i) add_compensated(frame.H_W[i], frame.H_W_low[i], H_gain[i]);
  translate(plan, h, attitude.force_W[0], scale(0.5, add(attitude.force_W[1], attitude.force_W[2])),
            attitude.force_W[3], frame);
  return frame;
}

/// Sets the momenta of a motion whose angular velocity has no share of the stiffness by fields.
void set_momenta(const StepPlan& plan, const Vec3& w_B, MotionState& state) noexcept {
  CoupledState& coupled = state.coupled;
  const std::size_t n = index(plan.num_padded);
  const Vec3& w = coupled.w_B = w_B;
  std::copy(state.q_dot.begin(), state.q_dot.end(), coupled.momentum.begin());
  Vec3 H{};
  const bool has_tables = plan.coupled.kinetics.form == PlanKinetics::Form::kTables;
  if (has_tables) H = momenta_by_tables(plan, w, state.q.data(), state.q_dot.data(), coupled.momentum.data());
  if (has_spread_mass(plan))
    H = add(momenta_of_spread(plan, w, state.q.data(), state.q_dot.data(), coupled.momentum.data()),
            wheel_momentum_in_frame(plan, state.wheel_momentum, state.q.data()));
  else if (turns(plan))
    H = momenta_of_turning(plan, state.wheel_momentum, w, state.q.data(), state.q_dot.data(),
                           coupled.momentum.data());
  for (std::size_t i = 0; i < plan.points.size() && !has_tables && !turns(plan); ++i) {
    const PlanPoint& point = plan.points[i];
    const double* rows = point_rows(plan, point.row);
    const Vec3 V = contract_rows(rows, state.q.data(), n), V_dot = contract_rows(rows, state.q_dot.data(), n);
    // the arm of V' is V instead of r + V, because sum_i m_i r_i x V_i' is zero   (THEORY 2.15)
    const Vec3 x = add(point.r, V);
    H = add_scaled(H, point.mass, add(cross(x, cross(w, x)), cross(V, V_dot)));
    combine_rows(rows, scale(point.mass / plan.mass, cross(w, V)), true, n, coupled.momentum.data());
  }
  if (!plan.wheels.empty() && !turns(plan)) {
    H = add(H, rotated_wheel_momentum(plan, state.wheel_momentum, state.q.data()));
    add_wheel_momenta(plan, state.wheel_momentum, state.q.data(), -1.0, coupled.momentum.data());
  }
  // Constraint shapes come after the modes in the arrays, and they do not move.
  // So do the coordinates of ball joints, whose momenta follow from the others.
  std::fill(coupled.momentum.begin() + plan.num_moving, coupled.momentum.end(), 0.0);
  state.H_W = multiply(rotation_matrix(state.q_WB), H);
  state.H_W_low = {};
  coupled.has_rates = false;
  coupled.integration_error = coupled.filter_error = 0.0;
  coupled.joints = plan.initial.joints;
  for (auto* v :
       {&coupled.slow_q, &coupled.slow_p, &coupled.slow_change, &coupled.left_out_q, &coupled.left_out_p})
    std::fill(v->begin(), v->end(), 0.0);
  start_massless_motion(plan, state);
  // Accelerations without loads, to first order in the elastic displacements. The first step overwrites these
  // values.
  coupled.w_dot_B = multiply(plan.inverse_inertia, cross(H, w));
  for (std::size_t l = 0; l < coupled.q_ddot.size(); ++l)
    coupled.q_ddot[l] = -plan.omega[l] * (plan.omega[l] * state.q[l]) - 2.0 * plan.decay[l] * state.q_dot[l];
}

}  // namespace

void set_coupled_motion(const StepPlan& plan, const Vec3& w_B, MotionState& state) noexcept {
  // of second order in the displacements (THEORY 8.52), so that each pass leaves a small share of the error
  // of the last one
  constexpr int kPasses = 8;
  Vec3 stiffened{};
  close_at_start(plan, state.q.data(), state.q_dot.data());
  for (int pass = 0; pass < kPasses; ++pass) {
    set_momenta(plan, sub(w_B, stiffened), state);
    if (plan.field_stiffening.modes.empty()) break;
    const Mat3 R_WB = rotation_matrix(state.q_WB);
    stiffened = stiffen_by_fields(plan, R_WB, multiply_transposed(R_WB, state.H_W), state.wheel_momentum,
                                  state.p_WB, state.q.data(), nullptr)
                    .w_B;
  }
  state.coupled.w_B = w_B;
}

bool advance_coupled_rung(const StepLoads& step_loads, const MotionState& state, bool is_fresh,
                          Workspace& workspace, Frame& frame, Vec3& force_W, Vec3& moment_B) noexcept {
  const StepPlan& plan = step_loads.plan;
  CoupledWorkspace& w = workspace.coupled;
  if (plan.num_elastic > 0) {
    frame = advance_stages(step_loads, state, is_fresh, workspace);
  } else {
    // The equations of a body without modes are those of the lower rungs.
    RigidLoads loads = step_loads.rigid();
    loads.wheels = step_loads.wheels(state.wheel_momentum);
    frame = advance_frame(plan, state, rotation_matrix(state.q_WB), loads);
  }
  const Mat3 R_end = rotation_matrix(frame.q_WB);
  wheel_momenta_at(step_loads, state.wheel_momentum, StageTime::kEnd, w.wheels);
  const StageState result{workspace.next_q.data(),
                          w.next.momentum.data(),
                          multiply_transposed(R_end, frame.H_W),
                          R_end,
                          frame.p_WB,
                          StageTime::kEnd,
                          w.wheels};
  if (plan.coupled.curve.is_filtered) set_filtered_rates(step_loads, result, workspace);
  StageRate end{w.next.rate_q.data(), w.next.rate_p.data(), workspace.Q_left.data()};
  end.q_ddot = w.next.q_ddot.data();
  evaluate(step_loads, result, workspace, end);
  if (!w.ball_joints.empty()) workspace.next_q = w.ball_joints.q, w.next.momentum = w.ball_joints.p;
  for (std::size_t l = 0; l < index(plan.num_padded); ++l)
    workspace.next_q_dot[l] = w.next.momentum[l] + w.next.rate_q[l];
  const bool is_true = traits_of(plan.fidelity).has_true_geometry;
  const double h = step_loads.period();
  w.next.integration_error =
      state.coupled.integration_error + (is_true && plan.num_elastic > 0 ? step_error(plan, h, w) : 0.0);
  if (is_curved(plan)) undamp_foreshortening(plan, w.curve, workspace.Q_left, w.next.q_ddot);
  if (plan.coupled.curve.is_filtered) w.next.filter_error = advance_left_out(plan, state.coupled, w);
  w.next.joints = w.stage_joints;
  w.next.slow_q = w.curve.slow_q;
  for (std::size_t k = 0; k < w.slow_start.size(); ++k)
    w.next.slow_change[k] = w.curve.slow_q[k] - w.slow_start[k];
  w.next.slow_p = w.curve.slow_p;
  w.next.w_B = end.w_B;
  w.next.w_dot_B = end.w_dot_B;
  w.next.moment_B = end.moment_B;
  w.next.balance_B = end.balance_B;
  w.next.has_rates = true;
  force_W = end.force_W;
  moment_B = end.rest_moment_B;
  w.turned_body = body_turned_too_far(plan, w.bodies);
  if (w.turned_body >= 0) return false;
  w.has_no_frame = turns(plan) && w.joints.unsolved < 0 && !has_frame(plan, w.frame);
  return !w.has_no_frame && are_finite(workspace.next_q) && are_finite(w.next.momentum) &&
         are_finite(w.next.rate_q) && are_finite(w.next.rate_p);
}

}  // namespace freeflex
