#include "core/plan/compile.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <set>

#include "core/plan/arrays.hpp"
#include "core/plan/file/plan_bytes.hpp"
#include "core/plan/integration/choose_method.hpp"
#include "core/plan/loads/groups.hpp"
#include "core/plan/loads/histories.hpp"
#include "core/plan/loads/stiffening.hpp"
#include "core/plan/modes/modal_coupling.hpp"
#include "core/plan/rungs/kinetics.hpp"
#include "core/plan/rungs/rates.hpp"
#include "core/plan/rungs/rungs.hpp"
#include "core/plan/start.hpp"
#include "core/scene/check/extremes.hpp"
#include "core/step/coupled/coupled.hpp"
#include "core/step/rigid/principal.hpp"
#include "core/step/vector.hpp"
#include "core/structure/links/link_factor.hpp"
#include "core/structure/masses/rigid_bodies.hpp"
#include "core/structure/reduce.hpp"

namespace freeflex {
namespace {

// Returns the structure with the modes and link forces that a spec keeps, or the given structure if the spec
// keeps all of them.
std::shared_ptr<const Structure> structure_of(const Structure& whole, const PlanSpec& spec) {
  const bool has_links = !whole.link_forces.empty() || whole.constraint_shapes.cols() > 0;
  if (traits_of(spec.rung).has_true_geometry && whole.constraint_shapes.cols() > 0) {
    // the forces of rigid links would need the accelerations without them (check_motion warns)
    auto few = std::make_shared<Structure>(reduce(whole, spec.modes));
    std::erase_if(few->link_forces, [](const LinkForceRows& each) { return each.load_rows.cols() > 0; });
    few->constraint_shapes.resize(few->shapes.rows(), 0);
    return few;
  }
  if (spec.static_modes.empty() && (spec.publishes_links || !has_links))
    return share_reduced(whole, spec.modes);
  auto few = std::make_shared<Structure>(reduce(whole, spec.modes));
  keep_static_link_forces(whole, spec.static_modes, spec.static_loads, *few);
  if (!spec.publishes_links) {
    few->link_forces.clear();
    few->constraint_shapes.resize(few->shapes.rows(), 0);
  }
  return few;
}

// Holds unit elastic displacements and constraint shapes, side by side.
class AllShapes {
 public:
  explicit AllShapes(const Structure& structure) : structure_(structure) {
    if (structure.constraint_shapes.cols() == 0) return;
    both_.resize(structure.shapes.rows(), structure.shapes.cols() + structure.constraint_shapes.cols());
    both_ << structure.shapes, structure.constraint_shapes;
  }
  const Eigen::MatrixXd& operator*() const { return both_.cols() > 0 ? both_ : structure_.shapes; }

