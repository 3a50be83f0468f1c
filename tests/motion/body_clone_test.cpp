// Structures with bodies move like the same structures in which each body is replaced by point masses on a
// rigid body.
#include "tests/motion/body_clones.hpp"
#include "tests/support/simulation.hpp"

namespace freeflex::testing {
namespace {

// The remaining difference comes from the mass of the joints in the copy.
TEST(BodyMotion, ABodyMovesLikePointMassesJoinedByARigidLink) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const RandomBodies random(seed);
    Scene bodies = random.scene(), points = as_point_masses(bodies);
    for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kSpinLoaded}) {
      bodies.fidelity = points.fidelity = rung;
      Simulation of_bodies(bodies), of_points(points);
      const auto ticks = std::llround(random.end() * bodies.rate);
      of_bodies.run(ticks);
      of_points.run(ticks);
      const Eigen::Matrix3Xd V = of_bodies.displacements_B();
      EXPECT_LT((V - of_points.displacements_B().leftCols(V.cols())).norm(), 1e-4 * V.norm()) << seed;
    }
  }
}

}  // namespace
}  // namespace freeflex::testing
