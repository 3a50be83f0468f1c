#include "core/step/coupled/coupled.hpp"

#include <algorithm>

#include "core/step/coupled/stage.hpp"
#include "core/step/linear/kernels.hpp"
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

using Stages = std::array<std::array<const double*, 2>, 4>;  // rates of q and p at each stage

/// Computes (q, p) at stage 2 or stage 3, which are both at the middle of the step   (THEORY 12.15):
///   Y_3 = exp(h L / 2) y + (h / 2) phi_1(h L / 2) N_1 + h phi_2(h L / 2) (N_2 - N_1)
/// Y_2 does not have the last term.
/// \param other  index of the stage whose rate is used as N_2; 0 for Y_2, so that the last term is zero
void half_stage(const StepPlan& plan, const MotionState& state, const Stages& N, std::size_t other,
                CoupledWorkspace& w) noexcept {
  const Function E = function_of(plan, PlanCoupled::kHalfStep), A = function_of(plan, PlanCoupled::kHalf1),
                 B = function_of(plan, PlanCoupled::kHalf2);
  const double *q = state.q.data(), *p = state.coupled.momentum.data();
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
void full_step(const StepPlan& plan, const MotionState& state, const Stages& N, bool is_last, double* q_out,
               double* p_out) noexcept {
  const Function E = function_of(plan, PlanCoupled::kStep), A = function_of(plan, PlanCoupled::kStep1),
                 B = function_of(plan, PlanCoupled::kStep2), C = function_of(plan, PlanCoupled::kStep3);
  const double *q = state.q.data(), *p = state.coupled.momentum.data();
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

bool are_finite(const Array& values) noexcept {
  double sum = 0.0;
  for (const double x : values) sum += x - x;
  return sum == 0.0;
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

/// Advances the modes and the frame through the four stages   (THEORY 12.15, 12.16). The attitude of a stage
/// is R_WB^0 G(g) (THEORY 7.8).
Frame advance_stages(const StepLoads& step_loads, const MotionState& state, bool is_fresh,
                     Workspace& workspace) noexcept {
  const StepPlan& plan = step_loads.plan;
  CoupledWorkspace& w = workspace.coupled;
  const double h = step_loads.period();
  AttitudeRates attitude{rotation_matrix(state.q_WB), {}};
  attitude.H_start = multiply_transposed(attitude.R_start, state.H_W);
  const bool is_long_fall = may_orbit_far(plan, state);
  const auto position_at = [&](double t) {
    if (!is_long_fall) return add_scaled(state.p_WB, t, state.v_WB);
    return add(state.p_WB, fall(plan.attractor_mu, sub(state.p_WB, plan.attractor_W), state.v_WB, t).p);
  };
  Stages N{};
  for (std::size_t k = 0; k < 4; ++k) N[k] = {w.rates[k][0].data(), w.rates[k][1].data()};
  const auto visit = [&](std::size_t k, const double* q, const double* p, const Vec3& g, const Vec3& H,
                         double t, StageTime stage_time) {
    const Mat3 G = rotation_of_gibbs(g);
    wheel_momenta_at(step_loads, state.wheel_momentum, stage_time, w.wheels);
    StageRate rate{w.rates[k][0].data(), w.rates[k][1].data()};
    evaluate(step_loads,
             {q, p, multiply_transposed(G, H), multiply(attitude.R_start, G), position_at(t), stage_time,
              w.wheels},
             workspace, rate);
    attitude.add_stage(k, g, rate);
  };
  if (is_fresh || !state.coupled.has_rates) {
    visit(0, state.q.data(), state.coupled.momentum.data(), {}, attitude.H_start, 0.0, StageTime::kStart);
  } else {
    N[0] = {state.coupled.rate_q.data(), state.coupled.rate_p.data()};
    attitude.add_stage(
        0, {}, {nullptr, nullptr, nullptr, state.coupled.w_B, state.coupled.moment_B, {}, state.force_W});
  }
  const auto H_at = [&](double t, std::size_t k) {
    return add_scaled(attitude.H_start, t, attitude.H_rate[k]);
  };
  half_stage(plan, state, N, 0, w);
  visit(1, w.q.data(), w.p.data(), scale(0.5 * h, attitude.g_rate[0]), H_at(0.5 * h, 0), 0.5 * h,
        StageTime::kMiddle);
  half_stage(plan, state, N, 1, w);
  visit(2, w.q.data(), w.p.data(), scale(0.5 * h, attitude.g_rate[1]), H_at(0.5 * h, 1), 0.5 * h,
        StageTime::kMiddle);
  full_step(plan, state, N, false, w.q.data(), w.p.data());
  visit(3, w.q.data(), w.p.data(), scale(h, attitude.g_rate[2]), H_at(h, 2), h, StageTime::kEnd);
  full_step(plan, state, N, true, workspace.next_q.data(), w.next.momentum.data());

  Frame frame = state;
  rotate_attitude(scale(h, AttitudeRates::mean(attitude.g_rate)), frame);
  const Vec3 H_gain = scale(h, multiply(attitude.R_start, AttitudeRates::mean(attitude.H_rate)));
  for (std::size_t i = 0; i < 3; ++i) add_compensated(frame.H_W[i], frame.H_W_low[i], H_gain[i]);
  translate(plan, h, attitude.force_W[0], scale(0.5, add(attitude.force_W[1], attitude.force_W[2])),
            attitude.force_W[3], frame);
  return frame;
}

}  // namespace

BarForce bar_force(const PlanBar& bar, const Vec3& d) noexcept {
  const Vec3 x = add_scaled(d, bar.length, bar.direction);
  const double along = dot(bar.direction, d), l = __builtin_sqrt(dot(x, x));
  const double tension = bar.stiffness * ((2.0 * bar.length * along + dot(d, d)) / (l + bar.length));
  return {tension, add_scaled(scale(tension / l, x), -bar.stiffness * along, bar.direction)};
}

BarForce damper_force(const PlanBar& bar, const Vec3& d, const Vec3& d_dot) noexcept {
  const Vec3 x = add_scaled(d, bar.length, bar.direction);
  const double l = __builtin_sqrt(dot(x, x)), tension = bar.damping * (dot(x, d_dot) / l);
  return {tension,
          add_scaled(scale(tension / l, x), -bar.damping * dot(bar.direction, d_dot), bar.direction)};
}

void set_coupled_motion(const StepPlan& plan, const Vec3& w_B, MotionState& state) noexcept {
  CoupledState& coupled = state.coupled;
  const std::size_t n = index(plan.num_padded);
  const Vec3& w = coupled.w_B = w_B;
  std::copy(state.q_dot.begin(), state.q_dot.end(), coupled.momentum.begin());
  Vec3 H{};
  const bool has_tables = plan.coupled.kinetics.form == PlanKinetics::Form::kTables;
  if (has_tables) H = momenta_by_tables(plan, w, state.q.data(), state.q_dot.data(), coupled.momentum.data());
  for (std::size_t i = 0; i < plan.points.size() && !has_tables; ++i) {
    const PlanPoint& point = plan.points[i];
    const double* rows = point_rows(plan, point.row);
    const Vec3 V = contract_rows(rows, state.q.data(), n), V_dot = contract_rows(rows, state.q_dot.data(), n);
    // the arm of V' is V instead of r + V, because sum_i m_i r_i x V_i' is zero   (THEORY 2.15)
    const Vec3 x = add(point.r, V);
    H = add_scaled(H, point.mass, add(cross(x, cross(w, x)), cross(V, V_dot)));
    combine_rows(rows, scale(point.mass / plan.mass, cross(w, V)), true, n, coupled.momentum.data());
  }
  if (!plan.wheels.empty()) {
    H = add(H, rotated_wheel_momentum(plan, state.wheel_momentum, state.q.data()));
    add_wheel_momenta(plan, state.wheel_momentum, state.q.data(), -1.0, coupled.momentum.data());
  }
  // Constraint shapes come after the modes in the arrays, and they do not move.
  std::fill(coupled.momentum.begin() + plan.num_moving, coupled.momentum.end(), 0.0);
  state.H_W = multiply(rotation_matrix(state.q_WB), H);
  state.H_W_low = {};
  coupled.has_rates = false;
  // Accelerations without loads, to first order in the elastic displacements. The first step overwrites these
  // values.
  coupled.w_dot_B = multiply(plan.inverse_inertia, cross(H, w));
  for (std::size_t l = 0; l < coupled.q_ddot.size(); ++l)
    coupled.q_ddot[l] = -plan.omega[l] * (plan.omega[l] * state.q[l]) - 2.0 * plan.decay[l] * state.q_dot[l];
}

CoupledWorkspace make_coupled_workspace(const StepPlan& plan) {
  CoupledWorkspace w;
  const std::size_t n = index(plan.num_padded);
  for (auto* v : {&w.V, &w.W, &w.drift}) v->resize(plan.points.size());
  w.force.resize(plan.points.size() + plan.particles.all.size());
  for (auto* v : {&w.q, &w.p, &w.q_dot, &w.Q}) v->resize(n);
  for (auto& stage : w.rates)
    for (Array& rate : stage) rate.resize(n);
  for (auto* v : {&w.next.momentum, &w.next.rate_q, &w.next.rate_p}) v->resize(n);
  const PlanKinetics& kinetics = plan.coupled.kinetics;
  if (kinetics.form == PlanKinetics::Form::kComplete) return w;
  w.C.resize(3 * n);
  w.wheels.resize(plan.wheels.size());
  if (!w.wheels.empty()) w.wheel_share.resize(n);
  for (auto* v : {&w.load, &w.inertial, &w.C_dot_w, &w.spare, &w.next.q_ddot}) v->resize(n);
  if (kinetics.form == PlanKinetics::Form::kPoints) w.arms.resize(plan.points.size());
  w.sums.resize(index(kinetics.num_tables) * n);
  w.sums_dot.resize(kinetics.num_tables > 0 ? 6 * n : 0);
  return w;
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
  StageRate end{w.next.rate_q.data(), w.next.rate_p.data(), workspace.Q_left.data()};
  end.q_ddot = w.next.q_ddot.data();
  wheel_momenta_at(step_loads, state.wheel_momentum, StageTime::kEnd, w.wheels);
  evaluate(step_loads,
           {workspace.next_q.data(), w.next.momentum.data(), multiply_transposed(R_end, frame.H_W), R_end,
            frame.p_WB, StageTime::kEnd, w.wheels},
           workspace, end);
  for (std::size_t l = 0; l < index(plan.num_padded); ++l)
    workspace.next_q_dot[l] = w.next.momentum[l] + w.next.rate_q[l];
  w.next.w_B = end.w_B;
  w.next.w_dot_B = end.w_dot_B;
  w.next.moment_B = end.moment_B;
  w.next.has_rates = true;
  force_W = end.force_W;
  moment_B = end.rest_moment_B;
  return are_finite(workspace.next_q) && are_finite(w.next.momentum) && are_finite(w.next.rate_q) &&
         are_finite(w.next.rate_p);
}

}  // namespace freeflex
