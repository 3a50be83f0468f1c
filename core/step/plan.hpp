// The immutable plan: all that the step reads. Plain arrays; filled by core/plan, saved and loaded as bytes.
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
using Quat = std::array<double, 4>;  // w x y z, unit

/// y = (q, q') of each mode: y^1 = (C + L) y + w_0 Q^0 + w_1 (Q^1 - Q^0)   (THEORY X10).
/// C + L is the exact propagator: C its leading 26 bits, so that C times the leading 26 bits of y is exact,
/// L the rest rounded to double. kLanes modes side by side, in the order in which the step reads them, so
/// that it reads one stream and not twelve; padding is zero.
struct Propagator {
  struct alignas(64) Lanes {
    using Lane = std::array<double, kLanes>;
    Lane c_qq{}, c_qv{}, l_qq{}, l_qv{};  // [-], [s], low parts of the same
    Lane w_q0{}, w_q1{};                  // [m/N] weights of Q at the start, and of its change over the step
    Lane c_vq{}, c_vv{}, l_vq{}, l_vv{};  // [1/s], [-], low parts of the same
    Lane w_v0{}, w_v1{};                  // [m/(s N)]
  };
  std::vector<Lanes> lanes;  // (num_moving / kLanes); empty where damping is left out

  /// The same of modes without decay, whose c_vv and l_vv are c_qq and l_qq to the bit.
  struct alignas(64) UndampedLanes {
    using Lane = std::array<double, kLanes>;
    Lane c_qq{}, c_qv{}, l_qq{}, l_qv{};
    Lane w_q0{}, w_q1{};
    Lane c_vq{}, l_vq{};
    Lane w_v0{}, w_v1{};
  };
  std::vector<UndampedLanes> undamped;  // (num_moving / kLanes) where damping is left out, else empty
};

struct PlanPoint {
  std::string name;
  double mass = 0.0;      // [kg] 0: links hold it
  Vec3 r{};               // [m] rest position from the centre of mass, body axes
  std::int32_t row = -1;  // block of three rows in Plan::rows; -1: nobody reads or loads the point
  bool pushable = false;
};

struct PlanLink {
  std::string name;
  std::string kind;  // "spring", "bar", "beam", "matrix", "bending", "torsion", "plate", "rigid", "dashpot"
  std::vector<std::int32_t> points;  // empty for a matrix
};

/// A named group with its mass-weighted rigid weights: force F_g and torque T_g at its centre of mass
/// give F_i = m_i (F_g / mass + (inverse_inertia T_g) x d_i),  d_i = r_i - centre   (THEORY X12).
struct PlanGroup {
  std::string name;
  std::vector<std::int32_t> points;
  double mass = 0.0;             // [kg]
  Vec3 centre{};                 // [m] centre of mass from B, body axes
  Mat3 inverse_inertia{};        // [1/(kg m^2)] pseudo-inverse for collinear groups
  std::int32_t torque_rank = 3;  // 3; 2 collinear; 0 one point
  Vec3 line{};                   // [-] the axis about which a collinear group takes no torque
};

/// Where points are more than point masses, what their mass counts as   (THEORY X160). Empty: the points.
struct PlanParticles {
  std::vector<PlanPoint> all;  // of bodies, without names
  // (num_groups) what carries the mass of each group, for mass_point: points, and particles of its bodies
  std::vector<std::vector<std::int32_t>> of_groups;
  // points with an attitude that is read or loaded, ascending, and how they turn
  std::vector<std::int32_t> turning;
  Array turn_rows;  // [1/m] (3 num_turning x num_padded) theta = turn_rows q
};

/// A wheel in a body that turns   (THEORY X167).
struct PlanWheel {
  std::string name;
  std::int32_t turning = -1;  // index into PlanParticles::turning
  Vec3 axis{};                // [-] unit vector, body axes
  double momentum = 0.0;      // [N m s] at the start
  // [1/m^2] (pairs of PlanNeglect) axis . (theta_l x theta_u): what its momentum couples
  Array gyroscopic;
};
struct PlanWheels {
  std::vector<PlanWheel> all;
};
/// Torques of motors on wheels.
struct WheelTorques {
  std::vector<double> torque;  // [N m] (num_wheels), or empty: none
};

