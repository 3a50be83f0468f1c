#include "core/scene/check/check_scene.hpp"

#include <algorithm>
#include <set>

#include "core/limits.hpp"
#include "core/scene/bodies.hpp"
#include "core/scene/check/checker.hpp"
#include "core/scene/link_kinds.hpp"

namespace freeflex {
namespace {

// largest number of points of a link such that the forces on these points fit in one message of 60 kB
constexpr std::size_t kMaxForcePoints = 2000;

}  // namespace

void Checker::check_points() {
  if (scene.points.empty()) error({}, "the scene has no points; a structure needs at least one point mass");
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const PointMass& each = scene.points[i];
    const std::string who = "point " + quoted(each.name, static_cast<int>(i));
    not_negative(each.origin, who + ": mass", each.mass, "kg");
    finite(each.origin, who + ": position", each.position);
    finite(each.origin, who + ": offset", each.offset);
    if (const std::string problem = inertia_problem(each.inertia); !problem.empty())
      error(each.origin, join_text(who, ": ", problem));
    if (each.mass == 0.0 && has_attitude(each))
      error(each.origin, who + " has inertia or an offset, but no mass; give its mass");
  }
  if (!scene.points.empty() &&
      std::all_of(scene.points.begin(), scene.points.end(),
                  [](const PointMass& each) { return each.mass == 0.0; }) &&
      std::none_of(scene.links.begin(), scene.links.end(), [](const Link& link) { return has_mass(link); }))
    error(scene.points.front().origin, kNoMass);
  check_num_points(scene, true, faults);
}

void Checker::check_group(const Group& group, int index) {
  const std::string who = "group " + quoted(group.name, index);
  if (group.points.empty()) error(group.origin, who + " has no points; name at least one");
  std::set<int> seen;
  for (const int each : group.points)
    if (known_point(group.origin, who, each) && !seen.insert(each).second)
      error(group.origin, who + " names point " + quoted(point(each).name, each) + " twice; name each once");
  const auto is_massless = [&](int each) { return is_point(each) && point(each).mass == 0.0; };
  const auto is_in = [&](int each) { return seen.count(each) > 0; };
  if (!group.points.empty() && std::all_of(group.points.begin(), group.points.end(), is_massless) &&
      std::none_of(scene.links.begin(), scene.links.end(), [&](const Link& link) {
        return has_mass(link) && !std::holds_alternative<MatrixLink>(link.kind) &&
               std::all_of(link.points.begin(), link.points.end(), is_in);
      }))
    error(group.origin, who +
                            " has no mass, but a wrench is distributed over its points by mass; add a point "
                            "with mass, or all "
                            "points of a beam, bar or plate with mass");
}

void Checker::check_damping() {
  const Damping& damping = scene.damping;
  not_negative(damping.origin, "damping: modal_ratio", damping.modal_ratio, "");
  not_negative(damping.origin, "damping: alpha", damping.alpha, "1/s");
  not_negative(damping.origin, "damping: beta", damping.beta, "s");
  std::set<int> seen;
  for (const auto& [mode, ratio] : damping.mode_ratios) {
    not_negative(damping.origin, join_text("damping: ratio of mode ", mode), ratio, "");
    if (!seen.insert(mode).second)
      error(damping.origin, join_text("damping: mode ", mode, " is given twice; give one ratio"));
  }
}

void Checker::check_wheels() {
  if (scene.wheels.size() > std::size_t{kMaxWheels})
    error(scene.wheels[std::size_t{kMaxWheels}].origin,
          join_text("the scene has ", scene.wheels.size(), " wheels, but at most ", kMaxWheels,
                    " are allowed; remove some"));
  for (std::size_t k = 0; k < scene.wheels.size(); ++k) {
    const Wheel& wheel = scene.wheels[k];
    const std::string who = "wheel " + quoted(wheel.name, static_cast<int>(k));
    if (known_point(wheel.origin, who, wheel.point) && !has_attitude(point(wheel.point)))
      error(wheel.origin, who + " is in point " + quoted(point(wheel.point).name, wheel.point) +
                              ", which has no inertia; give it the inertia of the body that holds the wheel");
    if (!(std::abs(wheel.axis.norm() - 1.0) < 1e-9))
      error(wheel.origin, join_text(who, ": axis (", wheel.axis.transpose(),
                                    ") is not a unit vector; give one of length 1"));
    if (!std::isfinite(wheel.momentum))
      error(wheel.origin, who + ": momentum is not finite; give a finite number");
  }
}

