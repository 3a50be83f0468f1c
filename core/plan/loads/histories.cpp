#include "core/plan/loads/histories.hpp"

#include <Eigen/Geometry>
#include <cassert>
#include <cmath>

#include "core/faults.hpp"
#include "core/plan/arrays.hpp"
#include "core/plan/loads/stiffening.hpp"
#include "core/step/loads/history.hpp"
#include "core/step/loads/loads.hpp"
#include "core/structure/links/link_factor.hpp"

namespace freeflex {
namespace {

// [ticks] An edge closer to a tick than this is taken as being on the tick, because the difference is a
// rounding error of the given value.
constexpr double kOnTick = 1e-6;

// [ticks] shortest cycle of a sine without a warning. With fewer ticks per cycle, straight lines between
// ticks miss the sine by more than 3 % of its amplitude.
constexpr double kTicksPerCycle = 13.0;

// [-] largest fraction of a torque that a group may be unable to support without an error
constexpr double kIdleTorque = 1e-9;

void check_torque(const Scene& scene, const StepPlan& plan, const Load& load, const WrenchLoad& wrench,
                  Faults& faults) {
  const PlanGroup& group = plan.groups[index(wrench.group)];
  const std::string who =
      join_text("load ", quoted(load.name, static_cast<int>(&load - scene.loads.data())), ": ");
  // If the points lie on a line, the component about it of a torque in other axes depends on the attitude.
  if (group.torque_rank == 2 && load.axes != Axes::kBody) {
    const Eigen::Vector4d& q = scene.initial.attitude;
    const Eigen::Quaterniond q_WB(q[0], q[1], q[2], q[3]);
    const Eigen::Vector3d torque =
        load.axes == Axes::kWorld ? Eigen::Vector3d(q_WB.inverse() * wrench.torque) : wrench.torque;
    if (!refused_torque(group, to_array(torque)).empty())
      add_warning(
          faults, load.origin,
          join_text(who, "the component of the torque about the line through the points of group '",
                    group.name, "' is left out, because forces on these points cannot exert it; it is ",
                    std::abs(torque.dot(Eigen::Vector3d(group.line[0], group.line[1], group.line[2]))),
                    " N m at the start; add a point beside the line to the group"));
    return;
  }
  const std::string idle = refused_torque(group, to_array(wrench.torque));
  if (!idle.empty()) add_error(faults, load.origin, who + idle);
}

// Sets the kind of a history and the parameters of its amplitude   (THEORY 8.10 to 8.13).
void set_kind(const History& history, PlanHistory& plan) {
  std::visit(Cases{[&](const ConstantHistory&) { plan.kind = PlanHistory::Kind::kConstant; },
                   [&](const PulseHistory& pulse) {
                     plan.kind = PlanHistory::Kind::kPulse;
                     plan.pulse_start = pulse.start;
                     plan.pulse_duration = pulse.duration;
                   },
                   [&](const SineHistory& sine) {
                     plan.kind = PlanHistory::Kind::kSine;
                     plan.frequency = sine.frequency;
                     plan.phase = sine.phase / (2.0 * M_PI);
                   },
                   [&](const TableHistory& table) {
                     plan.kind = PlanHistory::Kind::kTable;
                     plan.times = table.times;
                     plan.values = table.values;
                   }},
             history);
}

// Returns the points whose rotation a force in local axes follows, with their shares; none if a joint or a
// rigid body turns the force   (THEORY 8.53).
std::vector<PlanFollower::Neighbour> neighbours_of(const Scene& scene, int point) {
  std::vector<PlanFollower::Neighbour> all;
  const Freedoms freedoms(scene);
  if (freedoms.has_joint(point) || freedoms.body_of(point) >= 0) return all;
  const Eigen::MatrixXd rotation = rotation_of_neighbours(scene, point);
  for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(scene.points.size()); ++i)
    if (const Eigen::Matrix3d turn = rotation.middleCols<3>(3 * i); !turn.isZero(0.0))
      all.push_back({static_cast<std::int32_t>(i), to_array(turn)});
  return all;
}

// Returns the rows of the local rotation theta at each point of a load in local axes, whose force is f = f_B
// + theta x f_B (THEORY 8.24). If the load stiffens the lowest modes only, theta has only these modes: in
// higher modes the stiffness and the rotation of the load nearly cancel (THEORY 8.49).
std::vector<PlanFollower> followers(const Load& load, const Scene& scene, const PlanStiffening& stiffening,
                                    const Structure& structure, const StepPlan& plan) {
  std::vector<PlanFollower> all;
  if (load.axes != Axes::kLocal) return all;
  for (const PointLoad& each : load.forces) {
    const PlanPoint& point = plan.points[index(each.point)];
    PlanFollower follower;
    follower.row = point.row;
    follower.r = point.r;
    follower.force_B = to_array(each.force);
    follower.rotation_rows.assign(3 * index(plan.num_padded), 0.0);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::RowVectorXd row = structure.local_rotations.at(each.point).row(axis);
      double* const to = follower.rotation_rows.data() + std::ptrdiff_t{axis} * plan.num_padded;
      if (stiffening.modes.empty()) std::copy(row.begin(), row.end(), to);
      for (const std::int32_t mode : stiffening.modes) to[mode] = row[mode];
    }
    if (traits_of(plan.fidelity).has_true_geometry) follower.neighbours = neighbours_of(scene, each.point);
    all.push_back(std::move(follower));
  }
  return all;
}

}  // namespace

