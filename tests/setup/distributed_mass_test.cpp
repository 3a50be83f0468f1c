// These tests compare the distributed mass of links (consistent, lumped and mixed) with closed forms and
// published frequencies.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "core/scene/bodies.hpp"
#include "core/structure/masses/particles.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/setup/plate_mesh.hpp"

namespace freeflex::testing {
namespace {

constexpr std::array<double, 4> kBetaL{4.7300407448627, 7.8532046240958, 10.9956078380016, 14.1371654912574};

Beam slender(double mass_per_length) {
  Beam beam{1e4, 1e4, 1.0, 1.0, {0.0, 1.0, 0.0}};
  beam.mass_per_length = mass_per_length;
  return beam;
}

// Returns a free beam of length 1 along the first column of R. The points of the beam have no mass.
Scene consistent_beam(int num_spans, const Beam& beam, const Eigen::Matrix3d& R,
                      const Eigen::Vector3d& start) {
  Scene scene;
  for (int i = 0; i <= num_spans; ++i)
    add_point(scene, 0.0, start + R * Eigen::Vector3d(static_cast<double>(i) / num_spans, 0.0, 0.0));
  for (int i = 0; i < num_spans; ++i) {
    Beam each = beam;
    each.y_axis = R * beam.y_axis;
    add_link(scene, i, i + 1, each);
  }
  return scene;
}
Scene consistent_beam(int num_spans, const Beam& beam) {
  return consistent_beam(num_spans, beam, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
}

double nearest(const Structure& structure, double omega) {
  Eigen::Index mode = 0;
  (structure.omega.array() - omega).abs().minCoeff(&mode);
  return structure.omega[mode];
}

// A free beam of one element bends with w^2 = 720 and 8400 EI / (rho A L^4) and stretches with w^2 = 12 EA /
// (rho A L^2). These values are the roots of the 4 x 4 and 2 x 2 matrices of the element (Archer 1963, J.
// Struct. Div. ASCE 89, 161-178).
TEST(DistributedMass, ASingleBeamHasTheEigenvaluesOfItsOwnMatrices) {
  const Structure structure = build(consistent_beam(1, slender(1.0)));
  ASSERT_EQ(structure.omega.size(), 5);
  EXPECT_EQ(structure.mass_properties.rigid_freedoms, 5);
  for (const int pair : {0, 1}) EXPECT_NEAR(structure.omega[pair], std::sqrt(720.0), 1e-11);
  for (const int pair : {2, 3}) EXPECT_NEAR(structure.omega[pair], std::sqrt(8400.0), 1e-11);
  EXPECT_NEAR(structure.omega[4], std::sqrt(12e4), 1e-9);
}

TEST(DistributedMass, BeamFrequenciesConvergeWithFourthOrderInTheElementLength) {
  std::printf("mode  elements: error\n");
  for (std::size_t mode = 0; mode < kBetaL.size(); ++mode) {
    const double exact = kBetaL[mode] * kBetaL[mode];
    std::vector<double> error;
    for (const int spans : {4, 8, 16, 32})
      error.push_back(build(consistent_beam(spans, slender(1.0))).omega[2 * static_cast<int>(mode)] / exact -
                      1.0);
    std::printf("%zu  4: %.2e  8: %.2e  16: %.2e  32: %.2e\n", mode + 1, error[0], error[1], error[2],
                error[3]);
    for (const double each : error)
      EXPECT_GT(each, 0.0);  // elements restrict the shapes, so frequencies are upper bounds
    // the next term of the error, which falls four times as fast, changes the order of the highest mode
    EXPECT_NEAR(std::log2(error[2] / error[3]), 4.0, 0.1);
  }
}

// Frequencies along a chain of n elements, with c = cos(k pi / n) and w^2 in units of EA / (rho A h^2): 6 (1
// - c) / (2 + c) with consistent mass, 12 (1 - c) / (5 + c) with the mean of consistent and lumped mass, 2 (1
// - c) with lumped mass.
TEST(DistributedMass, FrequenciesAlongAChainHaveTheClosedFormOfEachKindOfMass) {
  constexpr int kSpans = 6;
  for (const bool is_bar : {false, true})
    for (const MassDistribution distribution :
         {MassDistribution::kConsistent, MassDistribution::kMeanAxial, MassDistribution::kLumped}) {
      Scene scene;
      for (int i = 0; i <= kSpans; ++i) add_point(scene, 0.0, {static_cast<double>(i) / kSpans, 0.0, 0.0});
      Beam beam = slender(1.0);
      beam.mass_distribution = distribution;
      for (int i = 0; i < kSpans; ++i)
        add_link(scene, i, i + 1, is_bar ? LinkKind(Bar{1e4, 1.0, distribution}) : LinkKind(beam));
      place_lumped_masses(scene);
      const Structure structure = build(scene);
      for (int k = 1; k <= kSpans; ++k) {
        const double c = std::cos(k * M_PI / kSpans), rate = 1e4 * kSpans * kSpans;
        const double square = distribution == MassDistribution::kConsistent  ? 6.0 * (1.0 - c) / (2.0 + c)
                              : distribution == MassDistribution::kMeanAxial ? 12.0 * (1.0 - c) / (5.0 + c)
                                                                             : 2.0 * (1.0 - c);
        const double omega = std::sqrt(rate * square);
        EXPECT_NEAR(nearest(structure, omega), omega, 1e-11 * omega) << k << ' ' << is_bar;
      }
    }
}

TEST(DistributedMass, LumpedMassEqualsPointMasses) {
  Beam lumped = slender(3.0), bare = slender(0.0);
  lumped.mass_distribution = MassDistribution::kLumped;
  Scene spread = consistent_beam(7, lumped), points = consistent_beam(7, bare);
  place_lumped_masses(spread);
  for (std::size_t i = 0; i < points.points.size(); ++i)
    points.points[i].mass = 3.0 / 7.0 * (i == 0 || i == 7 ? 0.5 : 1.0);
  const Structure a = build(spread), b = build(points);
  ASSERT_EQ(a.omega.size(), b.omega.size());
  EXPECT_LT(((a.omega - b.omega).array() / b.omega.array()).abs().maxCoeff(), 1e-12);
  EXPECT_NEAR(a.mass_properties.principal[2], b.mass_properties.principal[2], 1e-14);
}

// A part of the mass of a link at a point whose body has its centre elsewhere: mass, centre and inertia are
// those of the body and a point mass together, by Huygens' theorem.
TEST(DistributedMass, LumpedMassOnABodyWithAnOffsetMovesItsCentreAndAddsInertia) {
  Scene scene;
  add_point(scene, 3.0, {0.0, 0.0, 0.0});
  add_point(scene, 1.0, {2.0, 0.0, 0.0});
  PointMass& body = scene.points[0];
  body.offset = {0.1, -0.2, 0.3};
  body.inertia = Eigen::Vector3d(0.4, 0.5, 0.6).asDiagonal();
  const Eigen::Vector3d c = body.offset;
  const Eigen::Matrix3d J = body.inertia;
  Beam lumped = slender(1.0);
  lumped.mass_distribution = MassDistribution::kLumped;
  add_link(scene, 0, 1, lumped);
  place_lumped_masses(scene);
  EXPECT_DOUBLE_EQ(body.mass, 4.0);
  EXPECT_DOUBLE_EQ(scene.points[1].mass, 2.0);
  const auto about_point = [](double m, const Eigen::Vector3d& d) {
    return (m * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose())).eval();
  };
  EXPECT_LT((4.0 * body.offset - 3.0 * c).norm(), 1e-15);
  EXPECT_LT((body.inertia + about_point(4.0, body.offset) - J - about_point(3.0, c)).norm(), 1e-15);
}

TEST(DistributedMass, TheMassOfABeamHasTheInertiaOfARodInAnyDirection) {
  const Eigen::Matrix3d R =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, -2.0, 0.5).normalized()).toRotationMatrix();
  const Scene at_rest = consistent_beam(5, slender(2.0)),
              rotated = consistent_beam(5, slender(2.0), R, {3.0, -1.0, 7.0});
  const Structure a = build(at_rest), b = build(rotated);
  EXPECT_DOUBLE_EQ(a.mass_properties.mass, 2.0);
  EXPECT_NEAR(a.mass_properties.principal[2], 2.0 / 12.0, 1e-15);
  EXPECT_NEAR(b.mass_properties.principal[2], 2.0 / 12.0, 1e-13);
  ASSERT_EQ(a.omega.size(), b.omega.size());
  EXPECT_LT(((a.omega - b.omega).array() / a.omega.array()).abs().maxCoeff(), 1e-11);
}

