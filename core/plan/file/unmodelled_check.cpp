// Checks that the tables with which the verdict judges a motion are consistent with the plan.
#include "core/plan/file/plan_check.hpp"

namespace freeflex {
namespace {

// Returns what is wrong with the items that messages name, and with the tables for wheels and commands.
std::string find_in_names(const StepPlan& plan, const PlanUnmodelled& unmodelled) {
  std::string error;
  const auto require = [&](bool holds, const std::string& what) {
    if (!holds && error.empty()) error = what;
  };
  const std::vector<std::int32_t>& links = unmodelled.named.links;
  require((links.empty() || links.size() == index(unmodelled.num_judged)) &&
              std::all_of(links.begin(), links.end(),
                          [&](std::int32_t link) { return link == -1 || is_index(link, plan.links.size()); }),
          "a link of unknown internal forces is not in the plan");
  const std::size_t num_left_out = unmodelled.left_out_spin.size() / 6;
  require((unmodelled.named.left_out.empty() || unmodelled.named.left_out.size() == num_left_out) &&
              unmodelled.named.left_out_frequency.size() == unmodelled.named.left_out.size(),
          "the number of names of omitted modes is wrong");
  require(is_at_least(unmodelled.error_per_force, 0.0), "the error per force is not >= 0");
  require(unmodelled.gyroscopic.size() == plan.wheels.size() * unmodelled.pairs.size() &&
              are_finite(unmodelled.gyroscopic),
          "a wheel does not have one gyroscopic entry for each pair of judged modes");
  return error;
}

}  // namespace

std::string find_unmodelled_inconsistency(const StepPlan& plan, const PlanUnmodelled& unmodelled) {
  std::string error;
  const auto require = [&](bool holds, const std::string& what) {
    if (!holds && error.empty()) error = what;
  };
  const auto n = index(plan.num_elastic), num_pairs = unmodelled.pairs.size();
  require(is_at_least(unmodelled.left_out, 0.0), "the size of the omitted modes is out of range");
  require(unmodelled.lacks_modes <= LacksModes::kNotKept, "the kind of the omitted modes is out of range");
  require(is_at_least(unmodelled.tolerance, 0.0), "the tolerance is out of range");
  require(are_ascending(unmodelled.fast_loads) && are_indices(unmodelled.fast_loads, plan.histories.size()),
          "a fast load is not in the plan");
  // damaged content may have any number, and the checks go on after the first fault
  const std::size_t num_judged = index(std::max(0, unmodelled.num_judged));
  require(unmodelled.num_judged >= 0 && num_judged <= num_pairs,
          "the number of judged modes is out of range");
  for (std::size_t k = 0; k < num_pairs && error.empty(); ++k) {
    const auto [l, u] = unmodelled.pairs[k];
    require(is_index(l, n) && is_index(u, n) && (l == u) == (k < num_judged),
            "a pair of judged modes is not in the plan");
  }
  const auto num_shadowed = index(std::max(0, unmodelled.num_shadowed));
  require(unmodelled.num_shadowed >= 0 &&
              unmodelled.num_shadowed <= std::min(unmodelled.num_judged, kMostShadowedModes) &&
              (unmodelled.inertia_rows.empty() || unmodelled.inertia_rows.size() == num_shadowed * 6) &&
              are_finite(unmodelled.inertia_rows) &&
              unmodelled.load_arms.size() ==
                  plan.histories.size() * unmodelled.inertia_rows.size() / 6 * kArmSize &&
              are_finite(unmodelled.load_arms) &&
              unmodelled.shadow_rows.size() == num_shadowed * (num_shadowed + 1) / 2 * num_shadowed &&
              (num_shadowed == 0 ? unmodelled.quartic_forms.empty()
                                 : unmodelled.quartic_forms.size() % (num_shadowed * num_shadowed) == 0) &&
              are_finite(unmodelled.quartic_forms),
          "the tables of the integrated errors have the wrong size");
  for (std::size_t l = 0; l < num_shadowed && error.empty(); ++l)
    require(unmodelled.pairs[l][0] == static_cast<std::int32_t>(l),
            "the modes with an integrated error are not the first");
  require(
      unmodelled.load_rows.size() == num_pairs * n &&
          (unmodelled.rate_rows.empty() || unmodelled.rate_rows.size() == num_pairs * n) &&
          unmodelled.spin_rows.size() == num_pairs * 6 && unmodelled.coriolis_rows.size() == num_pairs * 3 &&
          unmodelled.root_quartic.size() == num_judged &&
          (unmodelled.coriolis_transfer.empty() || unmodelled.coriolis_transfer.size() == num_judged * 6) &&
          unmodelled.left_out_spin.size() % 6 == 0 &&
          unmodelled.left_out_rows.size() == unmodelled.left_out_spin.size() / 6 * n &&
          (unmodelled.spin_loads.empty() || unmodelled.spin_loads.size() == n * 6) &&
          (unmodelled.bodies.push_rows.empty() || unmodelled.bodies.push_rows.size() == num_pairs * 6) &&
          (unmodelled.spin_left_out.empty() || unmodelled.spin_left_out.size() == 36),
      "the tables of unmodelled terms have the wrong size");
  std::size_t num_stiffenings = plan.command_stiffening.components.size();
  for (const PlanHistory& history : plan.histories) num_stiffenings += history.stiffening.components.size();
  require((!unmodelled.is_known || unmodelled.stiffened_rows.size() == num_stiffenings * num_pairs) &&
              are_finite(unmodelled.stiffened_rows),
          "the table of the stiffness by loads has the wrong size");
  require(are_finite(unmodelled.load_rows) && are_finite(unmodelled.rate_rows) &&
              are_finite(unmodelled.spin_rows) && are_finite(unmodelled.coriolis_rows) &&
              are_finite(unmodelled.coriolis_transfer) && are_finite(unmodelled.spin_loads) &&
              are_finite(unmodelled.spin_left_out) && are_finite(unmodelled.root_quartic) &&
              are_finite(unmodelled.shadow_rows) && are_finite(unmodelled.bodies.push_rows) &&
              std::isfinite(unmodelled.bodies.inner_load) &&
              (unmodelled.bodies.unquantified_factor.empty() ||
               unmodelled.bodies.unquantified_factor.size() == num_judged) &&
              are_finite(unmodelled.bodies.unquantified_factor) && are_finite(unmodelled.bodies.load_sizes) &&
              (unmodelled.bodies.load_sizes.empty() ||
               unmodelled.bodies.load_sizes.size() == plan.histories.size()) &&
              are_finite(unmodelled.left_out_rows) && are_finite(unmodelled.left_out_spin),
          "the tables of unmodelled terms are not finite");
  if (error.empty()) error = find_in_names(plan, unmodelled);
  return error;
}

}  // namespace freeflex
