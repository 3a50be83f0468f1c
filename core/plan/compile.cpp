#include "core/plan/compile.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/plan/budget.hpp"
#include "core/plan/histories.hpp"
#include "core/plan/mixing.hpp"
#include "core/plan/propagator.hpp"
#include "core/plan/rungs.hpp"
#include "core/scene/extremes.hpp"
#include "core/scene/faults.hpp"
#include "core/structure/decompositions.hpp"

namespace freeflex {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

// [-] of the given displacements: a rigid part above this is said, below it is rounding of what a person
// typed
constexpr double kRigidPart = 1e-9;

Vec3 to_array(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Mat3 to_array(const Eigen::Matrix3d& m) {
  Mat3 rows{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) rows[3 * static_cast<std::size_t>(i) + static_cast<std::size_t>(j)] = m(i, j);
  return rows;
}

int pad(Eigen::Index count) { return (static_cast<int>(count) + kLanes - 1) / kLanes * kLanes; }

// values over modes and, if there are more, over constraint shapes
Array padded(const Plan& plan, const Eigen::Ref<const Eigen::VectorXd>& values) {
  Array all(static_cast<std::size_t>(plan.num_padded), 0.0);
  const Eigen::Index num_modes = std::min<Eigen::Index>(values.size(), plan.num_elastic);
  std::copy(values.begin(), values.begin() + num_modes, all.begin());
  std::copy(values.begin() + num_modes, values.end(), all.begin() + plan.num_moving);
  return all;
}

void append_row(const Plan& plan, const Eigen::RowVectorXd& values, Array& rows) {
  const Array row = padded(plan, values.transpose());
  rows.insert(rows.end(), row.begin(), row.end());
}

// unit elastic displacements and constraint shapes side by side
Eigen::MatrixXd all_shapes(const Structure& structure) {
  Eigen::MatrixXd shapes(structure.shapes.rows(),
                         structure.shapes.cols() + structure.constraint_shapes.cols());
  shapes << structure.shapes, structure.constraint_shapes;
  return shapes;
}

void compile_body(const Scene& scene, const MassProperties& body, Plan& plan) {
  plan.name = scene.name;
  plan.scene_hash = scene.hash;
  plan.mass = body.mass;
  plan.rigid_freedoms = body.rigid_freedoms;
  plan.p_SB = to_array(body.p_SB);
  plan.inertia = to_array(body.inertia);
  // through principal moments, which keep their digits for thin shapes; a moment of a freedom that is not
  // there has none
  Eigen::Vector3d inverse = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const bool turns = body.rigid_freedoms == 6 || (body.rigid_freedoms == 5 && k > 0);
    if (turns) inverse[k] = 1.0 / body.principal[k];
  }
  plan.inverse_inertia =
      to_array(Eigen::Matrix3d(body.principal_axes * inverse.asDiagonal() * body.principal_axes.transpose()));
  plan.line = to_array(body.line);
  plan.gravity_W = to_array(scene.gravity);
  plan.attractor_mu = scene.attractor.mu;
  plan.attractor_W = to_array(scene.attractor.position);
}

// X53, X66: decay = zeta omega + alpha / 2 + beta omega^2 / 2
Eigen::VectorXd decays(const Damping& damping, const Structure& structure) {
  const Eigen::VectorXd& omega = structure.omega;
  Eigen::VectorXd ratio = Eigen::VectorXd::Constant(omega.size(), damping.modal_ratio);
  for (const auto& [mode, zeta] : damping.mode_ratios) ratio[mode - 1] = zeta;
  ratio += structure.structural_ratio;
  return ratio.array() * omega.array() + 0.5 * damping.alpha + 0.5 * damping.beta * omega.array().square();
}

void compile_modes(const Scene& scene, const Structure& structure, Plan& plan) {
  plan.num_elastic = static_cast<std::int32_t>(structure.omega.size());
  plan.num_moving = pad(plan.num_elastic);
  plan.num_padded = plan.num_moving + pad(structure.constraint_shapes.cols());
  plan.omega = padded(plan, structure.omega);
  plan.decay = padded(plan, decays(scene.damping, structure));
  plan.frequency_accuracy = structure.frequency_accuracy;
  plan.conditioning = structure.conditioning;
  for (const Mechanism& mechanism : structure.mechanisms)
    plan.mechanisms.emplace_back(mechanism.moved_points.begin(), mechanism.moved_points.end());
  // residuals of (2.2): sum m b and sum m r x b
  const Eigen::Matrix3Xd& r = structure.mass_properties.r;
  Eigen::MatrixXd residual = Eigen::MatrixXd::Zero(6, structure.omega.size());
  for (Eigen::Index i = 0; i < r.cols(); ++i) {
    const double mass = scene.points[static_cast<std::size_t>(i)].mass;
    for (Eigen::Index mode = 0; mode < structure.omega.size(); ++mode) {
      const Eigen::Vector3d b = structure.shapes.block<3, 1>(3 * i, mode);
      residual.block<3, 1>(0, mode) += mass * b;
      residual.block<3, 1>(3, mode) += mass * r.col(i).cross(b);
    }
  }
  for (int row = 0; row < 6; ++row) append_row(plan, residual.row(row), plan.eckart_rows);
}

// X70, X72: Y_ab = sum m r_a b_b, symmetric by (2.6)
void compile_field(const Scene& scene, const Structure& structure, const Eigen::MatrixXd& shapes,
                   Plan& plan) {
  plan.fidelity = scene.fidelity;
  plan.has_spin_load = scene.fidelity == Fidelity::kSpinLoaded && plan.turns;
  if (!plan.has_spin_load && plan.attractor_mu == 0.0) return;
  const Eigen::Matrix3Xd& r = structure.mass_properties.r;
  static constexpr std::array<std::array<int, 2>, 6> kPairs{{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};
  for (const auto& [a, b] : kPairs) {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(shapes.cols());
    for (Eigen::Index i = 0; i < r.cols(); ++i) {
      const double mass = scene.points[static_cast<std::size_t>(i)].mass;
      row += 0.5 * mass * (r(a, i) * shapes.row(3 * i + b) + r(b, i) * shapes.row(3 * i + a));
    }
    append_row(plan, row, plan.field_rows);
  }
}

// points whose rows the step or the read-out can ask for
std::vector<bool> points_with_rows(const Scene& scene) {
  std::vector<bool> used(scene.points.size(), false);
  const auto use = [&](int point) { used[static_cast<std::size_t>(point)] = true; };
  std::for_each(scene.pushable.begin(), scene.pushable.end(), use);
  std::for_each(scene.publication.points.begin(), scene.publication.points.end(), use);
  // commands may put a wrench on any group
  for (const Group& group : scene.groups) std::for_each(group.points.begin(), group.points.end(), use);
  for (const Load& load : scene.loads)
    for (const PointLoad& each : load.forces) use(each.point);
  for (const Feedback& feedback : scene.feedbacks) use(feedback.point);
  // on coupled rungs every point moves the body, and a budget looks at each
  if (scene.fidelity >= Fidelity::kCoupled || scene.error_budget.horizon > 0.0)
    used.assign(used.size(), true);
  return used;
}

void compile_points(const Scene& scene, const Structure& structure, const Eigen::MatrixXd& shapes,
                    Plan& plan) {
  std::vector<bool> used = points_with_rows(scene);
  if (scene.leave_out.keeps[static_cast<std::size_t>(Part::kPointRows)]) used.assign(used.size(), true);
  std::int32_t num_blocks = 0;
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    PlanPoint point;
    point.name = scene.points[i].name;
    point.mass = scene.points[i].mass;
    point.r = to_array(Eigen::Vector3d(structure.mass_properties.r.col(column)));
    point.pushable =
        std::find(scene.pushable.begin(), scene.pushable.end(), static_cast<int>(i)) != scene.pushable.end();
    if (used[i]) {
      point.row = num_blocks++;
      for (int axis = 0; axis < 3; ++axis) append_row(plan, shapes.row(3 * column + axis), plan.rows);
    }
    plan.points.push_back(std::move(point));
  }
}

void compile_links(const Scene& scene, const Structure& structure, Plan& plan) {
  for (const Link& link : scene.links) {
    static constexpr std::array<const char*, std::variant_size_v<decltype(Link::kind)>> kKinds{
        "spring", "bar", "beam", "matrix", "bending", "torsion", "plate", "rigid", "dashpot"};
    PlanLink each;
    each.name = link.name;
    each.kind = kKinds.at(link.kind.index());
    if (!std::holds_alternative<MatrixLink>(link.kind))
      each.points.assign(link.points.begin(), link.points.end());
    plan.links.push_back(std::move(each));
  }
  std::int32_t next_row = 0;
  const auto append = [&](const Eigen::MatrixXd& rows, Eigen::Index offset) {
    if (rows.rows() == 0) return -1;
    const std::int32_t first = next_row;
    for (Eigen::Index row = 0; row < rows.rows(); ++row) {
      Eigen::RowVectorXd all = Eigen::RowVectorXd::Zero(offset + rows.cols());
      all.tail(rows.cols()) = rows.row(row);
      append_row(plan, all, plan.link_rows);
    }
    next_row += static_cast<std::int32_t>(rows.rows());
    return first;
  };
  for (const LinkForceRows& force : structure.link_forces) {
    if (force.rows.rows() == 0)
      continue;  // a rigid link that others make redundant carries no force of its own
    PlanLinkOutput output;
    output.link = force.link;
    output.num_rows = static_cast<std::int32_t>(force.rows.rows());
    output.first_row = append(force.rows, 0);
    output.first_rate_row = append(force.rate_rows, 0);
    output.first_load_row = append(force.load_rows, structure.omega.size());
    plan.link_outputs.push_back(output);
  }
}

// X12: mass-weighted rigid weights of a group; a line takes no torque about itself, one place takes none at
// all
PlanGroup compile_group(const Scene& scene, const Group& group, const MassProperties& body) {
  const auto num_points = static_cast<Eigen::Index>(group.points.size());
  PlanGroup plan;
  plan.name = group.name;
  plan.points.assign(group.points.begin(), group.points.end());
  Eigen::VectorXd mass(num_points);
  for (Eigen::Index k = 0; k < num_points; ++k)
    mass[k] = scene.points[static_cast<std::size_t>(group.points[static_cast<std::size_t>(k)])].mass;
  plan.mass = mass.sum();
  Eigen::Matrix3Xd d = body.r(Eigen::all, group.points);
  const Eigen::Vector3d centre = d * mass / plan.mass;
  d.colwise() -= centre;
  plan.centre = to_array(centre);

  const Eigen::JacobiSVD<Eigen::MatrixXd> shape(d, Eigen::ComputeFullU);
  const double length = std::sqrt(d.colwise().squaredNorm().maxCoeff());
  // the same measure of a line as for the whole body; coordinates are from its centre
  const double rounding = 64.0 * kEpsilon * std::max(1e-300, body.r.cwiseAbs().maxCoeff());
  const Eigen::Vector3d line = shape.matrixU().col(0);
  const Eigen::Matrix3Xd across = d - line * (line.transpose() * d);
  const double width = std::sqrt(across.colwise().squaredNorm().maxCoeff());
  plan.torque_rank = length <= rounding ? 0 : (num_points == 2 || width <= rounding ? 2 : 3);
  if (plan.torque_rank == 2) plan.line = to_array(line);
  if (plan.torque_rank == 0) return plan;

  const Eigen::Matrix3Xd weighted = d * mass.cwiseSqrt().asDiagonal();
  const Eigen::Matrix3d second_moment = weighted * weighted.transpose();
  const Eigen::Matrix3d inertia = second_moment.trace() * Eigen::Matrix3d::Identity() - second_moment;
  if (plan.torque_rank == 2) {
    const Eigen::Matrix3d normal = Eigen::Matrix3d::Identity() - line * line.transpose();
    plan.inverse_inertia = to_array(Eigen::Matrix3d(normal / second_moment.trace()));
  } else {
    plan.inverse_inertia = to_array(Eigen::Matrix3d(inertia.inverse()));
  }
  return plan;
}

// elastic coordinates from displacements given at points: q_l = sum m_i b_il . V_i / M   (THEORY X54)
Eigen::VectorXd project(const Scene& scene, const Structure& structure, const Eigen::VectorXd& V,
                        const char* what, Faults& faults) {
  Eigen::VectorXd weighted = V;
  for (std::size_t i = 0; i < scene.points.size(); ++i)
    weighted.segment<3>(3 * static_cast<Eigen::Index>(i)) *= scene.points[i].mass;
  Eigen::VectorXd q = structure.shapes.transpose() * weighted / structure.mass_properties.mass;
  const double given = std::sqrt(V.dot(weighted));
  const Eigen::VectorXd rest = V - structure.shapes * q;
  double rest2 = 0.0;
  for (std::size_t i = 0; i < scene.points.size(); ++i)
    rest2 += scene.points[i].mass * rest.segment<3>(3 * static_cast<Eigen::Index>(i)).squaredNorm();
  if (std::sqrt(rest2) > kRigidPart * given)
    add_warning(
        faults, scene.initial.origin,
        join_text("the initial ", what, " of the points hold ", 100.0 * std::sqrt(rest2) / given,
                  " % of rigid motion (mass-weighted), which was taken out; give rigid motion by position, "
                  "attitude and velocities"));
  return q;
}

void compile_elastic_state(const Scene& scene, const Structure& structure, Plan& plan, Faults& faults) {
  const Initial& initial = scene.initial;
  Eigen::VectorXd V = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(scene.points.size()));
  Eigen::VectorXd V_dot = V;
  for (const auto& each : initial.points) {
    V.segment<3>(3 * Eigen::Index{each.point}) += each.displacement;
    V_dot.segment<3>(3 * Eigen::Index{each.point}) += each.velocity;
  }
  Eigen::VectorXd q = project(scene, structure, V, "displacements", faults);
  Eigen::VectorXd q_dot = project(scene, structure, V_dot, "elastic velocities", faults);
  for (const auto& each : initial.modes) {
    q[each.mode - 1] += each.q;
    q_dot[each.mode - 1] += each.q_dot;
  }
  plan.initial.q = padded(plan, q);
  plan.initial.q_dot = padded(plan, q_dot);
}

