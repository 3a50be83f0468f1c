#include "core/plan/loads/stiffening.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <variant>

#include "core/step/loads/loads.hpp"

namespace freeflex {
namespace {

// Returns the largest size that the history of a load reaches [-].
double largest_amplitude(const History& history) {
  return std::visit(
      [](const auto& each) {
        double most = 1.0;
        if constexpr (requires { each.values; }) {
          most = 0.0;
          for (const double value : each.values) most = std::max(most, std::abs(value));
        }
        return most;
      },
      history);
}

// Returns the index of a component in the numbering of command_coefficient.
std::int32_t component_of(const ReferenceLoad& reference, const StepPlan& plan) {
  const CommandComponents at(plan);
  switch (reference.kind) {
    case ReferenceLoad::Kind::kForce:
      return static_cast<std::int32_t>(3 * index(reference.item)) + reference.component;
    case ReferenceLoad::Kind::kTorque:
      return static_cast<std::int32_t>(at.torques) + 3 * attitude_index_of(plan, reference.item) +
             reference.component;
    case ReferenceLoad::Kind::kGroupForce:
      return static_cast<std::int32_t>(at.group_forces) + 3 * reference.item + reference.component;
    case ReferenceLoad::Kind::kGroupTorque:
      return static_cast<std::int32_t>(at.group_torques) + 3 * reference.item + reference.component;
    case ReferenceLoad::Kind::kMotor:
      return static_cast<std::int32_t>(at.motors) + reference.item;
    case ReferenceLoad::Kind::kField:
    case ReferenceLoad::Kind::kBuiltIn:
      break;
  }
  return reference.component;
}

// Appends a matrix E_k to a stiffening. All matrices of a stiffening have the same modes.
void append(const LoadStiffness& stiffness, const StepPlan& plan, PlanStiffening& stiffening) {
  const Eigen::MatrixXd& E = stiffness.rows;
  stiffening.modes.assign(stiffness.modes.begin(), stiffness.modes.end());
  stiffening.components.push_back(component_of(stiffness.reference, plan));
  const std::size_t padded = pad(stiffening.modes.size());
  double share = 0.0;
  for (Eigen::Index l = 0; l < E.rows(); ++l) {
    const std::size_t begin = stiffening.rows.size();
    stiffening.rows.resize(begin + padded, 0.0);
    for (Eigen::Index u = 0; u < E.cols(); ++u) {
      stiffening.rows[begin + index(u)] = E(l, u);
      // a torsional torque on a straight beam couples modes, but stiffens none of them alone
      const double omegas =
          plan.omega[index(stiffness.modes[index(l)])] * plan.omega[index(stiffness.modes[index(u)])];
      if (E(l, u) != 0.0) share = std::max(share, std::abs(E(l, u)) / (plan.mass * omegas));
    }
  }
  stiffening.shares.push_back(std::min(share, std::numeric_limits<double>::max()));
}

}  // namespace

void compile_field_stiffening(const Structure& structure, StepPlan& plan) {
  const RungTraits& rung = traits_of(plan.fidelity);
  const bool has_field = plan.has_rotation || plan.attractor_mu != 0.0;
  if (!rung.couples || rung.has_true_geometry || plan.num_elastic == 0 || !has_field) return;
  for (const LoadStiffness& each : structure.load_stiffness)
    if (each.reference.is_field() && !each.modes.empty()) append(each, plan, plan.field_stiffening);
}

void compile_command_stiffening(const Structure& structure, StepPlan& plan) {
  const RungTraits& rung = traits_of(plan.fidelity);
  if (!rung.couples || rung.has_true_geometry || plan.num_elastic == 0) return;
  for (const LoadStiffness& each : structure.load_stiffness)
    if (each.reference.is_command() && !each.modes.empty()) append(each, plan, plan.command_stiffening);
}

PlanStiffening load_stiffening(const Scene& scene, const Structure& structure, int load,
                               const StepPlan& plan) {
  PlanStiffening stiffening;
  const RungTraits& rung = traits_of(plan.fidelity);
  const Load& of = scene.loads[index(load)];
  // below the rung `coupled`, only a load that turns with the structure changes the stiffness
  const bool is_taken = of.axes == Axes::kLocal || rung.couples;
  if (rung.has_true_geometry || !is_taken || plan.num_elastic == 0) return stiffening;
  for (const LoadStiffness& each : structure.load_stiffness)
    if (each.reference.kind == ReferenceLoad::Kind::kBuiltIn && each.reference.item == load &&
        !each.modes.empty())
      append(each, plan, stiffening);
  const double change = std::accumulate(stiffening.shares.begin(), stiffening.shares.end(), 0.0);
  if (change * largest_amplitude(of.history) < PlanStiffening::kNegligible) return {};
  return stiffening;
}

}  // namespace freeflex
