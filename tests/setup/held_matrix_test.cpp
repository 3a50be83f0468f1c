// These tests use matrix links that resist rigid motion. The removed stiffness is reported, and the stated
// accuracy includes the effect of this removal.
#include <charconv>
#include <cmath>
#include <cstdio>

#include "core/structure/links/link_factor.hpp"
#include "core/structure/modes/dense/decompositions.hpp"
#include "service/io/scene/input.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/exact_frequencies.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

Eigen::MatrixXd assembled(const Scene& scene) {
  Faults faults;
  const LinkFactor factor = factor_links(scene, false, faults);
  return factor.rows.transpose() * factor.rows;
}

// Returns the scene with one matrix in place of all its links.
Scene with_matrix(Scene scene, const Eigen::MatrixXd& K) {
  scene.links.clear();
  scene.publication.links.clear();
  Link link;
  link.name = "K";
  for (int i = 0; i < static_cast<int>(scene.points.size()); ++i) link.points.push_back(i);
  link.kind = MatrixLink{K.sparseView()};
  scene.links.push_back(link);
  return scene;
}

// Returns the scene with its points moved off their grid, so that no entry of K is a round number.
Scene uneven(Scene scene) {
  std::mt19937_64 engine(7);
  std::uniform_real_distribution<double> shift(-0.05, 0.05);
  for (PointMass& point : scene.points)
    for (double& coordinate : point.position) coordinate += shift(engine);
  return scene;
}

// Returns K with springs to ground along all axes of some points.
Eigen::MatrixXd grounded(Eigen::MatrixXd K, const std::vector<int>& points, double stiffness) {
  for (const int point : points) K.diagonal().segment<3>(3 * Eigen::Index{point}).array() += stiffness;
  return K;
}

// Returns K with every entry rounded to a number of significant digits, as in a table.
Eigen::MatrixXd printed(Eigen::MatrixXd K, int digits) {
  for (double& entry : K.reshaped()) {
    char text[40];
    const auto end =
        std::to_chars(text, text + sizeof text, entry, std::chars_format::scientific, digits - 1).ptr;
    std::from_chars(text, end, entry);
  }
  return K;
}

// Returns the frequencies of the given matrix including its supports [rad/s], ascending.
Eigen::VectorXd given_frequencies(const Scene& scene, const Eigen::MatrixXd& K) {
  const Eigen::VectorXd root = masses(scene).cwiseSqrt().cwiseInverse();
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(root.asDiagonal() * K * root.asDiagonal())
      .eigenvalues()
      .cwiseAbs()
      .cwiseSqrt();
}

double largest_shift(const Eigen::VectorXd& omega, const Eigen::VectorXd& given) {
  return ((given.tail(omega.size()) - omega).array() / omega.array()).abs().maxCoeff();
}

// Returns the frequencies that a warning lists.
std::vector<double> listed(const std::string& message) {
  std::vector<double> values;
  const std::string before = "vibrate at ";
  const char* at = message.c_str() + message.find(before) + before.size();
  const char* const end = message.c_str() + message.find(" Hz");
  while (at < end) {
    double value = 0.0;
    at = std::from_chars(at, end, value).ptr + 2;
    values.push_back(value);
  }
  return values;
}

