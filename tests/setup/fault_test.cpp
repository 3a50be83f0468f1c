// All faults of a scene's physics are reported at once, in plain words.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "core/plan/make_plan.hpp"
#include "core/structure/structure.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Faults faults_of(const Scene& scene) {
  Faults faults;
  const auto structure = build_structure(scene, faults);
  EXPECT_EQ(structure.has_value(), !has_error(faults));
  if (structure) {
    const auto plan = make_full_plan(scene, *structure, scene.fidelity, faults);
    EXPECT_EQ(plan.has_value(), !has_error(faults));
  }
  return faults;
}

bool has_words(const Faults& faults, const std::string& words) {
  for (const Fault& fault : faults)
    if (fault.severity == Fault::Severity::kError && fault.message.find(words) != std::string::npos)
      return true;
  return false;
}

std::string all_words(const Faults& faults) {
  std::string all;
  for (const Fault& fault : faults) all += fault.message + "\n";
  return all;
}

Eigen::SparseMatrix<double> spring_matrix(double stiffness) {
  Eigen::SparseMatrix<double> K(6, 6);
  K.insert(0, 0) = stiffness;
  K.insert(3, 3) = stiffness;
  K.insert(0, 3) = -stiffness;
  K.insert(3, 0) = -stiffness;
  return K;
}

// Returns a scene without faults that has a beam, a matrix link, a group and loads.
Scene sound_scene() {
  Scene scene = square_truss(2);
  scene.points[0].origin = {0, 4, 3};
  add_link(scene, 0, 1, Beam{1e5, 1e3, 1e3, 1e3, {1.0, 0.0, 0.0}});
  Link matrix;
  matrix.name = "box";
  matrix.points = {0, 4};
  matrix.kind = MatrixLink{spring_matrix(1e4)};
  matrix.origin = {0, 30, 5};
  scene.links.push_back(matrix);
  scene.groups.push_back({"pair", {0, 4}, {}});
  scene.groups.push_back({"end", {4, 5, 6, 7}, {}});
  Load load;
  load.name = "push";
  load.axes = Axes::kBody;
  load.forces.push_back({0, {1.0, 0.0, 0.0}});
  load.wrenches.push_back({0, {0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}});
  scene.loads.push_back(load);
  return scene;
}

TEST(Faults, AValidSceneHasNoFaults) { EXPECT_EQ(all_words(faults_of(sound_scene())), ""); }

struct BadScene {
  const char* words;  // a fragment of the message
  std::function<void(Scene&)> spoil;
};

Beam& beam(Scene& scene) { return std::get<Beam>(scene.links[scene.links.size() - 2].kind); }
MatrixLink& box(Scene& scene) { return std::get<MatrixLink>(scene.links.back().kind); }

