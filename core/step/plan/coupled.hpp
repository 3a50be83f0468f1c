// The part of a plan that only the coupled rungs read.
#pragma once

#include <cstdint>
#include <vector>

#include "core/step/array.hpp"
#include "core/step/plan/links.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

/// Holds a spring, bar or dashpot whose force is computed from its true length and direction
/// (THEORY 12.17 to 12.19).
struct PlanBar {
  std::int32_t link = -1;                // index into Plan::links; PlanCoupled::bars are sorted by this index
  std::int32_t first = -1, second = -1;  // indices of the two points that it joins
  double stiffness = 0.0;                // [N/m] 0 for a dashpot
  double damping = 0.0;                  // [N s/m] force per rate of elongation
  double length = 0.0;                   // [m] rest length
  Vec3 direction{};                      // [-] rest direction, from the first to the second point
};

/// Holds a body for the computation of its loads. The forces on its particles are summed to a force and a
/// torque, whose generalized forces include the second-order effect of the rotation of the body
/// (THEORY 12.53, 12.54).
struct PlanBodyRotation {
  std::int32_t first = 0, count = 0;  // first particle in PlanParticles::all, and number of particles
  std::int32_t point = -1;            // the point that carries them; -1: a link
  Vec3 centre{}, offset{};  // [m] rest position of its centre of mass; vector from its point to this centre
  Array rows;               // [1/m] (3 x num_padded) theta = rows q
};

/// Holds a body whose centre of mass is not at its point. The rotation of the body moves the centre, also to
/// second order (THEORY 12.55).
struct PlanOffset {
  double mass = 0.0;  // [kg]
  Vec3 offset{};      // [m] from the point to the centre of mass
  Array rows;         // [1/m] (3 x num_padded) theta = rows q
};

/// Holds the data for the kinetic energy on the coupled rungs, and the bodies whose rotation changes their
/// loads   (THEORY 12.33 to 12.55).
struct PlanKinetics {
  enum class Form : std::int32_t {
    kComplete = 0,  // a complete set of modes of point masses   (THEORY 12.5 to 12.12)
    kPoints = 1,    // some of the modes of point masses, by sums over points   (THEORY 12.36)
    kTables = 2,    // bodies or omitted modes, by sums over pairs of modes   (THEORY 12.48, 12.49)
    kTurning = 3,   // a complete set of modes of bodies that turn by any angle   (THEORY 12.84)
    kSpread = 4,    // the same with mass spread over links, by sums over pairs of modes   (THEORY 12.108)
  };
  Form form = Form::kComplete;
  Array moments;                // [kg m] (6 x num_padded) Y_l,ab for ab = xx, yy, zz, xy, xz, yz
  std::int32_t num_tables = 0;  // 9 for X_kl and Z_kl; 12 with G_kl, if there are bodies
  // [kg] (num_moving x num_tables x num_padded) for each mode k: X_kl,a for a = x, y, z, then Z_kl,ab for ab
  // as above, then G_kl,a
  Array tables;
  std::vector<PlanBodyRotation> body_rotations;  // the bodies together contain all particles, in order
  std::vector<PlanOffset> offsets;
};
/// Returns whether the modes are a complete set, so that a motion is one of points and bodies. With mass
/// spread over links it is not, although all modes are there.
inline bool is_complete(const PlanKinetics& kinetics) noexcept {
  return kinetics.form == PlanKinetics::Form::kComplete || kinetics.form == PlanKinetics::Form::kTurning;
}
/// Returns whether the sums over the mass are taken from tables over pairs of modes.
inline bool has_tables(const PlanKinetics& kinetics) noexcept {
  return kinetics.form == PlanKinetics::Form::kTables || kinetics.form == PlanKinetics::Form::kSpread;
}
inline constexpr std::int32_t kPointTables = 9, kBodyTables = 12;  // PlanKinetics::num_tables

/// Holds data that only the coupled rungs need. Below the coupled rungs these data are empty
/// (THEORY 12.14).
struct PlanCoupled {
  /// Lists functions of the linear motion L of one mode over a substep of length h. Each function is a 2 x 2
  /// matrix that acts on (q, p), with the entries in the order of Entry:
  ///   kHalfStep exp(h L / 2),  kHalf1, kHalf2  phi_1, phi_2 of h L / 2,
  ///   kStep exp(h L) - 1,  kStep1 to kStep3  phi_1 to phi_3 of h L   (THEORY 12.14)
  /// The unit matrix is subtracted in kStep, so that the small changes of slow modes keep their digits.
  enum Function { kHalfStep, kHalf1, kHalf2, kStep, kStep1, kStep2, kStep3, kNumFunctions };
  enum Entry { kQq, kQv, kVq, kVv, kNumEntries };
  Array functions;  // (4 kNumFunctions x num_padded), row 4 * function + entry
  std::vector<PlanBar> bars;
  PlanTrueLinks links;
  PlanTurning turning;
  PlanCurve curve;
  // [s] (num_padded) 2 zeta_l / omega_l, and Rayleigh's beta [s]: the times by which elastic forces lead.
  // Springs and bars have beta in PlanBar::damping. Empty without damping of strains   (THEORY 12.114)
  Array strain_times;
  // false: the substep does not resolve all modes, so damping acts on linear strains
  bool damps_true_strains = false;
  double beta = 0.0;
  // [rad] largest allowed product of the fastest rate [rad/s] and the length of a substep [s]; 0: the step is
  // not divided   (THEORY 12.29)
  double substep_phase = 0.0;
  std::int32_t num_substeps = 1;  // number of substeps per step; the number is a power of two, so the period
                                  // is divided without rounding error
  PlanKinetics kinetics;
};

}  // namespace freeflex
