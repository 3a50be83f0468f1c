#include "core/plan/start.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "core/faults.hpp"
#include "core/plan/arrays.hpp"
#include "core/rounding.hpp"
#include "core/structure/masses/particles.hpp"

namespace freeflex {
namespace {

// [-] A warning is given if the ratio of the rigid part to the given values is above this value. A smaller
// rigid part is a rounding error of the given values.
constexpr double kRigidPart = 1e-9;

// Holds initial displacements and their rates for all points (3N).
struct GivenAtPoints {
  Eigen::VectorXd V, V_dot;  // [m], [m/s] body axes
};
GivenAtPoints given_at_points(const Scene& scene) {
  GivenAtPoints given;
  given.V = given.V_dot = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(scene.points.size()));
  for (const auto& each : scene.initial.points) {
    given.V.segment<3>(3 * Eigen::Index{each.point}) += each.displacement;
    given.V_dot.segment<3>(3 * Eigen::Index{each.point}) += each.velocity;
  }
  return given;
}

// Returns the displacements of the particles that carry the mass, from the displacements of points. Given
// displacements of points do not rotate bodies. The mass of a link moves by interpolation between the points
// of the link.
Eigen::VectorXd at_particles(const Scene& scene, const Structure& structure, const Eigen::VectorXd& V) {
  if (structure.resolved.are_point_masses) return V;
  const std::vector<CarriedMass> carried = carried_masses(scene, Freedoms(scene));
  Eigen::VectorXd all = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(carried.size()));
  for (std::size_t p = 0; p < carried.size(); ++p)
    for (const auto& [point, share] : carried[p].shares)
      all.segment<3>(3 * static_cast<Eigen::Index>(p)) += share * V.segment<3>(3 * Eigen::Index{point});
  return all;
}

Eigen::VectorXd weighted(const Structure& structure, Eigen::VectorXd V) {
  for (Eigen::Index i = 0; i < structure.particles.mass.size(); ++i)
    V.segment<3>(3 * i) *= structure.particles.mass[i];
  return V;
}

// Returns q_l = sum_i m_i b_il . V_i / M   (THEORY 4.25).
Eigen::VectorXd project(const Scene& scene, const Structure& structure, const Eigen::VectorXd& V) {
  return particle_shapes(structure).transpose() * weighted(structure, at_particles(scene, structure, V)) /
         structure.mass_properties.mass;
}

void warn_of_rigid_part(const Scene& scene, const Structure& structure, const Eigen::VectorXd& V,
                        const char* what, Faults& faults) {
  const Eigen::VectorXd all = at_particles(scene, structure, V);
  const double given = std::sqrt(all.dot(weighted(structure, all)));
  const Eigen::VectorXd rest = all - particle_shapes(structure) * project(scene, structure, V);
  const double rigid = std::sqrt(rest.dot(weighted(structure, rest)));
  if (rigid > kRigidPart * given)
    add_warning(
        faults, scene.initial.origin,
        join_text("the initial ", what, " of the points contain ", 100.0 * rigid / given,
                  " % of rigid motion (mass-weighted), which was removed; give rigid motion by position, "
                  "attitude and velocities"));
}

Eigen::Quaterniond attitude_at_start(const Initial& initial) {
  const Eigen::Vector4d w_x_y_z = initial.attitude.stableNormalized();
  return {w_x_y_z[0], w_x_y_z[1], w_x_y_z[2], w_x_y_z[3]};
}

Eigen::Vector3d centre_at_start(const Scene& scene, const MassProperties& body) {
  return scene.initial.position + attitude_at_start(scene.initial) * body.p_SB;
}

// Returns the component of a spin that the body cannot have. For a collinear shape this is the component
// about the line, and for a single point it is the whole spin   (THEORY 2.10).
Eigen::Vector3d idle_spin(const Eigen::Vector3d& spin, const MassProperties& body) {
  if (body.rigid_freedoms == 5) return body.line * body.line.dot(spin);
  if (body.rigid_freedoms == 3) return spin;
  return Eigen::Vector3d::Zero();
}

void warn_of_idle_spin(const Scene& scene, const MassProperties& body, Faults& faults) {
  const Eigen::Vector3d& spin = scene.initial.angular_velocity;
  const double idle = idle_spin(spin, body).norm();
  if (idle > kRigidPart * spin.norm())
    add_warning(faults, scene.initial.origin,
                join_text("the initial angular velocity of ", idle, " rad/s ",
                          body.rigid_freedoms == 3 ? "is impossible for a single point"
                                                   : "about the line of the points "
                                                     "is impossible",
                          "; it was removed"));
}

