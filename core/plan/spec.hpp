// The specification of a plan holds the decisions that are made before the plan is compiled.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "core/plan.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// Holds the initial elastic coordinates and their rates [m], [m/s] (n each).
struct InitialModes {
  Eigen::VectorXd q, q_dot;
};

/// Specifies the plan that compile() makes. What these members decide, compile() reads only here and not from
/// the scene.
struct PlanSpec {
  Fidelity rung = Fidelity::kSeparated;
  double rate = 0.0;            // [Hz]
  std::vector<int> modes;       // indices of the structure's modes that the plan has, ascending
  InitialModes initial;         // initial state of all modes of the structure
  bool numbers_modes = false;   // true: fills Plan::mode_numbers, because modes may be omitted
  bool has_every_row = false;   // true: the plan has mode-shape rows of all points, read out or not
  bool publishes_links = true;  // true: the plan has the forces of the links that the scene publishes
  Integration integration;      // of modes or of points
  double substep_phase = 0.0;   // [rad] largest phase in a substep, on rungs that divide the tick
  // Features that change the operations of the step. If any of them is omitted, `scope` says which commands
  // the plan then supports.
  bool has_damping = true, has_gravity = true, has_rotation = true;
  CommandScope scope;
  // omitted modes whose quasi-static response to loads is included in link forces   (THEORY 14.11)
  std::vector<int> static_modes;
  Eigen::SparseMatrix<double> static_loads;  // [N] (3N x loads)
};

/// Returns the spec of the full plan on a rung, at the rate of the scene.
PlanSpec full_spec(const Scene& scene, const Structure& structure, Fidelity rung);

/// Returns the spec of a plan that is stepped in parallel with another plan and is not published. The plan
/// makes `substeps` steps per tick, has rows for all points, and has no link forces.
PlanSpec unpublished_spec(const Scene& scene, const Structure& structure, Fidelity rung,
                          std::int32_t substeps);

}  // namespace freeflex
