#include "core/plan/modes/free_forces.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/faults.hpp"
#include "core/plan/modes/modal_coupling.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// [-] The body is taken to have no inertia about a principal axis, and does not rotate about it, if the
// principal moment is at most this fraction of the largest.
constexpr double kNoInertia = 1e-12;

Eigen::Vector3d vector(const Vec3& v) { return {v[0], v[1], v[2]}; }

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  return (Eigen::Matrix3d() << 0.0, -v[2], v[1], v[2], 0.0, -v[0], -v[1], v[0], 0.0).finished();
}

// Returns the columns of the modes, without the padding, from three rows of a plan.
Eigen::MatrixXd three_rows(const double* rows, const StepPlan& plan) {
  return Eigen::Map<const RowMatrix>(rows, 3, plan.num_padded).leftCols(plan.num_elastic);
}

// Holds forces of one kind. The forces are appended row by row.
struct Kind {
  Eigen::MatrixXd out, by_q, by_q_dot;

  explicit Kind(Eigen::Index columns) : out(0, columns), by_q(0, columns), by_q_dot(0, columns) {}

  void add(const Eigen::MatrixXd& more_out, const Eigen::MatrixXd& more_by_q,
           const Eigen::MatrixXd& more_by_q_dot) {
    const Eigen::Index first = out.rows();
    for (auto [rows, more] : {std::pair{&out, &more_out}, {&by_q, &more_by_q}, {&by_q_dot, &more_by_q_dot}}) {
      rows->conservativeResize(first + more_out.rows(), Eigen::NoChange);
      rows->bottomRows(more_out.rows()).setZero();
      rows->bottomRows(more_out.rows()).leftCols(more->cols()) = *more;
    }
  }

  // Sets a column to zero if it is a rounding error compared with the largest column of its block. If it were
  // kept, such a column could give a mechanism a stiffness.
  void drop_rounding() {
    for (Eigen::MatrixXd* rows : {&out, &by_q, &by_q_dot}) {
      if (rows->size() == 0) continue;
      const double largest = rows->cwiseAbs().maxCoeff();
      for (Eigen::Index l = 0; l < rows->cols(); ++l)
        if (rows->col(l).cwiseAbs().maxCoeff() <= kUncoupled * largest) rows->col(l).setZero();
    }
  }
};

// Adds a follower load. The load consists of the force theta x f_B at each point (THEORY 8.24), the torque
// theta x T_B on each body (THEORY 16.14), and the geometric stiffness -E q (THEORY 8.49). As rows of by_q
// these parts are -[f_B]x Theta, -kappa [T_B]x Theta and -E   (THEORY 8.46).
void add_followers(const StepPlan& plan, const PlanHistory& history, Kind& forces) {
  const Eigen::Index n = plan.num_elastic;
  const Eigen::MatrixXd none(0, 0);
  const auto add = [&](const Eigen::MatrixXd& out, const Eigen::MatrixXd& by_q) {
    forces.add(out / plan.mass, by_q, Eigen::MatrixXd::Zero(out.rows(), n));
  };
  const std::size_t block = 3 * index(plan.num_padded);
  for (const PlanFollower& each : history.followers)
    add(three_rows(plan.rows.data() + index(each.row) * block, plan),
        -cross_matrix(vector(each.force_B)) * three_rows(each.rotation_rows.data(), plan));
  // kappa is 1/2 on the coupled rungs, because a torque on a rotated body there also has the term T x theta /
  // 2 (THEORY 12.53)
  const double share = is_coupled(plan) ? 0.5 : 1.0;
  for (const PlanTorque& each : history.torques) {
    const Eigen::MatrixXd theta = three_rows(rotation_rows(plan, each.attitude_index), plan);
    add(theta, -share * cross_matrix(vector(each.torque_B)) * theta);
  }
  const PlanStiffening& stiffening = history.stiffening;
  if (stiffening.components.size() != 1) return;
  const auto m = static_cast<Eigen::Index>(stiffening.modes.size()),
             padded = static_cast<Eigen::Index>(pad(stiffening.modes.size()));
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(m, n), by_q = out;
  for (Eigen::Index l = 0; l < m; ++l) out(l, stiffening.modes[index(l)]) = 1.0;
  by_q(Eigen::all, stiffening.modes) =
      -Eigen::Map<const RowMatrix>(stiffening.rows.data(), m, padded).leftCols(m);
  add(out, by_q);
}

// Returns unit rotations about the principal axes, u_k sqrt(M / I_k) (3 x axes)   (THEORY 8.48).
Eigen::MatrixXd body_rotations(const StepPlan& plan) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(plan.inertia.data()));
  Eigen::MatrixXd rotations(3, 0);
  for (int axis = 0; axis < 3; ++axis) {
    const double moment = solver.eigenvalues()[axis];
    if (!(moment > kNoInertia * solver.eigenvalues()[2])) continue;
    rotations.conservativeResize(Eigen::NoChange, rotations.cols() + 1);
    rotations.rightCols<1>() = std::sqrt(plan.mass / moment) * solver.eigenvectors().col(axis);
  }
  return rotations;
}

