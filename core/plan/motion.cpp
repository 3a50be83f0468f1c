#include "core/plan/motion.hpp"

#include "core/plan/histories.hpp"
#include "core/plan/mixing.hpp"
#include "core/plan/start.hpp"
#include "core/scene/faults.hpp"

namespace freeflex {
namespace {

// of elastic state and link forces, which go with the modes
void warn_of_rigid(const Scene& scene, Faults& faults) {
  if (!scene.initial.points.empty() || !scene.initial.modes.empty())
    add_warning(
        faults, scene.initial.origin,
        "the initial elastic state is left out: fidelity is rigid; take separated or a rung above it");
  if (!scene.publication.links.empty())
    add_warning(
        faults, {},
        "no forces of links are published: fidelity is rigid, and links carry load only where something "
        "deforms; take separated or a rung above it");
}

// feedback that drives a motion   (THEORY X75), by the modes that it mixes, which the coupled rungs take
// apart
void warn_of_driving_feedback(const Scene& scene, const Plan& plan, Faults& faults) {
  if (plan.feedbacks.empty()) return;
  Plan linear = plan;
  set_mixing_path(linear);
  if (linear.mixing.path != PlanMixing::Path::kExact) return;
  set_mixing_period(linear);
  check_growth(scene, linear, faults);
}

}  // namespace

void check_motion(const Scene& scene, const Structure& structure, const Plan& plan, Faults& faults) {
  const RungTraits& rung = traits_of(plan.fidelity);
  if (!rung.has_modes && structure.omega.size() > 0) warn_of_rigid(scene, faults);
  warn_of_fast_spin(scene, structure, plan.fidelity, faults);
  if (rung.couples)
    warn_of_driving_feedback(scene, plan, faults);
  else
    check_growth(scene, plan, faults);
  warn_of_ticks(scene, plan, faults);
}

}  // namespace freeflex