struct TorqueSums {
  std::vector<Vec3> W, B;  // [N m] (num_turning)
};
/// Forces summed per point that may be loaded and wrenches summed per group, in world and in body axes.
struct LoadSums {
  std::vector<Vec3> force_W, force_B;               // [N] (num_points on coupled rungs, else blocks of rows)
  std::vector<Vec3> group_force_W, group_torque_W;  // [N], [N m] (num_groups)
  std::vector<Vec3> group_force_B, group_torque_B;  // [N], [N m] (num_groups)
  TorqueSums torque;
  WheelTorques wheels;
};
/// The same with the points that may be loaded, ascending: every point on coupled rungs, else those with
/// rows.
struct SumsOnPoints : LoadSums {
  std::vector<std::int32_t> points;
};

/// Spatial part of a load, built once when it changes (THEORY X11). Arrays have capacity from the start.
/// World part turns with the body: Q_l = sum_ab R_WB,ba Q_l,ab, or directly from few points.
struct LoadPattern {
  static constexpr int kMaxDirect = 3;
  Vec3 force_W{};  // [N] resultant
  std::array<double, 27>
      moment_W{};  // [N m] L_c,ab at 9c+3a+b: L_B,c = sum_ab R_WB,ba L_c,ab, about the centre of mass
  bool has_world = false;
  std::int32_t num_direct = 0;                        // points kept one by one; 0 with uses_table
  std::array<std::int32_t, kMaxDirect> direct_row{};  // block of rows
  std::array<Vec3, kMaxDirect> direct_force_W{};      // [N]
  bool uses_table = false;
  Array table;      // [N] (9 x num_padded) Q_l,ab in row 3a+b: sum_i b_il,a F_i,b
  Vec3 force_B{};   // [N] resultant of the body-axis part
  Vec3 torque_B{};  // [N m] its moment about the centre of mass
  bool has_body = false;
  Array Q_B;  // [N] (num_padded)
  WheelTorques wheels;
  LoadSums sums;  // on coupled rungs: what the above is made of; else empty
};

/// A force that turns with the elastic rotation at its point: what it differs by from the same force in body
/// axes is theta x f, f the force_B   (THEORY X73).
struct PlanFollower {
  std::int32_t row = -1;  // block of rows of the point
  Vec3 r{};               // [m] rest position of the point
  Vec3 force_B{};         // [N] at amplitude 1
  Array turn_rows;        // [1/m] (3 x num_padded) theta = turn_rows q
};

/// A torque that turns with its body, as PlanFollower.
struct PlanTorque {
  std::int32_t turning = -1;  // index into PlanParticles::turning
  Vec3 torque_B{};            // [N m] at amplitude 1
};
struct PlanTorques {
  std::vector<PlanTorque> all;
};

/// What the internal forces of a load's followers add to the stiffness at amplitude 1: Q -= amplitude * E q
/// (THEORY X145).
struct PlanStiffening {
  std::vector<std::int32_t> modes;
  Array rows;  // [N/m] (modes x modes) E
};

/// Amplitude of a built-in load over ticks since the epoch began (THEORY X13).
struct PlanHistory {
  enum class Kind : std::int32_t { kConstant = 0, kPulse = 1, kSine = 2, kTable = 3 };
  std::string name;
  Kind kind = Kind::kConstant;
  double pulse_start = 0.0, pulse_duration = 0.0;  // [s] as given
  std::int64_t start_tick = 0, end_tick = 0;       // pulse: on for start <= tick < end
  double frequency = 0.0, phase = 0.0;             // [Hz], [cycles]
  std::vector<double> times, values;               // [s], [-]
  LoadPattern pattern;
  std::vector<PlanFollower> followers;
  PlanTorques torques;  // that follow
  PlanStiffening stiffening;
};

/// Force of linear feedback on a point, body axes: f = F_q q + F_v q' + F_Q Q   (THEORY X74).
struct PlanFeedback {
  std::string name;
  std::int32_t row = -1;  // block of rows of the point it acts on
  Vec3 r{};               // [m] rest position of that point
  Array q_rows, q_dot_rows,
      Q_rows;  // [N/m], [N s/m], [-] (3 x num_padded); Q_rows empty without acceleration gain
};