// Adds the torque of a wheel to first order, -h (theta' + w) x a (THEORY 8.47). Let n_1 and n_2 = a x n_1 be
// unit vectors normal to the axis a, and eta_k the rotation about n_k by each mode and body axis. The torque
// then gives the rows eta_1, eta_2 in out, and the rows -h eta_2 and h eta_1 in by_q_dot (THEORY 8.48).
void add_wheel(const StepPlan& plan, const PlanWheel& wheel, const Eigen::MatrixXd& body, Kind& forces) {
  const Eigen::Vector3d a = vector(wheel.axis), one = a.unitOrthogonal(), other = a.cross(one);
  Eigen::MatrixXd rotation(3, plan.num_elastic + body.cols());
  rotation << three_rows(rotation_rows(plan, wheel.attitude_index), plan), body;
  Eigen::MatrixXd across(2, rotation.cols()), torque = across;
  across << one.transpose() * rotation, other.transpose() * rotation;
  torque << -wheel.momentum * across.row(1), wheel.momentum * across.row(0);
  forces.add(across / plan.mass, Eigen::MatrixXd::Zero(2, rotation.cols()), torque);
}

bool has_acceleration_gain(const StepPlan& plan) {
  return std::any_of(plan.feedbacks.begin(), plan.feedbacks.end(),
                     [](const PlanFeedback& each) { return !each.Q_rows.empty(); });
}

bool has_wrench(const PlanHistory& history) {
  const LoadSums& sums = history.pattern.sums;
  for (const auto* each : {&sums.group_force_B, &sums.group_torque_B})
    for (const Vec3& v : *each)
      if (!vector(v).isZero(0.0)) return true;
  return false;
}

}  // namespace

bool has_gyroscopic_forces(const StepPlan& plan) {
  return is_coupled(plan) && std::any_of(plan.wheels.begin(), plan.wheels.end(),
                                         [](const PlanWheel& wheel) { return wheel.momentum != 0.0; });
}

std::vector<std::size_t> follower_loads(const StepPlan& plan, bool is_constant) {
  std::vector<std::size_t> loads;
  for (std::size_t k = 0; k < plan.histories.size(); ++k) {
    const PlanHistory& history = plan.histories[k];
    const bool follows = !history.followers.empty() || !history.torques.empty();
    if (follows && (history.kind == PlanHistory::Kind::kConstant) == is_constant) loads.push_back(k);
  }
  return loads;
}

FreeForces free_forces(const StepPlan& plan, bool has_followers) {
  assert(unknown_coupling(plan).empty());
  const Eigen::Index n = plan.num_elastic;
  const Eigen::MatrixXd body = has_gyroscopic_forces(plan) ? body_rotations(plan) : Eigen::MatrixXd(3, 0);
  const CouplingForces coupling = coupling_forces(plan);
  const Eigen::Index num_damping = plan.modal_coupling.num_damping,
                     num_feedback = coupling.out.rows() - num_damping;
  Kind dashpots(n + body.cols()), feedback = dashpots, followers = dashpots, wheels = dashpots;
  dashpots.add(coupling.out.topRows(num_damping), coupling.by_q.topRows(num_damping),
               coupling.by_q_dot.topRows(num_damping));
  feedback.add(coupling.out.bottomRows(num_feedback), coupling.by_q.bottomRows(num_feedback),
               coupling.by_q_dot.bottomRows(num_feedback));
  for (std::size_t f = 0; f < plan.feedbacks.size(); ++f)  // the moment that feedback exerts on the body
    feedback.out.block(3 * static_cast<Eigen::Index>(f), n, 3, body.cols()) =
        -cross_matrix(vector(plan.feedbacks[f].r)) * body / plan.mass;
  if (has_followers)
    for (const std::size_t load : follower_loads(plan, true))
      add_followers(plan, plan.histories[load], followers);
  if (body.cols() > 0)
    for (const PlanWheel& wheel : plan.wheels)
      if (wheel.momentum != 0.0) add_wheel(plan, wheel, body, wheels);
  for (Kind* kind : {&dashpots, &feedback, &followers, &wheels}) kind->drop_rounding();
  FreeForces all;
  all.num_body = body.cols();
  const Eigen::Index rows =
      dashpots.out.rows() + feedback.out.rows() + followers.out.rows() + wheels.out.rows();
  for (auto [to, block] :
       {std::pair{&all.out, &Kind::out}, {&all.by_q, &Kind::by_q}, {&all.by_q_dot, &Kind::by_q_dot}}) {
    to->resize(rows, n + body.cols());
    *to << dashpots.*block, feedback.*block, followers.*block, wheels.*block;
  }
  for (Eigen::Index l = 0; l < n; ++l)
    if (!all.out.col(l).isZero(0.0) && !(all.by_q.col(l).isZero(0.0) && all.by_q_dot.col(l).isZero(0.0)))
      all.modes.push_back(static_cast<std::int32_t>(l));
  return all;
}

std::string unknown_coupling(const StepPlan& plan) {
  const std::vector<std::size_t> loads = follower_loads(plan, true);
  const bool has_wheels = has_gyroscopic_forces(plan);
  if (has_wheels && has_acceleration_gain(plan)) return "wheels and acceleration feedback couple the modes";
  if (loads.empty()) return {};
  const std::string follows =
      join_text("load '", plan.histories[loads.front()].name, "' follows the structure");
  if (has_acceleration_gain(plan)) return follows + ", and acceleration feedback responds to it";
  if (!is_coupled(plan)) return {};
  if (has_wheels) return follows + ", and wheels couple the modes";
  if (!plan.coupled.bars.empty()) return follows + ", and it strains bars at their true geometry";
  if (!plan.coupled.kinetics.offsets.empty())
    return follows + ", and the centres of mass of bodies are not at their points";
  for (const std::size_t load : loads)
    if (has_wrench(plan.histories[load]))
      return join_text("load '", plan.histories[load].name,
                       "' follows the structure and has a force or torque on a group");
  return {};
}

}  // namespace freeflex