void Checker::check_history(const Load& load, const std::string& who) {
  if (const auto* pulse = std::get_if<PulseHistory>(&load.history)) {
    not_negative(load.origin, who + ": pulse start", pulse->start, "s");
    positive(load.origin, who + ": pulse duration", pulse->duration, "s");
  } else if (const auto* sine = std::get_if<SineHistory>(&load.history)) {
    positive(load.origin, who + ": sine frequency", sine->frequency, "Hz");
    if (!std::isfinite(sine->phase))
      error(load.origin, who + ": sine phase is not finite; give a finite number");
  } else if (const auto* table = std::get_if<TableHistory>(&load.history)) {
    if (table->times.empty() || table->times.size() != table->values.size()) {
      error(load.origin,
            join_text(who, ": the table has ", table->times.size(), " times and ", table->values.size(),
                      " values, but needs as many times as values, "
                      "at least one of each"));
      return;
    }
    for (std::size_t row = 0; row < table->times.size(); ++row) {
      if (!std::isfinite(table->times[row]) || !std::isfinite(table->values[row]))
        error(load.origin,
              join_text(who, ": row ", row + 1, " of the table is not finite; give finite numbers"));
      if (row > 0 && !(table->times[row] > table->times[row - 1]))
        error(load.origin, join_text(who, ": the times of the table must increase, but row ", row + 1,
                                     " has ", table->times[row], " s after ", table->times[row - 1], " s"));
    }
  }
}

void Checker::check_load(const Load& load, int index) {
  const std::string who = "load " + quoted(load.name, index);
  if (load.forces.empty() && load.wrenches.empty() && load.torques.empty() && load.wheels.empty())
    error(load.origin, who + " has no force, wrench, torque or wheel; give at least one");
  for (const WheelLoad& each : load.wheels) {
    if (each.wheel < 0 || each.wheel >= static_cast<int>(scene.wheels.size()))
      error(load.origin, join_text(who, " names wheel index ", each.wheel, ", but there are ",
                                   scene.wheels.size(), " wheels, numbered from 0"));
    if (!std::isfinite(each.torque))
      error(load.origin, who + ": torque of a wheel is not finite; give a finite number");
  }
  for (const PointLoad& each : load.forces) {
    known_point(load.origin, who, each.point);
    finite(load.origin, who + ": force", each.force);
  }
  for (const WrenchLoad& each : load.wrenches) {
    known_group(load.origin, who, each.group);
    finite(load.origin, who + ": force", each.force);
    finite(load.origin, who + ": torque", each.torque);
  }
  for (const TorqueLoad& each : load.torques) {
    finite(load.origin, who + ": torque", each.torque);
    if (known_point(load.origin, who, each.point) && !has_attitude(point(each.point)))
      error(load.origin,
            who + ": point " + quoted(point(each.point).name, each.point) +
                " has no attitude, so no torque can act on it; give it inertia or an offset, or apply a "
                "wrench to a group of several points");
  }
  if (load.axes == Axes::kLocal && !load.wrenches.empty())
    error(load.origin, who +
                           " has a wrench in local axes, but a group has no single local rotation; give "
                           "forces on points, or "
                           "body axes");
  check_history(load, who);
}

void Checker::check_feedback(const Feedback& feedback, int index) {
  const std::string who = "feedback " + quoted(feedback.name, index);
  known_point(feedback.origin, who, feedback.point);
  known_point(feedback.origin, who + ": sensor", feedback.sensor);
  const auto gain = [&](const char* what, const Eigen::Matrix3d& matrix) {
    if (!matrix.allFinite())
      error(feedback.origin, join_text(who, ": ", what, " gain is not finite; give finite numbers"));
    return !matrix.isZero(0.0);
  };
  const bool by_displacement = gain("displacement", feedback.displacement_gain),
             by_velocity = gain("velocity", feedback.velocity_gain),
             by_acceleration = gain("acceleration", feedback.acceleration_gain);
  if (!by_displacement && !by_velocity && !by_acceleration)
    error(feedback.origin, who + " has only zero gains; give a displacement, velocity or acceleration gain");
}

void Checker::check_attractor() {
  const Attractor& attractor = scene.attractor;
  finite(attractor.origin, "attractor: position", attractor.position);
  not_negative(attractor.origin, "attractor: mu", attractor.mu, "m^3/s^2");
  if (attractor.mu > 0.0 && !scene.gravity.isZero(0.0))
    error(attractor.origin, "the scene has an attractor and uniform gravity; give one field");
}

