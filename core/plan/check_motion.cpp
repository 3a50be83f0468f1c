#include "core/plan/check_motion.hpp"

#include <Eigen/LU>
#include <cmath>

#include "core/faults.hpp"
#include "core/plan/loads/histories.hpp"
#include "core/plan/loads/tick_rotations.hpp"
#include "core/plan/modes/damped_modes.hpp"
#include "core/plan/modes/free_forces.hpp"
#include "core/plan/modes/modal_coupling.hpp"
#include "core/plan/rungs/rungs.hpp"
#include "core/plan/start.hpp"
#include "core/structure/links/link_factor.hpp"
#include "core/structure/prestress/static_responses.hpp"

namespace freeflex {
namespace {

// Warns if the scene gives an initial elastic state or publishes link forces, because the rung `rigid` has
// neither.
void warn_of_rigid(const Scene& scene, Faults& faults) {
  if (!scene.initial.points.empty() || !scene.initial.modes.empty())
    add_warning(
        faults, scene.initial.origin,
        "the initial elastic state is ignored, because fidelity is rigid; set fidelity: separated or a "
        "higher rung");
  if (!scene.publication.links.empty())
    add_warning(faults, {},
                "no forces of links are published, because fidelity is rigid and link forces follow from "
                "deformation; set "
                "fidelity: separated or a higher rung");
}

// Warns if feedback has no effect, because it acts on elastic motion and the plan has none.
void warn_of_idle_feedback(const Scene& scene, const Structure& structure, const Plan& plan, Faults& faults) {
  if (scene.feedbacks.empty() || plan.num_elastic > 0) return;
  const Feedback& first = scene.feedbacks.front();
  const bool can_deform = structure.omega.size() > 0;
  add_warning(faults, first.origin,
              join_text("feedback ", quoted(first.name, 0),
                        " has no effect, because it acts on elastic motion and the plan has no modes; ",
                        can_deform ? "set fidelity: separated or a higher rung, and keep at least one mode"
                                   : "the structure does not deform, so remove the feedback or add links"));
}

// Warns if feedback makes a motion grow. The coupled rungs do not advance coupled modes together, so the
// exact step of these modes is made only for this check   (THEORY 8.34).
void warn_of_driving_feedback(const Scene& scene, const Plan& plan, Faults& faults) {
  if (plan.feedbacks.empty()) return;
  Plan linear = plan;
  set_modal_coupling_path(linear);
  if (linear.modal_coupling.path != PlanModalCoupling::Path::kExact) return;
  set_modal_coupling_period(linear);
  check_growth(scene, linear, faults);
}

// Warns of flutter due to a constant load in local axes, because such a load is not conservative
// (THEORY 8.42, 8.46)
void warn_of_driving_followers(const Scene& scene, const Plan& plan, Faults& faults) {
  const double rate = growth_by_followers(plan);
  if (rate == 0.0) return;
  const std::vector<std::size_t> loads = follower_loads(plan, true);
  const Load& first = scene.loads[loads.front()];
  const double per_second = std::exp(rate);
  add_warning(faults, first.origin,
              join_text(loads.size() == 1 ? "load " : "constant loads in local axes, among them load ",
                        quoted(first.name, static_cast<int>(loads.front())),
                        loads.size() == 1 ? ", which rotates with the structure, makes" : ", make",
                        " a mode grow by ", std::isfinite(per_second) ? "a factor of " : "",
                        std::isfinite(per_second) ? per_second : rate,
                        std::isfinite(per_second) ? " a second" : " e-folds a second",
                        "; use a smaller load, more stiffness or more damping"));
}

// Warns if commands have too many components for a geometric stiffness   (THEORY 8.49).
void warn_of_many_commands(const Scene& scene, const Plan& plan, Faults& faults) {
  const RungTraits& rung = traits_of(plan.fidelity);
  if (!rung.couples || rung.has_true_geometry || plan.num_elastic == 0) return;
  const std::size_t count = command_components(scene).size();
  if (count <= kMostCommandComponents) return;
  add_warning(
      faults, {},
      join_text(
          "commands may have ", count, " components of force and torque, but the rung ",
          name_of(plan.fidelity), " computes the change of the stiffness by commands for at most ",
          kMostCommandComponents,
          ", so commands do not change the stiffness; if they press or stretch the structure much, name "
          "the points to push in commands: points, or set fidelity: corotational"));
}

// Warns if forces of rigid links are not published, which are bodies at true geometry.
void warn_of_rigid_forces(const Scene& scene, const Structure& structure, const Plan& plan, Faults& faults) {
  if (!traits_of(plan.fidelity).has_true_geometry) return;
  for (const int number : scene.publication.links) {
    if (!structure.resolved.links[index(number)].is_rigid()) continue;
    const Link& link = scene.links[index(number)];
    return add_warning(
        faults, link.origin,
        join_text("link ", called(link, number), " is rigid, and fidelity ", name_of(plan.fidelity),
                  " does not compute forces of rigid links, so they are not published; use a "
                  "stiff bar to read a force, or leave the link out of publish: loads"));
  }
}

// Returns whether a point and its neighbours are on a line, and a force at the point has a share across it.
bool has_force_across_line(const Scene& scene, const PointLoad& load) {
  const Eigen::Matrix3Xd rotation = rotation_of_neighbours(scene, load.point);
  const Eigen::FullPivLU<Eigen::Matrix3d> rows(rotation * rotation.transpose());
  return rows.rank() < 3 && (rows.rank() == 0 || rows.kernel().col(0).normalized().cross(load.force).norm() >
                                                     1e-9 * load.force.norm());
}

// Warns of loads in local axes that nothing turns about a line, if links have their true geometry
// (THEORY 8.53).
void warn_of_local_axes(const Scene& scene, const Plan& plan, Faults& faults) {
  if (!traits_of(plan.fidelity).has_true_geometry) return;
  const std::vector<std::int32_t>& joints = plan.coupled.links.joints.of_points;
  for (std::size_t k = 0; k < scene.loads.size(); ++k) {
    if (scene.loads[k].axes != Axes::kLocal) continue;
    for (const PointLoad& each : scene.loads[k].forces) {
      if (!joints.empty() && joints[index(each.point)] >= 0) continue;
      if (!has_force_across_line(scene, each)) continue;
      add_warning(
          faults, scene.loads[k].origin,
          join_text("load ", quoted(scene.loads[k].name, static_cast<int>(k)),
                    " acts in local axes at point ", quoted(scene.points[index(each.point)].name, each.point),
                    ", which is on a line with the points that links join to it, so nothing turns the load "
                    "about this line; give the point inertia, or join a beam to it or a spring to a point "
                    "beside the line"));
      break;
    }
  }
}

// Warns of feedback that senses or acts at a point of a body that turns. The displacement of the sensor, and
// the forces on modes and on the rotation of the body, are then those of small rotations   (THEORY 8.26).
void warn_of_feedback_on_bodies(const Scene& scene, const Plan& plan, Faults& faults) {
  const std::vector<std::int32_t>& bodies = plan.coupled.turning.of_points;
  if (bodies.empty()) return;
  for (std::size_t k = 0; k < scene.feedbacks.size(); ++k) {
    const Feedback& feedback = scene.feedbacks[k];
    const bool acts = bodies[index(feedback.point)] >= 0;
    if (!acts && bodies[index(feedback.sensor)] < 0) continue;
    const int point = acts ? feedback.point : feedback.sensor;
    add_warning(faults, feedback.origin,
                join_text("feedback ", quoted(feedback.name, static_cast<int>(k)),
                          acts ? " acts at point " : " senses at point ",
                          quoted(scene.points[index(point)].name, point),
                          " of a rigid body, and uses the rotation of the body to first order only; if the "
                          "body turns against the rest by more than some 0.1 rad, let a point sense and act "
                          "that is not on a rigid body"));
  }
}

}  // namespace

void check_motion(const Scene& scene, const Structure& structure, const Plan& plan, Faults& faults) {
  const RungTraits& rung = traits_of(plan.fidelity);
  if (!rung.has_modes && structure.omega.size() > 0) warn_of_rigid(scene, faults);
  warn_of_rigid_forces(scene, structure, plan, faults);
  warn_of_idle_feedback(scene, structure, plan, faults);
  warn_of_fast_spin(scene, structure, plan.fidelity, faults);
  if (rung.couples)
    warn_of_driving_feedback(scene, plan, faults);
  else
    check_growth(scene, plan, faults);
  warn_of_driving_followers(scene, plan, faults);
  warn_of_local_axes(scene, plan, faults);
  warn_of_many_commands(scene, plan, faults);
  warn_of_feedback_on_bodies(scene, plan, faults);
  if (const std::string damping = find_unresolved_damping(plan); !damping.empty())
    add_warning(faults, scene.damping.origin, damping);
  warn_of_ticks(scene, plan, faults);
  warn_of_tick_rotations(scene, plan, faults);
}

}  // namespace freeflex
