#include "core/plan/rungs/turning.hpp"

#include <Eigen/Eigenvalues>

#include "core/plan/arrays.hpp"
#include "core/structure/masses/matrix_mass.hpp"
#include "core/structure/masses/rigid_bodies.hpp"

namespace freeflex {
namespace {

using Eigen::MatrixXd;

// \param body  a RigidBody or MatrixMass
// \param joints  (6 x 3J) unit motions of the coordinates of ball joints
template <typename Body>
PlanTurningBody plan_body(const Body& body, const MatrixXd& of_modes, const MatrixXd& joints,
                          const StepPlan& plan) {
  MatrixXd motions(6, of_modes.cols() + joints.cols());
  motions << of_modes, joints;
  PlanTurningBody result;
  result.mass = body.mass;
  result.centre = to_array(body.centre);
  result.inertia = to_array(body.inertia);
  for (Eigen::Index a = 0; a < 6; ++a) append_row(plan, row_of(motions, a), result.rows);
  return result;
}

// Returns the unit motions of the bodies (6B x 3J) for the coordinates of ball joints: the velocities that
// pairs of impulses at the joints cause, made orthonormal in the mass metric   (THEORY 12.123). Adds an error
// if joints constrain the same motion twice.
MatrixXd joint_motions(const Scene& scene, const Structure& structure, const std::vector<RigidBody>& bodies,
                       Faults& faults) {
  constexpr double kDependent = 1e-9;  // [-] of the largest eigenvalue
  std::vector<int> home(scene.points.size(), -1);
  std::vector<Eigen::Matrix<double, 3, Eigen::Dynamic>> gaps;  // of unit motions of the bodies
  std::vector<int> points;
  const auto num = static_cast<Eigen::Index>(bodies.size());
  const auto gap_of = [&](int body, int point) {
    Eigen::Matrix<double, 3, 6> gap;
    const Eigen::Vector3d d = structure.mass_properties.r.col(point) - bodies[index(body)].centre;
    gap << Eigen::Matrix3d::Identity(), Eigen::Vector3d::UnitX().cross(d), Eigen::Vector3d::UnitY().cross(d),
        Eigen::Vector3d::UnitZ().cross(d);
    return gap;
  };
  for (int b = 0; b < static_cast<int>(num); ++b)
    for (const int point : bodies[index(b)].points) {
      if (home[index(point)] < 0) {
        home[index(point)] = b;
        continue;
      }
      gaps.emplace_back(3, 6 * num).setZero();
      gaps.back().middleCols<6>(Eigen::Index{6} * home[index(point)]) = gap_of(home[index(point)], point);
      gaps.back().middleCols<6>(Eigen::Index{6} * b) = -gap_of(b, point);
      points.push_back(point);
    }
  const auto count = static_cast<Eigen::Index>(3 * gaps.size());
  MatrixXd G(count, 6 * num), moved(6 * num, count);
  for (std::size_t j = 0; j < gaps.size(); ++j) G.middleRows<3>(3 * static_cast<Eigen::Index>(j)) = gaps[j];
  if (count == 0) return moved;
  for (Eigen::Index b = 0; b < num; ++b) {
    const RigidBody& body = bodies[index(b)];
    const Eigen::Matrix3d J = body.inertia + body.inertia.trace() * body.line * body.line.transpose();
    const MatrixXd impulse = G.middleCols<6>(6 * b).transpose();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - body.line * body.line.transpose();
    moved.middleRows<3>(6 * b) = impulse.topRows<3>() / body.mass;
    moved.middleRows<3>(6 * b + 3) = J.inverse() * (across * impulse.bottomRows<3>());
  }
  const MatrixXd A = G * moved;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(0.5 * (A + A.transpose()));
  if (!(eigen.eigenvalues()[0] > kDependent * eigen.eigenvalues()[count - 1])) {
    Eigen::Index worst = 0;
    eigen.eigenvectors().col(0).cwiseAbs().maxCoeff(&worst);
    const int point = points[index(worst / 3)];
    add_error(
        faults, scene.points[index(point)].origin,
        join_text("the ball joint at point ", quoted(scene.points[index(point)].name, point),
                  " constrains a motion that other ball joints constrain already, as rigid links that "
                  "share two points do, which this fidelity does not support; use a stiff bar in place of "
                  "one of the rigid links, give the shared points inertia, which joins the links to one "
                  "body, or set fidelity: coupled or a lower rung"));
    return moved;
  }
  return moved *
         (eigen.eigenvectors() * (structure.mass_properties.mass * eigen.eigenvalues().array().inverse())
                                     .sqrt()
                                     .matrix()
                                     .asDiagonal());
}

}  // namespace

void compile_large_rotations(const Scene& scene, const Structure& structure, StepPlan& plan, Faults& faults) {
  PlanTurning& turning = plan.coupled.turning;
  const std::vector<RigidBody> bodies = rigid_bodies(scene, structure, faults);
  if (has_error(faults) || (bodies.empty() && !structure.resolved.have_links_mass())) return;
  const Freedoms freedoms(scene);
  const MatrixXd joints = joint_motions(scene, structure, bodies, faults);
  if (has_error(faults)) return;
  turning.of_points.assign(scene.points.size(), -1);
  for (const RigidBody& body : bodies) {
    MatrixXd joint_motion(6, 0);  // no columns: a scene without ball joints
    if (joints.cols() > 0)
      joint_motion = joints.middleRows<6>(6 * static_cast<Eigen::Index>(turning.bodies.size()));
    turning.bodies.push_back(
        plan_body(body, motions_of(scene, structure, freedoms, body), joint_motion, plan));
    turning.bodies.back().first = static_cast<std::int32_t>(turning.points.size());
    turning.bodies.back().count = static_cast<std::int32_t>(body.points.size());
    for (const int point : body.points) {
      // the first body of a ball joint carries what is at its point
      if (turning.of_points[index(point)] < 0)
        turning.of_points[index(point)] = static_cast<std::int32_t>(turning.bodies.size()) - 1;
      turning.points.push_back(point);
    }
  }
  // the rest of a mass matrix turns as one piece   (THEORY 12.121)
  for (const MatrixMass& matrix : matrix_masses(scene, structure, true)) {
    if (matrix.is_on_point || matrix.mass == 0.0) continue;
    turning.bodies.push_back(plan_body(matrix, matrix.motion, MatrixXd(6, 0), plan));
    turning.bodies.back().first = scene.links[index(matrix.link)].points.front();
  }
  for (const std::int32_t point : plan.particles.attitude_points)
    turning.of_attitudes.push_back(turning.of_points[index(point)]);
  for (const PlanBodyRotation& each : plan.coupled.kinetics.body_rotations)
    turning.of_carriers.insert(turning.of_carriers.end(), index(each.count),
                               each.point < 0 ? -1 : turning.of_points[index(each.point)]);
}

}  // namespace freeflex