// the separated equations take the spin as slow beside every vibration, and linear links do not stiffen by it
void warn_of_fast_spin(const Structure& structure, const Eigen::Vector3d& spin, const Origin& origin,
                       Faults& faults) {
  constexpr double kSlow = 0.01;  // [-] (spin / omega_1)^2: centrifugal softening of one per cent
  for (const double omega : structure.omega) {
    if (omega == 0.0) continue;
    const double ratio = spin.squaredNorm() / (omega * omega);
    if (ratio > kSlow)
      add_warning(
          faults, origin,
          join_text("the initial spin of ", spin.norm(), " rad/s is not slow beside the lowest frequency, ",
                    omega, " rad/s: (spin / omega_1)^2 is ", ratio, ", and the equations hold far below 1; ",
                    ratio > 1.0 ? "this motion is outside the method: the answer means nothing"
                                : "the deformation will be wrong, the pose less so"));
    return;
  }
}

// X72 keeps the first terms of size over distance, and has no direction at the attractor itself
void check_attractor(const Scene& scene, const Plan& plan, const MassProperties& body, Faults& faults) {
  if (scene.attractor.mu == 0.0) return;
  constexpr double kNear = 10.0;  // [-] distances over the size
  const Eigen::Vector3d centre(plan.initial.p_WB[0], plan.initial.p_WB[1], plan.initial.p_WB[2]);
  const double distance = (centre - scene.attractor.position).stableNorm(),
               size = std::sqrt(body.r.colwise().squaredNorm().maxCoeff()),
               rounding = 64.0 * kEpsilon *
                          std::max({centre.stableNorm(), scene.attractor.position.stableNorm(), size});
  const Origin& origin = scene.attractor.origin;
  if (distance <= rounding)
    add_error(
        faults, origin,
        "the attractor is on the centre of mass at the start, where its pull has no direction; move one "
        "of them");
  else if (!std::isfinite(scene.attractor.mu / (distance * distance)) || !std::isfinite(distance * distance))
    add_error(
        faults, origin,
        join_text("the attractor of mu ", scene.attractor.mu, " m^3/s^2 is ", distance,
                  " m from the centre of mass at the start: its pull is no finite number; use SI units"));
  else if (distance < kNear * size)
    add_warning(
        faults, origin,
        join_text("the attractor is ", distance, " m from the centre of mass at the start, ", distance / size,
                  " times the size of the body: its pull and gradient hold far from the body (THEORY X72), ",
                  distance < size ? "and mean nothing here"
                                  : join_text("and are wrong by some ", 100.0 * size / distance, " % here")));
}

