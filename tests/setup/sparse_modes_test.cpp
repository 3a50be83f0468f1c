// These tests compare the sparse set-up with the dense set-up on the same scenes, and check the messages of
// the sparse set-up.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/rounding.hpp"
#include "service/io/scene/machine.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/mixed_structures.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

std::string text_of(const Faults& faults) {
  std::string text;
  for (const Fault& fault : faults) text += fault.message + "\n";
  return text;
}

std::optional<Structure> sparse(Scene scene, int count, Faults& faults) {
  scene.modes = {};
  scene.modes.count = count;
  return build_structure_by(scene, SetupPath::kSparse, faults);
}

// Returns the response of every point to a force on every point, from the lowest modes. The response does not
// depend on signs or on the choice of modes of equal frequency. Mechanisms are given the flexibility of the
// first elastic mode.
Eigen::MatrixXd response(const Eigen::MatrixXd& rows, const Eigen::VectorXd& omega, Eigen::Index count) {
  Eigen::VectorXd softness(count);
  const double first = omega[std::min<Eigen::Index>((omega.head(count).array() == 0.0).count(), count - 1)];
  for (Eigen::Index k = 0; k < count; ++k) softness[k] = 1.0 / (omega[k] > 0.0 ? omega[k] : first);
  const Eigen::MatrixXd scaled = rows.leftCols(count) * softness.asDiagonal();
  return scaled * scaled.transpose();
}

double difference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.size() == 0 ? 0.0 : (a - b).cwiseAbs().maxCoeff() / std::max(a.cwiseAbs().maxCoeff(), 1e-300);
}

// Compares the two set-ups on a scene. The stated accuracies apply to the lowest elastic frequency. The
// responses from the mode shapes must agree within 1e-8 of the largest response.
void expect_equal(const Scene& scene, int count, const std::string& what) {
  SCOPED_TRACE(what);
  Faults faults;
  const auto whole = build_structure_by(scene, SetupPath::kDense, faults);
  ASSERT_TRUE(whole) << text_of(faults);
  Faults sparse_faults;
  const auto few = sparse(scene, count, sparse_faults);
  ASSERT_TRUE(few) << text_of(sparse_faults);
  ASSERT_GE(few->omega.size(), count);
  EXPECT_TRUE(few->kept.is_subset);
  const Eigen::Index n = few->omega.size();
  ASSERT_LE(n, whole->omega.size());
  EXPECT_EQ(few->num_constraints, whole->num_constraints);
  EXPECT_EQ(few->mechanisms.size(), whole->mechanisms.size());
  // the stated accuracy holds for the lowest frequency, but higher frequencies add rounding errors, because
  // the membrane stiffness is a thousand times the bending stiffness
  const double accuracy = few->frequency_accuracy + whole->frequency_accuracy + 4096.0 * kEpsilon;
  for (Eigen::Index k = 0; k < n; ++k)
    EXPECT_LE(std::abs(few->omega[k] - whole->omega[k]), accuracy * whole->omega[k]) << "mode " << k;
  EXPECT_LT(difference(response(whole->shapes, whole->omega, n), response(few->shapes, few->omega, n)), 1e-8);
  ASSERT_EQ(few->link_forces.size(), whole->link_forces.size());
  // links within a rigid body carry only rounding errors, so all links are compared relative to the link with
  // the largest force
  double largest = 0.0;
  for (const LinkForceRows& force : whole->link_forces)
    if (force.rows.rows() > 0)
      largest = std::max(largest, response(force.rows, whole->omega, n).cwiseAbs().maxCoeff());
  for (std::size_t k = 0; k < few->link_forces.size(); ++k) {
    if (few->link_forces[k].rows.rows() == 0) continue;
    EXPECT_LT((response(whole->link_forces[k].rows, whole->omega, n) -
               response(few->link_forces[k].rows, few->omega, n))
                  .cwiseAbs()
                  .maxCoeff(),
              1e-8 * largest)
        << "link " << whole->link_forces[k].link;
  }
  EXPECT_LT(
      difference(response(whole->particles.shapes, whole->omega, std::min(n, whole->particles.shapes.cols())),
                 response(few->particles.shapes, few->omega, std::min(n, few->particles.shapes.cols()))),
      1e-8);
}

void publish_elastic(Scene& scene) {
  publish_everything(scene);
  auto& links = scene.publication.links;
  links.erase(
      std::remove_if(links.begin(), links.end(),
                     [&](int link) {
                       return std::holds_alternative<Rigid>(scene.links[static_cast<std::size_t>(link)].kind);
                     }),
      links.end());
}

TEST(SparseModes, AgreeWithTheDenseSetUpOnRandomSprings) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed)
    for (const int count : {1, 7, 13}) {
      Scene scene = random_structure(seed, 8 + static_cast<int>(seed % 5));
      publish_elastic(scene);
      expect_equal(scene, count, "seed " + std::to_string(seed) + ", " + std::to_string(count) + " modes");
    }
}

