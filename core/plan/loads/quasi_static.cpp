#include "core/plan/loads/quasi_static.hpp"

#include <algorithm>
#include <cmath>

#include "core/faults.hpp"
#include "core/plan/loads/histories.hpp"
#include "core/step/loads/field.hpp"
#include "core/step/loads/loads.hpp"
#include "core/step/readout.hpp"
#include "core/step/rigid/frame.hpp"

namespace freeflex {
namespace {

// [-] a generalized force of a mechanism that is at most this fraction of the largest generalized force is a
// rounding error
constexpr double kDriven = 1e-9;

constexpr Mat3 kNoRotation{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};

std::string explain_mechanism(const Plan& plan, std::size_t mode) {
  constexpr std::size_t kNames = 8;
  std::string names;
  const std::vector<std::int32_t>& points = plan.mechanisms[mode];
  for (std::size_t k = 0; k < std::min(points.size(), kNames); ++k)
    names += (k > 0 ? ", " : "") + plan.points[index(points[k])].name;
  if (points.size() > kNames) names += ", ...";
  return join_text("the load drives an unresisted motion, mechanism ", mode + 1, ", which moves ", names,
                   ", so there is no steady state; add links, or use a load that does not drive this motion");
}

// Returns true if all values that can be read out of a steady state are finite.
bool is_finite(const Plan& plan, const State& state) {
  const auto are_finite = [](const auto& values) {
    return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
  };
  if (!are_finite(state.q) || !are_finite(state.force_W) || !are_finite(state.moment_B)) return false;
  for (const std::int32_t point : plan.published_points)
    if (!are_finite(read_point(plan, state, point).V_B)) return false;
  for (std::size_t k = 0; k < plan.link_outputs.size(); ++k) {
    std::vector<double> values(index(plan.link_outputs[k].num_rows));
    read_link(plan, state, static_cast<int>(k), values);
    if (!are_finite(values)) return false;
  }
  return true;
}

}  // namespace

std::optional<State> quasi_static(const Plan& plan, const SteadyLoad& load, std::string& error) {
  if (is_coupled(plan)) {
    error = join_text(
        "the plan has fidelity ", name_of(plan.fidelity),
        ", with loads that depend on the deformation, but a quasi-static response is linear; name the "
        "scene, or a plan with fidelity spin-loaded or a lower rung");
    return std::nullopt;
  }
  const bool spins = !is_zero(load.spin);
  if (spins && !plan.has_spin_load) {
    error = "the plan has no centrifugal load of the spin; set fidelity: spin-loaded in the scene";
    return std::nullopt;
  }
  for (const Wrench& wrench : load.wrenches) {
    error = refused_torque(plan.groups[index(wrench.group)], wrench.torque);
    if (!error.empty()) return std::nullopt;
  }
  State state = make_state(plan);
  state.p_WB = state.v_WB = {};
  state.q_WB = {1.0, 0.0, 0.0, 0.0};
  state.H_W = multiply(plan.inertia, load.spin);
  std::fill(state.wheel_momentum.begin(), state.wheel_momentum.end(), 0.0);
  std::fill(state.q.begin(), state.q.end(), 0.0);
  std::fill(state.q_dot.begin(), state.q_dot.end(), 0.0);
  const LoadPattern pattern = build_pattern(plan, {1, load.forces, load.wrenches, load.torques});
  if (!project(plan, pattern, kNoRotation, 1.0, false, state.Q.data()))
    std::fill(state.Q.begin(), state.Q.end(), 0.0);
  if (spins) {
    Plan steady = plan;
    steady.attractor_mu = 0.0;
    add_field(steady, kNoRotation, state.H_W, {}, state.Q.data());
  }
  state.force_W = pattern.force_B;
  state.moment_B = pattern.torque_B;

  double largest = 0.0;
  for (std::size_t mode = 0; mode < index(plan.num_elastic); ++mode)
    largest = std::max(largest, std::abs(state.Q[mode]));
  for (std::size_t mode = 0; mode < index(plan.num_elastic); ++mode) {
    const double stiffness = plan.mass * plan.omega[mode] * plan.omega[mode];
    if (stiffness > 0.0) {
      state.q[mode] = state.Q[mode] / stiffness;
    } else if (std::abs(state.Q[mode]) > kDriven * largest) {
      error = explain_mechanism(plan, mode);
      return std::nullopt;
    }
  }
  if (!is_finite(plan, state)) {
    error = "the result is not finite, because the load is too large for this structure; check its units";
    return std::nullopt;
  }
  return state;
}

}  // namespace freeflex