void compile_initial(const Scene& scene, const Structure& structure, Plan& plan, Faults& faults) {
  const Initial& initial = scene.initial;
  const MassProperties& body = structure.mass_properties;
  const Eigen::Vector4d w_x_y_z = initial.attitude.stableNormalized();
  const Eigen::Quaterniond attitude(w_x_y_z[0], w_x_y_z[1], w_x_y_z[2], w_x_y_z[3]);
  plan.initial.p_WB = to_array(Eigen::Vector3d(initial.position + attitude * body.p_SB));
  plan.initial.v_WB = to_array(initial.velocity);
  plan.initial.q_WB = {w_x_y_z[0], w_x_y_z[1], w_x_y_z[2], w_x_y_z[3]};

  Eigen::Vector3d spin = initial.angular_velocity;
  Eigen::Vector3d idle = Eigen::Vector3d::Zero();
  if (body.rigid_freedoms == 5) idle = body.line * body.line.dot(spin);
  if (body.rigid_freedoms == 3) idle = spin;
  if (idle.norm() > kRigidPart * spin.norm())
    add_warning(faults, initial.origin,
                join_text("the initial angular velocity has ", idle.norm(), " rad/s ",
                          body.rigid_freedoms == 3 ? "but one point does not turn"
                                                   : "about the line of the points, "
                                                     "which is no motion",
                          "; it was taken out"));
  spin -= idle;
  plan.initial.w_WB_B = to_array(spin);
  if (scene.fidelity < Fidelity::kExactBars) warn_of_fast_spin(structure, spin, initial.origin, faults);
  compile_elastic_state(scene, structure, plan, faults);
}

