#include "core/plan/histories.hpp"

#include <cmath>

#include "core/plan/arrays.hpp"
#include "core/scene/faults.hpp"
#include "core/step/history.hpp"
#include "core/step/loads.hpp"

namespace freeflex {
namespace {

// [-] of a period: an edge nearer to a tick than this is on it, the rest being rounding of what a person
// typed
constexpr double kOnTick = 1e-6;

// ticks a cycle below which straight lines between ticks miss a sine by more than 5 % of its amplitude
constexpr double kTicksPerCycle = 13.0;

// [-] of a torque: a part that the group cannot take above this is an error
constexpr double kIdleTorque = 1e-9;

void check_torque(const Scene& scene, const Plan& plan, const Load& load, const WrenchLoad& wrench,
                  Faults& faults) {
  const PlanGroup& group = plan.groups[static_cast<std::size_t>(wrench.group)];
  // about a line only a torque in body axes can be judged now; in world axes the part about the line turns
  // with the body
  if (group.torque_rank == 2 && load.axes != Axes::kBody) return;
  const std::string idle = idle_torque(group, to_array(wrench.torque));
  if (!idle.empty())
    add_error(
        faults, load.origin,
        join_text("load ", quoted(load.name, static_cast<int>(&load - scene.loads.data())), ": ", idle));
}

// X13: what the amplitude is made of
void set_kind(const History& history, PlanHistory& plan) {
  // constant unless told
  if (const auto* pulse = std::get_if<PulseHistory>(&history)) {
    plan.kind = PlanHistory::Kind::kPulse;
    plan.pulse_start = pulse->start;
    plan.pulse_duration = pulse->duration;
  } else if (const auto* sine = std::get_if<SineHistory>(&history)) {
    plan.kind = PlanHistory::Kind::kSine;
    plan.frequency = sine->frequency;
    plan.phase = sine->phase / (2.0 * M_PI);
  } else if (const auto* table = std::get_if<TableHistory>(&history)) {
    plan.kind = PlanHistory::Kind::kTable;
    plan.times = table->times;
    plan.values = table->values;
  }
}

// X73: the rotation at each point of a load in local axes
std::vector<PlanFollower> followers(const Load& load, const Structure& structure, const Plan& plan) {
  std::vector<PlanFollower> all;
  if (load.axes != Axes::kLocal) return all;
  for (const PointLoad& each : load.forces) {
    const PlanPoint& point = plan.points[static_cast<std::size_t>(each.point)];
    PlanFollower follower;
    follower.row = point.row;
    follower.r = point.r;
    follower.force_B = to_array(each.force);
    follower.turn_rows.assign(3 * static_cast<std::size_t>(plan.num_padded), 0.0);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::RowVectorXd row = structure.local_rotations.at(each.point).row(axis);
      std::copy(row.begin(), row.end(), follower.turn_rows.begin() + std::ptrdiff_t{axis} * plan.num_padded);
    }
    all.push_back(std::move(follower));
  }
  return all;
}

void set_stiffness(const Structure& structure, int load, const Plan& plan, PlanHistory& history) {
  for (const FollowerStiffness& each : structure.follower_stiffness) {
    if (each.load != load || plan.num_elastic == 0) continue;
    const Eigen::MatrixXd& rows = traits_of(plan.fidelity).has_true_geometry ? each.bent_rows : each.rows;
    history.stiffening.modes.assign(each.modes.begin(), each.modes.end());
    for (Eigen::Index l = 0; l < rows.rows(); ++l)
      for (Eigen::Index u = 0; u < rows.cols(); ++u) history.stiffening.rows.push_back(rows(l, u));
  }
}

}  // namespace

std::string idle_torque(const PlanGroup& group, const Vec3& torque_B) {
  const Eigen::Vector3d torque(torque_B[0], torque_B[1], torque_B[2]),
      line(group.line[0], group.line[1], group.line[2]);
  Eigen::Vector3d idle = Eigen::Vector3d::Zero();
  if (group.torque_rank == 0) idle = torque;
  if (group.torque_rank == 2) idle = line * line.dot(torque);
  if (idle.stableNorm() <= kIdleTorque * torque.stableNorm()) return "";
  return join_text("group '", group.name, "' cannot take ", idle.stableNorm(),
                   " N m of the torque: its points lie ",
                   group.torque_rank == 0 ? "in one place" : "on a line and it is about that line",
                   "; put points beside them into the group or leave that torque out");
}