/// What keeps the modes from being independent: dashpots and feedback   (THEORY X75, X76).
struct PlanMixing {
  enum class Path : std::int32_t {
    kNone = 0,
    kExact = 1,  // X75: the mixed modes by their own exponential
    kSplit = 2,  // X76: half a kick, the modes, half a kick; order 2
  };
  Path path = Path::kNone;
  Array damping_rows;  // [sqrt(N s/m)] (num_damping x num_padded) R: force of the dashpots -R^T R q'
  std::int32_t num_damping = 0;
  // exact: (q, q') of the mixed modes = sum of columns times (q, q', Q^0, Q^1 - Q^0)
  std::vector<std::int32_t> modes;  // mixed modes, ascending
  // [-], [s], [1/s], [m/N], [m/(s N)] (4 num_modes columns of pad(2 num_modes)) column-major
  Array columns;
  static constexpr int kLoadRows = 16;  // twelve, padded to kLanes
  // likewise, what feedback does to the body over the step: force and torque at its start, then at its end,
  // of loads linear in time with the same impulse and first moment; empty without feedback
  Array load_columns;  // [N], [N m] per (m, m/s, N, N) (4 num_modes columns of kLoadRows) column-major
  // split: q' += out^T (q_rows q + q_dot_rows q') over half a step
  std::int32_t num_kicks = 0;
  Array kick_q_rows, kick_q_dot_rows, kick_out;  // (num_kicks x num_padded)
};

/// A spring, bar or dashpot whose force is taken at true length and direction   (THEORY X94).
struct PlanBar {
  std::int32_t link = -1;                // index into Plan::links; bars stand in this order
  std::int32_t first = -1, second = -1;  // points
  double stiffness = 0.0;                // [N/m] 0 for a dashpot
  double damping = 0.0;                  // [N s/m] force by rate of elongation
  double length = 0.0;                   // [m] rest length
  Vec3 direction{};                      // [-] rest direction, first to second point
};

/// A body that wrenches load, by forces on its particles, as it turns   (THEORY X197).
struct PlanTurn {
  std::int32_t first = 0, count = 0;  // its particles, in PlanParticles::all
  Vec3 centre{}, offset{};            // [m] rest position of its centre; that from its point
  Array rows;                         // [1/m] (3 x num_padded) theta = rows q
};

/// A body whose centre is beside its point, which moves at second order of its turn   (THEORY X198).
struct PlanOffset {
  double mass = 0.0;  // [kg]
  Vec3 offset{};      // [m] of its centre
  Array rows;         // [1/m] (3 x num_padded) theta = rows q
};

/// How the coupled rungs have the kinetic energy, and how loads act as bodies turn   (THEORY X190 to X197).
struct PlanKinetics {
  enum class Form : std::int32_t {
    kComplete = 0,  // X92: point masses with every mode
    kPoints = 1,    // X191: some modes, by sums over point masses
    kTables = 2,    // X194: some modes, or bodies, by sums over pairs of modes
  };
  Form form = Form::kComplete;
  Array moments;                // [kg m] (6 x num_padded) Y_l,ab for ab = xx, yy, zz, xy, xz, yz
  std::int32_t num_tables = 0;  // 9: X_kl, Z_kl; 12 where bodies turn: and G_kl
  // [kg] (num_moving x num_tables x num_padded), mode k, then X_kl,a for x, y, z, Z_kl,ab as above, G_kl,a
  Array tables;
  std::vector<PlanTurn> turns;  // of every particle, in their order
  std::vector<PlanOffset> offsets;
};
inline constexpr std::int32_t kPointTables = 9, kBodyTables = 12;  // PlanKinetics::num_tables

/// What the coupled rungs need beside the rest; empty below them   (THEORY X92, X93).
struct PlanCoupled {
  /// Functions of one mode's own linear motion L over a step: each is a 2 x 2 matrix on (q, p), in the order
  /// of Entry. `kStep` less the unit matrix, so that slow modes keep their digits.
  enum Function { kHalfStep, kHalf1, kHalf2, kStep, kWhole1, kWhole2, kWhole3, kNumFunctions };
  enum Entry { kQq, kQv, kVq, kVv, kNumEntries };
  Array functions;  // (4 kNumFunctions x num_padded), row 4 * function + entry; of a part of the step
  std::vector<PlanBar> bars;
  double part_phase =
      0.0;  // [rad] the fastest rate times a part of the step, at most; 0: the step is not divided
  std::int32_t num_parts = 1;  // of a step, a power of two, so that the time of a part is exact   (X100)
  PlanKinetics kinetics;
};

