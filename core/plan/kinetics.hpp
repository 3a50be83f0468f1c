// How a plan of the coupled rungs has the kinetic energy (THEORY X190 to X196).
#pragma once

#include <Eigen/Core>

#include "core/plan/spec.hpp"

namespace freeflex {

/// X196: tables are taken where num_tables * num_elastic is below this times the number of points. Measured
/// with AVX2 (tests/bench/bench_kinetics): 20, 100 and 300 points cost the same either way at some 40, 160
/// and 480 modes; 300 points take 4, 16, 106 and 1105 us a tick by tables at 8, 48, 144 and 288 modes, 110,
/// 247, 457 and 1316 us point by point.
inline constexpr double kTablesPerPoint = 15.0;

/// Bodies are carried by tables whatever their size: twelve numbers a pair of modes, 216 MB here, some 100 ms
/// a tick.
inline constexpr std::int32_t kMostBodyModes = 1500;

/// The form that a plan takes: complete where it can, tables for bodies, else what costs less.
/// \pre modes and points of the plan stand; its rung couples
PlanKinetics::Form kinetic_form(const Scene& scene, const Plan& plan);

/// Fills plan.coupled.kinetics for a form.
/// \param shapes  [-] (3N x num) unit elastic displacements of the points, then constraint shapes
void compile_kinetics(const Scene& scene, const Structure& structure, const Eigen::MatrixXd& shapes,
                      PlanKinetics::Form form, Plan& plan);

/// True where the modes that the plan has let its points turn about the line that they stand on, which the
/// frame does not do: a set without this would push against the frame (THEORY X192). True off a line.
bool keeps_turns_about_line(const Structure& structure);

}  // namespace freeflex