const std::vector<BadScene>& bad_scenes() {
  static const std::vector<BadScene> kBad{
      {"the scene has no points", [](Scene& s) { s = Scene{}; }},
      {"point 'p0' has inertia or an offset, but no mass",
       [](Scene& s) { s.points[0].mass = 0.0, s.points[0].offset[0] = 0.1; }},
      {"point 'p0': mass is -2 kg", [](Scene& s) { s.points[0].mass = -2.0; }},
      {"mass is nan kg", [](Scene& s) { s.points[0].mass = kNaN; }},
      {"point 'p3': position is (-0.5  nan  0.5), but must be finite",
       [](Scene& s) { s.points[3].position.y() = kNaN; }},
      {"all 8 points are in one place",
       [](Scene& s) {
         for (auto& p : s.points) p.position.setOnes();
       }},
      {"which are in one place, but a link needs a length > 0",
       [](Scene& s) { s.points[1].position = s.points[0].position; }},
      {"joins point 'p1' to itself",
       [](Scene& s) {
         s.links[0].points = {1, 1};
       }},
      {"names point index 99, but there are 8 points",
       [](Scene& s) {
         s.links[0].points = {1, 99};
       }},
      {"stiffness is -5 N/m, but must be finite and > 0", [](Scene& s) { s.links[0].kind = Spring{-5.0}; }},
      {"EA is 0 N, but must be finite and > 0", [](Scene& s) { s.links[0].kind = Bar{0.0}; }},
      {"GJ is nan N m^2", [](Scene& s) { beam(s).GJ = kNaN; }},
      {"EI_y is 0 N m^2", [](Scene& s) { beam(s).EI_y = 0.0; }},
      {"EI_z is -1 N m^2", [](Scene& s) { beam(s).EI_z = -1.0; }},
      {"is parallel to the beam",
       [](Scene& s) {
         beam(s).y_axis = {0.0, 2.0, 0.0};
       }},
      {"the matrix is 6 x 6, but must be 9 x 9 for 3 points",
       [](Scene& s) {
         s.links.back().points = {0, 4, 5};
       }},
      {"joins point 'p0' to itself",
       [](Scene& s) {
         s.links.back().points = {0, 0};
       }},
      {"is not symmetric. Entries across the diagonal differ by up to 0.5",
       [](Scene& s) { box(s).matrix.coeffRef(0, 3) *= 0.5; }},
      {"resists rigid motion of its points", [](Scene& s) { box(s).matrix.coeffRef(1, 1) = 1.0; }},
      {"is not positive semidefinite", [](Scene& s) { box(s).matrix = spring_matrix(-1e4); }},
      {"the stiffness matrix is zero", [](Scene& s) { box(s).matrix = spring_matrix(0.0); }},
      {"has an entry that is not finite", [](Scene& s) { box(s).matrix = spring_matrix(kNaN); }},
      {"group 'pair' has no points", [](Scene& s) { s.groups[0].points.clear(); }},
      {"group 'pair' names point 'p0' twice",
       [](Scene& s) {
         s.groups[0].points = {0, 0};
       }},
      {"group 'pair' names point index -1", [](Scene& s) { s.groups[0].points = {-1}; }},
      {"damping: modal_ratio is -0.1", [](Scene& s) { s.damping.modal_ratio = -0.1; }},
      {"damping: alpha is nan 1/s", [](Scene& s) { s.damping.alpha = kNaN; }},
      {"damping names elastic mode 19, but there are only 18",
       [](Scene& s) {
         s.damping.mode_ratios = {{19, 0.1}};
       }},
      // a rigid pair removes one of the 18 modes
      {"damping names elastic mode 18, but there are only 17",
       [](Scene& s) {
         s.links[0].kind = Rigid{};
         s.damping.mode_ratios = {{17, 0.1}, {18, 0.1}};
       }},
      {"initial state names elastic mode 18, but there are only 17",
       [](Scene& s) {
         s.links[0].kind = Rigid{};
         s.initial.modes.push_back({17, 1.0, 0.0});
         s.initial.modes.push_back({18, 1.0, 0.0});
       }},
      {"initial state names elastic mode 1, but there are only 0",
       [](Scene& s) {
         s = Scene{};
         add_point(s, 1.0, {0.0, 0.0, 0.0});
         add_point(s, 1.0, {1.0, 0.0, 0.0});
         add_link(s, 0, 1, Rigid{});
         s.initial.modes.push_back({1, 1.0, 0.0});
       }},
      {"damping: mode 2 is given twice",
       [](Scene& s) {
         s.damping.mode_ratios = {{2, 0.1}, {2, 0.2}};
       }},
      {"initial state names elastic mode 0",
       [](Scene& s) {
         s.initial.modes.push_back({0, 1.0, 0.0});
       }},
      {"initial attitude (0 0 0 0) is not a rotation", [](Scene& s) { s.initial.attitude.setZero(); }},
      {"initial velocity is (nan   0   0), but must be finite",
       [](Scene& s) { s.initial.velocity.x() = kNaN; }},
      {"initial displacement names point index 8",
       [](Scene& s) {
         s.initial.points.push_back({8, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()});
       }},
      {"gravity is (  0   0 nan), but must be finite", [](Scene& s) { s.gravity.z() = kNaN; }},
      {"the attractor is on the centre of mass at the start",
       [](Scene& s) {
         s.attractor.mu = 100.0;
         s.initial.position = {5.0, 0.0, 0.0};
         Eigen::Vector3d centre = Eigen::Vector3d::Zero();
         for (const PointMass& p : s.points) centre += p.position / static_cast<double>(s.points.size());
         for (PointMass& p : s.points) p.mass = 1.0;
         s.attractor.position = s.initial.position + centre;
       }},
      {"its pull is not a finite number",
       [](Scene& s) {
         s.attractor.mu = 100.0;
         s.attractor.position = {1e300, 0.0, 0.0};
       }},
      {"rate is 0 Hz", [](Scene& s) { s.rate = 0.0; }},
      {"force limit is -1 N", [](Scene& s) { s.force_limit = -1.0; }},
      {"has no force, wrench, torque or wheel",
       [](Scene& s) {
         s.loads[0].forces.clear();
         s.loads[0].wrenches.clear();
       }},
      {"load 'push' names group index 2", [](Scene& s) { s.loads[0].wrenches[0].group = 2; }},
      {"cannot support 1 N m of the torque, because its points lie on a line",
       [](Scene& s) {
         s.loads[0].wrenches[0].torque = {1.0, 0.0, 0.0};
       }},
      {"cannot support 1 N m of the torque, because its points lie at one position",
       [](Scene& s) { s.groups[0].points = {3}; }},
      {"pulse duration is 0 s",
       [](Scene& s) {
         s.loads[0].history = PulseHistory{1.0, 0.0};
       }},
      {"sine frequency is -1 Hz",
       [](Scene& s) {
         s.loads[0].history = SineHistory{-1.0, 0.0};
       }},
      {"the table has 2 times and 1 values",
       [](Scene& s) {
         s.loads[0].history = TableHistory{{0.0, 1.0}, {1.0}};
       }},
      {"the times of the table must increase, but row 2 has 0 s after 1 s",
       [](Scene& s) {
         s.loads[0].history = TableHistory{{1.0, 0.0}, {1.0, 2.0}};
       }},
      {"publication names link index 99", [](Scene& s) { s.publication.links = {99}; }},
      {"publication: state rate is -1 Hz", [](Scene& s) { s.publication.rates[kStateChannel] = -1.0; }},
      {"the list of pushable points names point index 8", [](Scene& s) { s.pushable = {8}; }},
      {"this is point 200001 of 200010, but at most 200000 are allowed",
       [](Scene& s) {
         while (s.points.size() < 200010)
           add_point(s, 1.0, {1.0 * static_cast<double>(s.points.size()), 0.0, 0.0});
       }},
  };
  return kBad;
}

