// The kinetic energy of a plan on the coupled rungs is computed point by point or by tables
// (THEORY 12.33 to 12.52).
#pragma once

#include <Eigen/Core>

#include "core/plan/spec.hpp"

namespace freeflex {

/// [-] A plan of point masses uses tables if num_tables * num_elastic < kTablesPerPoint * num_points, which
/// is 9 n < 15 N for n modes and N points (THEORY 12.52). The costs were measured with AVX2
/// (tests/bench/bench_kinetics). For 20, 100 and 300 points, tables cost as much as sums over points at some
/// 40, 160 and 480 modes. A tick of 300 points with 8, 48, 144 and 288 modes takes 4, 16, 106 and 1105 us by
/// tables, and 110, 247, 457 and 1316 us point by point.
inline constexpr double kTablesPerPoint = 15.0;

/// Largest number of modes of a scene with bodies on the coupled rungs. Such a scene always uses tables, with
/// twelve numbers for each pair of modes. With 1500 modes the tables take 216 MB, and a tick takes some 100
/// ms.
inline constexpr std::int32_t kMaxBodyModes = 1500;

/// Returns the form in which a plan computes the kinetic energy. The form is `complete` for a complete set of
/// modes of point masses, `tables` for bodies, and otherwise the form that costs less   (THEORY 12.52).
/// \pre the modes and points of the plan are filled, and the plan's rung is coupled or above
PlanKinetics::Form kinetic_form(const Structure& structure, const StepPlan& plan);

/// Fills plan.coupled.kinetics for the given form.
/// \param shapes  [-] (3N x num) unit elastic displacements of the points, then constraint shapes
void compile_kinetics(const Scene& scene, const Structure& structure, const Eigen::MatrixXd& shapes,
                      PlanKinetics::Form form, StepPlan& plan);

/// Returns true if the modes of a collinear shape let the points rotate about the line. Then, for each b_l,
/// the modes also span e x b_l, where e is the direction of the line. If the modes did not span e x b_l,
/// forces would act on the frame about the line, but the frame does not rotate about the line (THEORY 12.37).
/// Also returns true if the shape is not collinear.
bool keeps_rotation_about_line(const Structure& structure);

}  // namespace freeflex
