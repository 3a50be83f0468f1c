// Consistency checks of the members that the rung of a plan needs, and of the shadows, before the plan is
// stepped.
#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "core/plan/file/plan_check.hpp"
#include "core/plan/rungs/rungs.hpp"
#include "core/step/massless/massless.hpp"
#include "core/step/turning/ball_joints.hpp"
#include "core/step/turning/turning.hpp"

namespace freeflex {
namespace {

bool is_sized(const std::vector<Vec3>& values, std::size_t size) {
  return values.size() == size &&
         std::all_of(values.begin(), values.end(), [](const Vec3& value) { return are_finite(value); });
}

bool is_sized(const LoadSums& sums, std::size_t points, std::size_t groups, std::size_t num_attitudes) {
  return is_sized(sums.force_W, points) && is_sized(sums.force_B, points) &&
         is_sized(sums.group_force_W, groups) && is_sized(sums.group_torque_W, groups) &&
         is_sized(sums.group_force_B, groups) && is_sized(sums.group_torque_B, groups) &&
         is_sized(sums.torque_W, num_attitudes) && is_sized(sums.torque_B, num_attitudes);
}

bool is_bar(const StepPlan& plan, const PlanBar& bar) {
  const auto is_point = [&](std::int32_t point) { return point >= 0 && index(point) < plan.points.size(); };
  return bar.link >= 0 && index(bar.link) < plan.links.size() && is_point(bar.first) &&
         is_point(bar.second) && bar.first != bar.second && std::isfinite(bar.stiffness) &&
         bar.stiffness >= 0.0 && std::isfinite(bar.damping) && bar.damping >= 0.0 &&
         bar.stiffness + bar.damping > 0.0 && std::isfinite(bar.length) && bar.length > 0.0 &&
         are_finite(bar.direction);
}

std::string find_in_histories(const StepPlan& plan) {
  for (const PlanHistory& history : plan.histories) {
    const LoadPattern& pattern = history.pattern;
    if (!is_coupled(plan) && !is_sized(pattern.sums, 0, 0, 0))
      return "history '" + history.name + "' has sums of loads, which only coupled rungs use";
    if (!is_coupled(plan)) continue;
    if (!is_sized(pattern.sums, plan.points.size(), plan.groups.size(),
                  plan.particles.attitude_points.size()))
      return "the sums of loads of history '" + history.name +
             "' do not have one value for each point and group";
    if (pattern.uses_table || pattern.num_direct > 0)
      return "history '" + history.name + "' has generalized forces, which coupled rungs do not use";
  }
  return {};
}

/// Returns whether the first and the last point of a body are points of the plan.
bool has_points(const StepPlan& plan, const PlanTurningBody& body) {
  const std::vector<std::int32_t>& points = plan.coupled.turning.points;
  if (body.first < 0 || body.count < 1 || index(body.first) + index(body.count) > points.size()) return false;
  const auto is_point = [&](std::int32_t k) {
    return points[index(k)] >= 0 && index(points[index(k)]) < plan.points.size();
  };
  return is_point(body.first) && is_point(body.first + body.count - 1);
}

// Returns whether find_ball_joints() may read the points of turning bodies.
bool name_points(const PlanTurning& turning) {
  const auto is_inside = [&](const PlanTurningBody& body) {
    return body.count == 0 || (body.first >= 0 && body.count > 0 &&
                               std::int64_t{body.first} + body.count <= std::ssize(turning.points));
  };
  const auto is_point = [&](std::int32_t point) {
    return point >= 0 && index(point) < turning.of_points.size();
  };
  return std::ranges::all_of(turning.bodies, is_inside) && std::ranges::all_of(turning.points, is_point);
}

std::string find_in_kinetics(const StepPlan& plan) {
  using Form = PlanKinetics::Form;
  const PlanKinetics& kinetics = plan.coupled.kinetics;
  if (kinetics.form < Form::kComplete || kinetics.form > Form::kSpread)
    return "the kinetic energy is of an unknown form";
  const auto num_points = static_cast<std::int64_t>(plan.points.size());
  const PlanTurning& turning = plan.coupled.turning;
  if (!name_points(turning)) return "a turning body is out of range";
  const std::size_t num_joints = find_ball_joints(plan).size();
  const auto num_in_bodies = static_cast<std::int64_t>(turning.points.size() - num_joints);
  std::int64_t num_massless = 0;
  for (std::size_t i = 0; i < plan.points.size(); ++i) num_massless += is_massless(plan, i) ? 1 : 0;
  std::int64_t num_freedoms = 3 * (num_points - num_in_bodies - num_massless), least = num_freedoms;
  for (const PlanTurningBody& body : turning.bodies) {
    if (body.count == 0) continue;
    num_freedoms += has_points(plan, body) && !is_zero(line_of(plan, body)) ? 5 : 6;
    least += 3;
  }
  num_freedoms -= 3 * static_cast<std::int64_t>(num_joints);
  const std::int64_t num_modes = std::int64_t{plan.num_elastic} + plan.rigid_freedoms;
  const bool is_spread = kinetics.form == Form::kSpread;
  // mass matrices have inner coordinates, and ends without inertia about an axis
  const bool has_all_modes =
      (is_spread ? num_modes >= least : num_modes == num_freedoms) &&
      plan.num_padded == plan.num_moving + pad(static_cast<std::int32_t>(3 * num_joints));
  if ((is_complete(kinetics) || is_spread) && !has_all_modes)
    return "the kinetic energy has the form for a complete set of modes, but the set is not complete, or the "
           "plan has constraint shapes";
  if (!is_complete(kinetics) && !is_spread && traits_of(plan.fidelity).has_true_geometry)
    return "the plan has links at true geometry, but its modes are not a complete set";
  if (is_spread && !traits_of(plan.fidelity).has_true_geometry)
    return "the plan has mass spread over links at true geometry, which its rung does not use";
  if (!has_tables(kinetics) && kinetics.form != Form::kTurning && !plan.particles.all.empty())
    return "the plan has bodies on a coupled rung, but no tables for them";
  const bool uses_tables = has_tables(kinetics);
  if (uses_tables ? kinetics.num_tables != kPointTables && (is_spread || kinetics.num_tables != kBodyTables)
                  : kinetics.num_tables != 0)
    return "the number of tables over pairs of modes is wrong";
  const auto n = index(plan.num_padded), moving = index(plan.num_moving);
  if (kinetics.moments.size() != (uses_tables ? 6 * n : 0) ||
      kinetics.tables.size() != moving * index(kinetics.num_tables) * n || !are_finite(kinetics.moments) ||
      !are_finite(kinetics.tables))
    return "the sums over pairs of modes have the wrong size or are not finite";
  for (const PlanOffset& body : kinetics.offsets)
    if (!uses_tables || is_spread || body.rows.size() != 3 * n || !are_finite(body.rows) ||
        !are_finite(body.offset) || !std::isfinite(body.mass))
      return "the rows of a body with an offset have the wrong size or are not finite";
  std::size_t next = 0;
  for (const PlanBodyRotation& body : kinetics.body_rotations) {
    if (body.first != static_cast<std::int32_t>(next) || body.count < 1 || body.rows.size() != 3 * n ||
        body.point < -1 || body.point >= static_cast<std::int32_t>(plan.points.size()) ||
        !are_finite(body.rows) || !are_finite(body.centre) || !are_finite(body.offset))
      return "a body with an attitude is out of order, or its rows have the wrong size or are not finite";
    next += index(body.count);
    if (next > plan.particles.all.size()) break;
  }
  if (next != plan.particles.all.size()) return "the bodies do not have the particles of the plan";
  return {};
}

}  // namespace

std::string find_rung_inconsistency(const StepPlan& plan) {
  assert(is_rung(plan.fidelity));
  if (std::string error = find_in_histories(plan); !error.empty()) return error;
  const PlanCoupled& coupled = plan.coupled;
  if (!is_coupled(plan))
    return coupled.functions.empty() && coupled.bars.empty() && coupled.num_substeps == 1 &&
                   coupled.kinetics.form == PlanKinetics::Form::kComplete &&
                   coupled.kinetics.tables.empty() && coupled.kinetics.moments.empty() &&
                   coupled.kinetics.num_tables == 0 && plan.points_method.steps == 0
               ? ""
               : "the plan has members that its rung does not use";
  const bool is_divided = traits_of(plan.fidelity).divides_tick;
  if (!std::isfinite(coupled.substep_phase) ||
      (is_divided ? coupled.substep_phase <= 0.0 : coupled.substep_phase != 0.0))
    return "the phase of a substep is out of range";
  if (coupled.num_substeps < 1 || coupled.num_substeps > kMaxSubsteps ||
      !std::has_single_bit(static_cast<std::uint32_t>(coupled.num_substeps)))
    return "the number of substeps is not a power of two, or is too large";
  if (std::string error = find_in_kinetics(plan); !error.empty()) return error;
  for (std::size_t i = 0; i < plan.points.size(); ++i)
    if (plan.points[i].row != static_cast<std::int32_t>(i))
      return "the rows of a coupled rung are not those of its points";
  constexpr std::size_t kRows =
      std::size_t{PlanCoupled::kNumEntries} * std::size_t{PlanCoupled::kNumFunctions};
  if (coupled.functions.size() != kRows * index(plan.num_padded) || !are_finite(coupled.functions))
    return "the functions of the modes have the wrong size or are not finite";
  const std::size_t num_times = coupled.strain_times.size();
  if ((num_times != 0 && num_times != index(plan.num_padded)) || !are_finite(coupled.strain_times) ||
      !std::isfinite(coupled.beta) || (num_times > 0 && !traits_of(plan.fidelity).has_true_geometry) ||
      (coupled.damps_true_strains && num_times == 0))
    return "the damping of strains has the wrong size or is not finite, or the rung does not use it";
  if (plan.modal_coupling.path != PlanModalCoupling::Path::kNone)
    return "a coupled rung has modal coupling, which only other rungs use";
  for (const PlanFeedback& feedback : plan.feedbacks)
    if (!feedback.Q_rows.empty()) return "the plan has acceleration feedback on a coupled rung";
  for (std::size_t k = 0; k < coupled.bars.size(); ++k)
    if (!is_bar(plan, coupled.bars[k]) || (k > 0 && coupled.bars[k - 1].link >= coupled.bars[k].link))
      return "a bar is out of range or out of order";
  const bool has_links = coupled.links.has_joints() || !coupled.links.angles.empty() ||
                         !coupled.links.matrices.empty() || !coupled.turning.bodies.empty() ||
                         !coupled.curve.modes.empty();
  if (has_links && !traits_of(plan.fidelity).has_true_geometry)
    return "the plan has links at true geometry, which its rung does not use";
  if (std::string error = find_link_inconsistency(plan); !error.empty()) return error;
  return find_points_inconsistency(plan);
}

std::string find_verdict_inconsistency(const Plan& plan) {
  const PlanVerdict& verdict = plan.verdict;
  const auto is_at_least_zero = [](double value) { return std::isfinite(value) && value >= 0.0; };
  for (const double value :
       {verdict.horizon, verdict.share, verdict.longest_step, verdict.tolerance, verdict.lowest_omega})
    if (!is_at_least_zero(value)) return "a value of the verdict is out of range";
  if (verdict.shared < SharedError::kNone || verdict.shared > SharedError::kInsideMass)
    return "the verdict names an unknown error";
  for (const std::int32_t load : verdict.fast_loads)
    if (load < 0 || index(load) >= plan.histories.size()) return "a fast load is not a load of the plan";
  if (verdict.shadows.size() > 1 || (!verdict.shadows.empty() && (verdict.is_off || verdict.share == 0.0)))
    return "the verdict has more than one shadow, or is off";
  for (const PlanShadow& shadow : verdict.shadows) {
    if (std::string error = find_own_inconsistency(shadow.plan); !error.empty()) return "shadow: " + error;
    const double step = plan.period * shadow.ticks / shadow.substeps;
    if (shadow.ticks < 1 || shadow.substeps < 1 || (shadow.ticks > 1 && shadow.substeps > 1) ||
        shadow.ticks > PlanShadow::kMostTicks || shadow.substeps > kMaxSubsteps ||
        shadow.every > PlanShadow::kMostHorizons || shadow.horizon_ticks > PlanShadow::kMostHorizonTicks ||
        shadow.delay_ticks > 2 * PlanShadow::kMostHorizonTicks ||
        !(std::abs(shadow.plan.period - step) <= 1e-9 * step) ||
        (shadow.ticks > 1 && shadow.plan.coupled.num_substeps > 1) || shadow.horizon_ticks < 1 ||
        shadow.horizon_ticks % shadow.ticks != 0 || shadow.every < 1 || shadow.delay_ticks < 1)
      return "the steps of the shadow are out of range";
    if (!shadow.plan.fallback.empty() || !is_coupled(shadow.plan) ||
        shadow.plan.points.size() != plan.points.size() || shadow.plan.groups.size() != plan.groups.size() ||
        shadow.plan.wheels.size() != plan.wheels.size() ||
        shadow.plan.histories.size() != plan.histories.size())
      return "a shadow plan belongs to another structure";
    for (std::size_t k = 0; k < (plan.fallback.empty() ? 1 : shadow.modes.size()); ++k) {
      const auto num_modes = index(k == 0 ? plan.num_elastic : plan.fallback.front().num_elastic);
      const ShadowModes& modes = shadow.modes[k];
      if (modes.numbers.size() != num_modes || !are_finite(modes.projection) ||
          (!modes.projection.empty() && modes.projection.size() != num_modes * index(shadow.plan.num_padded)))
        return "the modes of the shadow are not those of the plan";
      for (const std::int32_t mode : modes.numbers)
        if (mode < 0 || (modes.projection.empty() && mode >= shadow.plan.num_elastic))
          return "a mode of the plan is not a mode of the shadow";
    }
  }
  return {};
}

}  // namespace freeflex