 private:
  const Structure& structure_;
  Eigen::MatrixXd both_;  // empty without constraint shapes
};

void compile_body(const Scene& scene, const MassProperties& body, Plan& plan) {
  plan.name = scene.name;
  plan.scene_hash = scene.hash;
  plan.mass = body.mass;
  plan.rigid_freedoms = body.rigid_freedoms;
  plan.p_SB = to_array(body.p_SB);
  plan.inertia = to_array(body.inertia);
  // I^-1 = sum_k u_k u_k^T / I_k   (THEORY 2.8). The sum uses the principal moments, because for a thin shape
  // they are more accurate than the inertia matrix. Rotations that the body cannot make are omitted from the
  // sum.
  Eigen::Vector3d inverse = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const bool rotates = body.rigid_freedoms == 6 || (body.rigid_freedoms == 5 && k > 0);
    if (rotates) inverse[k] = 1.0 / body.principal[k];
  }
  plan.inverse_inertia =
      to_array(Eigen::Matrix3d(body.principal_axes * inverse.asDiagonal() * body.principal_axes.transpose()));
  plan.line = to_array(body.line);
  plan.principal = principal_of(plan.inverse_inertia);
  plan.gravity_W = to_array(scene.gravity);
  plan.attractor_mu = scene.attractor.mu;
  plan.attractor_W = to_array(scene.attractor.position);
}

// Returns decay_l = zeta_l omega_l + alpha_R / 2 + beta_R omega_l^2 / 2 of all modes of a structure [1/s]
// (THEORY 4.23).
Eigen::VectorXd decays(const Damping& damping, const Structure& structure) {
  const auto omega = structure.omega.array();
  return damping_ratios(damping, structure).array() * omega + 0.5 * damping.alpha +
         0.5 * damping.beta * omega.square();
}

void compile_modes(const Scene& scene, const Structure& structure, const Eigen::VectorXd& decay, Plan& plan) {
  plan.num_elastic = static_cast<std::int32_t>(structure.omega.size());
  plan.num_moving = pad(plan.num_elastic);
  auto num_others = static_cast<std::int32_t>(structure.constraint_shapes.cols());
  // ball joints have their coordinates in the place of constraint shapes   (THEORY 12.123)
  if (traits_of(plan.fidelity).has_true_geometry) num_others += 3 * num_ball_joints(scene, structure);
  plan.num_padded = plan.num_moving + pad(num_others);
  plan.omega = padded(plan, structure.omega);
  plan.decay = padded(plan, decay);
  plan.frequency_accuracy = structure.frequency_accuracy;
  plan.conditioning = structure.conditioning;
  for (const Mechanism& mechanism : structure.mechanisms)
    plan.mechanisms.emplace_back(mechanism.moved_points.begin(), mechanism.moved_points.end());
  // residuals of sum m b_l = 0 and sum m r x b_l = 0   (THEORY 2.12, 2.15)
  const Eigen::Matrix3Xd& r = structure.particles.r;
  const Eigen::MatrixXd& b_of = particle_shapes(structure);
  Eigen::MatrixXd residual = Eigen::MatrixXd::Zero(6, structure.omega.size());
  for (Eigen::Index mode = 0; mode < structure.omega.size(); ++mode) {
    for (Eigen::Index i = 0; i < r.cols(); ++i) {
      const double mass = structure.particles.mass[i];
      const Eigen::Vector3d b = b_of.block<3, 1>(3 * i, mode);
      residual.block<3, 1>(0, mode) += mass * b;
      residual.block<3, 1>(3, mode) += mass * r.col(i).cross(b);
    }
  }
  if (structure.matrix_sums.momenta.rows() > 0) residual += structure.matrix_sums.momenta;
  for (int row = 0; row < 6; ++row) append_row(plan, row_of(residual, row), plan.eckart_rows);
}

// Computes the field moments Y_l,ab = sum m_i r_i,a b_il,b, symmetric in a and b   (THEORY 8.15).
void compile_field(const Structure& structure, const Eigen::MatrixXd& shapes, Plan& plan) {
  plan.has_spin_load = traits_of(plan.fidelity).takes_spin_load && plan.has_rotation;
  if (!plan.has_spin_load && plan.attractor_mu == 0.0) return;
  const Eigen::Matrix3Xd& r = structure.particles.r;
  static constexpr std::array<std::array<int, 2>, 6> kPairs{{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};
  for (std::size_t k = 0; k < kPairs.size(); ++k) {
    const auto& [a, b] = kPairs[k];
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(shapes.cols());
    if (structure.matrix_sums.field.rows() > 0)
      row = structure.matrix_sums.field.row(static_cast<Eigen::Index>(k));
    for (Eigen::Index mode = 0; mode < row.size(); ++mode)
      for (Eigen::Index i = 0; i < r.cols(); ++i)
        row[mode] += 0.5 * structure.particles.mass[i] *
                     (r(a, i) * shapes(3 * i + b, mode) + r(b, i) * shapes(3 * i + a, mode));
    append_row(plan, row, plan.field_rows);
  }
}

// Returns true for each point whose mode-shape rows the step or the read-out uses.
std::vector<bool> points_with_rows(const Scene& scene) {
  std::vector<bool> used(scene.points.size(), false);
  const auto use = [&](int point) { used[static_cast<std::size_t>(point)] = true; };
  std::for_each(scene.pushable.begin(), scene.pushable.end(), use);
  std::for_each(scene.publication.points.begin(), scene.publication.points.end(), use);
  // commands may apply a wrench to any group
  for (const Group& group : scene.groups) std::for_each(group.points.begin(), group.points.end(), use);
  for (const Load& load : scene.loads)
    for (const PointLoad& each : load.forces) use(each.point);
  for (const Feedback& feedback : scene.feedbacks) use(feedback.point);
  return used;
}

void compile_points(const Scene& scene, const Structure& structure, const Eigen::MatrixXd& shapes,
                    bool has_every_row, Plan& plan) {
  std::vector<bool> is_pushable(scene.points.size(), false);
  for (const int point : scene.pushable) is_pushable[static_cast<std::size_t>(point)] = true;
  std::vector<bool> used = points_with_rows(scene);
  if (has_every_row) used.assign(used.size(), true);
  std::int32_t num_blocks = 0;
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    PlanPoint point;
    point.name = scene.points[i].name;
    point.mass = scene.points[i].mass;
    point.r = to_array(Eigen::Vector3d(structure.mass_properties.r.col(column)));
    point.pushable = is_pushable[i];
    if (used[i]) {
      point.row = num_blocks++;
      for (int axis = 0; axis < 3; ++axis) append_row(plan, row_of(shapes, 3 * column + axis), plan.rows);
    }
    plan.points.push_back(std::move(point));
  }
}

// Compiles the rotation rows of bodies whose attitude is published or that can carry a load or wheel.
void compile_attitudes(const Scene& scene, const Structure& structure, Plan& plan) {
  std::set<int> wanted;
  for (const int point : scene.pushable) wanted.insert(point);
  for (const int point : scene.publication.points) wanted.insert(point);
  for (const Load& load : scene.loads)
    for (const TorqueLoad& each : load.torques) wanted.insert(each.point);
  for (const Wheel& wheel : scene.wheels) wanted.insert(wheel.point);
  const Freedoms freedoms(scene);
  for (const int point : wanted) {
    if (!structure.resolved.has_attitude[index(point)]) continue;
    plan.particles.attitude_points.push_back(point);
    const int first = freedoms.rotation(point) - freedoms.num_displacements();
    for (int axis = 0; axis < 3; ++axis)
      append_row(plan, row_of(structure.rotations, first + axis), plan.particles.rotation_rows);
  }
}

void compile_wheels(const Scene& scene, Plan& plan) {
  for (const Wheel& wheel : scene.wheels)
    plan.wheels.push_back(
        {wheel.name, attitude_index_of(plan, wheel.point), to_array(wheel.axis), wheel.momentum});
}

void compile_links(const Scene& scene, const Structure& structure, Plan& plan) {
  for (std::size_t k = 0; k < scene.links.size(); ++k) {
    const Link& link = scene.links[k];
    const LinkTraits& kind = structure.resolved.links[k].traits;
    PlanLink each;
    each.name = link.name;
    each.type = kind.type;
    if (kind.lists_points) each.points.assign(link.points.begin(), link.points.end());
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
    if (force.rows.rows() == 0) continue;  // the force of a redundant rigid link is not determined
    PlanLinkOutput output;
    output.link = force.link;
    output.num_rows = static_cast<std::int32_t>(force.rows.rows());
    output.first_row = append(force.rows, 0);
    output.first_rate_row = append(force.rate_rows, 0);
    output.first_load_row = append(force.load_rows, structure.omega.size());
    plan.link_outputs.push_back(output);
  }
}

// Returns each index once, in the order of first occurrence.
std::vector<std::int32_t> without_repeats(const std::vector<int>& indices) {
  std::vector<std::int32_t> kept;
  for (const int index : indices)
    if (std::find(kept.begin(), kept.end(), index) == kept.end()) kept.push_back(index);
  return kept;
}

// Returns what keeps a massless point from a position of least energy at true geometry, or an empty text.
std::string massless_refusal(const Scene& scene, const Structure& structure, int point) {
  for (std::size_t k = 0; k < scene.links.size(); ++k) {
    const Link& link = scene.links[k];
    const ResolvedLink& resolved = structure.resolved.links[k];
    const std::string who = join_text("link ", called(link, static_cast<int>(k)));
    if (resolved.has_mass)
      return who + " has mass (lumped: true puts that of a beam, bar or plate on its points)";
    if (std::ranges::find(link.points, point) == link.points.end()) continue;
    if (resolved.axial.damping > 0.0) return who + " damps it";
    if (link.viscous > 0.0) return who + " is viscous";
  }
  for (const Feedback& feedback : scene.feedbacks)
    if (feedback.point == point) return "feedback acts on it";
  for (std::size_t k = 0; k < scene.loads.size(); ++k)
    for (const PointLoad& each : scene.loads[k].forces)
      if (each.point == point && scene.loads[k].axes == Axes::kLocal)
        return join_text("load ", quoted(scene.loads[k].name, static_cast<int>(k)),
                         " acts on it in local axes");
  return {};
}

// Adds errors for massless points and links with mass that a rung does not support. Bars at true length need
// the true positions of their points, but the rotation of a body moves its points to first order only.
void refuse_bodies(const Scene& scene, const Structure& structure, Fidelity rung, Faults& faults) {
  const ResolvedScene& resolved = structure.resolved;
  if (!traits_of(rung).has_true_geometry) return;
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const PointMass& point = scene.points[i];
    if (resolved.moves_mass[i]) continue;
    const std::string cause = massless_refusal(scene, structure, static_cast<int>(i));
    if (!cause.empty())
      return add_error(faults, point.origin,
                       join_text("point ", quoted(point.name, static_cast<int>(i)), " has no mass, and ",
                                 cause, ", which fidelity ", name_of(rung),
                                 " does not support; give it some mass, or set fidelity: coupled or a lower "
                                 "rung"));
  }
  for (std::size_t i = 0; i < scene.links.size(); ++i)
    if (resolved.links[i].has_mass && !structure.has_static_joints)
      return add_error(
          faults, scene.links[i].origin,
          join_text("link ", called(scene.links[i], static_cast<int>(i)), " has spread mass, which fidelity ",
                    name_of(rung),
                    " does not support; add lumped: true to the link, which puts its mass on its points, or "
                    "set fidelity: coupled or a lower rung"));
}

