// Everything that is decided about a plan before it is compiled.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "core/step/plan.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// Elastic coordinates at the start [m], [m/s] (n each).
struct InitialModes {
  Eigen::VectorXd q, q_dot;
};

/// What a plan is compiled to. compile() reads of the scene only what does not depend on these.
struct PlanSpec {
  Fidelity rung = Fidelity::kSeparated;
  double rate = 0.0;            // [Hz]
  std::vector<int> modes;       // of the structure, ascending: those that the plan has
  InitialModes initial;         // of every mode of the structure
  bool numbers_modes = false;   // Plan::mode_numbers: not every mode may be there
  bool has_every_row = false;   // mode shapes at every point, not only where somebody reads or loads
  bool publishes_links = true;  // forces of the scene's published links
  bool is_judged = true;        // what the rung neglects is put down: the plan's own motion is published
  double part_phase = 0.0;      // [rad] of a part of a divided tick; on rungs that divide it   (X100)
  // code that the plan does without, and what commands may then not do
  bool damps = true, falls = true, turns = true;
  CommandScope scope;
  // modes left out whose static answer to loads stays in the forces of links   (X123)
  std::vector<int> static_modes;
  Eigen::SparseMatrix<double> static_loads;  // [N] (3N x loads)
};

/// The plan with everything in it, on a rung at the scene's rate.
PlanSpec whole_spec(const Scene& scene, const Structure& structure, Fidelity rung);

/// The same for a plan that is only looked at beside another, at `substeps` steps a tick: every point, no
/// link forces.
PlanSpec unpublished_spec(const Scene& scene, const Structure& structure, Fidelity rung,
                          std::int32_t substeps);

}  // namespace freeflex