TEST(SparseModes, AgreeWithTheDenseSetUpOnLinksOfEveryKind) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Scene scene = random_mixture(seed, 8 + static_cast<int>(seed % 9));
    publish_elastic(scene);
    expect_equal(scene, 6, "seed " + std::to_string(seed));
  }
}

TEST(SparseModes, AreAllModesIfAllAreRequested) {
  const Scene scene = random_structure(5, 9);
  expect_equal(scene, 21, "all");
}

TEST(SparseModes, AgreeWithTheDenseSetUpOnSquareTrusses) {
  for (const int sections : {5, 26}) expect_equal(square_truss(sections), 20, "truss");
  expect_equal(truss_s4(), 20, "stiffness ratio 1e4, mass ratio 1e4");
}

// Every third point of a truss is a body with an offset, and one point is massless.
TEST(SparseModes, AgreeWithTheDenseSetUpOnBodiesAndMasslessPoints) {
  Scene scene = square_truss(6);
  for (std::size_t i = 0; i < scene.points.size(); i += 3) {
    PointMass& point = scene.points[i];
    point.inertia = Eigen::Vector3d(0.2, 0.25, 0.3).asDiagonal();
    point.offset = {0.1, 0.05, -0.1};
  }
  // beams along and across the truss resist the rotation of the bodies
  for (int i = 0; i < 24; ++i) {
    add_link(scene, i, 4 * (i / 4) + (i + 1) % 4, Beam{1e5, 1e3, 1e3, 2e3});
    if (i + 4 < 24) add_link(scene, i, i + 4, Beam{1e5, 1e3, 1e3, 2e3});
  }
  scene.points[10].mass = 0.0;
  publish_elastic(scene);
  expect_equal(scene, 16, "bodies");
  // a rigid link with a body among its points
  add_link(scene, 3, 14, Rigid{});
  publish_elastic(scene);
  expect_equal(scene, 16, "bodies, one with an arm");
}

TEST(SparseModes, OmitTheFreeTorsionOfAStraightChainOfBeams) {
  Scene scene;
  for (int i = 0; i < 12; ++i) add_point(scene, 1.0, {0.48 * i, 0.6 * i, 0.64 * i});
  add_point(scene, 1.0, {1.0, -1.0, 0.5});
  for (int i = 0; i < 11; ++i) add_link(scene, i, i + 1, Beam{1e5, 1e3, 1e3, 2e3});
  // the chain hangs on springs, and these springs leave the rotation of the chain about its line free
  for (int i = 0; i < 12; i += 2) add_link(scene, i, 12, Spring{1e3});
  expect_equal(scene, 8, "chain");
}

TEST(SparseModes, MechanismsAreReportedAsByTheDenseSetUp) {
  Scene scene = square_truss(6);
  const int hung = add_point(scene, 1.0, {2.0, 0.5, 1.5});
  add_link(scene, 10, hung, Spring{1e4});
  Faults faults;
  const Structure whole = build(scene);
  const auto few = sparse(scene, 10, faults);
  ASSERT_TRUE(few) << text_of(faults);
  ASSERT_EQ(whole.mechanisms.size(), 2U);
  ASSERT_EQ(few->mechanisms.size(), 2U) << text_of(faults);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(few->mechanisms[k].moved_points, std::vector<int>{hung});
    EXPECT_EQ(few->omega[static_cast<Eigen::Index>(k)], 0.0);
  }
  expect_equal(scene, 10, "hung point");
  EXPECT_NE(text_of(faults).find("mechanism 1 of 2"), std::string::npos);
}

TEST(SparseModes, ASoftStructureIsNotTakenForAMechanism) {
  Scene scene = square_truss(6);
  const int hung = add_point(scene, 1.0, {2.0, 0.5, 1.5});
  for (const int other : {9, 10, 11}) add_link(scene, other, hung, Spring{1e-7});
  Faults faults;
  const auto few = sparse(scene, 10, faults);
  ASSERT_TRUE(few) << text_of(faults);
  EXPECT_TRUE(few->mechanisms.empty());
  const Structure whole = build(scene);
  for (Eigen::Index k = 0; k < 10; ++k)
    EXPECT_NEAR(few->omega[k] / whole.omega[k], 1.0, 1e-10) << "mode " << k;
}

TEST(SparseModes, MasslessPointsNotHeldInEveryDirectionAreRefused) {
  Scene scene = square_truss(6);
  const int hung = add_point(scene, 0.0, {2.0, 0.5, 1.5});
  add_link(scene, 10, hung, Spring{1e4});
  Faults faults;
  EXPECT_FALSE(sparse(scene, 10, faults));
  EXPECT_NE(text_of(faults).find("has no mass, and links do not hold it"), std::string::npos)
      << text_of(faults);
}

