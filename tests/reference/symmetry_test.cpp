// If a scene is translated, rotated or renumbered, its description changes but its motion does not, except
// for rounding errors of coordinates and sums. Conditioning is the change of the motion per relative change
// of the numbers in the scene (coordinates relative to the size, masses, stiffnesses). To measure the
// conditioning, the tests change all these numbers at random by up to 2^-36 and record the changes of
// positions, velocities and link forces.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>

#include "tests/support/simulation.hpp"
#include "tests/support/structures.hpp"
#include "tests/support/transform.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr std::int64_t kTicks = 1000;
constexpr double kRounding = 2.3e-16;

struct Motion {
  Matrix3Xd p_W, v_W;      // [m], [m/s]
  Eigen::VectorXd forces;  // [N]
};

Motion motion_of(const Scene& scene) {
  Simulation simulation(scene);
  simulation.run(kTicks);
  return {simulation.positions_W(), simulation.velocities_W(), simulation.link_forces()};
}

/// Largest differences of positions, velocities and link forces.
struct Difference {
  double p = 0.0, v = 0.0, force = 0.0;
};
Difference difference(const Motion& a, const Motion& b) {
  return {(a.p_W - b.p_W).cwiseAbs().maxCoeff(), (a.v_W - b.v_W).cwiseAbs().maxCoeff(),
          (a.forces - b.forces).cwiseAbs().maxCoeff()};
}

/// Largest coordinate [m] in any description of the scene used below.
constexpr double kSize = 8.0;

/// Returns the conditioning: the largest change in a few random trials.
Difference conditioning(const Scene& scene, const Motion& motion, std::mt19937_64& engine) {
  constexpr double kChange = 0x1p-36;
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Difference largest;
  for (int trial = 0; trial < 8; ++trial) {
    Scene changed = scene;
    for (PointMass& point : changed.points) {
      for (int a = 0; a < 3; ++a) point.position[a] += kChange * kSize * uniform(engine);
      point.mass *= 1.0 + kChange * uniform(engine);
    }
    for (Link& link : changed.links) {
      if (auto* spring = std::get_if<Spring>(&link.kind))
        spring->stiffness *= 1.0 + kChange * uniform(engine);
      if (auto* bar = std::get_if<Bar>(&link.kind)) bar->EA *= 1.0 + kChange * uniform(engine);
    }
    const Difference found = difference(motion_of(changed), motion);
    largest.p = std::max(largest.p, found.p / kChange);
    largest.v = std::max(largest.v, found.v / kChange);
    largest.force = std::max(largest.force, found.force / kChange);
  }
  return largest;
}

void expect_within(const char* what, const Difference& found, const Difference& allowed) {
  std::printf("  %-14s moves positions %.1e m, velocities %.1e m/s, link forces %.1e N\n", what, found.p,
              found.v, found.force);
  EXPECT_LE(found.p, 10.0 * kRounding * allowed.p) << what;
  EXPECT_LE(found.v, 10.0 * kRounding * allowed.v) << what;
  EXPECT_LE(found.force, 10.0 * kRounding * allowed.force) << what;
}

/// Gives the scene a spin, a velocity, gravity, loads in world and body axes, and an elastic initial state.
void set_going(Scene& scene) {
  scene.gravity = {0.1, 0.0, -9.81};
  scene.initial.position = {0.5, -1.0, 2.0};
  scene.initial.velocity = {1.0, 2.0, -0.5};
  scene.initial.angular_velocity = {0.3, -0.2, 0.5};
  scene.initial.points.push_back({1, {1e-4, -2e-4, 1e-4}, {0.0, 0.01, 0.0}});
  Load world;
  world.forces.push_back({0, {1.0, -2.0, 0.5}});
  world.history = SineHistory{3.0, 0.2};
  Load body;
  body.axes = Axes::kBody;
  body.forces.push_back({2, {0.0, 1.5, -1.0}});
  body.history = PulseHistory{0.1, 0.4};
  scene.loads.push_back(world);
  scene.loads.push_back(body);
}

void expect_the_same_in_every_description(const Scene& scene, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  const Motion motion = motion_of(scene);
  const Difference allowed = conditioning(scene, motion, engine);
  std::printf("%s: conditioning %.2g m, %.2g m/s, %.2g N per relative change of its numbers\n",
              scene.name.c_str(), allowed.p, allowed.v, allowed.force);
  const Quaterniond Q = Quaterniond(0.3, -0.5, 0.7, 0.2).normalized();
  const Quaterniond identity = Quaterniond::Identity();
  const Vector3d shift(3.7, -2.3, 1.1);
  expect_within("translation", difference(motion_of(in_other_axes(scene, identity, shift)), motion), allowed);
  expect_within("rotation", difference(motion_of(in_other_axes(scene, Q, Vector3d::Zero())), motion),
                allowed);
  expect_within("both", difference(motion_of(in_other_axes(scene, Q, shift)), motion), allowed);
  Motion rotated = motion_of(in_rotated_world(scene, Q));
  rotated.p_W = Q.conjugate().toRotationMatrix() * rotated.p_W;
  rotated.v_W = Q.conjugate().toRotationMatrix() * rotated.v_W;
  expect_within("rotated world", difference(rotated, motion), allowed);
  std::vector<int> points(scene.points.size()), links(scene.links.size());
  std::iota(points.begin(), points.end(), 0);
  std::iota(links.begin(), links.end(), 0);
  std::shuffle(points.begin(), points.end(), engine);
  std::shuffle(links.begin(), links.end(), engine);
  const Motion other = motion_of(renumbered(scene, points, links));
  Motion back = other;
  for (std::size_t i = 0; i < points.size(); ++i) {
    back.p_W.col(points[i]) = other.p_W.col(static_cast<Eigen::Index>(i));
    back.v_W.col(points[i]) = other.v_W.col(static_cast<Eigen::Index>(i));
  }
  for (std::size_t i = 0; i < links.size(); ++i) {
    back.forces[links[i]] = other.forces[static_cast<Eigen::Index>(i)];
  }
  expect_within("renumbering", difference(back, motion), allowed);
}

TEST(Symmetry, TheMotionOfATrussDoesNotDependOnItsDescription) {
  Scene scene = truss_s1();
  set_going(scene);
  expect_the_same_in_every_description(scene, 1);
}

TEST(Symmetry, TheMotionOfRandomStructuresDoesNotDependOnTheirDescription) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Scene scene = random_structure(seed, 4 + static_cast<int>(seed));
    set_going(scene);
    expect_the_same_in_every_description(scene, seed);
  }
}

// The bound proves something only if a real change of the scene exceeds it.
TEST(Symmetry, ConditioningBoundDetectsAChangeOfOneMicrogram) {
  Scene scene = random_structure(3, 7);
  set_going(scene);
  std::mt19937_64 engine(3);
  const Motion motion = motion_of(scene);
  const Difference allowed = conditioning(scene, motion, engine);
  scene.points[2].mass += 1e-9;
  const Difference found = difference(motion_of(scene), motion);
  EXPECT_GT(found.p, 10.0 * kRounding * allowed.p);
  EXPECT_GT(found.force, 10.0 * kRounding * allowed.force);
}

}  // namespace
}  // namespace freeflex::testing