/// Output rows for one published link: force = rows q + rate rows q' + load rows Q, each in
/// Plan::link_rows.
struct PlanLinkOutput {
  std::int32_t link = -1;            // index into Plan::links
  std::int32_t num_rows = 1;         // values, see LinkForceRows
  std::int32_t first_row = 0;        // of q
  std::int32_t first_rate_row = -1;  // of q'; -1: none
  std::int32_t first_load_row = -1;  // of Q; -1: none
};

struct PlanInitial {
  Vec3 p_WB{};  // [m]
  Vec3 v_WB{};  // [m/s]
  Quat q_WB{1.0, 0.0, 0.0, 0.0};
  Vec3 w_WB_B{};  // [rad/s]
  Array q;        // [m] (num_padded)
  Array q_dot;    // [m/s] (num_padded)
};

/// One part of a plan: kept, or left out and why, and what that may change beyond rounding   (THEORY X124).
struct PlanPart {
  Part part = Part::kDamping;
  bool is_left_out = false;
  std::int32_t count = 0;  // modes or points concerned
  std::string why;
  // built-in loads and initial state, within the horizon
  double error = 0.0;       // [m] on the elastic displacement of any point that is read or pushed
  double share = 0.0;       // [-] of the largest such displacement
  double link_error = 0.0;  // [N], [N m] on any published force of a link
  // commands: times the force that stands on a pushable point and the sum of its changes
  double error_per_force = 0.0;       // [m/N]
  double share_per_force = 0.0;       // [-] of the static displacement under that force
  double link_error_per_force = 0.0;  // [-], [m]
};

/// What commands may not do, because the plan leaves out what that needs   (THEORY X121, X122).
struct CommandScope {
  bool lacks_rotation = false;
  bool lacks_out_of_plane = false;
  Vec3 normal_B{};  // [-] of a planar shape
  Mat3 R_WB{};      // [-] attitude at the start, which stays but for turns about the normal
};

/// What a rung came to when `fidelity: auto` tried it over a horizon: the largest estimates   (THEORY X99).
struct PlanRung {
  Fidelity rung = Fidelity::kRigid;
  double position = 0.0, attitude = 0.0, elastic = 0.0;  // [m] rms, [rad], [-]
  bool is_finite = false;                                // false: it left the numbers
  bool meets = false;                                    // every tolerance asked for
};

struct PlanShadow;

/// The live error budget: what steps beside the state   (THEORY X96). Empty: none.
struct PlanBudget {
  double horizon = 0.0;            // [s] after which the shadows start again from the state; 0: no budget
  std::int64_t horizon_ticks = 0;  // the same, at least 1
  std::vector<PlanShadow> shadows;
};

inline constexpr std::int32_t kMostShadowedModes = 32;  // of PlanNeglect

/// Torque of loads on displaced points per elastic coordinate, 27 numbers of the world part as
/// LoadPattern::moment_W, then 3 of the body part.
inline constexpr std::size_t kArmSize = 30;

/// Modes that a plan does not have, and what they carry. The numbers stand in plan files.
enum class LacksModes : std::uint8_t {
  kNone = 0,
  kSmallOnes = 1,  // small ones are left out: what they would have done is known
  kNotKept = 2,    // the set-up found the lowest alone: nothing of the others is known
};

/// What accelerations do to bodies that turn, on rungs that lack it, and what is inside of superelements
/// (THEORY X143, X198).
struct PlanBodyNeglect {
  Array push_rows;  // [kg] (pairs x 6) stiffness per acceleration and per angular acceleration; or empty
  double inner_load = 0.0;  // [m s^2] displacement per square of the spin that inner masses may have
  // [-] (judged) how much more than a free beam a mode moves points of links whose inside nothing tells;
  // empty without such links
  Array unseen_factor;
  Array load_sizes;  // [N] (histories) size_of_forces of each; empty without such links
};

/// Fourth order of the strain energy among the first modes: V_4 = 1/8 sum_r (x^T H_r x)^2   (THEORY X146).
struct PlanQuartic {
  Array forms;  // [sqrt(N)/m^2] (forms x num_shadowed x num_shadowed) symmetric; empty: of an old plan file
};

