// These tests check geometric stiffness against the deformations of links at true geometry, and against the
// effect of spin and thrust on frequencies.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "core/structure/links/link_factor.hpp"
#include "core/structure/prestress/load_stiffness.hpp"
#include "core/structure/prestress/true_deformation.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {
namespace {

Eigen::Vector3d random_vector(std::mt19937_64& engine) {
  std::normal_distribution<double> normal;
  return {normal(engine), normal(engine), normal(engine)};
}

Scene one_link(const LinkKind& kind, const std::vector<Eigen::Vector3d>& at) {
  Scene scene;
  Link link;
  link.name = "l";
  link.kind = kind;
  for (const Eigen::Vector3d& position : at) {
    link.points.push_back(static_cast<int>(scene.points.size()));
    add_point(scene, 1.0, position);
  }
  scene.links.push_back(link);
  return scene;
}

// Returns links of every kind, with straight, folded and bent bending springs.
std::vector<Scene> links_of_every_kind(std::mt19937_64& engine) {
  const auto some = [&](int count) {
    std::vector<Eigen::Vector3d> at;
    for (int k = 0; k < count; ++k) at.push_back(random_vector(engine) + 2.0 * k * Eigen::Vector3d::UnitX());
    return at;
  };
  const Eigen::Vector3d a = random_vector(engine), b = random_vector(engine);
  return {one_link(Spring{1e3}, some(2)),
          one_link(Bar{1e4}, some(2)),
          one_link(Beam{.EA = 1e6, .GJ = 10.0, .EI_y = 20.0, .EI_z = 30.0}, some(2)),
          one_link(BendingSpring{5.0}, some(3)),
          one_link(BendingSpring{5.0}, {a, a + b, a + 2.5 * b}),
          one_link(BendingSpring{5.0}, {a, a + b, a - 0.5 * b}),
          one_link(TorsionSpring{5.0}, some(4)),
          one_link(Plate{.E = 7e10, .nu = 0.3, .thickness = 0.01}, some(3))};
}

// A rigid rotation of any angle strains no link. The strain due to a small displacement agrees with the
// deformation rows up to second order.
TEST(TrueGeometry, RotationsStrainNoLinkAndSmallStrainsMatchTheLinearRows) {
  std::mt19937_64 engine(20260712);
  double worst_rotation = 0.0, worst_tangent = 0.0;
  for (int round = 0; round < 20; ++round)
    for (const Scene& scene : links_of_every_kind(engine)) {
      const Freedoms freedoms(scene);
      const TrueLink link(scene, 0, freedoms);
      Faults faults;
      const LinkFactor factor = factor_links(scene, true, faults);
      const auto num_points = static_cast<Eigen::Index>(scene.points.size());
      // the whole link rotates by 2 rad about the first point
      const Eigen::Vector3d rotation = 2.0 * random_vector(engine).normalized();
      const Eigen::Matrix3d R = Eigen::AngleAxisd(rotation.norm(), rotation.normalized()).toRotationMatrix();
      Eigen::Matrix3Xd V(3, num_points), theta(3, num_points);
      for (Eigen::Index k = 0; k < num_points; ++k) {
        const Eigen::Vector3d arm =
            scene.points[static_cast<std::size_t>(k)].position - scene.points[0].position;
        V.col(k) = R * arm - arm + random_vector(engine).Constant(0.3);
        theta.col(k) = rotation;
      }
      worst_rotation = std::max(worst_rotation, link.deformations(V, theta).cwiseAbs().maxCoeff());
      // the derivative along a random displacement comes from central differences of the true deformation
      for (Eigen::Index k = 0; k < num_points; ++k)
        V.col(k) = random_vector(engine), theta.col(k) = random_vector(engine);
      constexpr double kStep = 1e-5;
      const Eigen::VectorXd slope =
          (link.deformations(kStep * V, kStep * theta) - link.deformations(-kStep * V, -kStep * theta)) /
          (2.0 * kStep);
      for (int row = 0; row < link.num_deformations(); ++row) {
        double expected = 0.0, size = 0.0;
        for (const auto& [freedom, coefficient] :
             factor.natural[static_cast<std::size_t>(row)].coefficients) {
          const bool is_rotation = freedom >= freedoms.num_displacements();
          const int index = is_rotation ? freedom - freedoms.num_displacements() : freedom;
          const double value = is_rotation ? theta(index % 3, index / 3) : V(index % 3, index / 3);
          expected += coefficient * value;
          size = std::max(size, std::abs(coefficient * value));
        }
        worst_tangent = std::max(worst_tangent, std::abs(slope[row] - expected) / size);
      }
    }
  std::printf("largest deformation due to a rotation %.1e, tangent off by %.1e\n", worst_rotation,
              worst_tangent);
  EXPECT_LT(worst_rotation, 1e-12);  // rounding errors of positions of some 10 m
  EXPECT_LT(worst_tangent, 1e-7);    // error of third order in the step, over lengths of 0.1 m and more
}

constexpr double kBeamEI = 100.0, kBeamLength = 1.0;

// Returns a free beam of 1 kg and 1 m along x, stiffer in y so that no two modes have equal frequencies.
Scene free_beam(int elements) {
  Scene scene;
  for (int k = 0; k <= elements; ++k) {
    const double mass_fraction = (k == 0 || k == elements ? 0.5 : 1.0) / elements;
    add_point(scene, mass_fraction, {kBeamLength * k / elements, 0.0, 0.0});
  }
  for (int k = 0; k < elements; ++k) {
    Link link;
    link.name = "b" + std::to_string(k);
    link.points = {k, k + 1};
    link.kind = Beam{
        .EA = 1e7, .GJ = 50.0, .EI_y = kBeamEI, .EI_z = 1.5 * kBeamEI, .y_axis = Eigen::Vector3d::UnitY()};
    scene.links.push_back(link);
  }
  return scene;
}

// Returns the bending modes in the plane of x and the given axis, lowest first.
std::vector<int> bending_modes(const Structure& structure, Eigen::Index axis) {
  std::vector<int> modes;
  for (Eigen::Index l = 0; l < structure.omega.size(); ++l) {
    double along = 0.0;
    for (Eigen::Index i = axis; i < structure.shapes.rows(); i += 3)
      along += std::abs(structure.shapes(i, l));
    if (along > 0.9 * structure.shapes.col(l).cwiseAbs().sum()) modes.push_back(static_cast<int>(l));
  }
  return modes;
}

// Returns the geometric stiffness of a mode due to the loads of one kind and of the given components.
double stiffness_of(const Structure& structure, int mode, ReferenceLoad::Kind kind,
                    const std::vector<int>& components) {
  double sum = 0.0;
  std::size_t num_found = 0;
  for (const LoadStiffness& each : structure.load_stiffness) {
    if (each.reference.kind != kind || !std::ranges::count(components, each.reference.component)) continue;
    const auto at = std::ranges::find(each.modes, mode);
    if (at == each.modes.end()) continue;
    const Eigen::Index k = at - each.modes.begin();
    sum += each.rows(k, k);
    ++num_found;
  }
  EXPECT_EQ(num_found, components.size()) << mode;
  return sum;
}

// A uniform free beam spins about a transverse axis. The expected values are those of a continuous beam, from
// 60 Hermite elements. At Omega = 0.05 omega_1 the frequencies out of the plane of spin are 1.003805,
// 2.759439 and 5.406541 times omega_1. At rest they are 1, 61.6728 / 22.3733 and 5.403918 times omega_1. The
// geometric stiffness is the same in the plane of spin, where the motion of the mass against the centrifugal
// forces takes away Omega^2.
TEST(LoadStiffness, OfASpinningBeamMatchesAContinuousBeam) {
  const double at_rest[] = {1.0, 61.6728 / 22.3733, 120.9034 / 22.3733};
  const double spinning[] = {1.003805, 2.759439, 5.406541};
  Scene scene = free_beam(40);
  scene.fidelity = Fidelity::kCoupled;
  const Structure beam = build(scene);
  const auto across = bending_modes(beam, 2), along = bending_modes(beam, 1);
  ASSERT_GE(std::min(across.size(), along.size()), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    const double expected = (spinning[k] * spinning[k] - at_rest[k] * at_rest[k]) / (0.05 * 0.05);
    // the spin (0, 0, 1) rad/s has the centrifugal field S = diag(1, 1, 0)
    const auto by_spin = [&](int mode) {
      return stiffness_of(beam, mode, ReferenceLoad::Kind::kField, {0, 1}) / beam.mass_properties.mass;
    };
    std::printf("mode %zu: out of the plane %.4f, in it %.4f, continuous beam %.4f\n", k + 1,
                by_spin(across[k]), by_spin(along[k]), expected);
    // the last digit of the table is 4e-4 to 4e-3 of the difference, and lumped masses add 2e-3 of the
    // difference per mode
    EXPECT_NEAR(by_spin(across[k]), expected, 0.02 * expected);
    EXPECT_NEAR(by_spin(along[k]), expected, 0.02 * expected);
  }
}

// Dead loads P and -P at the ends: E is the integral of -P phi'^2. The first elastic frequency of the free
// column falls to zero at P = pi^2 EI / L^2, where the shape of the mode is a half sine. The mode shape of
// the column without load gives an upper bound on this load (Rayleigh), which is about 2.5 % too large.
TEST(LoadStiffness, OfAColumnGivesEulersLoad) {
  Scene scene = free_beam(40);
  scene.fidelity = Fidelity::kCoupled;
  Load load;  // unit compression
  load.axes = Axes::kBody;
  load.forces = {{0, {1.0, 0.0, 0.0}}, {40, {-1.0, 0.0, 0.0}}};
  scene.loads = {load};
  const Structure column = build(scene);
  const int mode = bending_modes(column, 2).at(0);
  const double E = stiffness_of(column, mode, ReferenceLoad::Kind::kBuiltIn, {0});
  const double stiffness = column.mass_properties.mass * std::pow(column.omega[mode], 2);
  const double critical = -stiffness / E, euler = M_PI * M_PI * kBeamEI / (kBeamLength * kBeamLength);
  std::printf("by the mode without load %.4f of Euler's load\n", critical / euler);
  EXPECT_GT(critical, 0.999 * euler);
  EXPECT_LT(critical, 1.07 * euler);
}

// Returns a random frame of point masses with beams, springs and an angle spring.
Scene mixed_frame() {
  std::mt19937_64 engine(5);
  Scene scene;
  for (int k = 0; k < 6; ++k)
    add_point(scene, 1.0 + 0.2 * k, 0.3 * random_vector(engine) + Eigen::Vector3d(k, k % 2, k % 3));
  for (int k = 0; k < 4; ++k)
    add_link(scene, {k, k + 1}, Beam{.EA = 1e5, .GJ = 50.0, .EI_y = 60.0, .EI_z = 80.0});
  add_link(scene, {4, 5}, Spring{1e4});
  for (int k = 0; k < 3; ++k) add_link(scene, {5, k}, Spring{5e3});
  add_link(scene, {3, 4, 5}, BendingSpring{20.0});
  return scene;
}

// Returns the change of displacements and of rotation vectors, one after the other, by a small rotation about
// an axis. To second order a rotation phi adds phi x theta / 2 to a rotation vector theta.
Eigen::VectorXd turned(const Eigen::VectorXd& v, Eigen::Index axis, Eigen::Index num_displacements) {
  Eigen::VectorXd out(v.size());
  for (Eigen::Index i = 0; i < v.size(); i += 3)
    out.segment<3>(i) = (i < num_displacements ? 1.0 : 0.5) *
                        Eigen::Vector3d::Unit(axis).cross(Eigen::Vector3d(v.segment<3>(i)));
  return out;
}

// Checks the geometric stiffness E of a scene by all loads: fields, a built-in load, and each component of
// the commands. A translation does not see it. In a truss, a rotation phi turns the structure against the
// forces f of a static response: phi . E u = -f . (phi x u).
void check_rigid_motions(Scene scene, bool is_truss, std::size_t num_loads) {
  Load load;
  load.axes = Axes::kBody;
  load.forces = {{0, {30.0, 10.0, -5.0}}, {5, {-20.0, 4.0, 8.0}}};
  scene.loads = {load};
  scene.pushable = {0, 5};
  scene.groups = {{"middle", {1, 2, 4}, {}}};
  scene.fidelity = Fidelity::kCoupled;
  Faults faults;
  const Structure structure = build(scene);
  const StaticResponses responses = static_responses(scene, structure);
  const LinkFactor factor = factor_links(scene, true, faults);
  ASSERT_TRUE(faults.empty());
  const Eigen::Index n = structure.omega.size(), num_displacements = structure.shapes.rows();
  const auto stacked = [](const Eigen::MatrixXd& shapes, const Eigen::MatrixXd& rotations) {
    Eigen::MatrixXd all(shapes.rows() + rotations.rows(), shapes.cols());
    all << shapes, rotations;
    return all;
  };
  const Eigen::MatrixXd modes = stacked(structure.shapes, structure.rotations),
                        responding = stacked(responses.shapes, responses.rotations);
  Eigen::VectorXd mass = Eigen::VectorXd::Constant(modes.rows(), 0.2);
  for (Eigen::Index i = 0; i < num_displacements; ++i)
    mass[i] = scene.points[static_cast<std::size_t>(i / 3)].mass;
  // three translations and three rotations before the modes
  Eigen::MatrixXd all_motions = Eigen::MatrixXd::Zero(modes.rows(), 6 + n);
  for (Eigen::Index i = 0; i < modes.rows(); i += 3)
    for (Eigen::Index a = 0; a < 3; ++a) {
      const bool is_rotation = i >= num_displacements;
      if (!is_rotation) all_motions(i + a, a) = 1.0;
      all_motions.block<3, 1>(i, 3 + a) =
          is_rotation
              ? Eigen::Vector3d(Eigen::Vector3d::Unit(a))
              : Eigen::Vector3d::Unit(a).cross(Eigen::Vector3d(structure.mass_properties.r.col(i / 3)));
    }
  all_motions.rightCols(n) = modes;
  Structure moved = structure;
  moved.omega.setZero(6 + n);
  moved.shapes = all_motions.topRows(num_displacements);
  moved.rotations = all_motions.bottomRows(modes.rows() - num_displacements);
  const std::vector<LoadStiffness> all = find_load_stiffness(scene, factor, moved, responses);
  ASSERT_EQ(all.size(), num_loads);
  double of_translations = 0.0, of_rotations = 0.0, size = 0.0;
  for (std::size_t k = 0; k < all.size(); ++k) {
    const Eigen::MatrixXd& E = all[k].rows;
    const double largest = E.bottomRightCorner(E.rows() - 6, E.cols() - 6).cwiseAbs().maxCoeff();
    of_translations = std::max(of_translations, E.topRows(3).cwiseAbs().maxCoeff() / largest);
    // f = sum omega_l^2 m b_l (m b_l . u_s) / M over all modes
    const Eigen::VectorXd u_s = responding.col(static_cast<Eigen::Index>(k));
    Eigen::VectorXd f = Eigen::VectorXd::Zero(u_s.size());
    for (Eigen::Index l = 0; l < n; ++l) {
      const Eigen::VectorXd momentum = mass.cwiseProduct(modes.col(l));
      f += structure.omega[l] * structure.omega[l] / structure.mass_properties.mass * momentum.dot(u_s) *
           momentum;
    }
    for (Eigen::Index a = 0; a < 3; ++a)
      for (Eigen::Index u = 6; u < E.cols(); ++u) {
        const Eigen::VectorXd shape = all_motions.col(u);
        const double expected = -f.dot(turned(shape, a, num_displacements));
        of_rotations = std::max(of_rotations, std::abs(E(3 + a, u) - expected) / largest);
        size = std::max(size, std::abs(expected) / largest);
      }
  }
  std::printf("translations %.1e\n", of_translations);
  EXPECT_LT(of_translations, 1e-12);
  if (is_truss) {
    std::printf("rotations off by %.1e of %.1e\n", of_rotations, size);
    EXPECT_LT(of_rotations, 1e-9);
  }
  EXPECT_GT(size, 0.01);
}

TEST(LoadStiffness, RigidMotionsChangeItOnlyAsTheyTurnTheForces) {
  // six fields, the load, two forces of three components, and a wrench of six
  Scene truss = mixed_frame();
  truss.links.clear();
  join_all(truss, 1e4);
  check_rigid_motions(truss, true, 7 + 2 * 3 + 6);
  // and a torque of three components and a motor
  Scene frame = mixed_frame();
  for (const int body : {0, 3}) frame.points[index(body)].inertia = 0.2 * Eigen::Matrix3d::Identity();
  frame.wheels = {{"wheel", 0, {0.6, 0.0, 0.8}, 0.0, {}}};
  check_rigid_motions(frame, false, 7 + 3 * 3 + 6 + 1);
}

}  // namespace
}  // namespace freeflex::testing