// A braced tower of three sections stands on springs whose stiffness is 1e-5 of the largest eigenvalue of K.
// Six frequencies below 0.3 Hz are removed and reported.
TEST(HeldMatrices, TheRemovedFrequenciesAreReportedInHertz) {
  const Scene tower = square_truss(3);
  Eigen::MatrixXd K = assembled(tower);
  const double norm = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(K).eigenvalues().tail<1>()[0];
  K = grounded(K, {0, 1, 2, 3}, 1e-5 * norm);
  ExactMatrix exact{36, std::vector<Exact>(36 * 36)};
  for (std::size_t i = 0; i < 36; ++i)
    for (std::size_t j = 0; j < 36; ++j)
      exact(i, j) = K(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  const std::vector<Exact> squares = exact_eigenvalues(exact);
  Eigen::VectorXd given(36);
  for (Eigen::Index k = 0; k < 36; ++k)
    given[k] = std::sqrt(static_cast<double>(squares[static_cast<std::size_t>(k)]));

  Faults warnings;
  const Structure structure = build(with_matrix(tower, K), &warnings);
  ASSERT_EQ(structure.omega.size(), 30);
  ASSERT_EQ(warnings.size(), 1u);
  const std::string& message = warnings[0].message;
  EXPECT_EQ(message.find("link 'K': the stiffness matrix resists rigid motion, as supports do"), 0u)
      << message;
  EXPECT_NE(message.find("give the matrix without supports"), std::string::npos) << message;
  const std::vector<double> hertz = listed(message);
  ASSERT_EQ(hertz.size(), 6u) << message;
  // the expected frequencies are those of a rigid body, because the compliance of the structure changes the
  // frequencies only at second order
  for (std::size_t k = 0; k < 6; ++k)
    EXPECT_NEAR(hertz[k], given[static_cast<Eigen::Index>(k)] / (2.0 * M_PI), 1e-3 * hertz[k]) << k;
  const double moved = largest_shift(structure.omega, given);
  EXPECT_LT(moved, structure.frequency_accuracy);
  EXPECT_GT(10.0 * moved, structure.frequency_accuracy);
  std::printf("%s\nlargest shift %.2e, stated %.2e\n", message.c_str(), moved, structure.frequency_accuracy);
}

// One spring to ground resists one rigid motion.
TEST(HeldMatrices, OnlyRigidMotionsThatTheMatrixHoldsAreReported) {
  const Scene tower = square_truss(3);
  Eigen::MatrixXd K = assembled(tower);
  K(5, 5) += 2.0;
  Faults warnings;
  build(with_matrix(tower, K), &warnings);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(listed(warnings[0].message).size(), 1u) << warnings[0].message;
}

TEST(HeldMatrices, RoundingErrorsOfAFreeMatrixAreNotTakenForASupport) {
  const Scene tower = square_truss(3);
  Faults warnings;
  const Structure structure = build(with_matrix(tower, assembled(tower)), &warnings);
  EXPECT_TRUE(warnings.empty());
  EXPECT_LT(structure.frequency_accuracy, 1e-12);
}

// Tables of 6 to 12 digits have errors in their last digit. Errors in the last digit raise the stated
// accuracy and are not taken for a support, but a stiffer support is detected.
TEST(HeldMatrices, SupportsAreDistinguishedFromRoundingToPrintedDigits) {
  const Scene tower = uneven(square_truss(3));
  const Eigen::MatrixXd K = assembled(tower);
  for (const int digits : {6, 7, 9, 12}) {
    SCOPED_TRACE(digits);
    const Eigen::MatrixXd table = printed(K, digits);
    Faults warnings;
    const Structure structure = build(with_matrix(tower, table), &warnings);
    EXPECT_TRUE(warnings.empty()) << warnings[0].message;
    const double moved = largest_shift(structure.omega, given_frequencies(tower, table));
    EXPECT_LE(moved, structure.frequency_accuracy + 1e-13);  // rounding error of the eigensolver
    std::printf("%d digits: largest shift %.1e, stated %.1e\n", digits, moved, structure.frequency_accuracy);
    if (digits == 6)
      continue;  // here the support below would be refused, because it is too stiff for a free structure
    // on each of four points the support is forty units of the last digit of the largest entry
    const double unit = std::pow(10.0, std::floor(std::log10(K.maxCoeff())) + 1.0 - digits);
    build(with_matrix(tower, printed(grounded(K, {0, 1, 2, 3}, 40.0 * unit), digits)), &warnings);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].message.find("as supports do"), std::string::npos) << warnings[0].message;
  }
}

// In a long and thin structure the rounding errors of six digits are as large as the bending stiffness.
TEST(HeldMatrices, MatricesOfTooFewDigitsForALongStructureAreReported) {
  Scene truss = uneven(square_truss(26));
  for (PointMass& point : truss.points) point.position.tail<2>() *= 0.2;
  const Eigen::MatrixXd table = printed(assembled(truss), 6);
  Faults warnings;
  const Structure structure = build(with_matrix(truss, table), &warnings);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].message.find("by the rounding of its digits"), std::string::npos)
      << warnings[0].message;
  EXPECT_NE(warnings[0].message.find("write the matrix with more digits"), std::string::npos);
  const double moved = largest_shift(structure.omega, given_frequencies(truss, table));
  EXPECT_LE(moved, structure.frequency_accuracy);
  std::printf("%s\nlargest shift %.1e, stated %.1e\n", warnings[0].message.c_str(), moved,
              structure.frequency_accuracy);
}

