// This file defines a scene in motion with its verdict.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/motion.hpp"
#include "core/plan/rungs/shadow.hpp"
#include "core/structure/links/link_factor.hpp"
#include "tests/motion/rung_cases.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/omissions.hpp"

namespace freeflex::testing {

/// Watched is a plan in motion, judged at every step of its shadow.
struct Watched {
  Plan plan;
  Motion motion;

  explicit Watched(const Scene& scene) : Watched(reduced_plan_of(scene)) {}
  explicit Watched(Plan given) : plan(std::move(given)), motion(plan) {}
  Watched(const Watched&) = delete;
  Watched& operator=(const Watched&) = delete;

  /// Steps `ticks` times. The commands take effect at the first tick.
  const Verdict& run(std::int64_t ticks, std::span<const ForceCommand> first = {}) {
    for (std::int64_t k = 0; k < ticks; ++k) {
      const StepStatus status = motion.advance(k == 0 ? first : std::span<const ForceCommand>()).status;
      EXPECT_EQ(status, StepStatus::kOk) << "tick " << k;
      if (status != StepStatus::kOk) break;
    }
    return motion.verdict();
  }
  /// Steps until the time since the start of the epoch is `end` [s].
  const Verdict& run_to(double end, std::span<const ForceCommand> first = {}) {
    return run(std::llround((end - motion.time()) / plan.period), first);
  }
  const State& state() const { return motion.state(); }
  std::string text() const { return text_of(plan, motion.verdict()); }
};

/// Returns the plan of a scene with all modes and features, and with its verdict.
inline Plan judged_plan_of(const Scene& scene) {
  const Structure structure = build(scene);
  Plan plan = compile(scene);
  compile_verdict(scene, structure, structure, plan);
  return plan;
}

/// Returns the elastic displacements of all points in body axes [m] (3 x N).
inline Eigen::Matrix3Xd displacements_of(const Watched& watched) {
  Eigen::Matrix3Xd V(3, static_cast<Eigen::Index>(watched.plan.points.size()));
  for (Eigen::Index i = 0; i < V.cols(); ++i)
    V.col(i) = Eigen::Vector3d(read_point(watched.plan, watched.state(), static_cast<int>(i)).V_B.data());
  return V;
}
/// Returns the distance of the displacements of two motions of a scene [m], rms over all mass. The rotations
/// of bodies count with their inertia (THEORY 15.5).  \pre if there are bodies, the plans have all modes
inline double distance_between(const Scene& scene, const Watched& a, const Watched& b) {
  Eigen::Matrix3Xd off = displacements_of(a) - displacements_of(b);
  const auto has_inertia = [](const PointMass& point) { return !point.inertia.isZero(0.0); };
  double sum = 0.0;
  if (std::any_of(scene.points.begin(), scene.points.end(), has_inertia)) {
    const Eigen::MatrixXd rotations = build(scene).rotations;
    const auto change = [&](int l) { return a.state().q[index(l)] - b.state().q[index(l)]; };
    const Eigen::VectorXd theta = rotations * Eigen::VectorXd::NullaryExpr(rotations.cols(), change);
    const Freedoms freedoms(scene);
    for (int i = 0; i < static_cast<int>(scene.points.size()); ++i) {
      const PointMass& point = scene.points[index(i)];
      if (!freedoms.has_joint(i)) continue;
      const Eigen::Vector3d turn = theta.segment<3>(freedoms.rotation(i) - freedoms.num_displacements());
      off.col(i) += turn.cross(point.offset);
      sum += turn.dot(point.inertia * turn);
    }
  }
  const Eigen::VectorXd mass = masses_of(scene);
  return std::sqrt(((off.colwise().squaredNorm() * mass)(0) + sum) / mass.sum());
}

inline Scene watched_truss(Fidelity rung, double horizon, double spin = 0.5) {
  Scene scene = boxed_truss(spin, 10.0);
  scene.fidelity = rung;
  scene.rate = 1000.0;
  scene.verdict.horizon = horizon;
  return scene;
}

inline std::pair<Verdict, std::string> verdict_of(const Scene& scene, int ticks) {
  Watched watched(scene);
  watched.run(ticks);
  return {watched.motion.verdict(), watched.text()};
}

}  // namespace freeflex::testing