TEST(Faults, EachInvalidSceneOfTheListGivesTheListedMessage) {
  for (const BadScene& bad : bad_scenes()) {
    Scene scene = sound_scene();
    bad.spoil(scene);
    const Faults faults = faults_of(scene);
    EXPECT_TRUE(has_words(faults, bad.words)) << bad.words << "\nfound:\n" << all_words(faults);
  }
}

// The equations of the attractor are a series in size over distance (THEORY 8.19). At a distance of 5 m this
// ratio is 1/5.
TEST(Faults, AnAttractorNearTheBodyGivesAWarning) {
  Scene scene;
  add_point(scene, 1.0, {-1.0, 0.0, 0.0});
  add_point(scene, 1.0, {1.0, 0.0, 0.0});
  add_link(scene, 0, 1, Spring{10.0});
  scene.attractor.mu = 1.0;
  for (const auto& [distance, is_near] : {std::pair{5.0, true}, {0.5, true}, {20.0, false}}) {
    scene.attractor.position = {0.0, distance, 0.0};
    const Faults faults = faults_of(scene);
    EXPECT_FALSE(has_error(faults));
    EXPECT_EQ(all_words(faults).find("valid only far from the body") != std::string::npos, is_near)
        << distance;
    EXPECT_EQ(all_words(faults).find("wrong by some 20 % here") != std::string::npos, distance == 5.0);
  }
}

struct Overflow {
  const char* words;
  std::function<void(Scene&)> spoil;
  int line;
};

