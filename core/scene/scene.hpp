// The scene that a person describes. It contains point masses, elastic links, loads, initial state and
// publication. The scene contains plain values and uses neither files nor a clock. The reader (service/io)
// fills the scene, and build_structure checks the physics.
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
#include "core/faults.hpp"
#include "core/index.hpp"
#include "core/scene/products.hpp"
#include "core/words.hpp"

namespace freeflex {

/// A set of cases for std::visit, one for each alternative of a variant.
template <class... Functions>
struct Cases : Functions... {
  using Functions::operator()...;
};
template <class... Functions>
Cases(Functions...) -> Cases<Functions...>;

/// Holds one of three things: a point mass (Alekseev 1970, section 1), a body whose centre of mass is at the
/// point or at an offset from it, or a massless point that links hold.
struct PointMass {
  std::string name;
  double mass = 0.0;                                   // [kg] >= 0
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // [m] rest position, scene axes
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();    // [m] centre of mass from the point, scene axes
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();   // [kg m^2] about the centre of mass, scene axes
  Origin origin{};
};

/// Distribution of the mass of a link   (THEORY 16.10 to 16.12).
enum class MassDistribution {
  kConsistent,  // consistent mass matrix, from the deformation shapes of the link
  kLumped,      // lumped mass: place_lumped_masses() moves it to the points of the link, in equal parts
  kMeanAxial,   // for motion across the link the consistent mass matrix, for motion along the link the mean
                // of the lumped and the consistent mass matrix
};

/// Axial spring between two points   (THEORY 3.3).
struct Spring {
  double stiffness = 0.0;  // [N/m] > 0
};

/// Bar between two points with axial stiffness EA / L, where L is the rest length   (THEORY 3.3).
struct Bar {
  double EA = 0.0;               // [N] > 0
  double mass_per_length = 0.0;  // [kg/m] >= 0
  MassDistribution mass_distribution = MassDistribution::kConsistent;
};

/// A beam in space between two points. At each end it is rigidly joined to every other beam and plate at this
/// point, except for the rotations in `released`. In each plane it is a Timoshenko beam if a shear stiffness
/// is given, else an Euler-Bernoulli beam (THEORY 3.4 to 3.10). Local x runs from the first point to the
/// second, and local z = x cross y_axis, normalised.
struct Beam {
  double EA = 0.0;    // [N] > 0
  double GJ = 0.0;    // [N m^2] torsion, > 0
  double EI_y = 0.0;  // [N m^2] bending about local y (deflection along z), > 0
  double EI_z = 0.0;  // [N m^2] bending about local z (deflection along y), > 0
  Eigen::Vector3d y_axis = Eigen::Vector3d::Zero();  // [-] local y direction, scene axes; zero: automatic
  double GA_y = 0.0;  // [N] shear stiffness k G A for deflection along local y; 0: no shear deformation
  double GA_z = 0.0;  // [N] shear stiffness for deflection along local z; 0: no shear deformation
  // true: the joint releases the rotation about local x, y or z; one row for each end
  std::array<std::array<bool, 3>, 2> released{};
  double mass_per_length = 0.0;  // [kg/m] >= 0; along the axis, without rotary inertia of the section
  MassDistribution mass_distribution = MassDistribution::kConsistent;
};

/// Spring that resists a change of the angle at the middle point of three. If the points are on a line, the
/// spring resists bending in both planes   (THEORY 3.23 to 3.25).
struct BendingSpring {
  double stiffness = 0.0;  // [N m/rad] > 0
};

/// Spring that resists a change of the dihedral angle of four points, which is measured about the line
/// through the two middle points   (THEORY 3.26, 3.27).
struct TorsionSpring {
  double stiffness = 0.0;  // [N m/rad] > 0
};

/// Thin isotropic triangular plate with membrane and bending stiffness   (THEORY 3.28 to 3.37).
struct Plate {
  double E = 0.0;                                                      // [Pa] > 0
  double nu = 0.0;                                                     // [-] Poisson's ratio, -1 < nu < 0.5
  double thickness = 0.0;                                              // [m] > 0
  double density = 0.0;                                                // [kg/m^3] >= 0
  MassDistribution mass_distribution = MassDistribution::kConsistent;  // not kMeanAxial
};

/// A link that is given by a matrix over the displacements of its points. Row 3*k+axis belongs to points[k]
/// (THEORY 3.11 to 3.14, 3.38, 3.39). The matrix is a stiffness matrix [N/m], or a flexibility matrix [m/N],
/// whose entries are displacements per force of the link on any statically determinate supports. A stiffness
/// matrix may describe a superelement with rotations, inner coordinates or mass   (THEORY 16.17).
struct MatrixLink {
  Eigen::SparseMatrix<double> matrix;  // (n x n), symmetric, full storage; n = num_rows()
  bool is_flexibility = false;
  bool has_rotations = false;          // true: row 6*k+axis belongs to points[k]; axes 3 to 5 are rotations
                                       // [rad]
  int num_inner = 0;                   // number of inner coordinates, in the last rows; > 0 requires a mass
                                       // matrix
  Eigen::SparseMatrix<double> mass{};  // (n x n) [kg]; empty: no mass
};

/// Returns whether the link is a superelement, that is, has rotations or a mass matrix.
inline bool is_superelement(const MatrixLink& matrix) {
  return matrix.has_rotations || matrix.mass.size() > 0;
}

/// Returns the number of rows of the matrices of a link.
inline Eigen::Index num_rows(const MatrixLink& matrix, std::size_t num_points) {
  return (matrix.has_rotations ? 6 : 3) * static_cast<Eigen::Index>(num_points) + matrix.num_inner;
}

/// A link that keeps all distances between its points. With two points it is a rigid link, with three or more
/// points a rigid body (THEORY 3.40, 3.41).
struct Rigid {};

/// A viscous dashpot between two points, with tension = damping * rate of elongation   (THEORY 3.45).
struct Dashpot {
  double damping = 0.0;  // [N s/m] > 0
};

/// The kinds of link. The header link_kinds.hpp defines the traits of each kind.
using LinkKind =
    std::variant<Spring, Bar, Beam, MatrixLink, BendingSpring, TorsionSpring, Plate, Rigid, Dashpot>;

/// One link.
// NOLINTNEXTLINE(bugprone-exception-escape): Eigen's sparse matrices copy where they might move
struct Link {
  std::string name;
  // Indices into Scene::points. A rigid link or a matrix has two or more points, a superelement one or more.
  // Each other kind has a fixed number of points: two, three or four
  std::vector<int> points;
  LinkKind kind;
  Origin origin{};
  // `viscous` and `loss_factor` give the dissipation within the link. Both are zero for rigid links and
  // dashpots.
  //
  // [s] force = stiffness (deformation + viscous * rate of deformation); only for links without rotations
  // (THEORY 3.46)
  double viscous = 0.0;
  double loss_factor = 0.0;  // [-] structural damping, converted to modal damping at the frequency of each
                             // mode   (THEORY 4.24)
  // position in the source list, used in messages about a link without a name: "2", "2.3" (third link of a
  // chain), "in row 4"
  std::string label = {};
};

/// A set of points with a name. Wrenches act on the set, and its pose is published.
struct Group {
  std::string name;
  std::vector<int> points;
  Origin origin{};
};

/// Damping that does not couple modes: damping ratios of modes, and Rayleigh damping, which is `alpha` times
/// the mass matrix plus `beta` times the stiffness matrix (THEORY 4.23).
struct Damping {
  double modal_ratio = 0.0;                         // [-] damping ratio of every elastic mode
  std::vector<std::pair<int, double>> mode_ratios;  // (elastic mode from 1, ratio); overrides modal_ratio
  double alpha = 0.0;                               // [1/s]
  double beta = 0.0;                                // [s]
  Origin origin{};
};

/// A wheel that spins in a body about an axis fixed in the body. The momentum of the wheel is the angular
/// momentum of body and wheel together about that axis, minus the inertia of the body times its angular
/// velocity   (THEORY 16.21). The inertia of the body includes that of the wheel, except the moment of
/// inertia of the wheel about its axis.
struct Wheel {
  std::string name;
  int point = -1;                                   // a body
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  // [-] unit vector, scene axes
  double momentum = 0.0;                            // [N m s] momentum at the start
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
  double torque = 0.0;  // [N m] torque of the motor; positive: increases the momentum of the wheel
};
struct WrenchLoad {
  int group = -1;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   // [N] at the group's centre of mass
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  // [N m] about the group's centre of mass
};

/// Histories: the factor [-] by which the loads of a Load are multiplied, as a function of the time since the
/// start of the epoch.
struct ConstantHistory {};
struct PulseHistory {
  double start = 0.0;     // [s] rounded to a tick
  double duration = 0.0;  // [s] > 0, rounded to a tick
};
struct SineHistory {
  double frequency = 0.0;  // [Hz] > 0
  double phase = 0.0;      // [rad]
};
struct TableHistory {          // linear between rows; constant before the first row and after the last row
  std::vector<double> times;   // [s] strictly increasing
  std::vector<double> values;  // [-]
};
using History = std::variant<ConstantHistory, PulseHistory, SineHistory, TableHistory>;
/// Returns the pulse if a history is one, otherwise nullptr.
inline const PulseHistory* pulse_of(const History& history) { return std::get_if<PulseHistory>(&history); }

/// A built-in load: forces, wrenches and torques, all multiplied by one history.
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

/// Linear feedback of elastic motion, such as an actuator or an aerodynamic stiffness. The force on `point`
/// is the sum of the gains times the elastic displacement, velocity and acceleration of the point `sensor`,
/// all in body axes   (THEORY 8.26).
struct Feedback {
  std::string name;
  int point = -1;
  int sensor = -1;
  Eigen::Matrix3d displacement_gain = Eigen::Matrix3d::Zero();  // [N/m]
  Eigen::Matrix3d velocity_gain = Eigen::Matrix3d::Zero();      // [N s/m]
  Eigen::Matrix3d acceleration_gain = Eigen::Matrix3d::Zero();  // [N s^2/m]
  Origin origin{};
};

/// A celestial body that gives every point the acceleration mu / distance^2 towards it   (THEORY 8.17).
struct Attractor {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // [m] world axes
  double mu = 0.0;                                     // [m^3/s^2] > 0; 0: no attractor
  Origin origin{};
};

/// Initial state. `position` and `attitude` describe the scene axes in the world at the start.
struct Initial {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();          // [m] position of the scene's origin, world
                                                               // axes
  Eigen::Vector4d attitude{1.0, 0.0, 0.0, 0.0};                // [-] quaternion w x y z, scene to world
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          // [m/s] velocity of the centre of mass, world
                                                               // axes
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  // [rad/s] body axes
  struct PointElastic {
    int point = -1;
    Eigen::Vector3d displacement = Eigen::Vector3d::Zero();  // [m] V_i, body axes
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();      // [m/s] V_i', body axes
  };
  std::vector<PointElastic> points;  // projected on the elastic modes; a rigid part is removed with a warning
  struct ModeElastic {
    int mode = 0;        // elastic mode from 1
    double q = 0.0;      // [m]
    double q_dot = 0.0;  // [m/s]
  };
  std::vector<ModeElastic> modes;  // coordinates of single modes, added to the projection of `points`
  Origin origin{};
};

/// Conditions under which a plan omits features that the scene does not need (THEORY section 14).
struct LeaveOut {
  // [-] modes with a smaller relative effect on the outputs are omitted; 0: no mode is omitted
  double tolerance = 0.0;
  double horizon = 10.0;  // [s] > 0, simulated time over which the effect of a mode and the error of its
                          // omission are evaluated
  OnNeed on_need = OnNeed::kKeep;
  // This array has one entry for each Feature. The entry is true if the feature is kept even if the scene
  // does not need it
  std::array<bool, kNumFeatures> keeps{};
  Origin origin{};
};

/// Published items and their rates.
struct Publication {
  ChannelRates rates = default_rates();
  double status_rate = 10.0;  // [Hz]
  std::vector<int> points;    // indices into Scene::points
  std::vector<int> links;     // indices into Scene::links
  std::vector<int> groups;    // indices into Scene::groups
};

/// Says how a motion is judged: by its distance from the same motion on a better plan   (THEORY section 15).
struct VerdictAsked {
  bool is_off = false;
  // [s] length of a horizon, of which one in several is judged if the better plan would take more than its
  // share; 0: 10 s, or 2 s if not all horizons are judged
  double horizon = 0.0;
  double share = 0.2;  // [-] from 0.001 to 1, of a processor that the better plan may take
  double step = 0.0;   // [s] longest step of the better plan; 0: 10 ms, or less for fast structures
  Origin origin{};
};

/// Limits for `fidelity: auto`, which chooses the cheapest rung whose estimated errors stay below these
/// limits over the horizon   (THEORY 12.28).
struct AutomaticRung {
  std::optional<double> position, attitude, elastic;  // [m] rms, [rad], [-]; at least one is given
  double horizon = 0.0;                               // [s] > 0
  Origin origin{};
};

/// Limits on the elastic modes that are kept, by frequency or by number. By default all modes are kept. In
/// large scenes, by default the modes below half the tick rate are kept, at most kModesByDefault.
struct ModesAsked {
  double below = 0.0;  // [Hz] modes below this frequency are kept; 0: no limit by frequency
  int count = 0;       // number of the lowest modes, including mechanisms; 0: no limit by number
  Origin origin{};
  bool is_asked() const { return below > 0.0 || count > 0; }
};

/// Specifies what the rungs with true geometry integrate.
enum class IntegrateBy { kAuto = 0, kModes = 1, kPoints = 2 };
inline constexpr double kLeastAccuracy = 1e-10, kMostAccuracy = 1e-3;
struct Integration {
  IntegrateBy by = IntegrateBy::kAuto;
  // [-] of the fastest vibration after 1000 rad, from kLeastAccuracy to kMostAccuracy, if points are
  // integrated; 0: 1e-6, on the rung `full` 1e-8
  double accuracy = 0.0;
  Origin origin{};
};

struct Scene {
  std::string name;
  std::vector<std::string> sources;  // file names as given
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
  Fidelity fidelity = Fidelity::kSeparated;  // if `automatic` is given, the set-up chooses the rung
  std::optional<AutomaticRung> automatic;
  Integration integration;
  VerdictAsked verdict;
  double tolerance = 0.0;  // [m] smallest displacement that matters to the user, with which errors are
                           // compared; 0: not given
  std::vector<Feedback> feedbacks;
  ModesAsked modes;
  LeaveOut leave_out;
  Initial initial;
  Publication publication;
  std::vector<int> pushable;  // points that commands may push, as indices into points
  double force_limit = 0.0;   // [N] largest |force| of a command on a point or group; 0: unlimited
  double torque_limit = 0.0;  // [N m] largest |torque| of a command; 0: unlimited
  CommandLimits command_limits;
};

/// Returns the label of a link in messages. The label is 'name', or the position in the source list if the
/// link has no name.
std::string called(const Link& link, int index);

/// Returns the names of the given points in messages, at most `limit` of them: "a, b, c and 4 more".
std::string point_names(const Scene& scene, const std::vector<int>& points, int limit);

}  // namespace freeflex