SumsOnPoints sums_of(const Load& load, const Plan& plan) {
  std::vector<PointForce> forces;
  for (const PointLoad& each : load.forces) forces.push_back({each.point, 0, to_array(each.force)});
  std::vector<Wrench> wrenches;
  for (const WrenchLoad& each : load.wrenches)
    wrenches.push_back({each.group, 0, to_array(each.force), to_array(each.torque)});
  std::vector<PointTorque> torques;
  for (const TorqueLoad& each : load.torques) torques.push_back({each.point, 0, to_array(each.torque)});
  std::vector<WheelTorque> wheels;
  for (const WheelLoad& each : load.wheels) wheels.push_back({each.wheel, 0, each.torque});
  SumsOnPoints sums = make_load_sums(plan);
  add_loads(plan, {load.axes == Axes::kWorld ? 0 : 1, forces, wrenches, torques, wheels}, sums);
  return sums;
}

void compile_histories(const Scene& scene, const Structure& structure, Plan& plan, Faults& faults) {
  for (const Load& load : scene.loads) {
    for (const WrenchLoad& each : load.wrenches) check_torque(scene, plan, load, each, faults);
    PlanHistory history;
    history.name = load.name;
    set_kind(load.history, history);
    // local axes: body axes, and what turns them
    history.pattern = build_pattern(plan, sums_of(load, plan));
    history.followers = followers(load, structure, plan);
    if (load.axes == Axes::kLocal)
      for (const TorqueLoad& each : load.torques)
        history.torques.all.push_back({turning_of(plan, each.point), to_array(each.torque)});
    set_stiffness(structure, static_cast<int>(plan.histories.size()), plan, history);
    plan.histories.push_back(std::move(history));
  }
}

void set_history_ticks(PlanHistory& history, double period) {
  if (history.kind != PlanHistory::Kind::kPulse) return;
  // beyond this a pulse outlasts any run; keeps the rounding inside 64 bits
  constexpr double kNever = 9e18;
  history.start_tick = std::llround(std::min(history.pulse_start / period, kNever));
  history.end_tick = std::llround(std::min((history.pulse_start + history.pulse_duration) / period, kNever));
  if (history.start_tick < history.end_tick) return;
  // the tick that its middle is in   (X13)
  history.start_tick = static_cast<std::int64_t>(
      std::min(std::floor((history.pulse_start + 0.5 * history.pulse_duration) / period), kNever));
  history.end_tick = history.start_tick + 1;
}

void warn_of_ticks(const Scene& scene, const Plan& plan, Faults& faults) {
  for (std::size_t k = 0; k < plan.histories.size(); ++k) {
    const PlanHistory& history = plan.histories[k];
    const std::string who = "load " + quoted(history.name, static_cast<int>(k));
    // loads are linear within a tick: what moves faster is another load
    const double slowest = 1.0 / (kTicksPerCycle * plan.period);
    if (history.kind == PlanHistory::Kind::kSine && history.frequency > slowest)
      add_warning(faults, scene.loads[k].origin,
                  join_text(who, ": the sine of ", history.frequency, " Hz has less than ", kTicksPerCycle,
                            " ticks a cycle at ", 1.0 / plan.period,
                            " Hz; it acts as straight lines between its values at ticks: raise the rate to ",
                            kTicksPerCycle * history.frequency, " Hz or more"));
    for (std::size_t row = 1; row < history.times.size(); ++row) {
      if (history.times[row] - history.times[row - 1] >= plan.period * (1.0 - kOnTick)) continue;
      add_warning(
          faults, scene.loads[k].origin,
          join_text(who, ": rows ", row, " and ", row + 1, " of the table are ",
                    history.times[row] - history.times[row - 1], " s apart, a tick is ", plan.period,
                    " s; the load acts as straight lines between its values at ticks: raise the rate or "
                    "give fewer rows"));
      break;
    }
    if (history.kind != PlanHistory::Kind::kPulse) continue;
    const auto warn = [&](const char* edge, double time, std::int64_t tick) {
      const double shift = static_cast<double>(tick) * plan.period - time;
      // a late edge carries the rounding of its own time besides
      if (std::abs(shift) <= kOnTick * plan.period + 1e-15 * time) return;
      add_warning(faults, scene.loads[k].origin,
                  join_text(who, ": the pulse ", edge, " at ", time, " s, which is no tick at ",
                            1.0 / plan.period, " Hz; it was moved by ", shift, " s, and the force is ",
                            amplitude_right(history, plan.period, history.start_tick),
                            " of what is given, so that its impulse is kept"));
    };
    warn("starts", history.pulse_start, history.start_tick);
    warn("ends", history.pulse_start + history.pulse_duration, history.end_tick);
  }
}

}  // namespace freeflex