// An overflow is reported at the value that causes it, although it appears only in frequencies or
// propagators.
TEST(Faults, AnOverflowIsReportedAtTheMostExtremeValue) {
  const std::vector<Overflow> overflows{
      {"link 's3': stiffness of 1e+308 N/m is the most extreme value of the scene, and ",
       [](Scene& s) { s.links[3].kind = Spring{1e308}; }, 40},
      {"EA of 1e+308 N is the most extreme value of the scene, and the frequencies are not finite",
       [](Scene& s) { beam(s).EA = 1e308; }, 41},
      {"damping of 1e+300 N s/m is the most extreme value of the scene, and the compiled plan is not usable",
       [](Scene& s) { s.links[3].kind = Dashpot{1e300}; }, 40},
      {"link 's3': viscous of 1e+308 s is the most extreme value of the scene, and ",
       [](Scene& s) { s.links[3].viscous = 1e308; }, 40},
      {"link 's3': loss_factor of 1e+308 is the most extreme value of the scene, and ",
       [](Scene& s) { s.links[3].loss_factor = 1e308; }, 40},
      {"damping: beta of 1e+308 s is the most extreme value of the scene, and ",
       [](Scene& s) { s.damping.beta = 1e308; }, 42},
      {"feedback 'f': velocity gain of 1e+300 N s/m is the most extreme value of the scene, and ",
       [](Scene& s) {
         s.feedbacks.push_back({"f", 0, 0, {}, {}, {}, {0, 43, 1}});
         s.feedbacks[0].displacement_gain.setZero();
         s.feedbacks[0].velocity_gain = 1e300 * Eigen::Matrix3d::Identity();
         s.feedbacks[0].acceleration_gain.setZero();
       },
       43},
  };
  for (const Overflow& overflow : overflows) {
    Scene scene = sound_scene();
    // a coordinate near zero that a program wrote is harmless and is not reported
    scene.points[0].position.x() += 1e-320;
    scene.links[3].origin.line = 40;
    scene.links[scene.links.size() - 2].origin.line = 41;
    scene.damping.origin.line = 42;
    overflow.spoil(scene);
    const Faults faults = faults_of(scene);
    EXPECT_TRUE(has_words(faults, overflow.words)) << overflow.words << "\nfound:\n" << all_words(faults);
    ASSERT_FALSE(faults.empty());
    EXPECT_EQ(faults.back().origin.line, overflow.line) << overflow.words;
  }
}

TEST(Faults, AllFaultsAreReportedAtOnceWithTheirLines) {
  Scene scene = sound_scene();
  scene.points[0].mass = -1.0;
  scene.links[3].kind = Spring{0.0};
  box(scene).matrix.coeffRef(1, 1) = 1.0;
  scene.groups[1].points.clear();
  const Faults faults = faults_of(scene);
  EXPECT_EQ(faults.size(), 4U) << all_words(faults);
  EXPECT_EQ(faults[0].origin.line, 4);
  EXPECT_EQ(faults.back().origin.line, 30);
}

TEST(MatrixLinks, MatricesWrittenWithSevenDigitsAreAccepted) {
  // the stiffness of a small truss is rounded to seven digits, as in a table
  Scene truss = square_truss(2);
  const Structure exact = build(truss);
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(24, 24);
  const double M = exact.mass_properties.mass;
  for (Eigen::Index l = 0; l < exact.omega.size(); ++l)
    K += exact.omega[l] * exact.omega[l] / M * exact.shapes.col(l) * exact.shapes.col(l).transpose();
  for (double& entry : K.reshaped()) entry = static_cast<double>(static_cast<float>(entry));
  truss.links.clear();
  truss.publication.links.clear();
  Link link;
  link.name = "K";
  link.points = {0, 1, 2, 3, 4, 5, 6, 7};
  link.kind = MatrixLink{K.sparseView()};
  truss.links.push_back(link);
  const Structure structure = build(truss);
  EXPECT_TRUE(structure.mechanisms.empty());
  // the bound is the rounding error of K in single precision, multiplied by the square of the ratio of the
  // highest to the lowest frequency
  EXPECT_LT(((structure.omega - exact.omega).array() / exact.omega.array()).abs().maxCoeff(),
            1e-7 * exact.conditioning * exact.conditioning);
}

}  // namespace
}  // namespace freeflex::testing
