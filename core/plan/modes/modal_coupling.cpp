#include "core/plan/modes/modal_coupling.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/faults.hpp"
#include "core/plan/modes/phi.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

// The number of added coordinates. They are the impulse J (of the force and torque of feedback on the body)
// and the integral K of J (THEORY 8.36)
constexpr Eigen::Index kImpulses = 12;
constexpr long double kSmallImpulse = 0x1p-12L;  // [-] scaled size of the rows of impulses

// Up to this number of coupling forces, the weights are computed with 64-bit mantissas. With more forces,
// such weights would take seconds.
constexpr Eigen::Index kMaxExtendedForces = 96;

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Rows = Eigen::Map<const RowMatrix, Eigen::Aligned64>;

Rows rows_of(const Array& array, Eigen::Index num_rows, const StepPlan& plan) {
  return {array.data(), num_rows, plan.num_padded};
}

// Returns the columns of the modes, without the padding, from rows of a plan.
Eigen::MatrixXd modal(const Array& array, Eigen::Index num_rows, const StepPlan& plan) {
  return rows_of(array, num_rows, plan).leftCols(plan.num_elastic);
}

Array to_rows(const Eigen::MatrixXd& modal_rows, const StepPlan& plan) {
  Array array(index(modal_rows.rows() * plan.num_padded), 0.0);
  Eigen::Map<RowMatrix>(array.data(), modal_rows.rows(), plan.num_padded).leftCols(plan.num_elastic) =
      modal_rows;
  return array;
}

// Returns B, the unit elastic displacements of the points on which feedback acts (3 f x n).
Eigen::MatrixXd actuator_rows(const StepPlan& plan) {
  Eigen::MatrixXd rows(3 * static_cast<Eigen::Index>(plan.feedbacks.size()), plan.num_elastic);
  for (std::size_t f = 0; f < plan.feedbacks.size(); ++f)
    rows.middleRows<3>(3 * static_cast<Eigen::Index>(f)) =
        rows_of(plan.rows, static_cast<Eigen::Index>(plan.rows.size()) / plan.num_padded, plan)
            .block(3 * Eigen::Index{plan.feedbacks[f].row}, 0, 3, plan.num_elastic);
  return rows;
}

enum class Input { kDisplacement, kVelocity, kLoad };

Eigen::MatrixXd feedback_rows(const StepPlan& plan, Input input) {
  Eigen::MatrixXd rows =
      Eigen::MatrixXd::Zero(3 * static_cast<Eigen::Index>(plan.feedbacks.size()), plan.num_elastic);
  for (std::size_t f = 0; f < plan.feedbacks.size(); ++f) {
    const PlanFeedback& each = plan.feedbacks[f];
    const Array& array = input == Input::kDisplacement ? each.q_rows
                         : input == Input::kVelocity   ? each.q_dot_rows
                                                       : each.Q_rows;
    if (!array.empty()) rows.middleRows<3>(3 * static_cast<Eigen::Index>(f)) = modal(array, 3, plan);
  }
  return rows;
}

