#include "core/model/check_scene.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <set>

#include "core/model/faults.hpp"

namespace freeflex {
namespace {

// [-] sine of the angle between a beam and its y_axis below which the local axes are not determined
constexpr double kParallel = 1e-6;

// elastic coordinates that one state message can carry below 60 kB: two doubles each
constexpr int kMaxElastic = 3700;

struct Checker {
  const Scene& scene;
  Faults& faults;

  bool is_point(int index) const { return index >= 0 && index < static_cast<int>(scene.points.size()); }
  bool is_group(int index) const { return index >= 0 && index < static_cast<int>(scene.groups.size()); }
  const PointMass& point(int index) const { return scene.points[static_cast<std::size_t>(index)]; }

  void error(const Origin& origin, const std::string& message) { add_error(faults, origin, message); }

  void positive(const Origin& origin, const std::string& what, double value, const char* unit) {
    if (!(std::isfinite(value) && value > 0.0))
      error(origin, join_text(what, " is ", value, " ", unit, ", must be finite and > 0"));
  }
  void not_negative(const Origin& origin, const std::string& what, double value, const char* unit) {
    if (!(std::isfinite(value) && value >= 0.0))
      error(origin, join_text(what, " is ", value, " ", unit, ", must be finite and >= 0"));
  }
  void finite(const Origin& origin, const std::string& what,
              const Eigen::Ref<const Eigen::VectorXd>& values) {
    if (!values.allFinite()) error(origin, join_text(what, " is not finite: (", values.transpose(), ")"));
  }
  bool known_point(const Origin& origin, const std::string& what, int index) {
    if (is_point(index)) return true;
    error(origin,
          join_text(what, " names point index ", index, ", there are ", scene.points.size(), " points"));
    return false;
  }
  bool known_group(const Origin& origin, const std::string& what, int index) {
    if (is_group(index)) return true;
    error(origin,
          join_text(what, " names group index ", index, ", there are ", scene.groups.size(), " groups"));
    return false;
  }

