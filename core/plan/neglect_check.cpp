// What must hold in the tables by which a plan's motion is judged.
#include "core/plan/plan_check.hpp"

namespace freeflex {

std::string find_neglect_inconsistency(const Plan& plan) {
  std::string error;
  const auto require = [&](bool holds, const std::string& what) {
    if (!holds && error.empty()) error = what;
  };
  const PlanNeglect& neglect = plan.neglect;
  const auto n = static_cast<std::size_t>(plan.num_elastic), num_pairs = neglect.pairs.size();
  require(is_at_least(neglect.left_out, 0.0), "what is left out is out of range");
  require(neglect.lacks_modes <= LacksModes::kNotKept, "what is said of modes that it lacks is out of range");
  require(is_at_least(neglect.tolerance, 0.0), "the tolerance is out of range");
  require(are_ascending(neglect.fast_loads) && are_indices(neglect.fast_loads, plan.histories.size()),
          "a fast load is none of the plan");
  require(neglect.num_judged >= 0 && static_cast<std::size_t>(neglect.num_judged) <= num_pairs,
          "the number of judged modes is out of range");
  for (std::size_t k = 0; k < num_pairs && error.empty(); ++k) {
    const auto [l, u] = neglect.pairs[k];
    require(
        is_index(l, n) && is_index(u, n) && (l == u) == (k < static_cast<std::size_t>(neglect.num_judged)),
        "a pair of judged modes is none of the plan");
  }
  const auto num_shadowed = static_cast<std::size_t>(std::max(0, neglect.num_shadowed));
  require(
      neglect.num_shadowed >= 0 && neglect.num_shadowed <= std::min(neglect.num_judged, kMostShadowedModes) &&
          (neglect.inertia_rows.empty() || neglect.inertia_rows.size() == num_shadowed * 6) &&
          are_finite(neglect.inertia_rows) &&
          neglect.load_arms.size() == plan.histories.size() * neglect.inertia_rows.size() / 6 * kArmSize &&
          are_finite(neglect.load_arms) &&
          neglect.shadow_rows.size() == num_shadowed * (num_shadowed + 1) / 2 * num_shadowed &&
          (num_shadowed == 0 ? neglect.quartic.forms.empty()
                             : neglect.quartic.forms.size() % (num_shadowed * num_shadowed) == 0) &&
          are_finite(neglect.quartic.forms),
      "what is judged by its own motion does not have the size of its modes");
  for (std::size_t l = 0; l < num_shadowed && error.empty(); ++l)
    require(neglect.pairs[l][0] == static_cast<std::int32_t>(l),
            "modes judged by their own motion are not the first");
  require(neglect.load_rows.size() == num_pairs * n &&
              (neglect.rate_rows.empty() || neglect.rate_rows.size() == num_pairs * n) &&
              neglect.spin_rows.size() == num_pairs * 6 && neglect.coriolis_rows.size() == num_pairs * 3 &&
              neglect.root_quartic.size() == static_cast<std::size_t>(neglect.num_judged) &&
              (neglect.coriolis_reach.empty() ||
               neglect.coriolis_reach.size() == static_cast<std::size_t>(neglect.num_judged) * 6) &&
              neglect.left_out_spin.size() % 6 == 0 &&
              neglect.left_out_rows.size() == neglect.left_out_spin.size() / 6 * n &&
              (neglect.spin_loads.empty() || neglect.spin_loads.size() == n * 6) &&
              (neglect.bodies.push_rows.empty() || neglect.bodies.push_rows.size() == num_pairs * 6) &&
              (neglect.spin_left_out.empty() || neglect.spin_left_out.size() == 36),
          "what the rung neglects does not have the size of its modes");
  require(
      are_finite(neglect.load_rows) && are_finite(neglect.rate_rows) && are_finite(neglect.spin_rows) &&
          are_finite(neglect.coriolis_rows) && are_finite(neglect.coriolis_reach) &&
          are_finite(neglect.spin_loads) && are_finite(neglect.spin_left_out) &&
          are_finite(neglect.root_quartic) && are_finite(neglect.shadow_rows) &&
          are_finite(neglect.bodies.push_rows) && std::isfinite(neglect.bodies.inner_load) &&
          (neglect.bodies.unseen_factor.empty() ||
           neglect.bodies.unseen_factor.size() == static_cast<std::size_t>(neglect.num_judged)) &&
          are_finite(neglect.bodies.unseen_factor) && are_finite(neglect.bodies.load_sizes) &&
          (neglect.bodies.load_sizes.empty() || neglect.bodies.load_sizes.size() == plan.histories.size()) &&
          are_finite(neglect.left_out_rows) && are_finite(neglect.left_out_spin),
      "what the rung neglects is not finite");
  const std::vector<std::int32_t>& unseen = neglect.named.links;
  require((unseen.empty() || unseen.size() == static_cast<std::size_t>(neglect.num_judged)) &&
              std::all_of(unseen.begin(), unseen.end(),
                          [&](std::int32_t link) { return link == -1 || is_index(link, plan.links.size()); }),
          "a link whose inside is not known is none of the plan");
  const std::size_t num_left_out = neglect.left_out_spin.size() / 6;
  require((neglect.named.left_out.empty() || neglect.named.left_out.size() == num_left_out) &&
              neglect.named.left_out_frequency.size() == neglect.named.left_out.size(),
          "the names of modes that are left out do not have their number");
  return error;
}

}  // namespace freeflex
