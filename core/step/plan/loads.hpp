// The part of a plan that holds the built-in loads, and the loads of commands in the same form.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/step/array.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

/// Holds the sums of forces on each point that may be loaded, and the sums of wrenches on each group, in
/// world and body axes.
struct LoadSums {
  std::vector<Vec3> force_W, force_B;               // [N] (num_points on coupled rungs, else one for each
                                                    // block of rows)
  std::vector<Vec3> group_force_W, group_torque_W;  // [N], [N m] (num_groups)
  std::vector<Vec3> group_force_B, group_torque_B;  // [N], [N m] (num_groups)
  std::vector<Vec3> torque_W, torque_B;             // [N m] (num_attitude_points)
  std::vector<double> wheel_torques;  // [N m] (num_wheels) torques that motors exert on wheels; empty: no
                                      // motor acts
  bool operator==(const LoadSums&) const = default;
};

/// Holds LoadSums with the indices of the points that may be loaded. On coupled rungs every point may be
/// loaded, but on the other rungs only the points with rows.
struct SumsOnPoints : LoadSums {
  std::vector<std::int32_t> points;  // ascending
};

/// Holds the spatial part of a load. The pattern is computed only when the load changes (THEORY 8.1 to 8.7).
/// The arrays of a pattern have their full capacity from the start. Forces fixed in world axes rotate
/// relative to the body: L_B,c = sum_ab R_WB,ba L_c,ab, Q_l = sum_ab R_WB,ba Q_l,ab
/// or, if they act on few points, Q_l = sum_i b_il . (R_WB^T F_i).
struct LoadPattern {
  static constexpr int kMaxDirect = 3;
  Vec3 force_W{};                     // [N] resultant of the forces in world axes
  std::array<double, 27> moment_W{};  // [N m] L_c,ab at 9c+3a+b, about the centre of mass
  bool has_world = false;
  std::int32_t num_direct = 0;                        // number of points whose forces are stored one by one;
                                                      // 0 if uses_table
  std::array<std::int32_t, kMaxDirect> direct_row{};  // block of rows
  std::array<Vec3, kMaxDirect> direct_force_W{};      // [N]
  bool uses_table = false;
  Array table;      // [N] (9 x num_padded) Q_l,ab in row 3a+b: sum_i b_il,a F_i,b
  Vec3 force_B{};   // [N] resultant of the loads in body axes
  Vec3 torque_B{};  // [N m] moment of these loads about the centre of mass
  bool has_body = false;
  Array Q_B;                          // [N] (num_padded)
  std::vector<double> wheel_torques;  // [N m] (num_wheels) empty: no motor acts
  LoadSums sums;  // the loads of which the pattern consists; empty below the coupled rungs
};

/// Holds a force that rotates with the elastic rotation theta at its point. In addition to force_B in body
/// axes, theta x force_B acts   (THEORY 8.24).
struct PlanFollower {
  /// Holds the share of a point in the mean rotation of the points around a force, sum_k turn_k V_k.
  struct Neighbour {
    std::int32_t point = -1;
    Mat3 turn{};  // [1/m]
  };
  std::int32_t row = -1;  // block of rows of the point
  Vec3 r{};               // [m] rest position of the point
  Vec3 force_B{};         // [N] at amplitude 1
  Array rotation_rows;    // [1/m] (3 x num_padded) theta = rotation_rows q
  // at true geometry, if no joint or body turns the force: the points whose rotation it follows (THEORY
  // 8.53). Otherwise empty
  std::vector<Neighbour> neighbours;
};

/// Holds a torque that rotates with the body on which it acts, by the elastic rotation theta. Therefore
/// theta x torque_B acts in addition to torque_B   (THEORY 16.14).
struct PlanTorque {
  std::int32_t attitude_index = -1;  // index of the body in PlanParticles::attitude_points
  Vec3 torque_B{};                   // [N m] at amplitude 1
};