// Converts the feedback f = G_d V_i + G_v V_i' + G_a V_i'' of sensor points i (THEORY 8.26) to the form f =
// F_q q + F_v q' + F_Q Q (THEORY 8.28). The load of feedback on the modes is B^T f (THEORY 8.29). V_i''
// follows from the equations of motion, feedback included   (THEORY 8.27).
void compile_feedbacks(const Scene& scene, const Structure& structure, StepPlan& plan, Faults& faults) {
  const auto num_forces = 3 * static_cast<Eigen::Index>(scene.feedbacks.size());
  Eigen::MatrixXd by_q(num_forces, plan.num_elastic), by_q_dot = by_q, by_q_ddot = by_q;
  for (std::size_t f = 0; f < scene.feedbacks.size(); ++f) {
    const Feedback& given = scene.feedbacks[f];
    const auto sensor = structure.shapes.middleRows<3>(3 * Eigen::Index{given.sensor});
    const auto row = 3 * static_cast<Eigen::Index>(f);
    by_q.middleRows<3>(row) = given.displacement_gain * sensor;
    by_q_dot.middleRows<3>(row) = given.velocity_gain * sensor;
    by_q_ddot.middleRows<3>(row) = given.acceleration_gain * sensor;
    PlanFeedback feedback;
    const PlanPoint& point = plan.points[index(given.point)];
    feedback.name = given.name;
    feedback.row = point.row;
    feedback.r = point.r;
    plan.feedbacks.push_back(std::move(feedback));
  }
  const Eigen::MatrixXd B = actuator_rows(plan),
                        R = modal(plan.modal_coupling.damping_rows, plan.modal_coupling.num_damping, plan);
  const Eigen::Map<const Eigen::VectorXd> omega(plan.omega.data(), plan.num_elastic),
      decay(plan.decay.data(), plan.num_elastic);
  // (1 - G_a b B^T / M) f = G_d b q + G_v b q' + G_a b (Q / M - (2 decay + R^T R / M) q' - omega^2 q), where
  // b holds the rows of the sensors   (THEORY 8.27)
  const Eigen::MatrixXd loop =
      Eigen::MatrixXd::Identity(num_forces, num_forces) - by_q_ddot * B.transpose() / plan.mass;
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(loop);
  if (!lu.isInvertible()) {
    add_error(faults, scene.feedbacks.front().origin,
              "the acceleration feedback has no solution, because its force causes exactly the acceleration "
              "that it responds to; change an acceleration gain");
    return;
  }
  const Eigen::MatrixXd q_rows = lu.solve(by_q - by_q_ddot * omega.array().square().matrix().asDiagonal());
  const Eigen::MatrixXd q_dot_rows =
      lu.solve(by_q_dot - 2.0 * by_q_ddot * decay.asDiagonal() - by_q_ddot * R.transpose() * R / plan.mass);
  const Eigen::MatrixXd Q_rows = lu.solve(by_q_ddot / plan.mass);
  for (std::size_t f = 0; f < plan.feedbacks.size(); ++f) {
    const auto row = 3 * static_cast<Eigen::Index>(f);
    plan.feedbacks[f].q_rows = to_rows(q_rows.middleRows<3>(row), plan);
    plan.feedbacks[f].q_dot_rows = to_rows(q_dot_rows.middleRows<3>(row), plan);
    if (!scene.feedbacks[f].acceleration_gain.isZero(0.0) || !Q_rows.middleRows<3>(row).isZero(0.0))
      plan.feedbacks[f].Q_rows = to_rows(Q_rows.middleRows<3>(row), plan);
  }
}

}  // namespace

std::vector<std::int32_t> coupled_modes(const StepPlan& plan) {
  const Eigen::MatrixXd R = modal(plan.modal_coupling.damping_rows, plan.modal_coupling.num_damping, plan);
  Eigen::VectorXd share = Eigen::VectorXd::Zero(plan.num_elastic);
  // Each kind of row is compared with the largest entry of its kind.
  const auto add = [&](const Eigen::MatrixXd& rows) {
    if (rows.size() == 0) return;
    const double largest = rows.cwiseAbs().maxCoeff();
    if (largest > 0.0) share = share.cwiseMax(rows.cwiseAbs().colwise().maxCoeff().transpose() / largest);
  };
  add(R);
  add(actuator_rows(plan));
  add(feedback_rows(plan, Input::kDisplacement));
  add(feedback_rows(plan, Input::kVelocity));
  add(feedback_rows(plan, Input::kLoad));
  std::vector<std::int32_t> modes;
  for (std::int32_t mode = 0; mode < plan.num_elastic; ++mode)
    if (share[mode] > kUncoupled) modes.push_back(mode);
  return modes;
}

CouplingForces coupling_forces(const StepPlan& plan) {
  const Eigen::MatrixXd R = modal(plan.modal_coupling.damping_rows, plan.modal_coupling.num_damping, plan),
                        B = actuator_rows(plan);
  const Eigen::Index num_forces = R.rows() + B.rows();
  CouplingForces forces;
  for (Eigen::MatrixXd* rows : {&forces.out, &forces.by_q, &forces.by_q_dot})
    rows->resize(num_forces, plan.num_elastic);
  forces.out << R / plan.mass, B / plan.mass;
  forces.by_q_dot << -R, feedback_rows(plan, Input::kVelocity);
  forces.by_q << Eigen::MatrixXd::Zero(R.rows(), plan.num_elastic), feedback_rows(plan, Input::kDisplacement);
  return forces;
}

