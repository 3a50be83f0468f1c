// These tests check superelements, which are matrices with rotations, inner coordinates and mass.
#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "core/scene/bodies.hpp"
#include "core/structure/masses/particles.hpp"
#include "service/io/scene/input.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/simulation.hpp"

namespace freeflex::testing {
namespace {

// Figures printed by pyYeti's cbcheck: free-free frequencies [Hz], centre of mass from the first grid [in],
// radii of gyration about the principal axes [in].
TEST(Superelement, TheReducedBodyHasThePublishedFrequencies) {
  const io::SceneResult input =
      io::read_scene(std::string(FREEFLEX_SOURCE_DIR) + "/tests/setup/outboard/outboard.yaml");
  ASSERT_TRUE(input.scene) << (input.faults.empty() ? "" : input.faults[0].message);
  const Structure structure = build(*input.scene);
  ASSERT_EQ(structure.omega.size(), 40);
  const std::array<double, 15> published{1.757662,  1.792869,  3.649292,  4.149376,  7.025406,
                                         7.254279,  11.070483, 11.752514, 14.226996, 15.414285,
                                         25.286983, 25.655202, 42.437306, 42.984102, 46.894346};
  for (std::size_t l = 0; l < published.size(); ++l)
    EXPECT_NEAR(structure.omega[static_cast<int>(l)] / (2.0 * M_PI), published[l], 6e-7) << l;
  const MassProperties& body = structure.mass_properties;
  EXPECT_NEAR(body.mass, 1.5904, 5e-5);
  EXPECT_LT((body.p_SB - Eigen::Vector3d(600.0 - 415.360203, 150.0, 150.0)).norm(), 1e-5);
  const std::array<double, 3> gyration{168.508128, 473.742359, 486.443496};
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(std::sqrt(body.principal[k] / body.mass), gyration[static_cast<std::size_t>(k)], 1e-4) << k;
  EXPECT_LT(structure.frequency_accuracy, 1e-4);
  EXPECT_LT(structure.matrix_sums.momenta.cwiseAbs().maxCoeff(), 1e-6 * body.mass * 500.0);
}

// The reduced body spins on the rung `corotational`: the rotations of its ends and its inner coordinates
// move, so it keeps its frequencies, and energy stays.
TEST(Superelement, TheReducedBodySpinsAtTrueGeometry) {
  const io::SceneResult input =
      io::read_scene(std::string(FREEFLEX_SOURCE_DIR) + "/tests/setup/outboard/outboard.yaml");
  ASSERT_TRUE(input.scene);
  Scene scene = *input.scene;
  const Eigen::VectorXd omega = build(scene).omega;
  scene.fidelity = Fidelity::kCorotational;
  scene.initial.angular_velocity = {0.3, 0.5, 1.0};
  EXPECT_LT(((build(scene).omega - omega).array() / omega.array()).abs().maxCoeff(), 1e-9);
  Simulation simulation(scene);
  const auto energy = [&] {
    const Invariants all = read_invariants(simulation.plan, simulation.state);
    return all.kinetic_rigid + all.kinetic_elastic + all.potential;
  };
  const double start = energy();
  simulation.run(1000);
  const double strain = read_invariants(simulation.plan, simulation.state).potential;
  std::printf("energy changes by %.1e of the strain energy %.3f\n", (energy() - start) / strain, strain);
  EXPECT_GT(strain, 0.0);
  EXPECT_LT(std::abs(energy() - start), 1e-4 * strain);
}

// Returns a chain of beams, or the same chain in which matrices replace the middle beam.
Scene chain(bool is_matrix) {
  Scene scene;
  const std::array<Eigen::Vector3d, 4> at{
      Eigen::Vector3d{0.1, 0.0, 0.2}, {1.0, 0.4, 0.0}, {1.9, 0.3, 0.5}, {2.5, 1.1, 0.1}};
  for (const Eigen::Vector3d& each : at) add_point(scene, 0.0, each);
  scene.points[0].mass = 2.0;
  scene.points[0].inertia = Eigen::Vector3d(0.3, 0.2, 0.4).asDiagonal();
  Beam beam{3e5, 400.0, 900.0, 1300.0, {0.0, 0.2, 1.0}};
  beam.mass_per_length = 1.3;
  for (int i = 0; i < 3; ++i) add_link(scene, i, i + 1, beam);
  if (!is_matrix) return scene;
  Faults faults;
  Scene alone;
  alone.points = {scene.points[1], scene.points[2]};
  add_link(alone, 0, 1, beam);
  const Freedoms freedoms(alone);
  const LinkFactor factor = factor_links(alone, false, faults);
  const Eigen::MatrixXd A = dense_rows(factor.natural, 12, false),
                        N = dense_rows(mass_rows(alone, freedoms, 1.0), 12, false);
  // factor_links orders freedoms as displacements of both points, then rotations of both points
  const std::vector<int> order{0, 1, 2, 6, 7, 8, 3, 4, 5, 9, 10, 11};
  MatrixLink matrix;
  matrix.has_rotations = true;
  matrix.matrix = Eigen::MatrixXd((A.transpose() * A)(order, order)).sparseView();
  matrix.mass = Eigen::MatrixXd((N.transpose() * N)(order, order)).sparseView();
  scene.links[1].kind = matrix;
  return scene;
}

TEST(Superelement, ABeamGivenByItsMatricesHasTheFrequenciesAndTheMassOfThatBeam) {
  const Structure beams = build(chain(false)), mixed = build(chain(true));
  ASSERT_EQ(beams.omega.size(), mixed.omega.size());
  EXPECT_LT(((beams.omega - mixed.omega).array() / beams.omega.array()).abs().maxCoeff(), 1e-10);
  EXPECT_NEAR(beams.mass_properties.mass, mixed.mass_properties.mass, 1e-14);
  EXPECT_LT((beams.mass_properties.inertia - mixed.mass_properties.inertia).norm(), 1e-13);
  EXPECT_LT((beams.mass_properties.p_SB - mixed.mass_properties.p_SB).norm(), 1e-14);
  // the momenta of the particles and of the matrix cancel, as the mean-axis frame requires   (THEORY 2.12)
  const Particles& particles = mixed.particles;
  for (Eigen::Index l = 0; l < mixed.omega.size(); ++l) {
    Eigen::Matrix<double, 6, 1> sum = mixed.matrix_sums.momenta.col(l);
    const double own = sum.norm();
    for (Eigen::Index p = 0; p < particles.mass.size(); ++p) {
      const Eigen::Vector3d b = particles.shapes.block<3, 1>(3 * p, l), r = particles.r.col(p);
      sum.head<3>() += particles.mass[p] * b;
      sum.tail<3>() += particles.mass[p] * r.cross(b);
    }
    EXPECT_GT(own, 0.0);
    EXPECT_LT(sum.norm(), 1e-10 * mixed.mass_properties.mass) << l;
  }
}

// Only the matrix has mass, so there are no particles. The motion equals that of the same beam with
// distributed mass.
TEST(Superelement, AMatrixMayHaveAllOfTheMass) {
  Scene beam = chain(false), matrix = chain(true);
  for (Scene* scene : {&beam, &matrix}) {
    scene->points = {scene->points[1], scene->points[2]};
    scene->links = {scene->links[1]};
    scene->links[0].points = {0, 1};
    scene->publication.points = {0, 1};
    scene->rate = 1000.0;
    Load load;
    load.forces = {{1, {0.0, 3.0, 1.0}}};
    load.history = PulseHistory{0.0, 0.01};
    scene->loads = {load};
    scene->fidelity = Fidelity::kSpinLoaded;
  }
  Simulation of_beam(beam), of_matrix(matrix);
  for (int k = 0; k < 5; ++k) {
    of_beam.run(20);
    of_matrix.run(20);
    const double size = of_beam.displacements_B().norm();
    EXPECT_GT(size, 1e-6);
    EXPECT_LT((of_beam.displacements_B() - of_matrix.displacements_B()).norm(), 1e-7 * size);
    EXPECT_LT((of_beam.positions_W() - of_matrix.positions_W()).norm(), 1e-12);
  }
}

std::string first_error(const Scene& scene) {
  Faults faults;
  build_structure(scene, faults);
  for (const Fault& fault : faults)
    if (fault.severity == Fault::Severity::kError) return fault.message;
  return {};
}
MatrixLink& middle(Scene& scene) { return std::get<MatrixLink>(scene.links[1].kind); }

TEST(Superelement, ErrorsStateWhatIsWrongWithTheMatrix) {
  const auto expect = [](const char* what, auto change) {
    Scene scene = chain(true);
    change(middle(scene));
    EXPECT_NE(first_error(scene).find(what), std::string::npos) << first_error(scene);
  };
  expect("mass matrix is not symmetric", [](MatrixLink& m) { m.mass.coeffRef(0, 7) += 0.1; });
  expect("in translation along x, y, z, which must be equal",
         [](MatrixLink& m) { m.mass.coeffRef(0, 0) += 0.1; });
  expect("mass matrix is not positive semidefinite",
         [](MatrixLink& m) { m.mass.coeffRef(3, 4) = m.mass.coeffRef(4, 3) = 1.0; });
  expect("resists rigid motion", [](MatrixLink& m) { m.matrix.coeffRef(3, 3) += 10.0; });
  expect("must be 12 x 12", [](MatrixLink& m) { m.matrix.conservativeResize(11, 11); });
  expect("inner coordinates need a mass matrix", [](MatrixLink& m) {
    m.mass.resize(0, 0);
    m.num_inner = 2;
    m.matrix.conservativeResize(14, 14);
  });
  Scene scene = chain(true);
  scene.publication.links = {1};
  EXPECT_NE(first_error(scene).find("whose forces are not published"), std::string::npos);
  scene = chain(true);
  scene.initial.points = {{3, {1e-3, 0.0, 0.0}, {}}};
  EXPECT_NE(first_error(scene).find("give initial: modes"), std::string::npos);
}

}  // namespace
}  // namespace freeflex::testing