  void check_points();
  void check_link(const Link& link, int index);
  void check_two_point_link(const Link& link, const std::string& who);
  void check_beam(const Link& link, const Beam& beam, const std::string& who);
  void check_matrix_link(const Link& link, const MatrixLink& matrix, const std::string& who);
  void check_group(const Group& group, int index);
  void check_damping();
  void check_load(const Load& load, int index);
  void check_history(const Load& load, const std::string& who);
  void check_initial();
  void check_publication();
};

void Checker::check_points() {
  if (scene.points.empty()) error({}, "the scene has no points; a structure needs at least one point mass");
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const PointMass& each = scene.points[i];
    const std::string who = "point " + quoted(each.name, static_cast<int>(i));
    positive(each.origin, who + ": mass", each.mass, "kg");
    finite(each.origin, who + ": position", each.position);
  }
  if (3 * static_cast<long>(scene.points.size()) - 6 > kMaxElastic)
    error({}, join_text(scene.points.size(), " points have more than ", kMaxElastic,
                        " elastic freedoms, which is what one state message of 60 kB can carry; use at most ",
                        (kMaxElastic + 6) / 3, " points"));
}

void Checker::check_two_point_link(const Link& link, const std::string& who) {
  bool known = true;
  for (const int index : link.points) known = known_point(link.origin, who, index) && known;
  if (!known) return;
  if (link.points[0] == link.points[1]) {
    error(link.origin, who + " joins point " + quoted(point(link.points[0]).name, link.points[0]) +
                           " to itself; give two different points");
    return;
  }
  const Eigen::Vector3d a = point(link.points[0]).position, b = point(link.points[1]).position;
  if (a.allFinite() && b.allFinite() && (b - a).isZero(0.0))
    error(link.origin,
          who + " joins " + point_names(scene, {link.points[0], link.points[1]}, 2) +
              ", which are in one place; a link needs a length > 0: move a point or remove the link");
}

void Checker::check_beam(const Link& link, const Beam& beam, const std::string& who) {
  positive(link.origin, who + ": EA", beam.EA, "N");
  positive(link.origin, who + ": GJ", beam.GJ, "N m^2");
  positive(link.origin, who + ": EI_y", beam.EI_y, "N m^2");
  positive(link.origin, who + ": EI_z", beam.EI_z, "N m^2");
  finite(link.origin, who + ": y_axis", beam.y_axis);
  if (!is_point(link.points[0]) || !is_point(link.points[1]) || beam.y_axis.isZero(0.0)) return;
  const Eigen::Vector3d x =
      (point(link.points[1]).position - point(link.points[0]).position).stableNormalized();
  if (x.cross(beam.y_axis.stableNormalized()).norm() < kParallel)
    error(link.origin,
          join_text(who, ": y_axis (", beam.y_axis.transpose(),
                    ") is parallel to the beam; give a direction across it, or none to have one chosen"));
}

void Checker::check_matrix_link(const Link& link, const MatrixLink& matrix, const std::string& who) {
  std::set<int> seen;
  for (const int index : matrix.points)
    if (known_point(link.origin, who, index) && !seen.insert(index).second)
      error(link.origin, who + " names point " + quoted(point(index).name, index) + " twice; name each once");
  const auto size = 3 * static_cast<Eigen::Index>(matrix.points.size());
  if (matrix.points.size() < 2)
    error(link.origin,
          join_text(who, " names ", matrix.points.size(), " points; a matrix link joins at least two"));
  if (matrix.stiffness.rows() != size || matrix.stiffness.cols() != size)
    error(link.origin, join_text(who, ": the stiffness matrix is ", matrix.stiffness.rows(), " x ",
                                 matrix.stiffness.cols(), ", must be ", size, " x ", size, " for ",
                                 matrix.points.size(), " points"));
}

void Checker::check_link(const Link& link, int index) {
  const std::string who = "link " + quoted(link.name, index);
  if (const auto* matrix = std::get_if<MatrixLink>(&link.kind)) {
    check_matrix_link(link, *matrix, who);
    return;
  }
  check_two_point_link(link, who);
  if (const auto* spring = std::get_if<Spring>(&link.kind))
    positive(link.origin, who + ": stiffness", spring->stiffness, "N/m");
  else if (const auto* bar = std::get_if<Bar>(&link.kind))
    positive(link.origin, who + ": EA", bar->EA, "N");
  else
    check_beam(link, std::get<Beam>(link.kind), who);
}

void Checker::check_group(const Group& group, int index) {
  const std::string who = "group " + quoted(group.name, index);
  if (group.points.empty()) error(group.origin, who + " has no points; name at least one");
  std::set<int> seen;
  for (const int each : group.points)
    if (known_point(group.origin, who, each) && !seen.insert(each).second)
      error(group.origin, who + " names point " + quoted(point(each).name, each) + " twice; name each once");
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

void Checker::check_history(const Load& load, const std::string& who) {
  if (const auto* pulse = std::get_if<PulseHistory>(&load.history)) {
    not_negative(load.origin, who + ": pulse start", pulse->start, "s");
    positive(load.origin, who + ": pulse duration", pulse->duration, "s");
  } else if (const auto* sine = std::get_if<SineHistory>(&load.history)) {
    positive(load.origin, who + ": sine frequency", sine->frequency, "Hz");
    if (!std::isfinite(sine->phase)) error(load.origin, who + ": sine phase is not finite");
  } else if (const auto* table = std::get_if<TableHistory>(&load.history)) {
    if (table->times.empty() || table->times.size() != table->values.size()) {
      error(load.origin,
            join_text(who, ": the table has ", table->times.size(), " times and ", table->values.size(),
                      " values; it needs as many of one as of the other, at least one"));
      return;
    }
    for (std::size_t row = 0; row < table->times.size(); ++row) {
      if (!std::isfinite(table->times[row]) || !std::isfinite(table->values[row]))
        error(load.origin, join_text(who, ": row ", row + 1, " of the table is not finite"));
      if (row > 0 && !(table->times[row] > table->times[row - 1]))
        error(load.origin, join_text(who, ": times of the table must increase, row ", row + 1, " has ",
                                     table->times[row], " s after ", table->times[row - 1], " s"));
    }
  }
}

void Checker::check_load(const Load& load, int index) {
  const std::string who = "load " + quoted(load.name, index);
  if (load.forces.empty() && load.wrenches.empty())
    error(load.origin, who + " has no force and no wrench; give at least one");
  for (const PointLoad& each : load.forces) {
    known_point(load.origin, who, each.point);
    finite(load.origin, who + ": force", each.force);
  }
  for (const WrenchLoad& each : load.wrenches) {
    known_group(load.origin, who, each.group);
    finite(load.origin, who + ": force", each.force);
    finite(load.origin, who + ": torque", each.torque);
  }
  check_history(load, who);
}

void Checker::check_initial() {
  const Initial& initial = scene.initial;
  finite(initial.origin, "initial position", initial.position);
  finite(initial.origin, "initial velocity", initial.velocity);
  finite(initial.origin, "initial angular velocity", initial.angular_velocity);
  const double norm = initial.attitude.stableNorm();
  if (!(std::isfinite(norm) && norm > 0.0))
    error(initial.origin, join_text("initial attitude (", initial.attitude.transpose(),
                                    ") is no rotation; give a quaternion w x y z that is not zero"));
  for (const auto& each : initial.points) {
    known_point(initial.origin, "initial displacement", each.point);
    finite(initial.origin, "initial displacement", each.displacement);
    finite(initial.origin, "initial elastic velocity", each.velocity);
  }
  for (const auto& each : initial.modes)
    if (!std::isfinite(each.q) || !std::isfinite(each.q_dot))
      error(initial.origin, join_text("initial state of mode ", each.mode, " is not finite"));
}

void Checker::check_publication() {
  const Publication& publication = scene.publication;
  not_negative({}, "publication: state rate", publication.state_rate, "Hz");
  not_negative({}, "publication: points rate", publication.points_rate, "Hz");
  not_negative({}, "publication: loads rate", publication.loads_rate, "Hz");
  not_negative({}, "publication: status rate", publication.status_rate, "Hz");
  for (const int index : publication.points) known_point({}, "publication", index);
  for (const int index : publication.groups) known_group({}, "publication", index);
  for (const int index : publication.links) {
    if (index < 0 || index >= static_cast<int>(scene.links.size())) {
      error({},
            join_text("publication names link index ", index, ", there are ", scene.links.size(), " links"));
      continue;
    }
    const Link& link = scene.links[static_cast<std::size_t>(index)];
    if (std::holds_alternative<MatrixLink>(link.kind))
      error(link.origin,
            "link " + quoted(link.name, index) +
                " is a matrix link: it has no member force to publish; publish springs, bars or beams");
  }
  for (const int index : scene.pushable) known_point({}, "the list of pushable points", index);
}

}  // namespace

void check_scene(const Scene& scene, Faults& faults) {
  Checker checker{scene, faults};
  checker.positive({}, "rate", scene.rate, "Hz");
  checker.not_negative({}, "force limit", scene.force_limit, "N");
  checker.not_negative({}, "torque limit", scene.torque_limit, "N m");
  checker.finite({}, "gravity", scene.gravity);
  checker.check_points();
  for (std::size_t i = 0; i < scene.links.size(); ++i)
    checker.check_link(scene.links[i], static_cast<int>(i));
  for (std::size_t i = 0; i < scene.groups.size(); ++i)
    checker.check_group(scene.groups[i], static_cast<int>(i));
  checker.check_damping();
  for (std::size_t i = 0; i < scene.loads.size(); ++i)
    checker.check_load(scene.loads[i], static_cast<int>(i));
  checker.check_initial();
  checker.check_publication();
}

void check_modes(const Scene& scene, int num_elastic, Faults& faults) {
  const auto check = [&](const Origin& origin, const char* what, int mode) {
    if (mode < 1 || mode > num_elastic)
      add_error(
          faults, origin,
          join_text(what, " names elastic mode ", mode, ", there are ", num_elastic, ", numbered from 1"));
  };
  for (const auto& [mode, ratio] : scene.damping.mode_ratios) check(scene.damping.origin, "damping", mode);
  for (const auto& each : scene.initial.modes) check(scene.initial.origin, "initial state", each.mode);
}

}  // namespace freeflex
