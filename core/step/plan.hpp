// The immutable plan holds everything that the step reads. A plan consists of plain arrays. core/plan fills
// these arrays, and plan files hold their bytes.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/command_limits.hpp"
#include "core/step/array.hpp"
#include "core/words.hpp"

namespace freeflex {

using Vec3 = std::array<double, 3>;
using Mat3 = std::array<double, 9>;  // row-major
using Quat = std::array<double, 4>;  // w x y z, unit norm

/// Holds the exact step of each mode over one period, y = (q, q'), for Q linear within the step:
///   y^1 = (C + L) y^0 + w_0 Q^0 + w_1 (Q^1 - Q^0)   (THEORY 6.1, 6.5)
/// C + L is the exact propagator. C holds the leading 26 bits of each entry of this propagator, so that the
/// product of C with the leading 26 bits of y is exact. L holds the rest of each entry, rounded to double.
/// The coefficients of kLanes modes are stored side by side, in the order in which the step reads them, so
/// that the step reads one stream of memory instead of twelve. Padding is zero.
struct Propagator {
  struct alignas(64) Lanes {
    using Lane = std::array<double, kLanes>;
    Lane c_qq{}, c_qv{}, l_qq{}, l_qv{};  // [-], [s]; parts C, then parts L
    Lane w_q0{}, w_q1{};                  // [m/N] weights of Q at the start, and of its change over the step
    Lane c_vq{}, c_vv{}, l_vq{}, l_vv{};  // [1/s], [-]; parts C, then parts L
    Lane w_v0{}, w_v1{};                  // [m/(s N)]
  };
  std::vector<Lanes> lanes;  // (num_moving / kLanes); empty if damping is omitted