TEST(SparseModes, ASceneWithMoreThanFiveMechanismsIsRefused) {
  Scene scene;
  for (int i = 0; i < 30; ++i) add_point(scene, 1.0, {1.0 * i, 0.1 * (i % 3), 0.1 * (i % 2)});
  for (int i = 0; i < 29; ++i) add_link(scene, i, i + 1, Spring{1e4});
  Faults faults;
  EXPECT_FALSE(sparse(scene, 10, faults));
  EXPECT_NE(text_of(faults).find("more than five mechanisms"), std::string::npos) << text_of(faults);
}

TEST(SparseModes, ModesOfEqualFrequencyAreKeptTogether) {
  Faults faults;
  const auto few = sparse(square_truss(26), 1, faults);
  ASSERT_TRUE(few) << text_of(faults);
  EXPECT_EQ(few->omega.size(), 2);
  EXPECT_NEAR(few->omega[1] / few->omega[0], 1.0, 1e-10);
}

TEST(SparseModes, ModesBelowAFrequencyAgreeWithTheDenseSetUp) {
  Scene scene = square_truss(26);
  const Structure whole = build(scene);
  for (const double below : {3.0, 10.0, 20.0}) {
    scene.modes.below = below;
    Faults faults;
    const auto few = build_structure_by(scene, SetupPath::kSparse, faults);
    ASSERT_TRUE(few) << text_of(faults);
    const Eigen::Index expected = (whole.omega.array() < 2.0 * M_PI * below).count();
    EXPECT_EQ(few->omega.size(), expected);
    // no mode is missing below the verified frequency, which lies between the requested frequency and the
    // first mode that is not kept
    EXPECT_GE(few->kept.verified_below, below);
    EXPECT_LE(few->kept.verified_below, whole.omega[expected] / (2.0 * M_PI));
    Faults dense_faults;
    const auto dense = build_structure_by(scene, SetupPath::kDense, dense_faults);
    ASSERT_TRUE(dense);
    EXPECT_EQ(dense->omega.size(), expected);
  }
}

// The verified frequency is reported even if no mode is kept.
TEST(SparseModes, NoModesAreFoundBelowTheLowestFrequency) {
  Scene scene = square_truss(26);
  const Structure whole = build(scene);
  const double lowest = whole.omega[0] / (2.0 * M_PI);
  for (const double below : {1e-3, 0.5 * lowest, 0.99 * lowest}) {
    scene.modes.below = below;
    Faults faults;
    const auto no_modes = build_structure_by(scene, SetupPath::kSparse, faults);
    ASSERT_TRUE(no_modes) << text_of(faults);
    EXPECT_EQ(no_modes->omega.size(), 0);
    EXPECT_GE(no_modes->kept.verified_below, below);
    EXPECT_LE(no_modes->kept.verified_below, lowest);
  }
}

// The set-up finds all modes, and the verdict uses more modes than are kept.
TEST(SparseModes, ASmallSceneWithALimitOfModesGivesAPlan) {
  for (const int count : {1, 12, 40}) {
    Scene scene = square_truss(10);
    scene.modes.count = count;
    Faults faults;
    const auto structure = build_structure(scene, faults);
    ASSERT_TRUE(structure) << text_of(faults);
    const auto plan = make_plan(scene, *structure, faults);
    ASSERT_TRUE(plan) << text_of(faults);
    EXPECT_GE(plan->num_elastic, count);
    EXPECT_EQ(plan->num_elastic, structure->omega.size());
  }
}

TEST(SparseModes, TheSparseSetUpEndsOnRequest) {
  SetupProgress progress;
  progress.report = [](const std::string&, double) { return false; };
  Scene scene = square_truss(100);
  scene.modes.count = 50;
  Faults faults;
  EXPECT_FALSE(build_structure(scene, faults, progress));
  EXPECT_NE(text_of(faults).find("the set-up was ended"), std::string::npos);
}

// 12,000 freedoms, above the number from which work is shared out
TEST(SparseModes, HaveTheSameBitsOnOneThreadAndOnTwo) {
  Scene scene = square_truss(1000);
  scene.publication = {};
  scene.pushable.clear();
  scene.modes.count = 20;
  Faults faults;
  const auto alone = build_structure(scene, faults, {{}, 0.0, {}});
  int num_shared = 0;
  const auto share = [&](int count, const std::function<void(int)>& work) {
    ++num_shared;
    io::share_on_two_threads(count, work);
  };
  const auto shared = build_structure(scene, faults, {{}, 0.0, share});
  ASSERT_TRUE(alone && shared) << text_of(faults);
  EXPECT_GT(num_shared, 100);
  EXPECT_EQ(alone->omega, shared->omega);
  EXPECT_EQ(alone->shapes, shared->shapes);
}

}  // namespace
}  // namespace freeflex::testing