// Sums over the particles must show that unit displacements are orthonormal and contain no rigid motion
// (THEORY 2.15, 4.3).
TEST(DistributedMass, ItsParticlesRepresentTheMassMatrix) {
  Scene scene = consistent_beam(4, slender(2.0));
  add_point(scene, 0.7, {0.5, 0.6, 0.2});
  Beam arm = slender(0.4);
  arm.GA_y = arm.GA_z = 50.0;
  arm.released[0][2] = true;
  add_link(scene, 2, 5, arm);
  add_point(scene, 0.3, {0.2, -0.4, 0.1});
  Plate plate{1e4, 0.3, 0.02, 100.0};
  add_link(scene, {1, 3, 6}, plate);
  const Structure structure = build(scene);
  const Particles& particles = structure.particles;
  const double M = structure.mass_properties.mass;
  EXPECT_NEAR(particles.mass.sum(), M, 1e-15 * M);
  const Eigen::VectorXd mass = particles.mass.transpose().replicate(3, 1).reshaped();
  const Eigen::MatrixXd gram = particles.shapes.transpose() * mass.asDiagonal() * particles.shapes / M;
  EXPECT_LT((gram - Eigen::MatrixXd::Identity(gram.rows(), gram.cols())).cwiseAbs().maxCoeff(), 1e-11);
  for (Eigen::Index l = 0; l < structure.omega.size(); ++l) {
    Eigen::Vector3d momentum = Eigen::Vector3d::Zero(), spin = Eigen::Vector3d::Zero();
    for (Eigen::Index p = 0; p < particles.mass.size(); ++p) {
      const Eigen::Vector3d b = particles.shapes.block<3, 1>(3 * p, l);
      momentum += particles.mass[p] * b;
      spin += particles.mass[p] * particles.r.col(p).cross(b);
    }
    EXPECT_LT(momentum.norm() + spin.norm(), 1e-11 * M) << l;
  }
}

