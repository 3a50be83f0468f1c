#include "core/step/massless/massless_motion.hpp"

#include <algorithm>

#include "core/step/coupled/stage.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/readout.hpp"

namespace freeflex {
namespace {

// [-] displacement for the differences of positions, over the size of the structure
constexpr double kMovedShare = 1e-3;

/// Moves all points with mass and all bodies from their places at the state by v t + a t^2 / 2, in axes that
/// do not rotate, and finds the massless points there.
/// \param t  [s] positive or negative  \pre w.linear_V, w.W and w.drift hold displacements, velocities and
/// accelerations at the state
void move_points(const StepLoads& step_loads, const MotionState& state, double t,
                 CoupledWorkspace& w) noexcept {
  const StepPlan& plan = step_loads.plan;
  for (std::size_t i = 0; i < w.V.size(); ++i)
    w.V[i] = add_scaled(add_scaled(w.linear_V[i], t, w.W[i]), 0.5 * t * t, w.drift[i]);
  for (std::size_t b = 0; b < w.bodies.size(); ++b) {
    const BodyRates rates = read_body_rates(plan, state, static_cast<std::int32_t>(b));
    const Vec3 turn = add_scaled(scale(t, rates.s), 0.5 * t * t, rates.s_dot);
    w.joints.R[index(plan.coupled.links.joints.num_joints) + b] =
        multiply(w.bodies[b].R, matrix_of(rotation_of(turn).q));
  }
  // loads in body axes turn with the frame
  const Mat3 turn = matrix_of(rotation_of(scale(t, state.coupled.w_B)).q);
  const StageState stage{state.q.data(),
                         state.coupled.momentum.data(),
                         {},
                         multiply(rotation_matrix(state.q_WB), turn),
                         state.p_WB,
                         StageTime::kEnd,
                         state.wheel_momentum};
  load_massless(step_loads, stage, w);
  for (Vec3& load : w.joints.massless.load) load = multiply(turn, load);
  w.stage_joints = state.coupled.joints;
  // the second call leaves only rounding errors, which the difference of second order needs
  for (int k = 0; k < 2; ++k)
    w.last_turn = relax_joints(plan.coupled.links, plan.coupled.bars, w.rest, index(plan.num_padded),
                               state.q.data(), w.V, w.stage_joints, w.joints);
}

}  // namespace

std::vector<MasslessMotion> make_massless_motion(const StepPlan& plan) {
  std::vector<MasslessMotion> result;
  for (const MasslessPoint& each : find_massless_points(plan)) result.push_back({each, {}, {}, {}});
  return result;
}

void start_massless_motion(const StepPlan& plan, MotionState& state) noexcept {
  const std::size_t n = index(plan.num_padded), num_massless = state.coupled.massless.size();
  const Vec3& w = state.coupled.w_B;
  for (std::size_t k = 0; k < num_massless; ++k) {
    MasslessMotion& at = state.coupled.massless[k];
    const PlanPoint& point = plan.points[index(at.point)];
    const std::vector<double>& beyond = state.coupled.joints.angle;
    at.V = contract_rows(point_rows(plan, point.row), state.q.data(), n);
    for (std::size_t a = 0; a < 3; ++a)
      at.V[a] += at.length * beyond[beyond.size() - 3 * (num_massless - k) + a];
    at.v =
        add(cross(w, add(point.r, at.V)), contract_rows(point_rows(plan, point.row), state.q_dot.data(), n));
    at.a = cross(w, at.v);
  }
}

void set_massless_motion(const StepLoads& step_loads, CoupledWorkspace& w, MotionState& state) noexcept {
  if (!has_massless(w)) return;
  const StepPlan& plan = step_loads.plan;
  double size = 0.0, speed = 0.0, acceleration = 0.0;
  std::copy(w.V.begin(), w.V.end(), w.linear_V.begin());
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    size = std::max(size, dot(plan.points[i].r, plan.points[i].r));
    const FrameMotion motion = w.joints.massless.number(static_cast<std::int32_t>(i)) >= 0
                                   ? FrameMotion{}
                                   : read_in_frame(plan, state, static_cast<int>(i));
    w.W[i] = motion.v, w.drift[i] = motion.a;
    speed = std::max(speed, dot(motion.v, motion.v));
    acceleration = std::max(acceleration, dot(motion.a, motion.a));
  }
  size = kMovedShare * __builtin_sqrt(size);
  speed = __builtin_sqrt(speed), acceleration = __builtin_sqrt(acceleration);
  const double t = size / std::max({speed, __builtin_sqrt(0.5 * size * acceleration), 1e-3 * size});
  renew_factor(plan.coupled.links, plan.coupled.bars, w.rest, w.V, w.stage_joints, w.joints);
  for (const double sign : {0.0, 1.0, -1.0}) {
    move_points(step_loads, state, sign * t, w);
    for (MasslessMotion& at : state.coupled.massless) {
      const Vec3& V = w.V[index(at.point)];
      // NaN if no equilibrium was found
      const double gap = w.last_turn - w.last_turn;
      if (sign == 0.0) {
        at.V = V, at.v = at.a = {gap, gap, gap};
        continue;
      }
      at.v = add_scaled(at.v, sign / (2.0 * t), V);
      at.a = add_scaled(at.a, 1.0 / (t * t), add_scaled(sub(V, at.V), gap, V));
    }
  }
  w.stage_joints = state.coupled.joints;
}

}  // namespace freeflex
