#include "tests/support/omissions.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "core/plan/make_plan.hpp"
#include "core/structure/structure.hpp"

namespace freeflex::testing {

Plan reduced_plan_of(const Scene& scene) {
  Faults faults;
  const auto structure = build_structure(scene, faults);
  auto plan = structure ? make_plan(scene, *structure, faults) : std::nullopt;
  if (!plan) {
    for (const Fault& fault : faults) std::fprintf(stderr, "%s\n", fault.message.c_str());
    std::abort();
  }
  return std::move(*plan);
}

const PlanFeature& feature_of(const Plan& plan, Feature feature) {
  return plan.features[static_cast<std::size_t>(feature)];
}

Change change_by(Scene scene, Feature back, std::int64_t ticks, const std::vector<TimedCommand>& commands) {
  Simulation without(reduced_plan_of(scene));
  scene.leave_out.keeps[static_cast<std::size_t>(back)] = true;
  Simulation with(reduced_plan_of(scene));
  Change change;
  const auto compare = [&] {
    for (const std::int32_t point : with.plan.published_points) {
      const PointState a = read_point(without.plan, without.state, point),
                       b = read_point(with.plan, with.state, point);
      const auto distance = [](const Vec3& x, const Vec3& y) {
        return (Eigen::Vector3d(x.data()) - Eigen::Vector3d(y.data())).norm();
      };
      change.displacement = std::max(change.displacement, distance(a.V_B, b.V_B));
      change.position = std::max(change.position, distance(a.p_W, b.p_W));
      change.largest = std::max(change.largest, distance(b.V_B, {}));
    }
    if (with.plan.link_outputs.empty()) return;
    const Eigen::VectorXd a = without.link_forces(), b = with.link_forces();
    change.link_force = std::max(change.link_force, (a - b).cwiseAbs().maxCoeff());
    change.largest_force = std::max(change.largest_force, b.cwiseAbs().maxCoeff());
  };
  compare();
  for (std::int64_t tick = 0; tick < ticks; ++tick) {
    std::vector<ForceCommand> due;
    for (const TimedCommand& each : commands)
      if (each.tick == tick) due.push_back(each.command);
    without.run(1, due);
    with.run(1, due);
    compare();
  }
  return change;
}

}  // namespace freeflex::testing
