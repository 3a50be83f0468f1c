// Loads from commands and histories. These functions convert point forces, wrenches and torques to a pattern,
// and a pattern to generalized forces.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/step/command.hpp"
#include "core/step/plan.hpp"

namespace freeflex {

/// Returns the index of a point in LoadSums. On the coupled rungs it is the index of the point. On the other
/// rungs it is the row of the point, so that points without rows, which cannot be loaded, take neither memory
/// nor time.
std::size_t load_index(const StepPlan& plan, std::int32_t point) noexcept;

/// Returns loads that are zero, sized for a plan.
SumsOnPoints make_load_sums(const StepPlan& plan);
void clear(LoadSums& sums) noexcept;

/// Holds one set of loads. `axes` has the same values as in ForceCommand.
struct LoadSet {
  std::int32_t axes = 0;
  std::span<const PointForce> forces;
  std::span<const Wrench> wrenches;
  std::span<const PointTorque> torques;  // torques on points with an attitude
  std::span<const WheelTorque> wheels = {};
};
/// Adds loads to sums.
/// \pre every index in `loads` is valid in the plan, and the sums were sized for the plan
void add_loads(const StepPlan& plan, const LoadSet& loads, LoadSums& sums) noexcept;

/// Holds the loads over a step that is longer than a tick. Commands and amplitudes of histories are parabolas
/// in time, given at the start, the middle and the end of the step   (THEORY 15.2).
struct LoadsOverStep {
  std::array<LoadPattern, 3> commands;
  std::vector<std::array<double, 3>> amplitudes;  // [-] (num histories)
  bool jumps = true;  // false: the loads at the start are those at the end of the step before
};

/// The numbering of the components of commands along the axes of the body: three forces on each point, three
/// torques on each point with an attitude, three forces and then three torques on each group, one torque of
/// each motor. The members are the first indices of each kind.
struct CommandComponents {
  explicit CommandComponents(const StepPlan& plan) noexcept;
  std::size_t torques, group_forces, group_torques, motors, count;
};
/// Returns a component of the loads of commands [N], [N m] at attitude R_WB   (THEORY 8.49).
/// \pre is_coupled(plan): sums has a force for each point
double command_coefficient(const CommandComponents& components, const LoadSums& sums, const Mat3& R_WB,
                           std::size_t component) noexcept;

/// Returns the generalized forces of unit wrenches on each group (6*num_groups x num_padded). For each group
/// there are three rows for unit forces, and three rows for unit torques, along the body axes. Every
/// point of a group must have rows.
///   Q_l = sum_i F_i . b_il   (THEORY 4.20),   F_i = (m_i / m_g) F_g + m_i (J_g^-1 T_g) x d_i   (THEORY 8.8)
Array make_group_rows(const StepPlan& plan);

/// Returns an empty pattern with room for every load.
LoadPattern make_pattern(const StepPlan& plan);

/// Overwrites a pattern of make_pattern with the sums   (THEORY 8.1 to 8.7). Allocates nothing.
void set_pattern(const StepPlan& plan, std::span<const double> group_rows, const SumsOnPoints& sums,
                 LoadPattern& pattern) noexcept;

/// Holds the resultant of loads in body axes.
struct BodyResultant {
  Vec3 force{};   // [N]
  Vec3 torque{};  // [N m] about the centre of mass, arms of the undeformed structure
};
/// Returns the resultant of those loads of a pattern that are given in body axes. On coupled rungs a pattern
/// holds its loads without this resultant, but the step of a body without modes needs it (THEORY 8.7).
/// \pre is_coupled(plan)
BodyResultant body_resultant(const StepPlan& plan, const LoadPattern& pattern) noexcept;

/// Returns the pattern of one built-in load, for the set-up of StepPlan::histories. Arrays that the pattern
/// does not use are empty. \pre plan.points, groups, rows, num_padded are filled
LoadPattern build_pattern(const StepPlan& plan, const SumsOnPoints& sums);
LoadPattern build_pattern(const StepPlan& plan, const LoadSet& loads);

/// Sets Q to amplitude times the generalized forces of the pattern at attitude R_WB, or adds them to Q if
/// `accumulate` is true. If the pattern has no load, returns false and leaves Q unchanged.
///   world forces on few points:  Q_l = sum_i b_il . (R_WB^T F_i)   (THEORY 8.4)
///   other world loads:  Q_l = sum_ab R_WB,ba Q_l,ab   (THEORY 8.6)
///   loads in body axes:  Q_l = Q_B,l   (THEORY 8.7)
/// \param Q  [N] (num_padded) generalized forces
bool project(const StepPlan& plan, const LoadPattern& pattern, const Mat3& R_WB, double amplitude,
             bool accumulate, double* Q) noexcept;

/// For coupled rungs: adds amplitude times the forces of the pattern to the forces on each point, body axes.
/// Wrenches are distributed over their groups: F_i = (m_i / m_g) F_g + m_i (J_g^-1 T_g) x d_i   (THEORY 8.8).
/// \param x  [m] (num_points + num_particles) present positions, body axes, from which the arms d_i and J_g
/// of
///   the torques follow; empty: those at rest
/// \param forces  [N] (num_points + num_particles) forces on the points, then on the particles
void add_point_forces(const StepPlan& plan, const LoadPattern& pattern, const Mat3& R_WB, double amplitude,
                      std::span<const Vec3> x, std::span<Vec3> forces) noexcept;

}  // namespace freeflex