/// What messages about a verdict name. Links of which no table tells how they carry forces inside are
/// matrices, rigid links, plates and links with mass. Empty in plan files of version 7 and before.
struct PlanNamed {
  // (judged) of those links the one whose points the mode moves most, an index into Plan::links; -1: none
  std::vector<std::int32_t> links;
  // the modes of PlanNeglect::left_out_rows: their numbers in the scene, from 1, and frequencies [Hz]
  std::vector<std::int32_t> left_out;
  std::vector<double> left_out_frequency;
};

/// What the rung neglects of the motion: nothing that steps it, but what judges it   (THEORY X140, X141).
/// Products of the spin stand in the order xx, yy, zz, xy, xz, yz of w w^T.
struct PlanNeglect {
  bool is_known = false;    // false: of a plan file without these tables
  bool is_rigid = false;    // nothing deforms, though the scene's links would
  bool has_unseen = false;  // links whose second order nothing tells: matrices, rigid links
  LacksModes lacks_modes = LacksModes::kNone;
  double tolerance = 0.0;                          // [m] of the scene; 0: none
  double left_out = 0.0;                           // [m] rms over all points of small modes that are left out
  std::vector<std::int32_t> fast_loads;            // histories that change faster than ticks follow
  std::int32_t num_judged = 0;                     // pairs (l, l), which come first
  std::vector<std::array<std::int32_t, 2>> pairs;  // modes of this plan
  Array load_rows;  // [N/m^2] (pairs x num_elastic) stiffness per static elastic coordinate
  Array rate_rows;  // [N s/m^2] (pairs x num_elastic) stiffness per rate of one; empty where nothing damps
  Array spin_rows;  // [N s^2/m] (pairs x 6) stiffness per product of the spin
  Array coriolis_rows;  // [-] (pairs x 3) sum m b_l x b_u / M; zero for (l, l)
  Array root_quartic;   // [sqrt(N/m^3)] (judged) root of the stiffness per square of the own displacement
  // the first modes, whose error is integrated: third derivatives of the strain energy along pairs a <= b and
  // a third mode, half of them where a is b   (THEORY X147)
  std::int32_t num_shadowed = 0;
  // [kg m] (num_shadowed x 6) centrifugal load per product of the spin; its derivative by the spin is the
  // momentum that a mode adds to it   (THEORY X148)
  Array inertia_rows;
  Array load_arms;    // [N] (histories x num_shadowed x kArmSize) set_arms of each
  Array shadow_rows;  // [N/m^2] (num_shadowed (num_shadowed + 1) / 2 x num_shadowed)
  // [s^2] (judged x 6) square of the share of a ringing mode that Coriolis forces put into others, per
  // product of the spin; empty on rungs that have them
  Array coriolis_reach;
  // of the lowest modes that are left out, [-] what they lose or gain of their stiffness, each over its own
  Array left_out_rows;  // [1/m] (left out x num_elastic) per static elastic coordinate
  Array left_out_spin;  // [s^2] (left out x 6) per product of the spin
  // centrifugal load; both empty on rungs that have it
  Array spin_loads;     // [kg m] (num_elastic x 6)
  Array spin_left_out;  // [m^2 s^4] (6 x 6) square of the static answer of modes left out, per two products
  PlanBodyNeglect bodies;
  PlanQuartic quartic;
  PlanNamed named;
};