void compile_initial_joints(const Scene& scene, StepPlan& plan, Faults& faults) {
  close_at_start(plan, plan.initial.q.data(), plan.initial.q_dot.data());
  if (std::ranges::any_of(plan.initial.q, [](double value) { return !std::isfinite(value); }))
    return add_error(faults, scene.initial.origin,
                     "a ball joint between rigid links cannot be closed in the initial shape; use smaller "
                     "initial displacements");
  plan.initial.joints = relaxed_joints(plan, plan.initial.q);
  const JointState& joints = plan.initial.joints;
  const auto is_lost = [](double value) { return !std::isfinite(value); };
  if (std::ranges::any_of(joints.angle, is_lost))
    return add_error(
        faults, scene.initial.origin,
        "a joint, release or massless point has no equilibrium in the initial shape; use smaller "
        "initial displacements or more elements");
  for (const Quat& rotation : joints.rotation)
    if (is_lost(rotation[0]))
      return add_error(
          faults, scene.initial.origin,
          "a joint has no equilibrium in the initial shape, because a beam or plate bends too far for one "
          "element; use smaller initial displacements or more elements");
}

void compile_publication(const Publication& publication, Plan& plan) {
  plan.rates = publication.rates;
  plan.status_rate = publication.status_rate;
  plan.published_points = without_repeats(publication.points);
  plan.published_groups = without_repeats(publication.groups);
}

}  // namespace