namespace {

// Holds y' = A y + (0, E Q) for y = (q, q') of the coupled modes   (THEORY 8.30).
struct Generator {
  WideMatrix A;  // (2 n_mixed x 2 n_mixed)
  WideMatrix E;  // (2 n_mixed x n_mixed) including the zeros above E
};

// A = [0, 1; -omega^2 + B^T F_q / M, -2 decay + (B^T F_v - R^T R) / M]   (THEORY 8.31),
// E = (1 + B^T F_Q) / M   (THEORY 8.32); q'^T R^T R q' / 2 is the dissipation function of the dashpots
// (THEORY 3.48)
Generator generator_of(const StepPlan& plan) {
  const std::vector<std::int32_t>& modes = plan.modal_coupling.modes;
  const auto n = static_cast<Eigen::Index>(modes.size());
  const auto extended = [&](const Eigen::MatrixXd& rows) -> WideMatrix {
    return rows(Eigen::all, modes).cast<long double>();
  };
  const WideMatrix R = extended(
                       modal(plan.modal_coupling.damping_rows, plan.modal_coupling.num_damping, plan)),
                   B = extended(actuator_rows(plan)),
                   F_q = extended(feedback_rows(plan, Input::kDisplacement)),
                   F_v = extended(feedback_rows(plan, Input::kVelocity)),
                   F_Q = extended(feedback_rows(plan, Input::kLoad));
  const long double mass = plan.mass;
  Generator system;
  system.A = WideMatrix::Zero(2 * n, 2 * n);
  system.A.topRightCorner(n, n).setIdentity();
  system.A.bottomLeftCorner(n, n) = B.transpose() * F_q / mass;
  system.A.bottomRightCorner(n, n) = (B.transpose() * F_v - R.transpose() * R) / mass;
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto mode = static_cast<std::size_t>(modes[index(k)]);
    const long double omega = plan.omega[mode], decay = plan.decay[mode];
    system.A(n + k, k) -= omega * omega;
    system.A(n + k, n + k) -= 2.0L * decay;
  }
  system.E = WideMatrix::Zero(2 * n, n);
  system.E.bottomRows(n) = (WideMatrix::Identity(n, n) + B.transpose() * F_Q) / mass;
  return system;
}

// Returns P (6 x 3 f). This matrix gives the force and torque on the body from the forces of feedback. Its
// columns are [1; [r_j]x] for each feedback   (THEORY 8.35).
Eigen::MatrixXd resultant_of_feedback(const StepPlan& plan) {
  Eigen::MatrixXd resultant(6, 3 * static_cast<Eigen::Index>(plan.feedbacks.size()));
  for (std::size_t f = 0; f < plan.feedbacks.size(); ++f) {
    const Vec3& r = plan.feedbacks[f].r;
    resultant.middleCols<3>(3 * static_cast<Eigen::Index>(f)) << Eigen::Matrix3d::Identity(),
        (Eigen::Matrix3d() << 0.0, -r[2], r[1], r[2], 0.0, -r[0], -r[1], r[0], 0.0).finished();
  }
  return resultant;
}

// Appends to y the impulse J of feedback on the body and the integral K of J: J' = P (F_q q + F_v q' + F_Q
// Q), K' = J (THEORY 8.35, 8.36).
Generator with_impulses(const StepPlan& plan, const Generator& modes) {
  const Eigen::Index n = modes.E.cols();
  const auto resultant = [&](Input input) -> WideMatrix {
    return (resultant_of_feedback(plan) * feedback_rows(plan, input))(Eigen::all, plan.modal_coupling.modes)
        .cast<long double>();
  };
  Generator all;
  all.A = WideMatrix::Zero(2 * n + kImpulses, 2 * n + kImpulses);
  all.A.topLeftCorner(2 * n, 2 * n) = modes.A;
  all.A.block(2 * n, 0, 6, n) = resultant(Input::kDisplacement);
  all.A.block(2 * n, n, 6, n) = resultant(Input::kVelocity);
  all.A.block(2 * n + 6, 2 * n, 6, 6).setIdentity();
  all.E = WideMatrix::Zero(2 * n + kImpulses, n);
  all.E.topRows(2 * n) = modes.E;
  all.E.middleRows(2 * n, 6) = resultant(Input::kLoad);
  return all;
}

