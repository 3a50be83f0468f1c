#include "core/plan/rungs/turning.hpp"

#include "core/plan/arrays.hpp"
#include "core/structure/masses/matrix_mass.hpp"
#include "core/structure/masses/rigid_bodies.hpp"

namespace freeflex {
namespace {

using Eigen::MatrixXd;

// \param body  a RigidBody or MatrixMass
template <typename Body>
PlanTurningBody plan_body(const Body& body, const MatrixXd& motions, const StepPlan& plan) {
  PlanTurningBody result;
  result.mass = body.mass;
  result.centre = to_array(body.centre);
  result.inertia = to_array(body.inertia);
  for (Eigen::Index a = 0; a < 6; ++a) append_row(plan, row_of(motions, a), result.rows);
  return result;
}

}  // namespace

void compile_large_rotations(const Scene& scene, const Structure& structure, StepPlan& plan, Faults& faults) {
  PlanTurning& turning = plan.coupled.turning;
  const std::vector<RigidBody> bodies = rigid_bodies(scene, structure, faults);
  if (has_error(faults) || (bodies.empty() && !structure.resolved.have_links_mass())) return;
  const Freedoms freedoms(scene);
  turning.of_points.assign(scene.points.size(), -1);
  for (const RigidBody& body : bodies) {
    turning.bodies.push_back(plan_body(body, motions_of(scene, structure, freedoms, body), plan));
    turning.bodies.back().first = static_cast<std::int32_t>(turning.points.size());
    turning.bodies.back().count = static_cast<std::int32_t>(body.points.size());
    for (const int point : body.points) {
      turning.of_points[index(point)] = static_cast<std::int32_t>(turning.bodies.size()) - 1;
      turning.points.push_back(point);
    }
  }
  // the rest of a mass matrix turns as one piece   (THEORY 12.121)
  for (const MatrixMass& matrix : matrix_masses(scene, structure, true)) {
    if (matrix.is_on_point || matrix.mass == 0.0) continue;
    turning.bodies.push_back(plan_body(matrix, matrix.motion, plan));
    turning.bodies.back().first = scene.links[index(matrix.link)].points.front();
  }
  for (const std::int32_t point : plan.particles.attitude_points)
    turning.of_attitudes.push_back(turning.of_points[index(point)]);
  for (const PlanBodyRotation& each : plan.coupled.kinetics.body_rotations)
    turning.of_carriers.insert(turning.of_carriers.end(), index(each.count),
                               each.point < 0 ? -1 : turning.of_points[index(each.point)]);
}

}  // namespace freeflex
