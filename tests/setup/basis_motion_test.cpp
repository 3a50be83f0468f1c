// The elastic motion does not depend on the basis (Alekseev 1970, section 6), so trajectories in all bases
// agree with each other.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include "core/structure/modes/dense/graded_svd.hpp"
#include "tests/setup/all_bases.hpp"
#include "tests/setup/shape_scenes.hpp"
#include "tests/support/simulation.hpp"

namespace freeflex::testing {
namespace {

constexpr int kTicks = 10000;

/// Solves M q'' + c q = Q in one basis in closed form. Q is constant from the start. The solution
/// diagonalises c = (A b)'(A b) of that basis through the factor A b.
class Motion {
 public:
  Motion(const Scene& scene, const Bases& bases, const Basis& basis, const Eigen::VectorXd& start,
         const Eigen::VectorXd& load) {
    const double mass = bases.structure.mass_properties.mass;
    const GradedSvd svd = graded_svd(bases.factor.rows * basis.shapes);
    omega_ = svd.values / std::sqrt(mass);
    own_shapes_ = basis.shapes * svd.vectors;
    const Eigen::VectorXd q = basis.shapes.transpose() * masses(scene).asDiagonal() * start / mass;
    const Eigen::VectorXd Q = basis.shapes.transpose() * load;
    start_ = svd.vectors.transpose() * q;
    deflection_ = (svd.vectors.transpose() * Q).cwiseQuotient(mass * omega_.cwiseAbs2());
  }
  Eigen::VectorXd displacements(double time) const {
    const Eigen::VectorXd cosine = (omega_ * time).array().cos();
    // in this form 1 - cos keeps its digits for small angles
    const Eigen::VectorXd rise = 2.0 * (0.5 * omega_ * time).array().sin().square();
    return own_shapes_ * (start_.cwiseProduct(cosine) + deflection_.cwiseProduct(rise));
  }

 private:
  Eigen::VectorXd omega_, start_, deflection_;
  Eigen::MatrixXd own_shapes_;
};

// Random forces, and random displacements without rigid motion and without motion that rigid links prevent.
struct Excitation {
  Eigen::VectorXd start, load;
};

Excitation excite(const Basis& basis, Engine& engine) {
  Eigen::VectorXd q(basis.rank()), load(basis.shapes.rows());
  for (double& component : q) component = uniform(engine, -1e-3, 1e-3);
  for (double& component : load) component = uniform(engine, -1.0, 1.0);
  return {basis.shapes * q, load};
}

// Expects the displacements V in all bases to agree with those in the first basis at every tick. The allowed
// difference is relative to the largest V.
void expect_one_motion(const std::string& name, const Scene& scene, std::uint64_t seed, double& worst) {
  const Bases bases = bases_of(scene);
  Engine engine(seed);
  const Excitation excitation = excite(bases.all.back(), engine);
  std::vector<Motion> motions;
  for (const Basis& basis : bases.all)
    motions.emplace_back(scene, bases, basis, excitation.start, excitation.load);
  double largest = 0.0, apart = 0.0;
  for (int tick = 0; tick <= kTicks; ++tick) {
    const double time = tick / scene.rate;
    const Eigen::VectorXd first = motions.front().displacements(time);
    largest = std::max(largest, first.cwiseAbs().maxCoeff());
    for (std::size_t k = 1; k < motions.size(); ++k)
      apart = std::max(apart, (motions[k].displacements(time) - first).cwiseAbs().maxCoeff());
  }
  const double omega_max = bases.structure.omega.tail<1>()[0];
  const double bound =
      std::max(1e-12, std::numeric_limits<double>::epsilon() * omega_max * kTicks / scene.rate);
  std::printf("%-20s seed %d: w_max/w_1 %.1e, bases apart by %.1e, bound %.1e\n", name.c_str(),
              static_cast<int>(seed), bases.structure.conditioning, apart / largest, bound);
  EXPECT_LT(apart, 10.0 * bound * largest) << name << ", seed " << seed;
  worst = std::max(worst, apart / largest / bound);
}

TEST(MotionInEveryBasis, IsTheSameOverTenThousandTicks) {
  double worst = 0.0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed)
    for (const auto& [name, num_elastic, scene] : every_class(seed, {2.0, 1.0}))
      expect_one_motion(name, scene, seed, worst);
  std::printf("worst: %.2g of the bound\n", worst);
}

TEST(MotionInEveryBasis, IsTheSameForStiffnessesInARatioOf1e10) {
  double worst = 0.0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed)
    for (const auto& [name, num_elastic, scene] : every_class(seed, {2.0, 10.0}))
      expect_one_motion(name, scene, seed, worst);
  std::printf("worst: %.2g of the bound\n", worst);
}

// The step computes in the basis of the modes. Its motion agrees with the motion in a basis of the paper.
TEST(MotionInEveryBasis, TheStepAgreesWithABasisOfThePaper) {
  for (const double decades : {1.0, 10.0})
    for (const auto& [name, num_elastic, given] : every_class(4, {2.0, decades})) {
      Scene scene = given;
      const Bases bases = bases_of(scene);
      Engine engine(5);
      const Excitation excitation = excite(bases.all.front(), engine);
      Load load;
      load.name = "all";
      load.axes = Axes::kBody;
      load.history = ConstantHistory{};
      scene.publication.points.clear();
      for (int i = 0; i < static_cast<int>(scene.points.size()); ++i) {
        const auto at = 3 * static_cast<Eigen::Index>(i);
        scene.initial.points.push_back({i, excitation.start.segment<3>(at), Eigen::Vector3d::Zero()});
        load.forces.push_back({i, excitation.load.segment<3>(at)});
        scene.publication.points.push_back(i);
      }
      scene.loads = {load};
      Simulation simulation(scene);
      const Motion motion(scene, bases, bases.all.front(), excitation.start, excitation.load);
      double largest = 0.0, apart = 0.0;
      for (int tick = 0; tick < kTicks;) {
        simulation.run(100);
        tick += 100;
        const Eigen::VectorXd exact = motion.displacements(tick / scene.rate);
        const Eigen::Matrix3Xd stepped = simulation.displacements_B();
        largest = std::max(largest, exact.cwiseAbs().maxCoeff());
        apart = std::max(apart, (stepped.reshaped() - exact).cwiseAbs().maxCoeff());
      }
      const double omega_max = bases.structure.omega.tail<1>()[0];
      const double bound =
          std::max(1e-12, std::numeric_limits<double>::epsilon() * omega_max * kTicks / scene.rate);
      std::printf("%-20s 1e%.0f: step and %s basis apart by %.1e, bound %.1e\n", name.c_str(), decades,
                  name_of(bases.all.front().recipe), apart / largest, bound);
      EXPECT_LT(apart, 10.0 * bound * largest) << name;
    }
}

}  // namespace
}  // namespace freeflex::testing
