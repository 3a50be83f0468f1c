// External loads: from point forces and wrenches to a pattern, and from a pattern to generalized forces.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/step/command.hpp"
#include "core/step/plan.hpp"

namespace freeflex {

/// Zero loads, sized for a plan.
SumsOnPoints make_load_sums(const Plan& plan);
void clear(LoadSums& sums) noexcept;

/// One set of loads; axes as in ForceCommand.
struct LoadSet {
  std::int32_t axes = 0;
  std::span<const PointForce> forces;
  std::span<const Wrench> wrenches;
  std::span<const PointTorque> torques;  // on points that turn
  std::span<const WheelTorque> wheels = {};
};
/// Adds them. Indices must be those of the plan, which sized the sums.
void add_loads(const Plan& plan, const LoadSet& loads, LoadSums& sums) noexcept;

/// Generalized forces of unit wrenches on each group, Q_l = sum_i F_i . b_il with
/// F_i = (m_i / m_g) F_g + m_i (J_g^-1 T_g) x d_i   (THEORY X12): (6*num_groups x num_padded), for each
/// group three rows for a unit force and three for a unit torque along the body axes. Every point of a group
/// has rows.
Array make_group_rows(const Plan& plan);

/// An empty pattern with room for every load.
LoadPattern make_pattern(const Plan& plan);

/// Overwrites a pattern of make_pattern with the sums (THEORY X11). Allocates nothing.
void set_pattern(const Plan& plan, std::span<const double> group_rows, const SumsOnPoints& sums,
                 LoadPattern& pattern) noexcept;

/// Overwrites arms with those that displacements give the loads, their torque about the centre of mass per
/// elastic coordinate (THEORY X148); empty where the plan does not ask for them. Every loaded point has rows.
/// Allocates nothing if there is room for kArmSize * kMostShadowedModes.  \param arms  [N] (num_shadowed x
/// kArmSize)
void set_arms(const Plan& plan, const SumsOnPoints& sums, Array& arms) noexcept;

/// [N] Sum of |x| + |y| + |z| of all forces, which may cancel   (THEORY X143).
double size_of_forces(const SumsOnPoints& sums) noexcept;

/// The pattern of one built-in load; arrays it does not use are empty. For the set-up of Plan::histories.
/// \pre plan.points, groups, rows, num_padded are filled
LoadPattern build_pattern(const Plan& plan, const SumsOnPoints& sums);
LoadPattern build_pattern(const Plan& plan, const LoadSet& loads);

/// Q = or += amplitude times the generalized forces of the pattern at attitude R_WB, Q_l = sum_i F_i . b_il
/// from few points, sum_ab R_WB,ba Q_l,ab from many   (THEORY 5.6, X11). Returns false, and leaves Q alone,
/// when the pattern has no load. \param Q  [N] (num_padded)
bool project(const Plan& plan, const LoadPattern& pattern, const Mat3& R_WB, double amplitude,
             bool accumulate, double* Q) noexcept;

/// forces += amplitude times the forces of the pattern on each point, body axes, wrenches spread over their
/// groups (THEORY X12). For coupled rungs. \param forces  [N] (num_points)
void add_point_forces(const Plan& plan, const LoadPattern& pattern, const Mat3& R_WB, double amplitude,
                      std::span<Vec3> forces) noexcept;

}  // namespace freeflex