// The free square plate of NAFEMS R0015 (1989), test FV12: 10 m x 10 m x 0.05 m, E = 200e9 Pa, nu 0.3, 8000
// kg/m^3. Its published frequencies [Hz]:
constexpr std::array<double, 8> kFreePlate{1.622, 2.360, 2.922, 4.190, 4.190, 7.356, 7.356, 7.668};
std::array<double, 8> free_plate_errors(int cells, SetupPath path = SetupPath::kDense) {
  Scene scene = plate_mesh(10.0, 10.0, cells, cells, Plate{200e9, 0.3, 0.05, 8000.0});
  for (PointMass& point : scene.points) point.mass = 0.0;
  scene.modes.count = path == SetupPath::kSparse ? 10 : 0;
  Faults faults;
  const auto found = build_structure_by(scene, path, faults);
  if (!found) throw std::runtime_error(faults.empty() ? "no structure" : faults.front().message);
  const Structure& structure = *found;
  EXPECT_NEAR(structure.mass_properties.mass, 40000.0, 1e-9);
  std::array<double, 8> error{};
  std::printf("%d x %d:", cells, cells);
  for (std::size_t l = 0; l < error.size(); ++l) {
    error[l] = structure.omega[static_cast<int>(l)] / (2.0 * M_PI) / kFreePlate[l] - 1.0;
    std::printf(" %+.4f", error[l]);
  }
  std::printf("\n");
  return error;
}

TEST(DistributedMass, TheFreePlateConvergesToThePublishedFrequencies) {
  const auto coarse = free_plate_errors(4), fine = free_plate_errors(8);
  for (std::size_t l = 0; l < coarse.size(); ++l) {
    EXPECT_LT(std::abs(fine[l]), 0.5 * std::abs(coarse[l])) << l;
    EXPECT_LT(std::abs(fine[l]), 0.012) << l;
  }
}

TEST(DistributedMass, FrequenciesOfTheFreePlateOf16By16CellsAreWithinHalfAPercent) {
  for (const double error : free_plate_errors(16, SetupPath::kSparse)) EXPECT_LT(std::abs(error), 0.005);
}

TEST(DistributedMass, ALinkWithNegativeMassIsAnError) {
  Scene scene = consistent_beam(2, slender(-1.0));
  Faults faults;
  EXPECT_FALSE(build_structure(scene, faults));
  EXPECT_TRUE(std::any_of(faults.begin(), faults.end(), [](const Fault& fault) {
    return fault.message.find("mass_per_length is -1 kg/m, but must be finite and >= 0") != std::string::npos;
  }));
}

}  // namespace
}  // namespace freeflex::testing