void Checker::check_initial() {
  const Initial& initial = scene.initial;
  finite(initial.origin, "initial position", initial.position);
  finite(initial.origin, "initial velocity", initial.velocity);
  finite(initial.origin, "initial angular velocity", initial.angular_velocity);
  const double norm = initial.attitude.stableNorm();
  if (!(std::isfinite(norm) && norm > 0.0))
    error(initial.origin, join_text("initial attitude (", initial.attitude.transpose(),
                                    ") is not a rotation; give a quaternion w x y z that is not zero"));
  for (const auto& each : initial.points) {
    known_point(initial.origin, "initial displacement", each.point);
    finite(initial.origin, "initial displacement", each.displacement);
    finite(initial.origin, "initial elastic velocity", each.velocity);
  }
  const auto has_mass_matrix = [](const Link& link) {
    return std::holds_alternative<MatrixLink>(link.kind) && has_mass(link);
  };
  if (!initial.points.empty() && std::any_of(scene.links.begin(), scene.links.end(), has_mass_matrix))
    error(initial.origin,
          "initial: points do not determine the motion inside a mass matrix; give initial: modes");
  for (const auto& each : initial.modes)
    if (!std::isfinite(each.q) || !std::isfinite(each.q_dot))
      error(initial.origin,
            join_text("initial state of mode ", each.mode, " is not finite; give finite numbers"));
}

void Checker::check_publication() {
  const Publication& publication = scene.publication;
  for (std::size_t i = 0; i < kNumMotionChannels; ++i)
    not_negative({}, join_text("publication: ", kMotionChannels[i].key, " rate"), publication.rates[i], "Hz");
  not_negative({}, "publication: status rate", publication.status_rate, "Hz");
  for (const int index : publication.points) known_point({}, "publication", index);
  for (const int index : publication.groups) known_group({}, "publication", index);
  for (const int index : publication.links) {
    if (index < 0 || index >= static_cast<int>(scene.links.size())) {
      error({}, join_text("publication names link index ", index, ", but there are ", scene.links.size(),
                          " links, numbered from 0"));
      continue;
    }
    const Link& link = scene.links[static_cast<std::size_t>(index)];
    if (!publishes_forces(scene, link))
      error(link.origin,
            join_text("link ", called(link, index),
                      std::holds_alternative<MatrixLink>(link.kind)
                          ? " is a superelement, whose forces are not published"
                          : " is rigid, and forces of rigid links are not published in scenes with bodies or "
                            "massless points",
                      "; remove it from publish: loads"));
    if (has_point_forces(link) && link.points.size() > kMaxForcePoints)
      error(link.origin,
            join_text("link ", called(link, index), " has ", link.points.size(), " points, but at most ",
                      kMaxForcePoints, " forces of one link fit a message; do not publish its forces"));
  }
  for (const int index : scene.pushable) known_point({}, "the list of pushable points", index);
}

void check_scene(const Scene& scene, Faults& faults) {
  Checker checker{scene, faults};
  checker.positive({}, "rate", scene.rate, "Hz");
  checker.not_negative({}, "force limit", scene.force_limit, "N");
  checker.not_negative({}, "torque limit", scene.torque_limit, "N m");
  checker.finite({}, "gravity", scene.gravity);
  checker.check_points();
  for (std::size_t i = 0; i < scene.links.size(); ++i)
    checker.check_link(scene.links[i], static_cast<int>(i));
  checker.check_resolution();
  for (std::size_t i = 0; i < scene.groups.size(); ++i)
    checker.check_group(scene.groups[i], static_cast<int>(i));
  checker.check_wheels();
  checker.check_damping();
  for (std::size_t i = 0; i < scene.loads.size(); ++i)
    checker.check_load(scene.loads[i], static_cast<int>(i));
  for (std::size_t i = 0; i < scene.feedbacks.size(); ++i)
    checker.check_feedback(scene.feedbacks[i], static_cast<int>(i));
  checker.check_attractor();
  checker.check_initial();
  checker.check_publication();
}

void check_num_points(const Scene& scene, bool is_whole, Faults& faults) {
  if (scene.points.size() <= std::size_t{kMaxPoints}) return;
  add_error(
      faults, scene.points[kMaxPoints].origin,
      join_text("this is point ", kMaxPoints + 1, " of ", scene.points.size(), is_whole ? "" : " or more",
                ", but at most ", kMaxPoints, " are allowed; merge points, or remove some"));
}

void check_modes(const Scene& scene, int num_elastic, Faults& faults) {
  const auto check = [&](const Origin& origin, const char* what, int mode) {
    if (mode < 1 || mode > num_elastic)
      add_error(faults, origin,
                join_text(what, " names elastic mode ", mode, ", but there are only ", num_elastic,
                          ", numbered from 1"));
  };
  for (const auto& [mode, ratio] : scene.damping.mode_ratios) check(scene.damping.origin, "damping", mode);
  for (const auto& each : scene.initial.modes) check(scene.initial.origin, "initial state", each.mode);
}

}  // namespace freeflex
