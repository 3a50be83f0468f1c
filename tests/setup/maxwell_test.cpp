// Maxwell and influence coefficients (Alekseev 1970, sections 5 and 6).
#include "core/paper/maxwell.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cstdio>

#include "core/rounding.hpp"
#include "core/structure/masses/mass_properties.hpp"
#include "core/structure/modes/dense/decompositions.hpp"
#include "tests/setup/all_bases.hpp"
#include "tests/setup/shape_scenes.hpp"

namespace freeflex::testing {
namespace {

LinkFactor factor_of(const Scene& scene) {
  Faults faults;
  return factor_links(scene, false, faults);
}

// Returns the largest difference divided by the largest entry.
double difference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

double condition_of(const Eigen::MatrixXd& matrix) {
  const Eigen::VectorXd values = matrix.jacobiSvd().singularValues();
  return values[0] / values[values.size() - 1];
}

Scene square_without_diagonals() {
  Scene scene;
  add_point(scene, 1.0, {0.0, 0.0, 0.0});
  add_point(scene, 1.0, {1.0, 0.0, 0.0});
  add_point(scene, 1.0, {1.0, 1.0, 0.0});
  add_point(scene, 1.0, {0.0, 1.0, 0.0});
  for (int i = 0; i < 4; ++i) add_link(scene, i, (i + 1) % 4, Spring{1e3});
  return scene;
}

// One spring k joins m1 and m2. The elongation of the spring is q M / sqrt(m1 m2), so c = k M^2 / (m1 m2).
TEST(Maxwell, TheCoefficientsOfTwoPointsHaveTheClosedForm) {
  Scene scene;
  add_point(scene, 1.0, {0.0, 0.0, 0.0});
  add_point(scene, 3.0, {0.0, 2.0, 0.0});
  add_link(scene, 0, 1, Spring{500.0});
  const Bases bases = bases_of(scene);
  for (const Basis& basis : bases.all) {
    const Maxwell maxwell = find_maxwell(scene, bases.structure, bases.factor, basis.shapes);
    ASSERT_TRUE(maxwell.c && maxwell.delta);
    EXPECT_NEAR((*maxwell.c)(0, 0), 500.0 * 16.0 / 3.0, 4e-15 * 500.0 * 16.0 / 3.0);
    EXPECT_NEAR((*maxwell.delta)(0, 0), 3.0 / (500.0 * 16.0), 4e-15 * 3.0 / (500.0 * 16.0));
  }
}

// Delta is Mohr's sum T T L / EA for a right triangle of bars, with member forces computed by hand from the
// equilibrium of the joints. A pair of forces along one side loads only the bar of that side.
TEST(Maxwell, InATriangleOfBarsAPairOfForcesAlongOneSideLoadsOnlyItsBar) {
  Scene scene;
  add_point(scene, 1.0, {0.0, 0.0, 0.0});
  add_point(scene, 2.0, {3.0, 0.0, 0.0});
  add_point(scene, 5.0, {0.0, 4.0, 0.0});
  add_link(scene, 0, 1, Bar{600.0});
  add_link(scene, 1, 2, Bar{700.0});
  add_link(scene, 2, 0, Bar{800.0});
  Eigen::MatrixXd loads = Eigen::MatrixXd::Zero(9, 1);
  loads(0, 0) = -1.0;
  loads(3, 0) = 1.0;
  const LinkStates states = link_states(factor_of(scene), 6, loads);
  EXPECT_EQ(states.num_redundant, 0);
  EXPECT_NEAR(states.natural(0, 0), 1.0, 1e-15);
  EXPECT_NEAR(states.natural(1, 0), 0.0, 1e-15);
  EXPECT_NEAR(states.natural(2, 0), 0.0, 1e-15);
  const Eigen::Vector3d flexibility(3.0 / 600.0, 5.0 / 700.0, 4.0 / 800.0);
  const Bases bases = bases_of(scene);
  for (const Basis& basis : bases.all) {
    // the tensions are computed by hand from the force on each joint, which is resolved along the two bars
    // that meet at the joint
    const Eigen::MatrixXd p = unit_forces(scene.points, basis.shapes);
    Eigen::Matrix3d tension;
    for (Eigen::Index l = 0; l < 3; ++l) {
      const double diagonal = -p(4, l) * 5.0 / 4.0;
      tension(1, l) = diagonal;                        // p_y of joint 1 against bar 1-2
      tension(0, l) = p(3, l) - diagonal * 3.0 / 5.0;  // the remainder of p_x of joint 1
      tension(2, l) = -p(1, l);                        // p_y of joint 0
    }
    const Eigen::MatrixXd by_hand = tension.transpose() * flexibility.asDiagonal() * tension;
    const Maxwell maxwell = find_maxwell(scene, bases.structure, bases.factor, basis.shapes);
    EXPECT_LT(difference(*maxwell.delta, by_hand), 1e-13) << name_of(basis.recipe);
  }
}

TEST(Maxwell, EachStateBalancesItsLoadAndRedundancyIsLinksMinusFreedoms) {
  const std::vector<std::pair<std::string, int>> redundant{
      {"pair", 0},       {"chain of 9", 0},          {"triangle", 0},
      {"cloud of 4", 0}, {"cloud of 10", 45 - 24},   {"cube", 28 - 18},
      {"peroxide", 0},   {"sheet of 8", 28 + 5 - 18}};
  for (const auto& [name, num_elastic, scene] : every_class(8, {2.0, 2.0})) {
    SCOPED_TRACE(name);
    const Bases bases = bases_of(scene);
    const LinkFactor& factor = bases.factor;
    const Eigen::MatrixXd loads = unit_forces(scene.points, bases.all.front().shapes);
    const LinkStates states = link_states(factor, bases.structure.mass_properties.rigid_freedoms, loads);
    for (const auto& [other, count] : redundant)
      if (other == name) {
        EXPECT_EQ(states.num_redundant, count);
      }
    Eigen::MatrixXd balance = Eigen::MatrixXd::Zero(factor.num_freedoms, loads.cols());
    for (std::size_t k = 0; k < factor.natural.size(); ++k)
      for (const auto& [freedom, coefficient] : factor.natural[k].coefficients)
        balance.row(freedom) += coefficient * states.natural.row(static_cast<Eigen::Index>(k));
    balance.topRows(loads.rows()) += factor.constraints.transpose() * states.multipliers - loads;
    // the bound allows a few rounding errors of the largest natural force, including moments over lengths of
    // 0.1 m
    const double largest = std::max(states.natural.cwiseAbs().maxCoeff(), loads.cwiseAbs().maxCoeff());
    EXPECT_LT(balance.cwiseAbs().maxCoeff(), 1e-12 * largest);
  }
}

TEST(Maxwell, MohrsDeltaIsTheInverseOfCUpToAmplifiedRoundingErrors) {
  double worst = 0.0;
  for (const double decades : {1.0, 4.0, 8.0})
    for (std::uint64_t seed = 1; seed <= 5; ++seed)
      for (const auto& [name, num_elastic, scene] : every_class(seed, {1.0, decades})) {
        const Bases bases = bases_of(scene);
        for (const Basis& basis : bases.all) {
          SCOPED_TRACE(name + ", " + name_of(basis.recipe) + ", " + std::to_string(decades) +
                       " decades, seed " + std::to_string(seed));
          const Maxwell maxwell = find_maxwell(scene, bases.structure, bases.factor, basis.shapes);
          ASSERT_TRUE(maxwell.c && maxwell.delta);
          EXPECT_EQ(maxwell.delta->rows(), num_elastic);
          // forming and inverting b' K b amplifies rounding errors by the condition number of c, and a sum of
          // n terms has n rounding errors
          const double allowed = 10.0 * static_cast<double>(num_elastic + 10) * kEpsilon *
                                 std::pow(bases.structure.conditioning, 2);
          const double error = difference(influence_of(*maxwell.c), *maxwell.delta);
          EXPECT_LT(error, allowed);
          EXPECT_LT(difference(influence_of(*maxwell.delta), *maxwell.c), allowed);
          worst = std::max(worst, error / allowed);
        }
      }
  std::printf("worst difference: %.2g of what conditioning allows\n", worst);
}

// In the basis of the modes c is diag(M omega_l^2), so Mohr's delta is diag(1 / (M omega_l^2)).
TEST(Maxwell, DeltaInTheBasisOfTheModesIsTheInverseOfMOmegaSquared) {
  for (const auto& [name, num_elastic, scene] : every_class(9, {1.0, 1.0})) {
    const Bases bases = bases_of(scene);
    const Maxwell maxwell = find_maxwell(scene, bases.structure, bases.factor, bases.structure.shapes);
    const Eigen::VectorXd exact =
        (bases.structure.mass_properties.mass * bases.structure.omega.array().square()).inverse();
    for (Eigen::Index l = 0; l < exact.size(); ++l)
      EXPECT_NEAR((*maxwell.delta)(l, l), exact[l], 1e-11 * exact[l]) << name << ' ' << l;
    const Eigen::MatrixXd diagonal = exact.asDiagonal();
    EXPECT_LT((*maxwell.delta - diagonal).cwiseAbs().maxCoeff(), 1e-11 * exact.maxCoeff()) << name;
  }
}

// By Castigliano's theorem, delta_lu = d2 Pi / ds_l ds_u, where Pi is the energy that is stored under the
// load sum_l s_l p_l. The displacements under this load are found by Cholesky factorization of an assembled
// K, to which springs on the rigid motions are added.
TEST(Maxwell, DeltaIsTheSecondDerivativeOfTheEnergy) {
  for (const auto& [name, num_elastic, scene] : every_class(10, {1.0, 1.0})) {
    if (name == "partly rigid") continue;  // rigid links make K infinite
    SCOPED_TRACE(name);
    const Bases bases = bases_of(scene);
    const Eigen::MatrixXd rigid = rigid_motions(bases.structure.mass_properties);
    const Eigen::MatrixXd K = bases.factor.rows.transpose() * bases.factor.rows;
    const Eigen::LLT<Eigen::MatrixXd> held(K + K.trace() * (rigid * rigid.transpose()));
    const Basis& basis = bases.all.front();
    const Eigen::MatrixXd p = unit_forces(scene.points, basis.shapes);
    const auto energy = [&](const Eigen::VectorXd& load) { return 0.5 * load.dot(held.solve(load)); };
    const Maxwell maxwell = find_maxwell(scene, bases.structure, bases.factor, basis.shapes);
    const double scale = maxwell.delta->cwiseAbs().maxCoeff();
    for (Eigen::Index l = 0; l < p.cols(); l += 3)
      for (Eigen::Index u = 0; u < p.cols(); u += 2) {
        // central differences of a quadratic function are exact except for rounding errors
        const double second = 0.25 * (energy(p.col(l) + p.col(u)) - energy(p.col(l) - p.col(u)) -
                                      energy(-p.col(l) + p.col(u)) + energy(-p.col(l) - p.col(u)));
        EXPECT_NEAR(second, (*maxwell.delta)(l, u),
                    100.0 * kEpsilon * std::pow(bases.structure.conditioning, 2) * scale);
      }
  }
}

// THEORY 11.16, 11.17
TEST(Maxwell, CoefficientsTransformWithTheBasis) {
  for (const auto& [name, num_elastic, scene] : every_class(12, {2.0, 2.0})) {
    const Bases bases = bases_of(scene);
    const Basis& from = bases.all.front();
    const Maxwell own = find_maxwell(scene, bases.structure, bases.factor, from.shapes);
    for (const Basis& to : bases.all) {
      SCOPED_TRACE(name + ", " + name_of(from.recipe) + " to " + name_of(to.recipe));
      const Maxwell other = find_maxwell(scene, bases.structure, bases.factor, to.shapes);
      const Eigen::MatrixXd a = change_of_basis(scene.points, from, to);
      EXPECT_LT(difference(a * *own.c * a.transpose(), *other.c), 1e-12);
      // minimising the energy over self-stresses loses digits in proportion to the ratio of stiffnesses, not
      // to its square
      EXPECT_LT(difference(a * *own.delta * a.transpose(), *other.delta), 1e-12);
    }
  }
}

TEST(Maxwell, AStructureWithAMechanismHasNoDeltaAndTheReasonIsReported) {
  const Scene scene = square_without_diagonals();
  const Bases bases = bases_of(scene);
  ASSERT_FALSE(bases.structure.mechanisms.empty());
  const Maxwell maxwell = find_maxwell(scene, bases.structure, bases.factor, bases.all.front().shapes);
  EXPECT_FALSE(maxwell.delta);
  EXPECT_NE(maxwell.delta_absence.find("p"), std::string::npos) << maxwell.delta_absence;
  EXPECT_NE(maxwell.delta_absence.find("cannot be balanced"), std::string::npos) << maxwell.delta_absence;
  ASSERT_TRUE(maxwell.c);
  // there are four springs and six elastic freedoms, so c has rank four
  const Eigen::VectorXd values = maxwell.c->jacobiSvd().singularValues();
  EXPECT_GT(values[3], 1e-3 * values[0]);
  EXPECT_LT(values[4], 1e-14 * values[0]);
}

// Over all 3N - 6 displacements, a rigid link makes one eigenvalue of delta zero, and c does not exist. Over
// the n displacements that the link allows, both exist.
TEST(Maxwell, ARigidLinkLeavesNoCOverAllDisplacementsAndIsReported) {
  const Scene elastic = cloud(5, 6, {1.0, 1.0});
  Scene scene = elastic;
  scene.links[3].kind = Rigid{};
  scene.links[3].name = "strut";
  const Basis all = bases_of(elastic).all.front();
  const Bases bases = bases_of(scene);
  const Maxwell over_all = find_maxwell(scene, bases.structure, bases.factor, all.shapes);
  EXPECT_FALSE(over_all.c);
  EXPECT_NE(over_all.c_absence.find("'strut'"), std::string::npos) << over_all.c_absence;
  ASSERT_TRUE(over_all.delta);
  const Eigen::VectorXd values = over_all.delta->jacobiSvd().singularValues();
  ASSERT_EQ(values.size(), 12);
  EXPECT_GT(values[10], 1e-6 * values[0]);
  EXPECT_LT(values[11], 1e-14 * values[0]);

  const Maxwell allowed = find_maxwell(scene, bases.structure, bases.factor, bases.all.front().shapes);
  ASSERT_TRUE(allowed.c && allowed.delta);
  EXPECT_EQ(allowed.c->rows(), 11);
  EXPECT_LT(difference(influence_of(*allowed.c), *allowed.delta), 1e-15 * condition_of(*allowed.c));
}

// In some modes both ends of the rigid link are at rest. The strain that C gives for the link is then a
// rounding error.
TEST(Maxwell, ARigidLinkAtRestInAModeIsNotReportedAsStretched) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Scene scene = [&] {
      Scene s = cloud(seed, 6, {1.0, 1.0});
      for (Link& link : s.links)
        if (link.points[0] + link.points[1] == 1) link.kind = Rigid{};
      // a second structure is far from the first structure and not joined to it, so the modes of the second
      // structure do not move the link
      const Scene other = cloud(seed + 100, 5, {1.0, 1.0});
      for (const PointMass& point : other.points)
        add_point(s, point.mass, point.position + Eigen::Vector3d(9.0, 0.0, 0.0));
      for (const Link& link : other.links) add_link(s, link.points[0] + 6, link.points[1] + 6, Spring{1e3});
      return s;
    }();
    const Bases bases = bases_of(scene);
    for (const Basis& basis : bases.all) {
      ASSERT_LT(basis.constraint_residual, 1e-13);
      EXPECT_EQ(find_maxwell(scene, bases.structure, bases.factor, basis.shapes).c_absence, "") << seed;
    }
  }
}

