// What must hold in a plan by its rung, and in its shadows, before it is stepped.
#include <algorithm>
#include <bit>
#include <cmath>

#include "core/plan/plan_check.hpp"
#include "core/plan/rungs.hpp"

namespace freeflex {
namespace {

bool is_sized(const std::vector<Vec3>& values, std::size_t size) {
  return values.size() == size &&
         std::all_of(values.begin(), values.end(), [](const Vec3& value) { return are_finite(value); });
}

bool is_sized(const LoadSums& sums, std::size_t points, std::size_t groups, std::size_t turning) {
  return is_sized(sums.force_W, points) && is_sized(sums.force_B, points) &&
         is_sized(sums.group_force_W, groups) && is_sized(sums.group_torque_W, groups) &&
         is_sized(sums.group_force_B, groups) && is_sized(sums.group_torque_B, groups) &&
         is_sized(sums.torque.W, turning) && is_sized(sums.torque.B, turning);
}

bool is_bar(const Plan& plan, const PlanBar& bar) {
  const auto is_point = [&](std::int32_t point) {
    return point >= 0 && static_cast<std::size_t>(point) < plan.points.size();
  };
  return bar.link >= 0 && static_cast<std::size_t>(bar.link) < plan.links.size() && is_point(bar.first) &&
         is_point(bar.second) && bar.first != bar.second && std::isfinite(bar.stiffness) &&
         bar.stiffness >= 0.0 && std::isfinite(bar.damping) && bar.damping >= 0.0 &&
         bar.stiffness + bar.damping > 0.0 && std::isfinite(bar.length) && bar.length > 0.0 &&
         are_finite(bar.direction);
}

std::string find_in_histories(const Plan& plan) {
  for (const PlanHistory& history : plan.histories) {
    const LoadPattern& pattern = history.pattern;
    if (!is_coupled(plan) && !is_sized(pattern.sums, 0, 0, 0))
      return "history '" + history.name + "' has sums of loads, which only coupled rungs use";
    if (!is_coupled(plan)) continue;
    if (!is_sized(pattern.sums, plan.points.size(), plan.groups.size(), plan.particles.turning.size()))
      return "the sums of loads of history '" + history.name + "' do not have one value a point and group";
    if (pattern.uses_table || pattern.num_direct > 0)
      return "history '" + history.name + "' has generalized forces, which coupled rungs do not use";
  }
  return {};
}

std::string find_in_kinetics(const Plan& plan) {
  using Form = PlanKinetics::Form;
  const PlanKinetics& kinetics = plan.coupled.kinetics;
  if (kinetics.form < Form::kComplete || kinetics.form > Form::kTables)
    return "the kinetic energy is of no known form";
  const auto num_points = static_cast<std::int64_t>(plan.points.size());
  const bool is_complete =
      plan.num_elastic == 3 * num_points - plan.rigid_freedoms && plan.num_padded == plan.num_moving;
  if (kinetics.form == Form::kComplete && !is_complete)
    return "a coupled rung needs every elastic mode and nothing besides, or sums for those that it has";
  if (kinetics.form != Form::kComplete && traits_of(plan.fidelity).has_true_geometry)
    return "true bars with modes that are not a complete set";
  if (kinetics.form != Form::kTables && !plan.particles.all.empty())
    return "bodies on a coupled rung without sums for them";
  const bool has_tables = kinetics.form == Form::kTables;
  if (has_tables ? kinetics.num_tables != kPointTables && kinetics.num_tables != kBodyTables
                 : kinetics.num_tables != 0)
    return "the number of tables over pairs of modes is none of those known";
  const auto n = static_cast<std::size_t>(plan.num_padded),
             moving = static_cast<std::size_t>(plan.num_moving);
  if (kinetics.moments.size() != (has_tables ? 6 * n : 0) ||
      kinetics.tables.size() != moving * static_cast<std::size_t>(kinetics.num_tables) * n ||
      !are_finite(kinetics.moments) || !are_finite(kinetics.tables))
    return "the sums over pairs of modes do not have their size or are not finite";
  for (const PlanOffset& body : kinetics.offsets)
    if (!has_tables || body.rows.size() != 3 * n || !are_finite(body.rows) || !are_finite(body.offset) ||
        !std::isfinite(body.mass))
      return "the rows of a body with an offset do not have their size or are not finite";
  std::size_t next = 0;
  for (const PlanTurn& turn : kinetics.turns) {
    if (turn.first != static_cast<std::int32_t>(next) || turn.count < 1 || turn.rows.size() != 3 * n ||
        !are_finite(turn.rows) || !are_finite(turn.centre) || !are_finite(turn.offset))
      return "a body that turns is out of order, or its rows do not have their size or are not finite";
    next += static_cast<std::size_t>(turn.count);
    if (next > plan.particles.all.size()) break;
  }
  if (next != plan.particles.all.size()) return "the bodies that turn do not have the particles of the plan";
  return {};
}

}  // namespace

std::string find_rung_inconsistency(const Plan& plan) {
  if (std::string error = find_in_histories(plan); !error.empty()) return error;
  const PlanCoupled& coupled = plan.coupled;
  if (!is_coupled(plan))
    return coupled.functions.empty() && coupled.bars.empty() && coupled.num_parts == 1 &&
                   coupled.kinetics.form == PlanKinetics::Form::kComplete &&
                   coupled.kinetics.tables.empty() && coupled.kinetics.moments.empty() &&
                   coupled.kinetics.num_tables == 0
               ? ""
               : "there is more than the rung needs";
  const bool is_divided = traits_of(plan.fidelity).divides_tick;
  if (!std::isfinite(coupled.part_phase) ||
      (is_divided ? coupled.part_phase <= 0.0 : coupled.part_phase != 0.0))
    return "the phase of a part of a step is out of range";
  if (coupled.num_parts < 1 || coupled.num_parts > kMaxParts ||
      !std::has_single_bit(static_cast<std::uint32_t>(coupled.num_parts)))
    return "a step is in a number of parts that is no power of two or too large";
  if (std::string error = find_in_kinetics(plan); !error.empty()) return error;
  for (std::size_t i = 0; i < plan.points.size(); ++i)
    if (plan.points[i].row != static_cast<std::int32_t>(i))
      return "the rows of a coupled rung are not those of its points";
  constexpr std::size_t kRows =
      std::size_t{PlanCoupled::kNumEntries} * std::size_t{PlanCoupled::kNumFunctions};
  if (coupled.functions.size() != kRows * static_cast<std::size_t>(plan.num_padded) ||
      !are_finite(coupled.functions))
    return "the functions of the modes do not have their size or are not finite";
  if (plan.mixing.path != PlanMixing::Path::kNone) return "a coupled rung has no other mixing of modes";
  for (const PlanFeedback& feedback : plan.feedbacks)
    if (!feedback.Q_rows.empty()) return "acceleration feedback on a coupled rung";
  for (std::size_t k = 0; k < coupled.bars.size(); ++k)
    if (!is_bar(plan, coupled.bars[k]) || (k > 0 && coupled.bars[k - 1].link >= coupled.bars[k].link))
      return "a bar is out of range or out of order";
  return {};
}

std::string find_budget_inconsistency(const Plan& plan) {
  const PlanBudget& budget = plan.budget;
  if (!std::isfinite(budget.horizon) || budget.horizon < 0.0)
    return "the horizon of the error budget is out of range";
  if (budget.shadows.empty()) return {};
  if (budget.horizon == 0.0 || budget.horizon_ticks < 1) return "an error budget without a horizon";
  const auto has_every_row = [](const Plan& each) {
    for (std::size_t i = 0; i < each.points.size(); ++i)
      if (each.points[i].row != static_cast<std::int32_t>(i)) return false;
    return true;
  };
  if (!has_every_row(plan) || budget.shadows.front().kind != PlanShadow::Kind::kBest)
    return "an error budget needs the rows of every point and the best shadow first";
  for (const PlanShadow& shadow : budget.shadows) {
    if (shadow.kind < PlanShadow::Kind::kBest || shadow.kind > PlanShadow::Kind::kWhole ||
        shadow.substeps < 1 || shadow.substeps > kMaxParts ||
        !std::has_single_bit(static_cast<std::uint32_t>(shadow.substeps)))
      return "a shadow is of no known kind";
    if (std::string error = find_own_inconsistency(shadow.plan); !error.empty()) return "shadow: " + error;
    if (!shadow.plan.wide.empty() || !shadow.plan.budget.shadows.empty() || !has_every_row(shadow.plan) ||
        shadow.plan.points.size() != plan.points.size() || shadow.plan.groups.size() != plan.groups.size())
      return "a shadow is of another structure";
  }
  return {};
}

}  // namespace freeflex