/// The axes in which the inertia is diagonal   (THEORY X200). They follow from Plan::inverse_inertia, and
/// plan files do not have them: set_principal.
struct PlanPrincipal {
  Mat3 R_PB{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};  // [-] their directions in its rows, body axes
  Vec3 inverse_moment{};  // [1/(kg m^2)] about each, the largest first; zero where the body has no spin
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
  double attractor_mu = 0.0;  // [m^3/s^2] 0: none   (THEORY X72)
  Vec3 attractor_W{};         // [m]
  // elastic modes
  std::int32_t num_elastic = 0;
  std::int32_t num_moving = 0;  // elastic modes padded to kLanes: what the step advances
  // num_moving and the constraint shapes, padded: their coordinates stay zero, their Q is what rigid links
  // carry (X67)
  std::int32_t num_padded = 0;
  Array omega;                      // [rad/s] (num_padded), padding 0
  Array decay;                      // [1/s] (num_padded) real part of the damped root   (THEORY X53)
  double frequency_accuracy = 0.0;  // [-]
  double conditioning = 0.0;        // [-]
  Propagator propagator;
  PlanMixing mixing;
  PlanCoupled coupled;
  Fidelity fidelity = Fidelity::kSeparated;
  bool has_spin_load = false;  // centrifugal load, on the rung of that name   (THEORY X70)
  // [kg m] (6 x num_padded) Y_l,ab = sum m_i r_i,a b_il,b for ab = xx, yy, zz, xy, xz, yz; empty without spin
  // load and attractor
  Array field_rows;
  // points, links, groups
  std::vector<PlanPoint> points;
  std::vector<PlanLink> links;
  std::vector<PlanGroup> groups;
  PlanParticles particles;
  PlanWheels wheels;
  Array rows;         // [-] (3*num_row_blocks x num_padded) unit elastic displacements
  Array eckart_rows;  // (6 x num_padded) sum m b [kg], sum m r x b [kg m]: zero but for rounding
  Array link_rows;    // (num_link_rows x num_padded) forces of links per q, q' or Q
  std::vector<PlanLinkOutput> link_outputs;
  std::vector<std::vector<std::int32_t>> mechanisms;  // moved points of each
  // loads
  std::vector<PlanHistory> histories;
  std::vector<PlanFeedback> feedbacks;
  double force_limit = 0.0, torque_limit = 0.0;  // 0: none
  CommandLimits command_limits;
  // initial state and publication
  PlanInitial initial;
  double state_rate = 0.0, points_rate = 0.0, loads_rate = 0.0, status_rate = 0.0;  // [Hz]
  std::vector<std::int32_t> published_points;
  std::vector<std::int32_t> published_groups;
  // what is left out   (THEORY section 14)
  bool damps = true, falls = true, turns = true;  // false: damping, gravity, rotation is left out
  std::vector<PlanPart> parts;                    // empty: nothing was judged, everything is kept
  double tolerance = 0.0;                         // [-] of small modes
  double horizon = 0.0;                           // [s] over which their errors were judged
  std::vector<std::int32_t> mode_numbers;         // (num_elastic) from 1, of the scene's modes; empty: all
  CommandScope scope;
  std::vector<PlanRung> tried_rungs;  // with `fidelity: auto`, cheapest first; the last was taken
  PlanBudget budget;
  PlanNeglect neglect;
  // none or one: the plan that is stepped from the tick at which a command needs a part left out here
  std::vector<Plan> wide;
  std::vector<std::int32_t> wide_modes;  // (num_elastic) index in the wide plan, ascending; empty without one
};

/// A better plan of the same scene, all modes and all points in it, that makes `substeps` steps a tick.
struct PlanShadow {
  enum class Kind : std::int32_t {
    kBest = 0,   // the plan's own rung where that has the true geometry, else exact-bars
    kFine = 1,   // the plan's own rung at half the period or less
    kWhole = 2,  // the plan's own rung and period, no mode left out
  };
  Kind kind = Kind::kBest;
  std::int32_t substeps = 1;
  Plan plan;
};

/// What carries mass: a point, or, from the number of points on, a particle.
inline const PlanPoint& mass_point(const Plan& plan, std::int32_t part) noexcept {
  const auto i = static_cast<std::size_t>(part);
  return i < plan.points.size() ? plan.points[i] : plan.particles.all[i - plan.points.size()];
}
/// Where a point stands among those that turn; -1: it has no attitude that anybody asked for.
inline std::int32_t turning_of(const Plan& plan, std::int32_t point) noexcept {
  const auto& turning = plan.particles.turning;
  const auto found = std::lower_bound(turning.begin(), turning.end(), point);
  return found != turning.end() && *found == point ? static_cast<std::int32_t>(found - turning.begin()) : -1;
}
/// The three rows of one that turns.
inline const double* turn_rows(const Plan& plan, std::int32_t turning) noexcept {
  return plan.particles.turn_rows.data() + 3 * index(turning) * index(plan.num_padded);
}
inline std::span<const std::int32_t> parts_of_group(const Plan& plan, std::size_t group) noexcept {
  return plan.particles.of_groups.empty() ? plan.groups[group].points : plan.particles.of_groups[group];
}

/// True on the rungs where elastic motion acts back on the body.
inline bool is_coupled(const Plan& plan) noexcept { return traits_of(plan.fidelity).couples; }

}  // namespace freeflex
