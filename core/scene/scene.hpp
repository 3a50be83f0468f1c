// What a person describes: point masses, elastic links, loads, initial state, publication.
// Plain values; no file, no clock. The reader (service/io) fills it, build_structure checks its physics.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/command_limits.hpp"
#include "core/scene/products.hpp"
#include "core/words.hpp"

namespace freeflex {

/// Where a person wrote an item; source indexes Scene::sources, line and column count from 1 (0: unknown).
struct Origin {
  int source = -1;
  int line = 0;
  int column = 0;
};

/// One thing wrong with a person's input. Errors prevent a plan; warnings are said and kept going.
struct Fault {
  enum class Severity { kError, kWarning };
  Severity severity = Severity::kError;
  Origin origin{};
  std::string message;  // what was found, what is allowed, how to fix it
};
using Faults = std::vector<Fault>;

/// True when at least one fault is an error.
bool has_error(const Faults& faults);

/// A point mass (Alekseev 1970, section 1), or a body whose centre of mass is the point or beside it, or a
/// massless point that links hold.
struct PointMass {
  std::string name;
  double mass = 0.0;                                   // [kg] >= 0
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // [m] rest position, scene axes
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();    // [m] centre of mass from the point, scene axes
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();   // [kg m^2] about the centre of mass, scene axes
  Origin origin{};
};

/// How the mass of a link is spread over its points   (THEORY X164).
enum class MassSpread {
  kConsistent,  // by the shapes that the link deforms in
  kLumped,      // in equal parts on its points
  kMeanAxial,   // consistent across, along the mean of lumped and consistent
};

/// Axial spring between two points   (THEORY X44).
struct Spring {
  double stiffness = 0.0;  // [N/m] > 0
};

/// Bar between two points: axial stiffness EA / L, L the rest length   (THEORY X44).
struct Bar {
  double EA = 0.0;               // [N] > 0
  double mass_per_length = 0.0;  // [kg/m] >= 0
  MassSpread spread = MassSpread::kConsistent;
};

/// Beam in space between two points, rigidly joined to every other beam and plate there but for releases:
/// Euler- Bernoulli, or Timoshenko in a plane whose shear stiffness is given   (THEORY X45). Local x runs
/// from the first point to the second; local z = x cross y_axis, normalised.
struct Beam {
  double EA = 0.0;    // [N] > 0
  double GJ = 0.0;    // [N m^2] torsion, > 0
  double EI_y = 0.0;  // [N m^2] bending about local y (deflection along z), > 0
  double EI_z = 0.0;  // [N m^2] bending about local z (deflection along y), > 0
  Eigen::Vector3d y_axis = Eigen::Vector3d::Zero();  // [-] local y direction, scene axes; zero: chosen
  double GA_y = 0.0;  // [N] shear stiffness k G A for deflection along local y; 0: no shear deformation
  double GA_z = 0.0;  // [N] the same along local z
  // at each end, the rotations about local x, y, z that the joint does not hold
  std::array<std::array<bool, 3>, 2> released{};
  double mass_per_length = 0.0;  // [kg/m] >= 0; along the axis, without rotary inertia of the section
  MassSpread spread = MassSpread::kConsistent;
};

/// Resists the change of the angle at the middle one of three points; on a line, bending in both planes
/// (THEORY X60).
struct BendingSpring {
  double stiffness = 0.0;  // [N m/rad] > 0
};

/// Resists the change of the dihedral angle of four points, about the line of the middle two   (THEORY X61).
struct TorsionSpring {
  double stiffness = 0.0;  // [N m/rad] > 0
};

/// Thin isotropic triangular plate, membrane and bending   (THEORY X62).
struct Plate {
  double E = 0.0;                               // [Pa] > 0
  double nu = 0.0;                              // [-] Poisson's ratio, -1 < nu < 0.5
  double thickness = 0.0;                       // [m] > 0
  double density = 0.0;                         // [kg/m^3] >= 0
  MassSpread spread = MassSpread::kConsistent;  // not kMeanAxial
};

/// A matrix from elsewhere over the link's points, row 3*k+axis for points[k]   (THEORY X46, X63).
/// Stiffness [N/m], or flexibility [m/N]: displacements per force with the structure held in any statically
/// determinate way. A stiffness may be that of a superelement, with rotations, inner coordinates or mass
/// (THEORY X166).
struct MatrixLink {
  Eigen::SparseMatrix<double> matrix;  // (n x n), symmetric, full storage, n = 3 N_link but for what follows
  bool is_flexibility = false;
  bool has_rotations = false;          // row 6*k+axis, of axis 3 to 5 rotations [rad]
  int num_inner = 0;                   // coordinates of its own after those of its points, with a mass matrix
  Eigen::SparseMatrix<double> mass{};  // (n x n) [kg]; empty: none
};

/// True of one that is a superelement.
inline bool is_superelement(const MatrixLink& matrix) {
  return matrix.has_rotations || matrix.mass.size() > 0;
}

/// Rows of its matrices.
inline Eigen::Index num_rows(const MatrixLink& matrix, std::size_t num_points) {
  return (matrix.has_rotations ? 6 : 3) * static_cast<Eigen::Index>(num_points) + matrix.num_inner;
}

/// Keeps every distance within its points: a rigid link for two, a rigid body for more   (THEORY X64).
struct Rigid {};

/// Viscous dashpot between two points: tension = damping times the rate of elongation   (THEORY X65).
struct Dashpot {
  double damping = 0.0;  // [N s/m] > 0
};

/// The kinds of link. What each is, link_kinds.hpp says.
using LinkKind =
    std::variant<Spring, Bar, Beam, MatrixLink, BendingSpring, TorsionSpring, Plate, Rigid, Dashpot>;

/// One massless link.
// NOLINTNEXTLINE(bugprone-exception-escape): Eigen's sparse matrices copy where they might move
struct Link {
  std::string name;
  std::vector<int> points;  // indices into Scene::points: two, three, four or, matrix and rigid, two or more
  LinkKind kind;
  Origin origin{};
  // dissipation within the link; not for rigid links and dashpots
  double viscous =
      0.0;  // [s] force = stiffness (deformation + viscous * its rate); springs without rotations
  double loss_factor = 0.0;  // [-] structural: equivalent modal damping at each frequency   (THEORY X66)
  // of one written without a name, whose name is a number among all links, where it stands in its list: "2",
  // the third of a chain "2.3", "in row 4"
  std::string place = {};
};

/// A named set of points that takes wrenches and has a pose.
struct Group {
  std::string name;
  std::vector<int> points;
  Origin origin{};
};

/// Dissipation that shares the modes: zeta_l given per mode, plus Rayleigh's, alpha_R M + beta_R K   (THEORY
/// X53).
struct Damping {
  double modal_ratio = 0.0;                         // [-] every elastic mode
  std::vector<std::pair<int, double>> mode_ratios;  // (elastic mode from 1, ratio) overrides modal_ratio
  double alpha = 0.0;                               // [1/s]
  double beta = 0.0;                                // [s]
  Origin origin{};
};

/// A wheel that spins in a body about an axis fixed in it: its momentum about that axis, of the body and the
/// wheel together, less what the body's own inertia holds   (THEORY X167). The inertia of the body is that of
/// both but for the wheel's moment about its axis.
struct Wheel {
  std::string name;
  int point = -1;                                   // a body
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  // [-] unit vector, scene axes
  double momentum = 0.0;                            // [N m s] at the start
  Origin origin{};
};

struct PointLoad {
  int point = -1;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  // [N]
};
struct TorqueLoad {
  int point = -1;                                    // a body
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  // [N m]
};
struct WheelLoad {
  int wheel = -1;
  double torque = 0.0;  // [N m] of the motor, positive where it adds to the wheel's momentum
};
struct WrenchLoad {
  int group = -1;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   // [N] at the group's centre of mass
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  // [N m] about the group's centre of mass
};

/// Amplitude over the time since the epoch began, dimensionless; multiplies the load's forces.
struct ConstantHistory {};
struct PulseHistory {
  double start = 0.0;     // [s] rounded to a tick
  double duration = 0.0;  // [s] > 0, rounded to a tick
};
struct SineHistory {
  double frequency = 0.0;  // [Hz] > 0
  double phase = 0.0;      // [rad]
};
struct TableHistory {          // linear between rows, first and last values held outside
  std::vector<double> times;   // [s] strictly increasing
  std::vector<double> values;  // [-]
};
using History = std::variant<ConstantHistory, PulseHistory, SineHistory, TableHistory>;

/// A force history built into the scene.
struct Load {
  std::string name;
  Axes axes = Axes::kWorld;
  std::vector<PointLoad> forces;
  std::vector<WrenchLoad> wrenches;
  std::vector<TorqueLoad> torques;
  std::vector<WheelLoad> wheels;
  History history;
  Origin origin{};
};

/// Linear feedback of elastic motion: the force on `point` is gain times displacement, velocity and
/// acceleration of `sensor`, all in body axes   (THEORY X74). An actuator, an aerodynamic stiffness.
struct Feedback {
  std::string name;
  int point = -1;
  int sensor = -1;
  Eigen::Matrix3d displacement_gain = Eigen::Matrix3d::Zero();  // [N/m]
  Eigen::Matrix3d velocity_gain = Eigen::Matrix3d::Zero();      // [N s/m]
  Eigen::Matrix3d acceleration_gain = Eigen::Matrix3d::Zero();  // [N s^2/m]
  Origin origin{};
};

/// A body that attracts every point with mu / distance^2, and so turns and strains the structure   (THEORY
/// X72).
struct Attractor {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // [m] world axes
  double mu = 0.0;                                     // [m^3/s^2] > 0; 0: none
  Origin origin{};
};

/// Initial state. The scene's axes stand at position/attitude in the world at the start.
struct Initial {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();          // [m] of the scene's origin, world axes
  Eigen::Vector4d attitude{1.0, 0.0, 0.0, 0.0};                // [-] quaternion w x y z, scene to world
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          // [m/s] of the centre of mass, world axes
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  // [rad/s] body axes
  struct PointElastic {
    int point = -1;
    Eigen::Vector3d displacement = Eigen::Vector3d::Zero();  // [m] V_i, body axes
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();      // [m/s] V_i', body axes
  };
  std::vector<PointElastic> points;  // projected on the elastic modes; a rigid part is a warning
  struct ModeElastic {
    int mode = 0;        // elastic mode from 1
    double q = 0.0;      // [m]
    double q_dot = 0.0;  // [m/s]
  };
  std::vector<ModeElastic> modes;  // added to what points give
  Origin origin{};
};

/// What a plan may do without   (THEORY section 14).
struct LeaveOut {
  double tolerance = 0.0;  // [-] modes with a smaller share of what is asked for go; 0: none
  double horizon = 10.0;   // [s] > 0, simulated time over which that share and its error are judged
  OnNeed on_need = OnNeed::kKeep;
  std::array<bool, kNumParts> keeps{};  // by Part: stays whatever the scene needs
  Origin origin{};
};

/// What goes out and how often. A rate of 0 switches a channel off.
struct Publication {
  double state_rate = 50.0;   // [Hz]
  double points_rate = 50.0;  // [Hz]
  double loads_rate = 50.0;   // [Hz]
  double status_rate = 10.0;  // [Hz]
  std::vector<int> points;    // indices into Scene::points
  std::vector<int> links;     // indices into Scene::links
  std::vector<int> groups;    // indices into Scene::groups
};

/// The live error budget: how far the motion is from that of the best equations and a finer step (THEORY
/// X96).
struct ErrorBudget {
  double horizon = 0.0;  // [s] over which errors are counted before the comparison starts again; 0: none
  Origin origin{};
};

/// `fidelity: auto`: the cheapest rung within these over the horizon (THEORY X99).
struct AutomaticRung {
  std::optional<double> position, attitude, elastic;  // [m] rms, [rad], [-]; at least one
  double horizon = 0.0;                               // [s] > 0
  Origin origin{};
};

/// Which elastic modes are kept: the lowest. Without it all of them, of large scenes those that the rate
/// shows.
struct ModesAsked {
  double below = 0.0;  // [Hz] all below it; 0: by number
  int count = 0;       // the lowest, mechanisms among them; 0: by frequency
  Origin origin{};
  bool is_asked() const { return below > 0.0 || count > 0; }
};

struct Scene {
  std::string name;
  std::vector<std::string> sources;  // file names, as the person wrote them
  std::uint64_t hash = 0;            // XXH3 over the bytes of every source in order
  double rate = 1000.0;              // [Hz] ticks per second; period = 1 / rate
  std::vector<PointMass> points;
  std::vector<Link> links;
  std::vector<Group> groups;
  std::vector<Wheel> wheels;
  std::vector<Load> loads;
  Damping damping;
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  // [m/s^2] uniform, world axes
  Attractor attractor;
  Fidelity fidelity = Fidelity::kSeparated;  // with `automatic` the set-up chooses another
  std::optional<AutomaticRung> automatic;
  ErrorBudget error_budget;
  double tolerance = 0.0;  // [m] displacement that matters, against which errors are judged; 0: not stated
  std::vector<Feedback> feedbacks;
  ModesAsked modes;
  LeaveOut leave_out;
  Initial initial;
  Publication publication;
  std::vector<int> pushable;  // points that commands may name, indices into points
  double force_limit = 0.0;   // [N] largest |force| a command may put on a point or wrench; 0: none
  double torque_limit = 0.0;  // [N m] same for torques; 0: none
  CommandLimits command_limits;
};

}  // namespace freeflex