// a repeated name in a list publishes once
std::vector<std::int32_t> without_repeats(const std::vector<int>& indices) {
  std::vector<std::int32_t> kept;
  for (const int index : indices)
    if (std::find(kept.begin(), kept.end(), index) == kept.end()) kept.push_back(index);
  return kept;
}

void compile_publication(const Publication& publication, Plan& plan) {
  plan.state_rate = publication.state_rate;
  plan.points_rate = publication.points_rate;
  plan.loads_rate = publication.loads_rate;
  plan.status_rate = publication.status_rate;
  plan.published_points = without_repeats(publication.points);
  plan.published_groups = without_repeats(publication.groups);
}

}  // namespace

std::optional<Plan> compile_plan(const Scene& scene, const Structure& structure, Faults& faults,
                                 const CodeLeftOut& left_out) {
  if (scene.fidelity == Fidelity::kRigid && structure.omega.size() > 0) {
    const Reduced rigid = without_modes(scene, structure, faults);
    return compile_plan(rigid.scene, rigid.structure, faults, left_out);
  }
  Plan plan;
  plan.damps = left_out.damps;
  plan.falls = left_out.falls;
  plan.turns = left_out.turns;
  plan.scope = left_out.scope;
  compile_body(scene, structure.mass_properties, plan);
  compile_modes(scene, structure, plan);
  const Eigen::MatrixXd shapes = all_shapes(structure);
  compile_points(scene, structure, shapes, plan);
  compile_field(scene, structure, shapes, plan);
  compile_links(scene, structure, plan);
  for (const Group& group : scene.groups)
    plan.groups.push_back(compile_group(scene, group, structure.mass_properties));
  plan.force_limit = scene.force_limit;
  plan.torque_limit = scene.torque_limit;
  compile_initial(scene, structure, plan, faults);
  check_attractor(scene, plan, structure.mass_properties, faults);
  compile_publication(scene.publication, plan);
  compile_histories(scene, structure, plan, faults);
  compile_mixing(scene, structure, plan, faults);
  if (is_coupled(plan)) {
    warn_of_feedback(scene, plan, faults);
    compile_coupled(scene, structure, plan, faults);
  }
  if (has_error(faults)) return std::nullopt;
  set_rate(plan, scene.rate);
  if (is_coupled(plan)) check_stages(scene, plan, faults);
  check_growth(scene, plan, faults);
  warn_of_ticks(scene, plan, faults);
  if (has_error(faults)) return std::nullopt;
  if (const std::string error = find_inconsistency(plan); !error.empty()) {
    add_overflow(scene, "the compiled plan is not usable: " + error, faults);
    return std::nullopt;
  }
  return plan;
}

void set_rate(Plan& plan, double rate) {
  plan.period = 1.0 / rate;
  plan.propagator.undamped.clear();
  plan.propagator.lanes.assign(static_cast<std::size_t>(plan.num_moving) / kLanes, {});
  for (int mode = 0; mode < plan.num_elastic; ++mode) {
    const auto l = static_cast<std::size_t>(mode);
    set_mode(plan.propagator, mode, plan.omega[l], plan.decay[l], plan.period, plan.mass);
  }
  set_mixing_period(plan);
  set_coupled_period(plan);
  if (!plan.damps) drop_damping(plan.propagator);
  for (PlanHistory& history : plan.histories) set_history_ticks(history, plan.period);
  for (Plan& wide : plan.wide) set_rate(wide, rate);
  set_shadow_rates(plan);
}

}  // namespace freeflex