std::optional<Plan> compile(const Scene& scene, const Structure& whole, const PlanSpec& spec,
                            Faults& faults) {
  refuse_bodies(scene, whole, spec.rung, faults);
  if (has_error(faults)) return std::nullopt;
  const std::shared_ptr<const Structure> kept = structure_of(whole, spec);
  const Structure& structure = *kept;
  Plan plan;
  plan.fidelity = spec.rung;
  plan.has_damping = spec.has_damping;
  plan.has_gravity = spec.has_gravity;
  plan.has_rotation = spec.has_rotation;
  plan.scope = spec.scope;
  compile_body(scene, structure.mass_properties, plan);
  compile_modes(scene, structure, decays(scene.damping, whole)(spec.modes), plan);
  if (spec.numbers_modes)
    for (const int mode : spec.modes) plan.mode_numbers.push_back(mode + 1);
  const AllShapes both(structure);
  const Eigen::MatrixXd& shapes = *both;
  compile_points(scene, structure, shapes, spec.has_every_row, plan);
  if (!structure.resolved.are_point_masses) compile_attitudes(scene, structure, plan);
  compile_wheels(scene, plan);
  compile_field(structure, has_particles(structure) ? structure.particles.shapes : shapes, plan);
  compile_links(scene, structure, plan);
  compile_groups(scene, structure, plan);
  plan.force_limit = scene.force_limit;
  plan.command_limits = scene.command_limits;
  plan.torque_limit = scene.torque_limit;
  compile_start(scene, structure.mass_properties, plan);
  plan.initial.q = padded(plan, spec.initial.q(spec.modes));
  plan.initial.q_dot = padded(plan, spec.initial.q_dot(spec.modes));
  compile_publication(scene.publication, plan);
  compile_field_stiffening(structure, plan);
  compile_command_stiffening(structure, plan);
  compile_histories(scene, structure, plan, faults);
  compile_modal_coupling(scene, structure, plan, faults);
  if (is_coupled(plan)) compile_coupled(scene, structure, spec, plan, faults);
  if (has_error(faults)) return std::nullopt;
  if (is_coupled(plan)) compile_kinetics(scene, structure, shapes, kinetic_form(structure, plan), plan);
  if (is_coupled(plan)) compile_initial_joints(scene, plan, faults);
  if (has_error(faults)) return std::nullopt;
  set_rate(plan, spec.rate);
  if (const std::string why = choose_method(spec.integration, plan); !why.empty()) {
    const Origin& asked = spec.integration.origin;
    add_error(faults, asked.source >= 0 ? asked : scene.points.front().origin,
              "integration: points cannot be integrated, because " + why +
                  "; write by: modes, or leave integration out");
  }
  if (has_error(faults)) return std::nullopt;
  if (is_coupled(plan) && !integrates_points(plan)) {
    Faults of_modes;
    check_stages(scene, plan, of_modes);
    // stages that modes cannot have are a reason for points, even if these take somewhat longer
    constexpr double kMostTimes = 3.0;
    const bool tries_points = has_error(of_modes) && spec.integration.by == IntegrateBy::kAuto;
    if (tries_points) choose_method({IntegrateBy::kPoints, spec.integration.accuracy, {}}, plan);
    if (plan.integration.on_points > kMostTimes * plan.integration.on_modes) plan.points_method = {};
    if (!integrates_points(plan)) faults.insert(faults.end(), of_modes.begin(), of_modes.end());
  }
  if (has_error(faults)) return std::nullopt;
  if (const std::string error = find_inconsistency(plan); !error.empty()) {
    add_overflow(scene, "the compiled plan is not usable, because " + error, faults);
    return std::nullopt;
  }
  return plan;
}

}  // namespace freeflex