// Returns the load that is linear in time and has the impulse J and the integral K over a step, from rows of
// J and K. The load is 6 K / h^2 - 2 J / h at the start and 4 J / h - 6 K / h^2 at the end   (THEORY 8.37)
WideMatrix linear_loads(const WideMatrix& impulses, long double h) {
  const WideMatrix mean = impulses.topRows(6) / h, weighted = 2.0L / (h * h) * impulses.bottomRows(6);
  WideMatrix loads(2 * 6, impulses.cols());
  loads << 3.0L * weighted - 2.0L * mean, 4.0L * mean - 3.0L * weighted;
  return loads;
}

// Returns the entries column by column, each column padded to stride.
Array to_columns(const WideMatrix& rows, Eigen::Index stride) {
  Array columns(index(rows.cols() * stride), 0.0);
  Eigen::Map<Eigen::MatrixXd>(columns.data(), stride, rows.cols()).topRows(rows.rows()) = rows.cast<double>();
  return columns;
}

// Sets the columns of the exact step y^1 = phi_0 y^0 + h phi_1 (0, E Q^0) + h phi_2 (0, E (Q^1 - Q^0)), where
// phi_k is a function of h A (THEORY 8.34). The functions are computed in scaled coordinates, in which q and
// q' have the same size.
void set_exact(StepPlan& plan) {
  Generator system = generator_of(plan);
  const Eigen::Index n = system.E.cols();
  const long double h = plan.period;
  const bool has_feedback = !plan.feedbacks.empty();
  if (has_feedback) system = with_impulses(plan, system);
  Eigen::Matrix<long double, Eigen::Dynamic, 1> size =
      Eigen::Matrix<long double, Eigen::Dynamic, 1>::Ones(system.A.rows());
  for (Eigen::Index k = 0; k < n; ++k)
    size[k] = std::max<long double>(plan.omega[static_cast<std::size_t>(plan.modal_coupling.modes[index(k)])],
                                    1.0L / h);
  if (has_feedback) {
    // No other coordinate depends on the impulses. The impulses are scaled to be small, so that they do not
    // change the number of doublings of the series.
    const WideMatrix rate =
        h * system.A.middleRows(2 * n, 6).leftCols(2 * n) * size.head(2 * n).cwiseInverse().asDiagonal();
    const long double largest = rate.cwiseAbs().maxCoeff();
    size.segment(2 * n, 6).setConstant(largest > 0.0L ? kSmallImpulse / largest : 1.0L);
    size.tail(6) = kSmallImpulse / h * size.segment(2 * n, 6);
  }
  const WideMatrix z = h * (size.asDiagonal() * system.A * size.cwiseInverse().asDiagonal());
  const Phi phi = phi_functions(z);
  const auto unscaled = [&](const WideMatrix& matrix) -> WideMatrix {
    return size.cwiseInverse().asDiagonal() * matrix;
  };
  const WideMatrix input = h * size.asDiagonal() * system.E;
  WideMatrix columns(system.A.rows(), 4 * n);
  columns << unscaled(phi.phi0.leftCols(2 * n) * size.head(2 * n).asDiagonal()), unscaled(phi.phi1 * input),
      unscaled(phi.phi2 * input);
  plan.modal_coupling.columns = to_columns(columns.topRows(2 * n), pad(2 * n));
  if (has_feedback)
    plan.modal_coupling.load_columns =
        to_columns(linear_loads(columns.bottomRows(kImpulses), h), PlanModalCoupling::kLoadRows);
}

// Returns tau phi_1(tau W_v U) for tau = h / 2 in extended precision, from rows of U^T and W_v
// (THEORY 8.40).
Eigen::MatrixXd extended_weight(const Eigen::MatrixXd& out, const Eigen::MatrixXd& by_q_dot, double tau) {
  const WideMatrix loop = tau * (by_q_dot * out.transpose()).cast<long double>();
  return (tau * phi_functions(loop).phi1).cast<double>();
}

// Returns the weight of extended_weight in double precision, because the error of splitting is far larger
// than the rounding error. If there are fewer modes than forces, uses phi_1(tau W_v U) = 1 + tau W_v
// phi_2(tau U W_v) U.
Eigen::MatrixXd weight_of_many(const Eigen::MatrixXd& out, const Eigen::MatrixXd& by_q_dot, double tau) {
  if (out.rows() <= out.cols())
    return tau * phi_functions<Eigen::MatrixXd>(tau * by_q_dot * out.transpose()).phi1;
  const Eigen::MatrixXd phi2 = phi_functions<Eigen::MatrixXd>(tau * out.transpose() * by_q_dot).phi2;
  Eigen::MatrixXd weight = tau * tau * (by_q_dot * phi2) * out.transpose();
  weight.diagonal().array() += tau;
  return weight;
}

