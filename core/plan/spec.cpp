#include "core/plan/spec.hpp"

#include <numeric>

#include "core/plan/rungs/rungs.hpp"
#include "core/plan/start.hpp"

namespace freeflex {

PlanSpec full_spec(const Scene& scene, const Structure& structure, Fidelity rung) {
  const RungTraits& traits = traits_of(rung);
  const auto num_modes = index(structure.omega.size());
  PlanSpec spec;
  spec.rung = rung;
  spec.rate = scene.rate;
  spec.integration = scene.integration;
  if (traits.has_modes) spec.modes.resize(num_modes);
  std::iota(spec.modes.begin(), spec.modes.end(), 0);
  spec.initial = initial_modes(scene, structure);
  // on the coupled rungs all points act on the body
  spec.has_every_row = traits.couples || scene.leave_out.keeps[static_cast<std::size_t>(Feature::kPointRows)];
  // link forces follow from the deformation, so the rung must have modes unless the structure has none
  spec.publishes_links = traits.has_modes || num_modes == 0;
  if (traits.divides_tick) spec.substep_phase = kFullPhase;
  return spec;
}

PlanSpec unpublished_spec(const Scene& scene, const Structure& structure, Fidelity rung,
                          std::int32_t substeps) {
  PlanSpec spec = full_spec(scene, structure, rung);
  spec.rate = scene.rate * substeps;
  spec.has_every_row = true;
  spec.publishes_links = false;
  spec.integration.by = IntegrateBy::kModes;
  // a rung that divides the tick would make fewer substeps per tick at the higher rate, so the largest phase
  // in a substep is reduced too
  if (traits_of(rung).divides_tick) spec.substep_phase /= substeps;
  return spec;
}

}  // namespace freeflex
