// How single methods are run and timed within a study. Internal to the report.
#pragma once

#include <functional>
#include <vector>

#include "core/reference/rivals.hpp"
#include "core/structure/structure.hpp"
#include "tools/report/measure.hpp"
#include "tools/report/study.hpp"

namespace freeflex::tools {

/// What every run of one scene needs.
struct Bench {
  const Scene& scene;
  const CartesianSystem& system;
  const Structure& structure;
  const ErrorMeter& meter;
  StudyOptions options;
  double structure_cpu = 0.0;  // [s]
  double free_from = 0.0;      // [s] when the last load ended; the end when one does not
  ElasticScale scale;
  std::function<bool()> is_stopped;  // by the person
};

/// Positions at the end of the separated and the other rungs at a step that is small enough, for the parts of
/// the error; empty when the rung does not run.
struct ExactRung {
  Fidelity fidelity;
  Eigen::Matrix3Xd p_W;
};

/// Every rung that compiles, at every step that fits; appends to study.runs and study.left_out.
std::vector<ExactRung> run_rungs(const Bench& bench, Study& study, const std::function<bool(double)>& told);

/// Every rival. `linear` is the exact motion of the linearised system, when known.
void run_rivals(const Bench& bench, const Eigen::Matrix3Xd* linear, Study& study,
                const std::function<bool(double)>& told);

/// Fills the errors of a run from its motion   (THEORY X117).
void set_errors(const Bench& bench, const Motion& motion, const Eigen::Matrix3Xd* exact, Run& run);

}  // namespace freeflex::tools
