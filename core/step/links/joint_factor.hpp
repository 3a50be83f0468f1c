// The factor of the stiffness over the rotations of joints. It starts as that of the rest shape and is
// renewed where large rotations or strong axial forces have changed the stiffness.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/step/plan/links.hpp"

namespace freeflex {

inline constexpr std::size_t kBeamUnknowns = 12;  // two joints and two ends with up to three releases
inline constexpr std::size_t kPlateUnknowns = 9;  // three joints

/// Returns the unknown rotations of a link: those of its joints, then those of releases. -1: the axis is not
/// released, or a body turns the end.
std::array<std::int32_t, kBeamUnknowns> unknowns_of(const PlanTrueBeam& beam,
                                                    std::int32_t num_joints) noexcept;
std::array<std::int32_t, kPlateUnknowns> unknowns_of(const PlanTruePlate& plate,
                                                     std::int32_t num_joints) noexcept;
std::vector<std::int32_t> unknowns_of(const PlanTrueMatrix& matrix, std::int32_t num_joints);

/// Holds a factor K_tt = L D L^T and where the stiffness of each link goes in it. Made once, without an
/// allocation afterwards.
struct JointFactor {
  bool is_renewed = false;                    // false: the factor is that of the rest shape, in the plan
  bool is_definite = true;                    // false: the last stiffness that was factored was not
  std::vector<double> lower, inverse_pivots;  // of the renewed factor, in the pattern of the plan
  std::vector<double> diagonal;               // [N m] (num_rotations) in the order of the factor
  std::vector<std::int32_t> place;            // (num_rotations) position of each unknown in the order
  std::vector<std::int32_t> at;               // (num_rotations) entry of each row of the column at work
  // numbers of columns that are solved together, from the first to the last: 3 if the rows below three are
  // the same, as for most joints, else 1
  std::vector<std::uint8_t> widths;
  // for each link and each pair of its unknowns (first >= second): k for the diagonal of place k,
  // num_rotations + e for entry e of `lower`, -1 for none
  std::vector<std::int32_t> slots;
};

JointFactor make_joint_factor(const PlanTrueLinks& links);

/// Adds to the entry of two unknowns. -1: a rotation that is not unknown.
void add_to_entry(const PlanJoints& joints, std::int32_t a, std::int32_t b, double value,
                  JointFactor& factor) noexcept;
/// Sets the stiffness to zero, so that add_stiffness() can sum that of all links.
void clear_stiffness(JointFactor& factor) noexcept;
/// Adds the stiffness of one link.
/// \param slots  those of the link  \param axes  [-] unit rotation of each unknown  \param ends  index of the
/// end that it rotates  \param K  [N m] (3 num_ends x 3 num_ends) over the rotations of the ends
void add_stiffness(std::span<const std::int32_t> slots, std::span<const Vec3> axes,
                   std::span<const std::uint8_t> ends, std::span<const double> K, std::size_t num_ends,
                   JointFactor& factor) noexcept;
/// Adds the stiffness of a matrix link over the rotations of its ends, without its geometric stiffness.
/// \param turns  rotations of the ends in the axes of the turned link
void add_stiffness(std::span<const std::int32_t> slots, const MatrixConstants& matrix,
                   std::span<const Mat3> turns, JointFactor& factor) noexcept;
/// Factors the sum   (THEORY 12.73). If it is not positive definite, the factor is that of the sum with
/// larger diagonal entries, so that a step with it still leads downhill (Gill, Murray and Wright 1981,
/// Practical Optimization, section 4.4.2.2).
void factor_stiffness(const PlanJoints& joints, JointFactor& factor) noexcept;

/// Replaces the right side b by K_tt^-1 b. Idle rotations stay zero.  \param x  (num_rotations)
void solve_stiffness(const PlanJoints& joints, const JointFactor& factor, double* x) noexcept;

}  // namespace freeflex
