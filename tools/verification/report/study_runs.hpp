// Runs and times single methods within a study. Internal to the report.
#pragma once

#include <functional>
#include <vector>

#include "core/structure/structure.hpp"
#include "tools/verification/reference/rivals.hpp"
#include "tools/verification/report/measure.hpp"
#include "tools/verification/report/study.hpp"

namespace freeflex::tools {

/// Data for all runs of one scene.
struct Bench {
  const Scene& scene;
  const CartesianSystem& system;
  const Structure& structure;
  const ErrorMeter& meter;
  StudyOptions options;
  double structure_cpu = 0.0;  // [s]
  // [s] time at which the last load ends, or the end of the study if a load does not end
  double free_from = 0.0;
  ElasticScale scale;
  std::function<bool()> is_stopped;  // returns true if the user stopped the study
};

/// Positions at the end of a run of a rung at a small step, which divide the error of other runs into
/// integration error and model error. Empty if the rung does not run.
struct ExactRung {
  Fidelity fidelity;
  Eigen::Matrix3Xd p_W;
};

/// Runs every rung for which a plan can be made, at every step that fits. Appends to study.runs and
/// study.left_out.
std::vector<ExactRung> run_rungs(const Bench& bench, Study& study,
                                 const std::function<bool(double)>& report_progress);

/// Runs every other method. `linear` is the exact motion of the linearised system, if it is known.
void run_rivals(const Bench& bench, const Eigen::Matrix3Xd* linear, Study& study,
                const std::function<bool(double)>& report_progress);

/// Sets the errors of a run from its motion   (THEORY 13.15).
void set_errors(const Bench& bench, const Trajectory& motion, const Eigen::Matrix3Xd* exact, Run& run);

}  // namespace freeflex::tools