std::string refused_torque(const PlanGroup& group, const Vec3& torque_B) {
  const Eigen::Vector3d torque(torque_B[0], torque_B[1], torque_B[2]),
      line(group.line[0], group.line[1], group.line[2]);
  Eigen::Vector3d idle = Eigen::Vector3d::Zero();
  if (group.torque_rank == 0) idle = torque;
  if (group.torque_rank == 2) idle = line * line.dot(torque);
  if (idle.stableNorm() <= kIdleTorque * torque.stableNorm()) return "";
  return join_text("group '", group.name, "' cannot support ", idle.stableNorm(),
                   " N m of the torque, because its points lie ",
                   group.torque_rank == 0 ? "at one position"
                                          : "on a line, and this component acts about "
                                            "that line",
                   "; add other points to the group, or omit this component of the torque");
}

SumsOnPoints sums_of(const Load& load, const StepPlan& plan) {
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

void compile_histories(const Scene& scene, const Structure& structure, StepPlan& plan, Faults& faults) {
  assert(plan.points.size() == scene.points.size() && plan.groups.size() == scene.groups.size());
  for (const Load& load : scene.loads) {
    for (const WrenchLoad& each : load.wrenches) check_torque(scene, plan, load, each, faults);
    PlanHistory history;
    history.name = load.name;
    set_kind(load.history, history);
    // A load in local axes has the pattern of the same load in body axes and, in addition, rotation rows for
    // its followers.
    history.pattern = build_pattern(plan, sums_of(load, plan));
    history.stiffening = load_stiffening(scene, structure, static_cast<int>(plan.histories.size()), plan);
    history.followers = followers(load, scene, history.stiffening, structure, plan);
    if (load.axes == Axes::kLocal)
      for (const TorqueLoad& each : load.torques)
        history.torques.push_back({attitude_index_of(plan, each.point), to_array(each.torque)});
    plan.histories.push_back(std::move(history));
  }
}

void set_history_ticks(PlanHistory& history, double period) {
  if (history.kind != PlanHistory::Kind::kPulse) return;
  // [ticks] A longer pulse outlasts any run, so this limit changes no run. The limit keeps the rounded value
  // within 64 bits.
  constexpr double kNever = 9e18;
  history.start_tick = std::llround(std::min(history.pulse_start / period, kNever));
  history.end_tick = std::llround(std::min((history.pulse_start + history.pulse_duration) / period, kNever));
  if (history.start_tick < history.end_tick) return;
  // the tick that contains the middle of the pulse   (THEORY 8.10)
  history.start_tick = static_cast<std::int64_t>(
      std::min(std::floor((history.pulse_start + 0.5 * history.pulse_duration) / period), kNever));
  history.end_tick = history.start_tick + 1;
}

void warn_of_ticks(const Scene& scene, const StepPlan& plan, Faults& faults) {
  for (std::size_t k = 0; k < plan.histories.size(); ++k) {
    const PlanHistory& history = plan.histories[k];
    const std::string who = "load " + quoted(history.name, static_cast<int>(k));
    // the step takes loads as linear within a tick, and straight lines are too far from a faster sine
    const double slowest = 1.0 / (kTicksPerCycle * plan.period);
    if (history.kind == PlanHistory::Kind::kSine && history.frequency > slowest && !integrates_points(plan))
      add_warning(faults, scene.loads[k].origin,
                  join_text(who, ": the sine of ", history.frequency, " Hz has fewer than ", kTicksPerCycle,
                            " ticks a cycle at ", 1.0 / plan.period,
                            " Hz, but the load is linear between ticks; raise the rate to ",
                            kTicksPerCycle * history.frequency, " Hz or more"));
    for (std::size_t row = 1; row < history.times.size(); ++row) {
      if (history.times[row] - history.times[row - 1] >= plan.period * (1.0 - kOnTick)) continue;
      add_warning(faults, scene.loads[k].origin,
                  join_text(who, ": rows ", row, " and ", row + 1, " of the table are ",
                            history.times[row] - history.times[row - 1], " s apart, less than a tick of ",
                            plan.period,
                            " s. The load is sampled at ticks, so rows between ticks are lost; "
                            "raise the rate or give fewer rows"));
      break;
    }
    if (history.kind != PlanHistory::Kind::kPulse) continue;
    const auto warn = [&](const char* edge, double time, std::int64_t tick) {
      const double shift = static_cast<double>(tick) * plan.period - time;
      // the second term allows for the rounding error of a large time
      if (std::abs(shift) <= kOnTick * plan.period + 1e-15 * time) return;
      add_warning(faults, scene.loads[k].origin,
                  join_text(who, ": the pulse ", edge, " at ", time, " s, which is not a tick at ",
                            1.0 / plan.period, " Hz; it was moved by ", shift, " s, and the force is ",
                            amplitude_right(history, plan.period, history.start_tick),
                            " times the given force, so that the impulse is the same"));
    };
    warn("starts", history.pulse_start, history.start_tick);
    warn("ends", history.pulse_start + history.pulse_duration, history.end_tick);
  }
}

}  // namespace freeflex
