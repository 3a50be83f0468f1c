#include "core/step/points/points.hpp"

#include <algorithm>
#include <utility>

#include "core/step/coupled/stage.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/loads/history.hpp"
#include "core/step/loads/loads.hpp"
#include "core/step/points/frame_of_points.hpp"
#include "core/step/points/reading.hpp"
#include "core/step/points/springs.hpp"
#include "core/step/readout.hpp"

namespace freeflex {
namespace {

bool is_damped(const PlanPoints& method) noexcept { return !method.damping.empty(); }

constexpr Mat3 kWorldAxes{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};

void put(const Vec3& from, double* to) noexcept { std::copy(from.begin(), from.end(), to); }
/// Holds what the functions below share in a tick.
struct Tick {
  const StepLoads& step_loads;
  const StepPlan& plan;
  const PlanPoints& method;
  State& state;
  PointHistory& history;
  PointsWorkspace& w;
  double h;             // [s] length of a step of the multistep method
  std::int32_t pieces;  // extrapolated steps in a tick

  Tick(const StepLoads& loads, State& motion, Workspace& workspace) noexcept
      : step_loads(loads),
        plan(loads.plan),
        method(plan.points_method),
        state(motion),
        history(motion.point_history),
        w(workspace.points),
        h(plan.period * method.ticks / method.steps),
        pieces(method.pieces) {}
  std::size_t size() const noexcept { return history.x.size(); }
};

/// Returns whether the accelerations by a pattern of loads are constant: whether all its loads are forces
/// fixed in world axes.
bool is_fixed(const LoadPattern& pattern) noexcept {
  if (pattern.has_body) return false;
  const std::vector<Vec3>& torques = pattern.sums.group_torque_W;
  return std::all_of(torques.begin(), torques.end(), [](const Vec3& each) { return is_zero(each); });
}

bool are_constant(const StepLoads& step_loads) noexcept {
  using Kind = PlanHistory::Kind;
  if (!is_fixed(step_loads.slots)) return false;
  for (const PlanHistory& history : step_loads.plan.histories) {
    const bool is_level = history.kind == Kind::kConstant || history.kind == Kind::kPulse;
    if (is_level && step_loads.amplitude(history, StageTime::kStart) == 0.0) continue;
    if (!is_level || !is_fixed(history.pattern)) return false;
  }
  return true;
}

/// Sets the accelerations by loads at a time of the tick   (THEORY 12.127):
///   a_i = F_i / m_i - sum F / M,   of the centre of mass sum F / M + g
/// \param fraction  time since the start of the tick over its period; may be negative
/// \param x  positions; nullptr: no load depends on them
void set_load(Tick& tick, double fraction, const double* x, Array& load) noexcept {
  const StepPlan& plan = tick.plan;
  PointsWorkspace& w = tick.w;
  const std::size_t num_points = plan.points.size();
  const Mat3 R = x == nullptr ? kWorldAxes : matrix_of(attitude_of_points(plan, x, tick.history.attitude));
  for (std::size_t i = 0; x != nullptr && i < num_points; ++i)
    w.x_B[i] = multiply_transposed(R, of_point(x, i));
  const std::span<const Vec3> x_B = x == nullptr ? std::span<const Vec3>() : w.x_B;
  std::fill(w.forces.begin(), w.forces.end(), Vec3{});
  add_point_forces(plan, tick.step_loads.slots, R, 1.0, x_B, w.forces);
  for (const PlanHistory& history : plan.histories) {
    const double amplitude = amplitude_at(history, plan.period, tick.step_loads.tick, fraction);
    if (amplitude != 0.0) add_point_forces(plan, history.pattern, R, amplitude, x_B, w.forces);
  }
  Vec3 total{};
  for (const Vec3& force : w.forces) total = add(total, force);
  const Vec3 common = scale(1.0 / plan.mass, multiply(R, total));
  for (std::size_t i = 0; i < num_points; ++i)
    put(sub(scale(tick.method.inverse_mass[i], multiply(R, w.forces[i])), common), load.data() + 3 * i);
  put(plan.has_gravity ? add(common, plan.gravity_W) : common, load.data() + 3 * num_points);
}

/// Sets the accelerations at positions and velocities and at a time of the tick.
/// \param v  may be nullptr if nothing is damped
void accelerate_at(Tick& tick, double fraction, const double* x, const double* v, double* a) noexcept {
  const bool is_constant = tick.history.has_constant_loads;
  if (!is_constant) set_load(tick, fraction, x, tick.w.load);
  accelerate(tick.method, x, v, (is_constant ? tick.history.load : tick.w.load).data(), tick.w.force.data(),
             a);
}

/// Sets x and v to the motion of the frame and the modes.
void place_modes(const StepPlan& plan, const State& state, PointsWorkspace& w, double* x,
                 double* v) noexcept {
  contract_points(plan, state.q.data(), state.q_dot.data(), w.u, w.rate);
  const Mat3 R = rotation_matrix(state.q_WB);
  const Vec3 spin = angular_velocity(plan, state);
  const std::size_t num_points = plan.points.size();
  for (std::size_t i = 0; i < num_points; ++i) {
    const Vec3 x_B = add(plan.points[i].r, w.u[i]);
    put(multiply(R, x_B), x + 3 * i);
    put(multiply(R, add(w.rate[i], cross(spin, x_B))), v + 3 * i);
  }
  put(state.p_WB, x + 3 * num_points);
  put(state.v_WB, v + 3 * num_points);
}

void add_node(PointHistory& history, const Array& d, const Array& v, const Array& a) noexcept {
  const std::size_t k = index(history.num_nodes++);
  history.node_d[k] = d;
  history.node_v[k] = v;
  history.node_a[k] = a;
  history.steps_since_node = 0;
}

/// Restarts the method from the motion at the present tick, because the loads have changed, the steps did not
/// resolve the motion, or the last tick failed.
void begin(Tick& tick) noexcept {
  PointHistory& history = tick.history;
  PointsWorkspace& w = tick.w;
  const bool is_of_points = history.num_nodes > 0;
  if (is_of_points)
    place_points(tick.plan, history, w.x.data(), w.v.data());
  else
    place_modes(tick.plan, tick.state, w, w.x.data(), w.v.data());
  history.attitude =
      is_of_points ? attitude_of_points(tick.plan, w.x.data(), history.attitude) : tick.state.q_WB;
  if (!is_of_points || history.ticks_left > 0) std::fill(history.x_low.begin(), history.x_low.end(), 0.0);
  history.has_constant_loads = are_constant(tick.step_loads);
  if (history.has_constant_loads) set_load(tick, 0.0, nullptr, history.load);
  history.x = w.x;
  history.v = w.v;
  std::fill(history.d.begin(), history.d.end(), 0.0);
  accelerate_at(tick, 0.0, history.x.data(), history.v.data(), history.a.data());
  history.is_multistep = false;
  history.ticks_left = history.num_nodes = 0;
  add_node(history, history.d, history.v, history.a);
}

/// Makes an extrapolated step, the piece `number` of the tick, from the motion in the workspace
/// (THEORY 12.130).
void advance_piece(Tick& tick, std::int32_t number) noexcept {
  PointsWorkspace& w = tick.w;
  PointHistory& history = tick.history;
  const PlanPoints& method = tick.method;
  const double h = tick.plan.period / tick.pieces;
  const auto with_velocities = [&](double fraction, const double* x, const double* v, double* a) {
    accelerate_at(tick, (number + fraction) / tick.pieces, x, v, a);
  };
  const auto without = [&](double fraction, const double* x, double* a) {
    with_velocities(fraction, x, nullptr, a);
  };
  if (is_damped(method))
    extrapolate_midpoint(method.columns, h, w.x.data(), w.v.data(), w.a.data(), with_velocities,
                         w.extrapolation);
  else
    extrapolate(method.columns, h, w.x.data(), w.v.data(), w.a.data(), without, w.extrapolation);
  const Array& by = w.extrapolation.sum_d;
  for (std::size_t i = 0; i < by.size(); ++i) {
    w.d[i] += by[i];
    add_compensated(w.x[i], w.x_low[i], by[i]);
  }
  w.v.swap(w.extrapolation.sum_u);
  with_velocities(1.0, w.x.data(), w.v.data(), w.a.data());
  if (!is_damped(method) && ++history.steps_since_node == method.spacing) add_node(history, w.d, w.v, w.a);
}

/// Sets `to` to the displacement at one of the positions that start the multistep method   (THEORY 12.131).
void interpolate(const PlanStartValue& start, const PointHistory& history, Array& to) noexcept {
  std::fill(to.begin(), to.end(), 0.0);
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t node = index(start.first_node) + k;
    const double by_d = start.weights[3 * k], by_v = start.weights[3 * k + 1],
                 by_a = start.weights[3 * k + 2];
    const Array &d = history.node_d[node], &v = history.node_v[node], &a = history.node_a[node];
    for (std::size_t i = 0; i < to.size(); ++i) to[i] += by_d * d[i] + (by_v * v[i] + by_a * a[i]);
  }
}

/// Starts the multistep method from the nodes: finds its past positions and the accelerations there.
/// \param now  time of the last node since the start of the tick, over the period
void start_multistep(Tick& tick, double now) noexcept {
  PointHistory& history = tick.history;
  PointsWorkspace& w = tick.w;
  const std::vector<PlanStartValue>& starts = tick.method.starts;
  Array &before = w.extrapolation.d, &d = w.extrapolation.u, &x = w.extrapolation.at;
  for (std::size_t j = 0; j < starts.size(); ++j) {
    const PlanStartValue& start = starts[j];
    const bool is_node = start.node >= 0;
    if (is_node)
      d = history.node_d[index(start.node)];
    else
      interpolate(start, history, d);
    if (j > 0) {
      Array &change = history.changes[j - 1], &a = history.accelerations[j - 1];
      for (std::size_t i = 0; i < d.size(); ++i) change[i] = d[i] - before[i];
      for (std::size_t i = 0; i < d.size() && !is_node; ++i) x[i] = w.x[i] - (w.d[i] - d[i]);
      const double back = static_cast<double>(starts.size() - 1 - j) * tick.h / tick.plan.period;
      if (is_node)
        a = history.node_a[index(start.node)];
      else
        accelerate_at(tick, now - back, x.data(), nullptr, a.data());
    }
    before.swap(d);
  }
  history.earliest = 0;
  history.is_multistep = true;
}

/// Makes a step of the multistep method from the positions in w.x to w.x. Keeps the past values that the
/// first steps of a tick replace.
/// \param fraction  time at the end of the step since the start of the tick, over the period
void advance_step(Tick& tick, std::size_t number, double fraction) noexcept {
  PointHistory& history = tick.history;
  PointsWorkspace& w = tick.w;
  const std::size_t spare = std::min(number, kPastSteps);
  Array &change = w.changes[spare], &a = w.accelerations[spare];
  advance_multistep(past_of(history.changes, history.earliest),
                    past_of(history.accelerations, history.earliest), tick.h, tick.size(),
                    {w.x.data(), w.x_low.data()}, change.data(), {w.other_x.data(), w.other_low.data()});
  w.x.swap(w.other_x);
  w.x_low.swap(w.other_low);
  accelerate_at(tick, fraction, w.x.data(), nullptr, a.data());
  history.changes[index(history.earliest)].swap(change);
  history.accelerations[index(history.earliest)].swap(a);
  history.earliest = static_cast<std::int32_t>((index(history.earliest) + 1) % kPastSteps);
  ++history.steps_made;
}

/// Takes back the last `count` steps of a tick.
void take_back(Tick& tick, std::size_t count) noexcept {
  PointHistory& history = tick.history;
  history.steps_made -= static_cast<std::int64_t>(count);
  history.earliest =
      static_cast<std::int32_t>((index(history.earliest) + kPastSteps - count % kPastSteps) % kPastSteps);
  for (std::size_t k = 0; k < std::min(count, kPastSteps); ++k) {
    const std::size_t at = (index(history.earliest) + k) % kPastSteps;
    history.changes[at].swap(tick.w.changes[k]);
    history.accelerations[at].swap(tick.w.accelerations[k]);
  }
}

/// Returns whether lengths can be computed from the values: whether their squares are finite.
bool have_finite_squares(const Array& values) noexcept {
  double sum = 0.0;
  for (const double x : values) sum += x * x - x * x;
  return sum == 0.0;
}

/// Returns whether the steps resolve the motion   (THEORY 12.135).
bool is_resolved(Tick& tick) noexcept {
  const Past a = past_of(tick.history.accelerations, tick.history.earliest);
  const double* const share = tick.method.share.data();
  const double difference = __builtin_sqrt(square_of_differences(a, share, tick.size()));
  double square = 0.0;
  for (std::size_t i = 0; i < tick.size(); ++i)
    square += share[i] * (a[kPastSteps - 1][i] * a[kPastSteps - 1][i]);
  return !(difference > tick.method.resolved * __builtin_sqrt(square) + tick.method.noise);
}

/// Number of steps between two checks of the resolution. They are whole pieces of 1, 2 or 3 steps.
constexpr std::int32_t kCheckEvery = 12;

/// Makes extrapolated steps, the first at the start of the given piece of the tick, until the multistep
/// method has enough nodes or the tick ends. Each piece spans one or more steps of the multistep method.
/// Returns the number of multistep steps from the start of the tick to the time that was reached.
std::int32_t advance_to_start(Tick& tick, std::int32_t piece) noexcept {
  PointHistory& history = tick.history;
  PointsWorkspace& w = tick.w;
  for (; piece < tick.pieces; ++piece) {
    advance_piece(tick, piece);
    history.attitude = attitude_of_points(tick.plan, w.x.data(), history.attitude);
    if (is_damped(tick.method) || history.num_nodes < tick.method.num_nodes) continue;
    start_multistep(tick, static_cast<double>(piece + 1) / tick.pieces);
    return tick.method.steps / tick.pieces * (piece + 1);
  }
  return tick.method.steps;
}

/// Begins anew within a tick, from the positions in the workspace after a step of the multistep method.
void begin_within(Tick& tick) noexcept {
  PointHistory& history = tick.history;
  PointsWorkspace& w = tick.w;
  std::swap(history.x, w.x);  // of which the velocities are read
  place_points(tick.plan, history, w.other_x.data(), w.v.data());
  std::swap(history.x, w.x);
  w.a = history.accelerations[(index(history.earliest) + kPastSteps - 1) % kPastSteps];
  std::fill(w.d.begin(), w.d.end(), 0.0);
  history.is_multistep = false;
  history.num_nodes = 0;
  add_node(history, w.d, w.v, w.a);
}

/// Makes the steps of a tick that follow the first `made` ones. Returns whether it began anew within the
/// tick.
bool advance_steps(Tick& tick, std::int32_t made) noexcept {
  PointHistory& history = tick.history;
  const std::int32_t end = tick.method.steps;
  bool begins_anew = false;
  for (std::int32_t first = made; made < end;) {
    advance_step(tick, index(made - first), static_cast<double>(made + 1) * tick.method.ticks / end);
    ++made;
    if (made % kCheckEvery != 0 || made == end) continue;
    history.attitude = attitude_of_points(tick.plan, tick.w.x.data(), history.attitude);
    if (is_resolved(tick)) continue;
    begins_anew = true;
    begin_within(tick);
    first = made = advance_to_start(tick, made / (end / tick.pieces));
  }
  return begins_anew;
}

/// Advances the motion in the workspace by a tick. Returns false if it is not finite. The motion is then that
/// at the start of the tick.
bool advance_tick(Tick& tick) noexcept {
  PointHistory& history = tick.history;
  PointsWorkspace& w = tick.w;
  w.x = history.x, w.x_low = history.x_low;
  const bool was_multistep = history.is_multistep;
  const std::int32_t num_nodes = history.num_nodes, steps_since_node = history.steps_since_node;
  const auto latest = [&]() -> const Array& {
    return history.accelerations[(index(history.earliest) + kPastSteps - 1) % kPastSteps];
  };
  std::int32_t made = 0;
  if (!was_multistep) {
    w.d = history.d, w.v = history.v, w.a = history.a;
    made = advance_to_start(tick, 0);
  } else if (tick.method.steps > kCheckEvery) {
    place_points(tick.plan, history, w.other_x.data(), w.start_v.data());
    w.start_a = latest();
  }
  const bool has_steps = made < tick.method.steps;
  const bool begins_anew = advance_steps(tick, made);
  const Array& a = history.is_multistep ? latest() : w.a;
  if (have_finite_squares(w.x) && have_finite_squares(a)) {
    history.ticks_left = has_steps ? tick.method.ticks - 1 : 0;
    return true;
  }
  if (was_multistep && !begins_anew) {
    take_back(tick, index(tick.method.steps));
    return false;
  }
  history.is_multistep = false;
  history.num_nodes = std::max(1, num_nodes), history.steps_since_node = steps_since_node;
  if (was_multistep) history.v = w.start_v, history.a = w.start_a;
  return false;
}

}  // namespace

bool advance_points(const StepLoads& step_loads, bool is_fresh, State& state, Workspace& workspace) noexcept {
  Tick tick(step_loads, state, workspace);
  PointHistory& history = tick.history;
  if (is_fresh || history.num_nodes == 0 || history.begins_anew) begin(tick);
  history.begins_anew = false;
  if (history.ticks_left > 0) {
    --history.ticks_left;
  } else {
    const std::int64_t checked = history.steps_made / kCheckEvery;
    if (!advance_tick(tick)) {
      history.begins_anew = true;  // without the loads of this tick
      return false;
    }
    history.x.swap(tick.w.x);
    history.x_low.swap(tick.w.x_low);
    if (!history.is_multistep) {
      history.d.swap(tick.w.d);
      history.v.swap(tick.w.v);
      history.a.swap(tick.w.a);
    } else if (history.steps_made / kCheckEvery != checked) {
      history.begins_anew = !is_resolved(tick);
      history.attitude = attitude_of_points(tick.plan, history.x.data(), history.attitude);
    }
  }
  state.points.is_set = false;
  state.has_frame = state.has_modes = false;
  return true;
}

}  // namespace freeflex
