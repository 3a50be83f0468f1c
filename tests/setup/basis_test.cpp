// Unit elastic displacements by every recipe (Alekseev 1970, sections 3, 6 and 7).
#include "core/paper/basis.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>
#include <map>
#include <numeric>

#include "core/structure/masses/mass_properties.hpp"
#include "tests/setup/all_bases.hpp"
#include "tests/setup/shape_scenes.hpp"

namespace freeflex::testing {
namespace {

std::vector<int> in_turn(const Scene& scene) {
  std::vector<int> numbering(scene.points.size());
  std::iota(numbering.begin(), numbering.end(), 0);
  return numbering;
}

MassProperties properties_of(const Scene& scene) {
  Faults faults;
  return find_mass_properties(scene, faults);
}

// Returns the rank of the force groups of a recipe for the points in their given order, without rigid links.
std::size_t rank_in_turn(const Scene& scene, Recipe recipe) {
  const Eigen::MatrixXd groups = force_groups(recipe, scene.points, properties_of(scene), in_turn(scene));
  return independent_groups(Eigen::MatrixXd(0, groups.rows()), groups).kept.size();
}

Basis basis_of(const Scene& scene, Recipe recipe) {
  const Structure structure = build(scene);
  Faults faults;
  std::string why_not;
  Basis basis = find_basis(scene, structure, factor_links(scene, false, faults), recipe, why_not);
  EXPECT_EQ(why_not, "");
  return basis;
}

// Returns the points of a grid in a plane, row by row.
Scene grid(int rows, int columns) {
  Scene scene;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) add_point(scene, 1.0, {0.1, 1.0 * i, 1.0 * j});
  join_all(scene, 1e4);
  return scene;
}

TEST(ForceGroups, EachRecipeGivesTheExpectedNumberOfGroupsInEquilibrium) {
  for (const auto& [name, num_elastic, scene] : every_class(3, {1.0, 1.0})) {
    const MassProperties properties = properties_of(scene);
    const Recipe own = recipe_of(shape_class(scene.points, properties));
    const auto num_points = static_cast<Eigen::Index>(scene.points.size());
    for (const Recipe recipe : {own, Recipe::kFormal}) {
      const Eigen::MatrixXd f = force_groups(recipe, scene.points, properties, in_turn(scene));
      EXPECT_EQ(f.cols(),
                recipe == Recipe::kFormal ? 3 * num_points : 3 * num_points - properties.rigid_freedoms)
          << name;
      for (Eigen::Index l = 0; l < f.cols(); ++l) {
        Eigen::Vector3d force = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();
        for (Eigen::Index i = 0; i < num_points; ++i) {
          force += f.block<3, 1>(3 * i, l);
          moment += properties.r.col(i).cross(f.block<3, 1>(3 * i, l));
        }
        // the sums have some ten terms of order one with one rounding error each, and arms of up to 6 m
        EXPECT_LT(force.norm(), 1e-14) << name << ' ' << name_of(recipe) << ' ' << l;
        EXPECT_LT(moment.norm(), 3e-14) << name << ' ' << name_of(recipe) << ' ' << l;
      }
    }
  }
}

// A unit load minus its formal group gives accelerations that strain no link (THEORY 11.1 to 11.3).
TEST(ForceGroups, AUnitLoadMinusItsFormalGroupAcceleratesRigidly) {
  for (const auto& [name, num_elastic, scene] : every_class(4, {2.0, 1.0})) {
    const MassProperties properties = properties_of(scene);
    const Eigen::MatrixXd F = force_groups(Recipe::kFormal, scene.points, properties, in_turn(scene));
    const Eigen::MatrixXd S = Eigen::MatrixXd::Identity(F.rows(), F.rows()) - F;
    const Eigen::MatrixXd acceleration = masses(scene).cwiseInverse().asDiagonal() * S;
    for (std::size_t i = 0; i < scene.points.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const Eigen::Vector3d u = (scene.points[j].position - scene.points[i].position).normalized();
        const Eigen::RowVectorXd stretch =
            u.transpose() * (acceleration.middleRows<3>(3 * static_cast<Eigen::Index>(j)) -
                             acceleration.middleRows<3>(3 * static_cast<Eigen::Index>(i)));
        EXPECT_LT(stretch.cwiseAbs().maxCoeff(), 1e-13 * acceleration.cwiseAbs().maxCoeff()) << name;
      }
  }
}

TEST(Basis, IsCompleteAndOrthonormalForEveryShapeAndMassRatiosUpTo1e12) {
  struct Worst {
    double gram = 0.0, force = 0.0, moment = 0.0, constraint = 0.0, least_kept = 1.0, most_skipped = 0.0;
  };
  std::map<std::string, Worst> worst_of;
  for (const double decades : {0.0, 6.0, 12.0})
    for (std::uint64_t seed = 1; seed <= 20; ++seed)
      for (const auto& [name, num_elastic, scene] : every_class(seed, {decades, 1.0})) {
        const Bases bases = bases_of(scene);
        for (const Basis& basis : bases.all) {
          SCOPED_TRACE(name + ", " + name_of(basis.recipe) + ", " + std::to_string(decades) +
                       " decades, seed " + std::to_string(seed));
          EXPECT_EQ(basis.num_expected, num_elastic);
          EXPECT_EQ(basis.rank(), num_elastic);
          EXPECT_LT(basis.gram_error, 1e-12);
          EXPECT_LT(basis.force_residual, 1e-12);
          EXPECT_LT(basis.moment_residual, 1e-12);
          EXPECT_LT(basis.constraint_residual, 1e-12);
          Worst& worst = worst_of[name_of(basis.recipe)];
          worst.gram = std::max(worst.gram, basis.gram_error);
          worst.force = std::max(worst.force, basis.force_residual);
          worst.moment = std::max(worst.moment, basis.moment_residual);
          worst.constraint = std::max(worst.constraint, basis.constraint_residual);
          worst.least_kept = std::min(worst.least_kept, basis.choice.least_kept);
          worst.most_skipped = std::max(worst.most_skipped, basis.choice.most_skipped);
        }
      }
  for (const auto& [name, worst] : worst_of)
    std::printf("%-11s Gram %.1e, sum m b %.1e, sum m r x b %.1e, C b %.1e; kept >= %.1e, skipped <= %.1e\n",
                name.c_str(), worst.gram, worst.force, worst.moment, worst.constraint, worst.least_kept,
                worst.most_skipped);
}

// The residuals that Basis reports are recomputed from b with 64-bit mantissas.
TEST(Basis, ReportsItsResidualsCorrectly) {
  for (const auto& [name, num_elastic, scene] : every_class(2, {12.0, 1.0})) {
    const MassProperties properties = properties_of(scene);
    for (const Basis& basis : bases_of(scene).all) {
      const Eigen::Matrix<long double, -1, -1> b = basis.shapes.cast<long double>();
      long double force = 0.0L, gram = 0.0L;
      for (Eigen::Index l = 0; l < b.cols(); ++l) {
        Eigen::Matrix<long double, 3, 1> sum = Eigen::Matrix<long double, 3, 1>::Zero();
        long double size = 0.0L;
        for (std::size_t i = 0; i < scene.points.size(); ++i) {
          const auto at = 3 * static_cast<Eigen::Index>(i);
          sum += static_cast<long double>(scene.points[i].mass) * b.block<3, 1>(at, l);
          size += static_cast<long double>(scene.points[i].mass) * b.block<3, 1>(at, l).norm();
        }
        force = std::max(force, sum.norm() / size);
        for (Eigen::Index u = 0; u < b.cols(); ++u) {
          const long double product =
              (b.col(l).array() * masses(scene).cast<long double>().array() * b.col(u).array()).sum();
          gram = std::max(
              gram, std::abs(product / static_cast<long double>(properties.mass) - (l == u ? 1.0L : 0.0L)));
        }
      }
      // the sums in Basis have the rounding errors of some 30 terms
      EXPECT_LT(std::abs(static_cast<double>(force) - basis.force_residual), 5e-15) << name;
      EXPECT_LT(std::abs(static_cast<double>(gram) - basis.gram_error), 5e-15) << name;
    }
  }
}

TEST(Basis, TheBasisOfOnePointIsEmpty) {
  Scene scene;
  add_point(scene, 2.0, {1.0, 2.0, 3.0});
  for (const Recipe recipe : {Recipe::kCollinear, Recipe::kPlanar, Recipe::kSpatial, Recipe::kFormal,
                              Recipe::kHouseholder, Recipe::kModes}) {
    const Basis basis = basis_of(scene, recipe);
    EXPECT_EQ(basis.rank(), 0) << name_of(recipe);
    EXPECT_TRUE(basis.is_complete()) << name_of(recipe);
  }
}

TEST(Basis, RenumberingACubeGivesAll18GroupsInsteadOf15) {
  const Scene scene = cube(1, {0.0, 0.0});
  EXPECT_EQ(rank_in_turn(scene, Recipe::kSpatial), 15u);
  const Basis basis = basis_of(scene, Recipe::kSpatial);
  EXPECT_EQ(basis.rank_as_numbered, 15);
  EXPECT_EQ(basis.rank(), 18);
  EXPECT_TRUE(basis.choice.skipped.empty());
  std::vector<int> sorted = basis.numbering;
  EXPECT_NE(sorted, in_turn(scene));
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(sorted, in_turn(scene));
}

TEST(Basis, RenumberingASquareTrussGivesAll66GroupsInsteadOf55) {
  const Scene scene = square_truss(6);
  EXPECT_EQ(rank_in_turn(scene, Recipe::kSpatial), 55u);
  const Basis basis = basis_of(scene, Recipe::kSpatial);
  EXPECT_EQ(basis.rank_as_numbered, 55);
  EXPECT_EQ(basis.rank(), 66);
}

// A window consists of a few successive points of the numbering. It is flat if its points lie at one
// position, on one line or in one plane (THEORY 11.10). A recipe is complete if and only if no window of its
// numbering is flat.
TEST(Basis, AnExplicitRecipeIsCompleteIfAndOnlyIfNoWindowIsFlat) {
  Engine engine(7);
  int num_complete = 0, num_short = 0;
  for (int attempt = 0; attempt < 400; ++attempt) {
    Scene scene;
    const int num_points = 5 + attempt % 4, thickness = attempt % 2;
    while (static_cast<int>(scene.points.size()) < num_points) {
      const Eigen::Vector3d position(static_cast<double>(engine() % 3), static_cast<double>(engine() % 3),
                                     thickness * static_cast<double>(engine() % 3));
      const bool is_taken = std::any_of(scene.points.begin(), scene.points.end(),
                                        [&](const PointMass& point) { return point.position == position; });
      if (!is_taken) add_point(scene, 1.0, position);
    }
    const MassProperties properties = properties_of(scene);
    const ShapeClass shape = shape_class(scene.points, properties);
    if (shape == ShapeClass::kCollinear) continue;
    const Recipe recipe = recipe_of(shape);
    const std::vector<int> window = flattest_window(recipe, properties, in_turn(scene));
    const bool is_complete =
        rank_in_turn(scene, recipe) == 3 * scene.points.size() - static_cast<std::size_t>(6);
    EXPECT_EQ(is_complete, window_spread(properties, window) >= kFlatWindow) << attempt;
    (is_complete ? num_complete : num_short) += 1;
  }
  // complete and incomplete recipes must both occur
  EXPECT_GT(num_complete, 20);
  EXPECT_GT(num_short, 20);
}

TEST(Basis, AGridNumberedByRowsIsIncompleteAndAnotherNumberingIsComplete) {
  const Scene scene = grid(3, 3);
  EXPECT_LT(rank_in_turn(scene, Recipe::kPlanar), 21u);
  const Basis basis = basis_of(scene, Recipe::kPlanar);
  EXPECT_EQ(basis.rank(), 21);
  EXPECT_TRUE(basis.flat_window.empty());
}

// The points are ten points in a plane and an apex. A window of the spatial recipe has four successive
// points, so eleven points have eight windows. In any numbering the apex lies in at most four of them. The
// other windows, at least four, contain only points of the plane and are flat.
TEST(Basis, IfNoNumberingIsCompleteFourPointsInOnePlaneAreReported) {
  Scene scene = grid(2, 5);
  add_point(scene, 1.0, {1.0, 0.3, 1.7});
  join_all(scene, 1e4);
  const Basis basis = basis_of(scene, Recipe::kSpatial);
  // each flat window reduces the rank by one
  EXPECT_EQ(basis.rank(), 27 - 4);
  EXPECT_FALSE(basis.is_complete());
  ASSERT_EQ(basis.flat_window.size(), 4u);
  for (const int point : basis.flat_window) EXPECT_LT(point, 10);
  // the formal recipe is complete
  EXPECT_TRUE(basis_of(scene, Recipe::kFormal).is_complete());
}

TEST(Basis, IfOnlyOnePointIsOffALineThreePointsOfTheLineAreReported) {
  Scene scene;
  for (int i = 0; i < 8; ++i) add_point(scene, 1.0, {1.0 * i, 2.0 * i, 0.0});
  add_point(scene, 1.0, {0.0, 1.0, 0.0});
  join_all(scene, 1e4);
  const Basis basis = basis_of(scene, Recipe::kPlanar);
  EXPECT_FALSE(basis.is_complete());
  ASSERT_EQ(basis.flat_window.size(), 3u);
  for (const int point : basis.flat_window) EXPECT_LT(point, 8);
}

TEST(Basis, ARecipeForAnotherShapeIsRefusedWithTheShapeItNeeds) {
  const Scene scene = cloud(1, 5, {1.0, 1.0});
  const Structure structure = build(scene);
  Faults faults;
  std::string why_not;
  const Basis basis =
      find_basis(scene, structure, factor_links(scene, false, faults), Recipe::kCollinear, why_not);
  EXPECT_EQ(basis.rank(), 0);
  EXPECT_NE(why_not.find("needs a collinear shape, but this shape is spatial"), std::string::npos) << why_not;
}

// The coefficients C_ul of the vectors u reproduce every group l (THEORY 11.11). They are zero for the
// vectors that come after the vector of the group.
TEST(Basis, TheTriangularCoefficientsReproduceEveryForceGroup) {
  for (const auto& [name, num_elastic, scene] : every_class(5, {6.0, 1.0})) {
    if (name == "partly rigid") continue;  // rigid links carry a part of the groups of this scene
    const MassProperties properties = properties_of(scene);
    for (const Basis& basis : bases_of(scene).all) {
      if (basis.coefficients.size() == 0) continue;
      SCOPED_TRACE(name + ", " + name_of(basis.recipe));
      const Eigen::MatrixXd beta = properties.mass * masses(scene).cwiseInverse().asDiagonal() *
                                   force_groups(basis.recipe, scene.points, properties, basis.numbering);
      const Eigen::VectorXd root_mass = masses(scene).cwiseSqrt();
      const Eigen::MatrixXd error = root_mass.asDiagonal() * (basis.shapes * basis.coefficients - beta);
      const Eigen::MatrixXd size = root_mass.asDiagonal() * beta;
      // a unit load on a heavy point gives a group as small as the ratio of the lightest to the heaviest
      // mass, and the rounding error of this group is relatively large
      const double load = properties.mass / root_mass.minCoeff();
      for (Eigen::Index l = 0; l < beta.cols(); ++l)
        EXPECT_LT(error.col(l).norm(), 1e-14 * size.col(l).norm() + 1e-15 * load) << l;
      for (std::size_t l = 0; l < basis.choice.kept.size(); ++l) {
        const auto column = basis.coefficients.col(basis.choice.kept[l]);
        EXPECT_GT(column[static_cast<Eigen::Index>(l)], 0.0);
        for (Eigen::Index later = static_cast<Eigen::Index>(l) + 1; later < column.size(); ++later)
          EXPECT_EQ(column[later], 0.0);
      }
    }
  }
}

// THEORY 11.13, 11.15, 11.18
TEST(Basis, AnyTwoBasesAreRelatedByAnOrthogonalMatrix) {
  for (const auto& [name, num_elastic, scene] : every_class(6, {4.0, 1.0})) {
    Engine engine(11);
    const Bases bases = bases_of(scene);
    Eigen::VectorXd load(3 * static_cast<Eigen::Index>(scene.points.size()));
    for (double& component : load) component = uniform(engine, -1.0, 1.0);
    for (const Basis& from : bases.all)
      for (const Basis& to : bases.all) {
        SCOPED_TRACE(name + ", " + name_of(from.recipe) + " to " + name_of(to.recipe));
        const Eigen::MatrixXd a = change_of_basis(scene.points, from, to);
        const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(a.rows(), a.rows());
        EXPECT_LT((a * a.transpose() - one).cwiseAbs().maxCoeff(), 1e-13);
        const double largest = to.shapes.cwiseAbs().maxCoeff();
        EXPECT_LT((from.shapes * a.transpose() - to.shapes).cwiseAbs().maxCoeff(), 1e-13 * largest);
        const Eigen::VectorXd Q = from.shapes.transpose() * load, Q_to = to.shapes.transpose() * load;
        EXPECT_LT((a * Q - Q_to).norm(), 1e-12 * Q.norm());
      }
  }
}

// A shape with a width of 1e-9 of its length is not a line, so n = 3N - 6, not 3N - 5.
TEST(Basis, TheBasisOfAShapeNearlyOnALineIsComplete) {
  Engine engine(3);
  Scene scene;
  for (int i = 0; i < 6; ++i)
    add_point(scene, 1.0 + i, Eigen::Vector3d(1.0 * i, 0.0, 0.0) + 1e-9 * random_vector(engine));
  join_all(scene, 1e4);
  Faults faults;
  const Structure structure = build(scene);
  for (const Recipe recipe : {Recipe::kFormal, Recipe::kHouseholder}) {
    std::string why_not;
    const Basis basis = find_basis(scene, structure, factor_links(scene, false, faults), recipe, why_not);
    EXPECT_EQ(basis.rank(), 18 - 6) << name_of(recipe);
    EXPECT_LT(basis.gram_error, 1e-12);
    EXPECT_LT(basis.force_residual, 1e-12);
    EXPECT_LT(basis.moment_residual, 1e-12);
  }
}

}  // namespace
}  // namespace freeflex::testing
