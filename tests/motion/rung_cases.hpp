// This file has scenes and error measures for tests of the fidelity ladder.
#pragma once

#include "core/plan/make_plan.hpp"
#include "core/structure/structure.hpp"
#include "tests/reference/separated_cases.hpp"

namespace freeflex::testing {

/// Returns a free truss of five sections at x = 0 .. 4 m with corners at (y, z) = (0,0), (1,0), (1,1), (0,1),
/// 1 kg each. Springs of 1e5 N/m join corners c to c+1 (cyclic) and 0 to 2 in each section, and c to c and c
/// to c+1 in each bay. The truss spins about z at `spin` [rad/s]. A force along world z [N] acts on corner
/// (1,1) of the last section for 0.1 s.
inline Scene boxed_truss(double spin, double force) {
  constexpr double kCorners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  Scene scene;
  scene.name = "boxed truss";
  const auto join = [&](int a, int b) {
    Link link;
    link.name = std::to_string(scene.links.size());
    link.points = {a, b};
    link.kind = Spring{1e5};
    scene.links.push_back(link);
  };
  for (int i = 0; i < 5; ++i)
    for (int c = 0; c < 4; ++c) {
      PointMass point;
      point.name = std::to_string(4 * i + c);
      point.mass = 1.0;
      point.position = {1.0 * i, kCorners[c][0], kCorners[c][1]};
      scene.points.push_back(point);
      scene.publication.points.push_back(4 * i + c);
      scene.pushable.push_back(4 * i + c);
    }
  for (int i = 0; i < 5; ++i) {
    for (int c = 0; c < 4; ++c) join(4 * i + c, 4 * i + (c + 1) % 4);
    join(4 * i, 4 * i + 2);
  }
  for (int i = 0; i < 4; ++i)
    for (int c = 0; c < 4; ++c) {
      join(4 * i + c, 4 * i + 4 + c);
      join(4 * i + c, 4 * i + 4 + (c + 1) % 4);
    }
  Load load;
  load.name = "push";
  load.forces.push_back({18, {0.0, 0.0, force}});
  load.history = PulseHistory{0.0, 0.1};
  scene.loads.push_back(load);
  scene.initial.angular_velocity = {0.0, 0.0, spin};
  return scene;
}

/// Returns the simulation of the scene on a rung, on its modes, with steps of h [s], at the time `end` [s].
inline Simulation run_rung(Scene scene, Fidelity rung, double h, double end) {
  scene.fidelity = rung;
  scene.integration.by = IntegrateBy::kModes;
  scene.rate = 1.0 / h;
  Simulation simulation(scene);
  simulation.run(std::llround(end / h));
  return simulation;
}

/// Returns the first error of a scene that has no plan, and an empty text for a scene that has one.
inline std::string refusal_of(const Scene& scene) {
  Faults faults;
  const auto structure = build_structure(scene, faults);
  if (!structure || make_full_plan(scene, *structure, scene.fidelity, faults)) return {};
  for (const Fault& fault : faults)
    if (fault.severity == Fault::Severity::kError) return fault.message;
  return "?";
}

inline Eigen::VectorXd masses_of(const Scene& scene) {
  Eigen::VectorXd mass(static_cast<Eigen::Index>(scene.points.size()));
  for (Eigen::Index i = 0; i < mass.size(); ++i) mass[i] = scene.points[static_cast<std::size_t>(i)].mass;
  return mass;
}
inline Eigen::Matrix3Xd elastic_of(const Scene& scene, const Eigen::Matrix3Xd& positions) {
  Eigen::Matrix3Xd rest(3, static_cast<Eigen::Index>(scene.points.size()));
  for (Eigen::Index i = 0; i < rest.cols(); ++i)
    rest.col(i) = scene.points[static_cast<std::size_t>(i)].position;
  return elastic_displacements(masses_of(scene), rest, positions);
}
inline Eigen::Matrix3Xd elastic_of(const Scene& scene, const Simulation& simulation) {
  return elastic_of(scene, simulation.positions_W());
}

/// Truth holds a scene and the positions of the full system at `end` [s].
struct Truth {
  Scene scene;
  Eigen::Matrix3Xd p_W;  // [m]
};
inline Truth truth_of(const Scene& scene, double end) {
  std::string error;
  const auto system = make_cartesian_system(scene, error);
  EXPECT_TRUE(system.has_value()) << error;
  const double times[] = {end};
  const ReferenceRun run = integrate(*system, times);
  EXPECT_EQ(run.error, "");
  return {scene, run.states.at(0).p_W};
}

struct Errors {
  double position, elastic;  // [m] rms over points, [-]
};
inline Errors errors_of(const Simulation& simulation, const Truth& truth) {
  const Eigen::Matrix3Xd p = simulation.positions_W();
  return {(p - truth.p_W).norm() / std::sqrt(static_cast<double>(p.cols())),
          elastic_error(elastic_of(truth.scene, p), elastic_of(truth.scene, truth.p_W))};
}

inline double energy_of(const Simulation& simulation) {
  const Invariants invariants = read_invariants(simulation.plan, simulation.state);
  return invariants.kinetic_rigid + invariants.kinetic_elastic + invariants.potential;
}

/// Expects that the total energy is conserved after the load has ended. In each of `rounds` successive
/// intervals of `ticks` ticks of 1 ms, it may change by at most 1e-8 of its value.
inline void expect_energy_kept(Scene scene, std::int64_t ticks, int rounds) {
  scene.fidelity = Fidelity::kCoupled;
  scene.rate = 1000.0;
  Simulation simulation(scene);
  simulation.run(100);
  const Invariants start = read_invariants(simulation.plan, simulation.state);
  const double energy = energy_of(simulation);
  double last = energy, worst = 0.0;
  for (int round = 0; round < rounds; ++round) {
    simulation.run(ticks);
    worst = std::max(worst, std::abs(energy_of(simulation) - last) / energy);
    last = energy_of(simulation);
  }
  std::printf(
      "energy %.3e J, elastic share %.2f: worst drift over %lld ticks %.1e, over all %lld ticks %.1e\n",
      energy, (start.kinetic_elastic + start.potential) / energy, static_cast<long long>(ticks), worst,
      static_cast<long long>(ticks * rounds), std::abs(last - energy) / energy);
  EXPECT_LT(worst, 1e-8);
  EXPECT_LT(std::abs(last - energy), 1e-8 * energy) << "over all rounds";
}

}  // namespace freeflex::testing