  /// Holds the step of modes without decay. For these modes c_vv and l_vv equal c_qq and l_qq to the bit.
  struct alignas(64) UndampedLanes {
    using Lane = std::array<double, kLanes>;
    Lane c_qq{}, c_qv{}, l_qq{}, l_qv{};
    Lane w_q0{}, w_q1{};
    Lane c_vq{}, l_vq{};
    Lane w_v0{}, w_v1{};
  };
  std::vector<UndampedLanes> undamped;  // (num_moving / kLanes) if damping is omitted, else empty
};

struct PlanPoint {
  std::string name;
  double mass = 0.0;      // [kg] 0: a massless point; links hold it
  Vec3 r{};               // [m] rest position from the centre of mass, body axes
  std::int32_t row = -1;  // block of three rows in Plan::rows; -1: the point is neither read nor loaded
  bool pushable = false;
};

struct PlanLink {
  std::string name;
  std::string kind;  // "spring", "bar", "beam", "matrix", "bending", "torsion", "plate", "rigid", "dashpot"
  std::vector<std::int32_t> points;  // empty for a matrix
};

/// Holds a named group and the data that distribute a wrench over its points. A force F_g and a torque T_g at
/// the centre of mass of the group are distributed as the forces
///   F_i = m_i (F_g / mass + (inverse_inertia T_g) x d_i),  d_i = r_i - centre   (THEORY 8.8)
struct PlanGroup {
  std::string name;
  std::vector<std::int32_t> points;
  double mass = 0.0;             // [kg]
  Vec3 centre{};                 // [m] centre of mass of the group from B, body axes
  Mat3 inverse_inertia{};        // [1/(kg m^2)] pseudo-inverse for collinear groups
  std::int32_t torque_rank = 3;  // number of independent torques that the group supports: 3, or 2 if it is
                                 // collinear, or 0 if it is at one position
  Vec3 line{};  // [-] direction of the line of a collinear group; the group supports no torque about this
                // line   (THEORY 8.9)
};

/// Holds the particles that stand for the mass of bodies (THEORY 16.4). The arrays are empty if all points
/// are point masses.
struct PlanParticles {
  std::vector<PlanPoint> all;  // particles of bodies, without names
  // (num_groups) the points and particles that carry the mass of each group, as indices for mass_point
  std::vector<std::vector<std::int32_t>> of_groups;
  std::vector<std::int32_t> attitude_points;  // points whose attitude is read or loaded, ascending
  Array rotation_rows;  // [1/m] (3 num_attitude_points x num_padded) three rows for each of attitude_points:
                        // elastic rotation theta = rows q
};

/// Holds a wheel in a body   (THEORY 16.21 to 16.26).
struct PlanWheel {
  std::string name;
  std::int32_t attitude_index = -1;  // index of the wheel's body in PlanParticles::attitude_points
  Vec3 axis{};                       // [-] unit vector, body axes
  double momentum = 0.0;             // [N m s] momentum at the start
  // [1/m^2] axis . (theta_l x theta_u) for each pair of modes (l, u) in PlanUnmodelled::pairs: the gyroscopic
  // coupling per unit of momentum
  Array gyroscopic;
};
struct PlanWheels {
  std::vector<PlanWheel> all;
};
/// Holds the torques that motors exert on wheels.
struct WheelTorques {
  std::vector<double> torque;  // [N m] (num_wheels); empty: no motor acts
};

struct TorqueSums {
  std::vector<Vec3> W, B;  // [N m] (num_attitude_points)
};
/// Holds the sums of forces on each point that may be loaded, and the sums of wrenches on each group, in
/// world and body axes.
struct LoadSums {
  std::vector<Vec3> force_W, force_B;               // [N] (num_points on coupled rungs, else one for each
                                                    // block of rows)
  std::vector<Vec3> group_force_W, group_torque_W;  // [N], [N m] (num_groups)
  std::vector<Vec3> group_force_B, group_torque_B;  // [N], [N m] (num_groups)
  TorqueSums torque;
  WheelTorques wheels;
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
  Array Q_B;  // [N] (num_padded)
  WheelTorques wheels;
  LoadSums sums;  // the loads of which the pattern consists; empty below the coupled rungs
};

/// Holds a force that rotates with the elastic rotation theta at its point. In addition to force_B in body
/// axes, theta x force_B acts   (THEORY 8.24).
struct PlanFollower {
  std::int32_t row = -1;  // block of rows of the point
  Vec3 r{};               // [m] rest position of the point
  Vec3 force_B{};         // [N] at amplitude 1
  Array rotation_rows;    // [1/m] (3 x num_padded) theta = rotation_rows q
};

/// Holds a torque that rotates with the body on which it acts, by the elastic rotation theta. Therefore
/// theta x torque_B acts in addition to torque_B   (THEORY 16.14).
struct PlanTorque {
  std::int32_t attitude_index = -1;  // index of the body in PlanParticles::attitude_points
  Vec3 torque_B{};                   // [N m] at amplitude 1
};
struct PlanTorques {
  std::vector<PlanTorque> all;
};

/// Holds the geometric stiffness E that is due to the internal forces under the followers of a load:
/// Q -= amplitude * E q (THEORY X145).
struct PlanStiffening {
  std::vector<std::int32_t> modes;
  Array rows;  // [N/m] (modes x modes) E at amplitude 1
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
  PlanTorques torques;  // torques in local axes
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

/// Holds the data of modes that dashpots and feedback couple   (THEORY 8.30 to 8.41).
struct PlanModalCoupling {
  enum class Path : std::int32_t {
    kNone = 0,
    kExact = 1,  // the coupled modes are advanced by their matrix exponential   (THEORY 8.34)
    kSplit = 2,  // a splitting impulse is applied, the modes are advanced without coupling, and a second
                 // splitting impulse is applied; order 2   (THEORY 8.38)
  };
  Path path = Path::kNone;
  Array damping_rows;  // [sqrt(N s/m)] (num_damping x num_padded) R: the generalized forces of the dashpots
                       // are -R^T R q'
  std::int32_t num_damping = 0;     // number of rows of damping_rows
  std::vector<std::int32_t> modes;  // kExact: coupled modes, ascending
  // kExact: (q, q') of the coupled modes at the end of the step is the sum of these columns times the entries
  // of (q^0, q'^0, Q^0, Q^1 - Q^0)
  // [-], [s], [1/s], [m/N], [m/(s N)] (4 num_modes columns of pad(2 num_modes)) column-major
  Array columns;
  static constexpr int kLoadRows = 16;  // twelve, padded to kLanes
  // kExact: these columns give the force and torque of feedback on the body at the start of the step, then at
  // the end of the step. Between the two times the load is linear in time, and its impulse and the first
  // moment of the impulse are exact (THEORY 8.37). The array is empty without feedback.
  Array load_columns;  // [N], [N m] per (m, m/s, N, N) (4 num_modes columns of kLoadRows) column-major
  // kSplit: the splitting impulse is q' += impulse_out^T (impulse_q_rows q + impulse_q_dot_rows q')
  // (THEORY 8.40)
  std::int32_t num_impulses = 0;
  Array impulse_q_rows, impulse_q_dot_rows, impulse_out;  // (num_impulses x num_padded)
};

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
  // [rad] largest allowed product of the fastest rate [rad/s] and the length of a substep [s]; 0: the step is
  // not divided   (THEORY 12.29)
  double substep_phase = 0.0;
  std::int32_t num_substeps = 1;  // number of substeps per step; the number is a power of two, so the period
                                  // is divided without rounding error
  PlanKinetics kinetics;
};

/// Holds the output rows of one published link, in Plan::link_rows:
///   force = rows q + rate rows q' + load rows Q
struct PlanLinkOutput {
  std::int32_t link = -1;            // index into Plan::links
  std::int32_t num_rows = 1;         // number of values, see LinkForceRows
  std::int32_t first_row = 0;        // first row of q
  std::int32_t first_rate_row = -1;  // first row of q'; -1: no rate rows
  std::int32_t first_load_row = -1;  // first row of Q; -1: no load rows
};

struct PlanInitial {
  Vec3 p_WB{};                    // [m] position of the centre of mass
  Vec3 v_WB{};                    // [m/s] velocity of the centre of mass
  Quat q_WB{1.0, 0.0, 0.0, 0.0};  // [-] attitude
  Vec3 w_B{};                     // [rad/s] angular velocity, body axes
  Array q;                        // [m] (num_padded) elastic coordinates
  Array q_dot;                    // [m/s] (num_padded) rates of the elastic coordinates
};

/// Holds the decision on one feature: whether the plan keeps or omits it, why, and by how much the omission
/// may change the motion beyond rounding error   (THEORY 14.15).
struct PlanFeature {
  Feature feature = Feature::kDamping;
  bool is_left_out = false;
  std::int32_t count = 0;  // number of modes or points concerned
  std::string why;
  // largest errors within the horizon, under the built-in loads and from the initial state
  double error = 0.0;           // [m] of the elastic displacement of any point that is read or pushed
  double relative_error = 0.0;  // [-] error over the largest elastic displacement of such a point
  double link_error = 0.0;      // [N], [N m] in any published link force
  // The errors under commands, per newton. To get the error of a command, multiply by the force on a pushable
  // point plus the sum of the changes of this force.
  double error_per_force = 0.0;           // [m/N]
  double relative_error_per_force = 0.0;  // [-] error over the static displacement under the force
  double link_error_per_force = 0.0;      // [-], [m]
};

/// Holds what commands must not do, because the plan omits a feature that such commands would need
/// (THEORY 14.4, 14.5).
struct CommandScope {
  bool lacks_rotation = false;
  bool lacks_out_of_plane = false;
  Vec3 normal_B{};  // [-] normal of a planar shape
  Mat3 R_WB{};      // [-] initial attitude; later attitudes differ from it only by a rotation about the
                    // normal
};

/// Holds the result for one rung that `fidelity: auto` tried: the largest error estimates over the horizon
/// (THEORY 12.28).
struct PlanRung {
  Fidelity rung = Fidelity::kRigid;
  double position = 0.0, attitude = 0.0, elastic = 0.0;  // [m] rms, [rad], [-]
  bool is_finite = false;                                // false: the motion became infinite or NaN
  bool meets = false;  // true: the estimates meet every tolerance of the scene
};

struct PlanShadow;

/// Holds the plans for the error budget. The shadows are stepped in parallel with the state
/// (THEORY 12.22 to 12.26). There are no shadows if the scene does not ask for an error budget.
struct PlanBudget {
  double horizon = 0.0;            // [s] time between restarts of the shadows; 0: no budget
  std::int64_t horizon_ticks = 0;  // the horizon in ticks, at least 1
  std::vector<PlanShadow> shadows;
};

/// Largest number of modes of PlanUnmodelled whose error is integrated.
inline constexpr std::int32_t kMostShadowedModes = 32;

/// Number of values per elastic coordinate that give the torque of loads on displaced points: 27 values for
/// loads in world axes, in the layout of LoadPattern::moment_W, then 3 values for loads in body axes
/// (THEORY X148).
inline constexpr std::size_t kArmSize = 30;

/// Specifies which modes of the structure a plan omits. Plan files hold the numbers.
enum class LacksModes : std::uint8_t {
  kNone = 0,
  kSmallModes = 1,  // Small modes are omitted, but their motion is known.
  kNotKept = 2,     // The set-up found only the lowest modes, so the motion of the others is unknown.
};

/// Holds the stiffness of bodies that is due to accelerations, on rungs that omit this stiffness, and bounds
/// on the effects of the interior of superelements   (THEORY X143, 12.56).
struct PlanUnmodelledBodies {
  Array push_rows;          // [kg] (pairs x 6) stiffness per acceleration and angular acceleration; empty on
                            // the coupled rungs
  double inner_load = 0.0;  // [m s^2] bound on the displacement of inner masses, per square of the spin
  // [-] (judged) how far each mode moves the points of links with unknown internal forces, compared with a
  // free beam; empty if there are no such links
  Array unquantified_factor;
  Array load_sizes;  // [N] (histories) size_of_forces of each history; empty if there are no links with
                     // unknown internal forces
};

/// Holds the fourth-order terms of the strain energy of the first modes: V_4 = 1/8 sum_r (x^T H_r x)^2
/// (THEORY X146).
struct PlanQuartic {
  // [sqrt(N)/m^2] (forms x num_shadowed x num_shadowed) symmetric matrices H_r; empty in old plan files
  Array forms;
};

/// Holds the items that messages about a verdict name. The arrays are empty for plan files of version 7 and
/// before. Links with unknown internal forces are matrices, rigid links, plates and links with mass, because
/// no table gives the forces inside them.
struct PlanNamed {
  // (judged) for each mode, the link with unknown internal forces whose points move most in the mode, as an
  // index into Plan::links; -1: no such link
  std::vector<std::int32_t> links;
  // The modes of PlanUnmodelled::left_out_rows, with their numbers in the scene, from 1, and their
  // frequencies [Hz].
  std::vector<std::int32_t> left_out;
  std::vector<double> left_out_frequency;
};

/// Holds the terms that the rung neglects. The step does not use these terms. The verdict is computed from
/// them (THEORY X140, X141). "Products of the spin" below are the entries xx, yy, zz, xy, xz, yz of w w^T, in
/// this order.
struct PlanUnmodelled {
  bool is_known = false;          // false: the plan file is of version 5 or before, which has no such tables
  bool is_rigid = false;          // true: the plan is on the rung `rigid`, but the structure has elastic
                                  // modes
  bool has_unquantified = false;  // true: the neglected terms of some items are not computed (matrices, rigid
                                  // links, mass in links, wheels)
  LacksModes lacks_modes = LacksModes::kNone;
  double tolerance = 0.0;  // [m] tolerance of the scene; 0: no tolerance given
  // [m] displacement of the omitted small modes, rms over all points
  double left_out = 0.0;
  std::vector<std::int32_t> fast_loads;            // indices of histories that change faster than the ticks
                                                   // resolve
  std::int32_t num_judged = 0;                     // number of pairs (l, l), which come first in `pairs`
  std::vector<std::array<std::int32_t, 2>> pairs;  // (l, u), indices of modes of this plan
  Array load_rows;  // [N/m^2] (pairs x num_elastic) stiffness per quasi-static coordinate
  // [N s/m^2] (pairs x num_elastic) stiffness per rate of a coordinate; empty without damping
  Array rate_rows;
  Array spin_rows;      // [N s^2/m] (pairs x 6) stiffness per product of the spin
  Array coriolis_rows;  // [-] (pairs x 3) sum m b_l x b_u / M; zero for (l, l)
  Array root_quartic;   // [sqrt(N/m^3)] (judged) root of (stiffness / displacement^2) of the mode
  // number of modes whose errors are integrated; these are the first modes of the plan
  std::int32_t num_shadowed = 0;
  // [kg m] (num_shadowed x 6) centrifugal load per product of the spin. Its derivative with respect to the
  // spin is the angular momentum that a mode adds   (THEORY X148)
  Array inertia_rows;
  Array load_arms;  // [N] (histories x num_shadowed x kArmSize) result of set_arms for each history
  // [N/m^2] (num_shadowed (num_shadowed + 1) / 2 x num_shadowed) third derivatives of the strain energy with
  // respect to a pair of modes a <= b and a third mode. If a = b, the entry is half the derivative
  // (THEORY X147)
  Array shadow_rows;
  // [s^2] (judged x 6) square of the fraction of a mode's amplitude that Coriolis forces transfer to other
  // modes, per product of the spin; empty on rungs with Coriolis forces
  Array coriolis_transfer;
  // [1/m] (omitted modes x num_elastic) relative stiffness change of each omitted mode per metre of
  // quasi-static response of each kept mode. Only the lowest omitted modes have a row.
  Array left_out_rows;
  Array left_out_spin;  // [s^2] (omitted modes x 6) relative stiffness change per product of the spin
  // effect of the centrifugal load; both arrays are empty on rungs that include this load
  Array spin_loads;     // [kg m] (num_elastic x 6)
  Array spin_left_out;  // [m^2 s^4] (6 x 6) square of the quasi-static response of omitted modes
  PlanUnmodelledBodies bodies;
  PlanQuartic quartic;
  PlanNamed named;
};

/// Holds the principal axes   (THEORY 7.14). set_principal computes them from Plan::inverse_inertia, so plan
/// files do not contain them.
struct PlanPrincipal {
  Mat3 R_PB{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};  // [-] the rows are the axes, in body axes
  Vec3 inverse_moment{};  // [1/(kg m^2)] largest first; zero for an axis about which the body has no inertia
  bool operator==(const PlanPrincipal&) const = default;
};

struct Plan {
  std::string name;
  std::uint64_t scene_hash = 0;
  double period = 0.0;  // [s]
  // rigid body
  double mass = 0.0;  // [kg]
  std::int32_t rigid_freedoms = 6;
  Vec3 p_SB{};             // [m] centre of mass in scene axes
  Mat3 inertia{};          // [kg m^2] body axes
  Mat3 inverse_inertia{};  // [1/(kg m^2)] pseudo-inverse for collinear shapes, zero for one point
  Vec3 line{};             // [-] unit vector of a collinear shape, else zero
  PlanPrincipal principal;
  Vec3 gravity_W{};           // [m/s^2]
  double attractor_mu = 0.0;  // [m^3/s^2] 0: no attractor   (THEORY 8.17)
  Vec3 attractor_W{};         // [m]
  // elastic modes
  std::int32_t num_elastic = 0;
  std::int32_t num_moving = 0;  // number of modes that the step advances: num_elastic padded to a multiple of
                                // kLanes
  // num_moving plus the constraint shapes, padded. The coordinates of constraint shapes stay zero, but their
  // Q is the load on the rigid links   (THEORY 5.6, 5.7)
  std::int32_t num_padded = 0;
  Array omega;  // [rad/s] (num_padded), padding 0
  Array decay;  // [1/s] (num_padded) minus the real part of the damped root   (THEORY 4.23)
  double frequency_accuracy = 0.0;  // [-]
  double conditioning = 0.0;        // [-]
  Propagator propagator;
  PlanModalCoupling modal_coupling;
  PlanCoupled coupled;
  Fidelity fidelity = Fidelity::kSeparated;
  bool has_spin_load = false;  // true: the centrifugal load acts on the modes (rung kSpinLoaded)
                               // (THEORY 8.16)
  // [kg m] (6 x num_padded) Y_l,ab = sum m_i r_i,a b_il,b for ab = xx, yy, zz, xy, xz, yz   (THEORY 8.15);
  // empty if there is neither spin load nor attractor
  Array field_rows;
  // points, links, groups
  std::vector<PlanPoint> points;
  std::vector<PlanLink> links;
  std::vector<PlanGroup> groups;
  PlanParticles particles;
  PlanWheels wheels;
  Array rows;  // [-] (3*num_row_blocks x num_padded) unit elastic displacements
  // (6 x num_padded) sum m b [kg], sum m r x b [kg m], zero except for rounding errors (THEORY 2.15)
  Array eckart_rows;
  Array link_rows;  // (num_link_rows x num_padded) forces of links per q, q' or Q
  std::vector<PlanLinkOutput> link_outputs;
  std::vector<std::vector<std::int32_t>> mechanisms;  // the points that each mechanism moves
  // loads
  std::vector<PlanHistory> histories;
  std::vector<PlanFeedback> feedbacks;
  double force_limit = 0.0, torque_limit = 0.0;  // [N], [N m] for one command; 0: no limit
  CommandLimits command_limits;
  // initial state and publication
  PlanInitial initial;
  double state_rate = 0.0, points_rate = 0.0, loads_rate = 0.0, status_rate = 0.0;  // [Hz]
  std::vector<std::int32_t> published_points;
  std::vector<std::int32_t> published_groups;
  // features that a plan may omit   (THEORY section 14)
  bool has_damping = true, has_gravity = true, has_rotation = true;  // false: omitted
  std::vector<PlanFeature> features;       // empty: not examined; every feature is kept
  double tolerance = 0.0;                  // [-] tolerance for omitting small modes
  double horizon = 0.0;                    // [s] simulated time over which the errors of omission were
                                           // estimated
  std::vector<std::int32_t> mode_numbers;  // (num_elastic) numbers in the scene, from 1; empty: all
  CommandScope scope;
  std::vector<PlanRung> tried_rungs;  // the rungs that `fidelity: auto` tried, cheapest first; the last one
                                      // was chosen
  PlanBudget budget;
  PlanUnmodelled unmodelled;
  // At most one plan. The state is stepped on it from the tick at which a command needs a feature that this
  // plan omits   (THEORY 14.16)
  std::vector<Plan> fallback;
  // (num_elastic) index of each mode in the fallback plan, ascending; empty without a fallback plan
  std::vector<std::int32_t> fallback_modes;
};

/// Holds a shadow: a better plan of the same scene, with all modes and all points, which makes `substeps`
/// steps in each tick of the plan that it accompanies.
struct PlanShadow {
  enum class Kind : std::int32_t {
    kBest = 0,  // the rung that best_rung_beside returns
    kFine = 1,  // the rung of the accompanied plan, at half its period or less
    kFull = 2,  // the rung and the period of the accompanied plan, with every mode
  };
  Kind kind = Kind::kBest;
  std::int32_t substeps = 1;
  Plan plan;
};

/// Returns a carrier of mass. An index below the number of points means a point, and an index from there on
/// means a particle.
inline const PlanPoint& mass_point(const Plan& plan, std::int32_t carrier) noexcept {
  const auto i = static_cast<std::size_t>(carrier);
  return i < plan.points.size() ? plan.points[i] : plan.particles.all[i - plan.points.size()];
}
/// Returns the index of a point in PlanParticles::attitude_points; -1 if its attitude is neither read nor
/// loaded.
inline std::int32_t attitude_index_of(const Plan& plan, std::int32_t point) noexcept {
  const auto& points = plan.particles.attitude_points;
  const auto found = std::lower_bound(points.begin(), points.end(), point);
  return found != points.end() && *found == point ? static_cast<std::int32_t>(found - points.begin()) : -1;
}
/// Returns the rows [1/m] (3 x num_padded) of the rotation theta = rows q of a body.
inline const double* rotation_rows(const Plan& plan, std::int32_t attitude_index) noexcept {
  return plan.particles.rotation_rows.data() + 3 * index(attitude_index) * index(plan.num_padded);
}
/// Returns the carriers of mass of a group, as indices for mass_point.
inline std::span<const std::int32_t> carriers_of_group(const Plan& plan, std::size_t group) noexcept {
  return plan.particles.of_groups.empty() ? plan.groups[group].points : plan.particles.of_groups[group];
}

/// Returns true on the rungs on which elastic motion acts back on the body.
inline bool is_coupled(const Plan& plan) noexcept { return traits_of(plan.fidelity).couples; }

}  // namespace freeflex
