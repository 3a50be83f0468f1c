#include "tests/support/simulation.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <utility>

#include "core/plan/make_plan.hpp"
#include "core/structure/structure.hpp"

namespace freeflex::testing {
namespace {

[[noreturn]] void give_up(const char* why, const Faults& faults = {}) {
  std::fprintf(stderr, "%s\n", why);
  for (const Fault& fault : faults) std::fprintf(stderr, "  %s\n", fault.message.c_str());
  std::abort();
}

template <typename Read>
Eigen::Matrix3Xd read_points(const Simulation& simulation, Read read) {
  const auto count = static_cast<Eigen::Index>(simulation.plan.points.size());
  // points for which the plan has no mode-shape row keep NaN
  Eigen::Matrix3Xd values = Eigen::Matrix3Xd::Constant(3, count, std::numeric_limits<double>::quiet_NaN());
  for (Eigen::Index i = 0; i < count; ++i) {
    if (simulation.plan.points[static_cast<std::size_t>(i)].row < 0) continue;
    const Vec3 value = read(read_point(simulation.plan, simulation.state, static_cast<int>(i)));
    values.col(i) = Eigen::Vector3d(value[0], value[1], value[2]);
  }
  return values;
}

}  // namespace

Plan plan_of(const Scene& scene) {
  Faults faults;
  const auto structure = build_structure(scene, faults);
  if (!structure) give_up("no structure:", faults);
  auto plan = make_full_plan(scene, *structure, scene.fidelity, faults);
  if (!plan) give_up("no plan:", faults);
  return std::move(*plan);
}

Simulation::Simulation(Plan given)
    : plan(std::move(given)), state(make_state(plan)), workspace(make_workspace(plan)) {}

void Simulation::run(std::int64_t ticks, std::span<const ForceCommand> commands) {
  for (std::int64_t k = 0; k < ticks; ++k) {
    step(plan, state, Inputs{k == 0 ? commands : std::span<const ForceCommand>{}}, workspace, report);
    if (report.status != StepStatus::kOk) give_up("a step failed");
  }
}

Eigen::Matrix3Xd Simulation::positions_W() const {
  return read_points(*this, [](const PointState& point) { return point.p_W; });
}

Eigen::Matrix3Xd Simulation::velocities_W() const {
  return read_points(*this, [](const PointState& point) { return point.v_W; });
}

Eigen::Matrix3Xd Simulation::displacements_B() const {
  return read_points(*this, [](const PointState& point) { return point.V_B; });
}

Eigen::VectorXd Simulation::link_forces() const {
  Eigen::Index rows = 0;
  for (const PlanLinkOutput& output : plan.link_outputs) rows += output.num_rows;
  Eigen::VectorXd forces(rows);
  Eigen::Index next = 0;
  for (std::size_t k = 0; k < plan.link_outputs.size(); ++k) {
    const auto count = static_cast<std::size_t>(plan.link_outputs[k].num_rows);
    read_link(plan, state, static_cast<int>(k), std::span(forces.data() + next, count));
    next += static_cast<Eigen::Index>(count);
  }
  return forces;
}

ForceCommand make_command(int slot, std::int64_t sequence, Axes axes, std::int64_t duration_ticks) {
  ForceCommand command{};
  constexpr std::string_view kSender = "test";
  std::copy(kSender.begin(), kSender.end(), command.sender.begin());
  command.slot = slot;
  command.sequence = sequence;
  command.axes = static_cast<std::int32_t>(axes);
  command.start_tick = -1;
  command.duration_ticks = duration_ticks;
  return command;
}

void add_force(ForceCommand& command, int point, const Eigen::Vector3d& force) {
  command.points[static_cast<std::size_t>(command.num_points++)] = {point, 0, {force[0], force[1], force[2]}};
}

}  // namespace freeflex::testing