/// Holds the geometric stiffness due to the static internal forces under a load or a field:
/// Q_l -= sum_k c_k sum_u E_k,lu q_u. The coefficients are S_xx S_yy S_zz S_xy S_xz S_yz of a field, the
/// amplitude times R_WB of a load in world axes, then the amplitude for its motors, the components of
/// commands, and the amplitude of any other load   (THEORY 8.49).
struct PlanStiffening {
  static constexpr std::int32_t kMotors = 9;  // component: the motors of a load in world axes
  static constexpr std::size_t kMostModes = 64;
  // [-] A field that changes every omega_l^2 by less than this share of it does not act: a frequency that is
  // off by half of it is off by 5e-3 rad after 1e6 rad.
  static constexpr double kNegligible = 1e-8;
  std::vector<std::int32_t> modes;       // ascending, at most kMostModes
  std::vector<std::int32_t> components;  // index of each coefficient c_k
  // (components x modes x padded modes) E_k: [N/m] at amplitude 1, [kg] of a field
  Array rows;
  // (components) the largest |E_k,lu| / (M omega_l omega_u): [-] at amplitude 1, [s^2] of a field; the
  // largest number if a mechanism has a stiffness
  Array shares;
};

/// Holds a built-in load, that is, its pattern and its amplitude over ticks since the epoch began
/// (THEORY 8.10 to 8.13).
struct PlanHistory {
  enum class Kind : std::int32_t { kConstant = 0, kPulse = 1, kSine = 2, kTable = 3 };
  std::string name;
  Kind kind = Kind::kConstant;
  double pulse_start = 0.0, pulse_duration = 0.0;  // [s] as given in the scene
  std::int64_t start_tick = 0, end_tick = 0;       // a pulse acts while start <= tick < end
  double frequency = 0.0, phase = 0.0;             // [Hz], [cycles]
  std::vector<double> times, values;               // [s], [-]
  LoadPattern pattern;
  std::vector<PlanFollower> followers;
  std::vector<PlanTorque> torques;  // torques in local axes
  PlanStiffening stiffening;
};

/// Holds the rows that give the force of linear feedback on a point, in body axes: f = F_q q + F_v q' + F_Q Q
/// (THEORY 8.28).
struct PlanFeedback {
  std::string name;
  std::int32_t row = -1;  // block of rows of the point on which the feedback acts
  Vec3 r{};               // [m] rest position of that point
  Array q_rows,           // [N/m] (3 x num_padded) F_q
      q_dot_rows,         // [N s/m] (3 x num_padded) F_v
      Q_rows;             // [-] (3 x num_padded) F_Q; empty if no gain is on the acceleration
};

/// Holds what commands must not do, because the plan omits a feature that such commands would need
/// (THEORY 14.4, 14.5).
struct CommandScope {
  bool lacks_rotation = false;
  bool lacks_out_of_plane = false;
  Vec3 normal_B{};  // [-] normal of a planar shape
  Mat3 R_WB{};      // [-] initial attitude; later attitudes are rotated from it about the normal only
};

/// Holds the loads that act without a command, and what commands must not do.
struct PlanLoads {
  bool has_spin_load = false;  // true: the centrifugal load acts on the modes (rung kSpinLoaded)
                               // (THEORY 8.16)
  // [kg m] (6 x num_padded) Y_l,ab = sum m_i r_i,a b_il,b for ab = xx, yy, zz, xy, xz, yz   (THEORY 8.15);
  // empty if there is neither spin load nor attractor
  Array field_rows;
  // stiffness by the fields of the spin and the attractor; empty except on the rung kCoupled
  PlanStiffening field_stiffening;
  // stiffness by the components of commands, in the numbering of CommandComponents; empty except on the rung
  // kCoupled
  PlanStiffening command_stiffening;
  std::vector<PlanHistory> histories;
  std::vector<PlanFeedback> feedbacks;
  CommandScope scope;
};

}  // namespace freeflex