// Sets the impulse of the coupling terms, q' += (h / 2) U phi_1((h / 2) W_v U) (W_v q' + W_q q)
// (THEORY 8.40), with U = [R^T B^T] / M, W_v = [-R; F_v], W_q = [0; F_q]   (THEORY 8.39).
void set_split(StepPlan& plan) {
  PlanModalCoupling& modal_coupling = plan.modal_coupling;
  const auto& [out, by_q, by_q_dot] = coupling_forces(plan);
  const Eigen::Index num_impulses = out.rows();
  const double tau = 0.5 * plan.period;
  const Eigen::MatrixXd weight = num_impulses <= kMaxExtendedForces ? extended_weight(out, by_q_dot, tau)
                                                                    : weight_of_many(out, by_q_dot, tau);
  modal_coupling.num_impulses = static_cast<std::int32_t>(num_impulses);
  modal_coupling.impulse_q_dot_rows = to_rows(weight * by_q_dot, plan);
  modal_coupling.impulse_q_rows = to_rows(weight * by_q, plan);
  modal_coupling.impulse_out = to_rows(out, plan);
}

}  // namespace

void compile_modal_coupling(const Scene& scene, const Structure& structure, StepPlan& plan, Faults& faults) {
  assert(plan.points.size() == scene.points.size() && plan.omega.size() == index(plan.num_padded));
  Eigen::MatrixXd R = structure.damping_rows;
  if (R.rows() > R.cols()) {
    // a QR factorization gives the same R^T R with no more rows than modes
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(R);
    R = qr.matrixQR().topRows(R.cols()).triangularView<Eigen::Upper>();
  }
  if (R.rows() > 0) {
    // D = R^T R. If each dashpot damps the modes without coupling them, D is diagonal, and decay_l += D_ll /
    // (2 M)   (THEORY 4.23).
    const Eigen::MatrixXd D = R.transpose() * R;
    const Eigen::VectorXd diagonal = D.diagonal();
    const double off_diagonal = (D - Eigen::MatrixXd(diagonal.asDiagonal())).cwiseAbs().maxCoeff();
    if (off_diagonal <= kUncoupled * diagonal.maxCoeff()) {
      for (Eigen::Index mode = 0; mode < diagonal.size(); ++mode)
        plan.decay[index(mode)] += 0.5 * diagonal[mode] / plan.mass;
      R.resize(0, R.cols());
    }
  }
  plan.modal_coupling.num_damping = static_cast<std::int32_t>(R.rows());
  plan.modal_coupling.damping_rows = to_rows(R, plan);
  // feedback of elastic motion has no effect if there are no modes
  if (!scene.feedbacks.empty() && plan.num_elastic > 0) compile_feedbacks(scene, structure, plan, faults);
  if (R.rows() == 0 && plan.feedbacks.empty()) return;
  const std::size_t num_coupled = set_modal_coupling_path(plan);
  if (plan.modal_coupling.path != PlanModalCoupling::Path::kSplit) return;
  for (const Feedback& feedback : scene.feedbacks)
    if (!feedback.acceleration_gain.isZero(0.0))
      add_error(
          faults, feedback.origin,
          join_text("acceleration feedback couples ", num_coupled, " modes, but at most ", kMaxExactModes,
                    " are advanced together; use a smaller model, or displacement and velocity gains"));
}

std::size_t set_modal_coupling_path(StepPlan& plan) {
  std::vector<std::int32_t> modes = coupled_modes(plan);
  const std::size_t num_coupled = modes.size();
  if (num_coupled == 0) return 0;
  const bool is_exact = num_coupled <= index(kMaxExactModes);
  plan.modal_coupling.path = is_exact ? PlanModalCoupling::Path::kExact : PlanModalCoupling::Path::kSplit;
  if (is_exact) plan.modal_coupling.modes = std::move(modes);
  return num_coupled;
}

void set_modal_coupling_period(StepPlan& plan) {
  if (plan.modal_coupling.path == PlanModalCoupling::Path::kExact) set_exact(plan);
  if (plan.modal_coupling.path == PlanModalCoupling::Path::kSplit) set_split(plan);
}

}  // namespace freeflex