// The stiffness matrix of the protein is printed with few digits, or springs to ground hold it. The stiffness
// of the springs is 1e-6 of the largest diagonal entry.
TEST(HeldMatrices, TheFrequencyShiftOfTheProteinIsWithinTheStatedAccuracy) {
  const io::SceneResult read =
      io::read_scene(std::string(FREEFLEX_SOURCE_DIR) + "/service/scenes/network.yaml");
  ASSERT_TRUE(read.scene);
  const Scene& network = *read.scene;
  const Eigen::MatrixXd K = assembled(network);
  std::vector<int> all;
  for (int i = 0; i < static_cast<int>(network.points.size()); ++i) all.push_back(i);
  const double norm = K.diagonal().maxCoeff();
  struct Case {
    const char* name;
    Eigen::MatrixXd K;
    bool is_said;
  };
  for (const Case& each :
       {Case{"six digits", printed(K, 6), false}, Case{"nine digits", printed(K, 9), false},
        Case{"six points on springs", grounded(K, {3, 17, 30, 41, 55, 70}, 1e-6 * norm), true},
        Case{"all points on springs", grounded(K, all, 1e-6 * norm), true}}) {
    SCOPED_TRACE(each.name);
    Faults warnings;
    const Structure structure = build(with_matrix(network, each.K), &warnings);
    EXPECT_EQ(warnings.size(), each.is_said ? 1u : 0u);
    const double moved = largest_shift(structure.omega, given_frequencies(network, each.K));
    EXPECT_LE(moved, structure.frequency_accuracy + 1e-12);  // rounding error of the eigensolver
    std::printf("protein, %s: largest shift %.2e, stated %.2e\n", each.name, moved,
                structure.frequency_accuracy);
  }
}

// Each scene has random masses, springs, and two matrix links that share two points. The matrices contain
// errors.
TEST(HeldMatrices, TheStatedAccuracyCoversTheFrequencyShift) {
  double tightest = 1e300, loosest = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 engine(seed);
    std::normal_distribution<double> normal;
    Scene scene = random_structure(seed, 10);
    scene.publication.links.clear();
    Eigen::MatrixXd given = Eigen::MatrixXd::Zero(30, 30);
    std::vector<Link> matrices;
    for (const std::vector<int>& points : {std::vector<int>{0, 1, 2, 3, 4, 5}, {4, 5, 6, 7, 8, 9}}) {
      Scene substructure;
      for (const int point : points)
        substructure.points.push_back(scene.points[static_cast<std::size_t>(point)]);
      join_all(substructure, 1e5);
      Eigen::MatrixXd K = assembled(substructure), noise(18, 18);
      for (double& entry : noise.reshaped()) entry = normal(engine);
      // errors whose eigenvalues have one sign, or both signs
      noise = seed % 2 == 0 ? Eigen::MatrixXd(noise * noise.transpose() / 18.0)
                            : Eigen::MatrixXd(noise + noise.transpose());
      // the error is 4e-6 to 4e-9 relative to the matrix
      K += 0.3 * std::pow(10.0, -static_cast<double>(seed % 4)) * noise;
      Link link;
      link.name = "K" + std::to_string(matrices.size());
      link.points = points;
      link.kind = MatrixLink{K.sparseView()};
      matrices.push_back(link);
      for (std::size_t i = 0; i < points.size(); ++i)
        for (std::size_t j = 0; j < points.size(); ++j)
          given.block<3, 3>(3 * points[i], 3 * points[j]) +=
              K.block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(j));
    }
    scene.links.resize(20);
    given += assembled(scene);
    scene.links.insert(scene.links.end(), matrices.begin(), matrices.end());
    const Structure structure = build(scene);
    const double moved = largest_shift(structure.omega, given_frequencies(scene, given));
    EXPECT_LE(moved, structure.frequency_accuracy + 1e-13);  // rounding error of the eigensolver
    tightest = std::min(tightest, structure.frequency_accuracy / moved);
    loosest = std::max(loosest, structure.frequency_accuracy / moved);
  }
  std::printf("stated accuracy over the largest shift: %.1f to %.1f\n", tightest, loosest);
}

}  // namespace
}  // namespace freeflex::testing