// A spring inside a rigid body carries no force under any load, so it stores no energy and delta is zero.
TEST(Maxwell, ASpringInsideARigidBodyIsRedundantAndLeavesDeltaZero) {
  const Scene elastic = cloud(3, 5, {1.0, 1.0});
  Scene scene = elastic;
  scene.links.resize(1);
  add_angle(scene, {0, 1, 2, 3, 4}, Rigid{});
  const Basis all = bases_of(elastic).all.front();
  const Maxwell maxwell = find_maxwell(scene, build(scene), factor_of(scene), all.shapes);
  ASSERT_TRUE(maxwell.delta);
  EXPECT_EQ(maxwell.num_redundant, 1);
  const double beside_a_spring =
      find_maxwell(elastic, build(elastic), factor_of(elastic), all.shapes).delta->norm();
  EXPECT_LT(maxwell.delta->norm(), 1e-25 * beside_a_spring);
  EXPECT_FALSE(maxwell.c);
}

// The difference between delta with a stiff spring and delta with a rigid link is proportional to
// 1 / stiffness.
TEST(Maxwell, DeltaWithARigidLinkIsTheLimitOfStiffSprings) {
  const Scene elastic = cloud(5, 6, {1.0, 1.0});
  const Basis all = bases_of(elastic).all.front();
  Scene scene = elastic;
  const auto delta_of = [&]() {
    return *find_maxwell(scene, build(scene), factor_of(scene), all.shapes).delta;
  };
  scene.links[3].kind = Rigid{};
  const Eigen::MatrixXd limit = delta_of();
  double last = 0.0;
  for (double k = 1e6; k < 1e12; k *= 10.0) {
    scene.links[3].kind = Spring{k};
    const double gap = difference(delta_of(), limit);
    // relative to the difference, terms of the next order are about the mean stiffness over k, and rounding
    // errors are about 1e-15 over the difference
    if (last > 0.0) {
      EXPECT_NEAR(last / gap, 10.0, 10.0 * (3e4 / k * 10.0 + 1e-14 / gap)) << k;
    }
    last = gap;
  }
  EXPECT_LT(last, 1e-6);
}

TEST(Maxwell, AFullyRigidBodyHasNoCoefficients) {
  Scene scene = cloud(3, 5, {1.0, 1.0});
  scene.links.clear();
  add_angle(scene, {0, 1, 2, 3, 4}, Rigid{});
  const Bases bases = bases_of(scene);
  for (const Basis& basis : bases.all) {
    EXPECT_EQ(basis.rank(), 0);
    EXPECT_TRUE(basis.is_complete());
    const Maxwell maxwell = find_maxwell(scene, bases.structure, bases.factor, basis.shapes);
    EXPECT_EQ(maxwell.delta->size(), 0);
    EXPECT_EQ(maxwell.c->size(), 0);
  }
}

}  // namespace
}  // namespace freeflex::testing