// Checks the distance of an attractor, because the field of the attractor is approximated up to the gradient
// (THEORY 8.17, 8.19)
void check_attractor(const Scene& scene, const MassProperties& body, Faults& faults) {
  if (scene.attractor.mu == 0.0) return;
  constexpr double kNear = 10.0;  // [-] distance over size of the body
  const Eigen::Vector3d centre = centre_at_start(scene, body);
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
        join_text(
            "the attractor of mu ", scene.attractor.mu, " m^3/s^2 is ", distance,
            " m from the centre of mass at the start, so its pull is not a finite number; use SI units"));
  else if (distance < kNear * size)
    add_warning(
        faults, origin,
        join_text("the attractor is ", distance, " m from the centre of mass at the start, ", distance / size,
                  " times the size of the body. Its pull and gradient are valid only far from the body "
                  "(THEORY 8.19), ",
                  distance < size ? "and have no meaning here; move one of the two"
                                  : join_text("and are wrong by some ", 100.0 * size / distance,
                                              " % here; move one of the two")));
}

// Refuses wheels and torques about an axis if the body has no moment of inertia about this axis, because they
// would have no effect.
void check_idle_torques(const Scene& scene, const MassProperties& body, Faults& faults) {
  constexpr const char* kRemedy =
      ", about which the structure has no moment of inertia and cannot rotate; give a body inertia "
      "about that axis";
  for (std::size_t k = 0; k < scene.wheels.size(); ++k)
    if (idle_spin(scene.wheels[k].axis, body).norm() > kRigidPart)
      add_error(faults, scene.wheels[k].origin,
                join_text("wheel ", quoted(scene.wheels[k].name, static_cast<int>(k)),
                          " has an axis with a component along the line of the points", kRemedy));
  for (std::size_t k = 0; k < scene.loads.size(); ++k)
    for (const TorqueLoad& each : scene.loads[k].torques)
      if (scene.loads[k].axes != Axes::kWorld &&
          idle_spin(each.torque, body).norm() > kRigidPart * each.torque.norm())
        add_error(faults, scene.loads[k].origin,
                  join_text("load ", quoted(scene.loads[k].name, static_cast<int>(k)),
                            " has a torque with a component along the line of the points", kRemedy));
}

}  // namespace

InitialModes initial_modes(const Scene& scene, const Structure& structure) {
  const GivenAtPoints given = given_at_points(scene);
  InitialModes initial{project(scene, structure, given.V), project(scene, structure, given.V_dot)};
  for (const auto& each : scene.initial.modes) {
    initial.q[each.mode - 1] += each.q;
    initial.q_dot[each.mode - 1] += each.q_dot;
  }
  return initial;
}

void check_start(const Scene& scene, const Structure& structure, Faults& faults) {
  const MassProperties& body = structure.mass_properties;
  warn_of_idle_spin(scene, body, faults);
  check_idle_torques(scene, body, faults);
  const GivenAtPoints given = given_at_points(scene);
  warn_of_rigid_part(scene, structure, given.V, "displacements", faults);
  warn_of_rigid_part(scene, structure, given.V_dot, "elastic velocities", faults);
  check_attractor(scene, body, faults);
}

// Below the rung `corotational`, the spin must be slow compared with the lowest vibration, because linear
// links get no geometric stiffness from the spin.
void warn_of_fast_spin(const Scene& scene, const Structure& structure, Fidelity rung, Faults& faults) {
  if (traits_of(rung).has_true_geometry) return;
  const Origin& origin = scene.initial.origin;
  const Eigen::Vector3d& given = scene.initial.angular_velocity;
  const Eigen::Vector3d spin = given - idle_spin(given, structure.mass_properties);
  // [-] largest (|w| / omega_1)^2 without a warning: 1 % softening due to spin
  constexpr double kSlow = 0.01;
  for (const double omega : structure.omega) {
    if (omega == 0.0) continue;
    const double ratio = spin.squaredNorm() / (omega * omega);
    if (ratio > kSlow)
      add_warning(
          faults, origin,
          join_text("the initial spin of ", spin.norm(),
                    " rad/s is not slow compared with the lowest frequency, ", omega,
                    " rad/s. (spin / omega_1)^2 is ", ratio,
                    ", but the equations are valid only far below 1, so ",
                    ratio > 1.0 ? "they do not cover this motion; do not use the result"
                                : "the deformation will be wrong, and the pose less so; reduce the spin"));
    return;
  }
}

void compile_start(const Scene& scene, const MassProperties& body, StepPlan& plan) {
  const Initial& initial = scene.initial;
  const Eigen::Quaterniond attitude = attitude_at_start(initial);
  plan.initial.p_WB = to_array(centre_at_start(scene, body));
  plan.initial.v_WB = to_array(initial.velocity);
  plan.initial.q_WB = {attitude.w(), attitude.x(), attitude.y(), attitude.z()};
  const Eigen::Vector3d& spin = initial.angular_velocity;
  plan.initial.w_B = to_array(Eigen::Vector3d(spin - idle_spin(spin, body)));
}

}  // namespace freeflex
