#include "core/model/coupling.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "core/model/faults.hpp"
#include "core/model/phi.hpp"

namespace freeflex {
namespace {

// [-] of the largest damping coefficient: what couples less is rounding of dashpots that share the modes
constexpr double kUncoupled = 1e-13;

// growth of an amplitude per tick above this is no rounding
constexpr double kGrowth = 1e-9;

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Rows = Eigen::Map<const RowMatrix, Eigen::Aligned64>;

Rows rows_of(const Array& array, Eigen::Index num_rows, const Plan& plan) {
  return {array.data(), num_rows, plan.num_padded};
}

// the modes' part of rows of a plan
Eigen::MatrixXd modal(const Array& array, Eigen::Index num_rows, const Plan& plan) {
  return rows_of(array, num_rows, plan).leftCols(plan.num_elastic);
}

Array to_rows(const Eigen::MatrixXd& modal_rows, const Plan& plan) {
  Array array(static_cast<std::size_t>(modal_rows.rows() * plan.num_padded), 0.0);
  Eigen::Map<RowMatrix>(array.data(), modal_rows.rows(), plan.num_padded).leftCols(plan.num_elastic) =
      modal_rows;
  return array;
}

// unit elastic displacements of the points that feedback acts on (3 f x n)
Eigen::MatrixXd actuator_rows(const Plan& plan) {
  Eigen::MatrixXd rows(3 * static_cast<Eigen::Index>(plan.feedbacks.size()), plan.num_elastic);
  for (std::size_t f = 0; f < plan.feedbacks.size(); ++f)
    rows.middleRows<3>(3 * static_cast<Eigen::Index>(f)) =
        rows_of(plan.rows, static_cast<Eigen::Index>(plan.rows.size()) / plan.num_padded, plan)
            .block(3 * Eigen::Index{plan.feedbacks[f].row}, 0, 3, plan.num_elastic);
  return rows;
}

enum class Input { kDisplacement, kVelocity, kLoad };

Eigen::MatrixXd feedback_rows(const Plan& plan, Input input) {
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

// X74: f = G_d V + G_v V' + G_a V'' of the sensors, V'' taken from the equations of motion, feedback included
void compile_feedbacks(const Scene& scene, const Structure& structure, Plan& plan, Faults& faults) {
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
    const PlanPoint& point = plan.points[static_cast<std::size_t>(given.point)];
    feedback.name = given.name;
    feedback.row = point.row;
    feedback.r = point.r;
    plan.feedbacks.push_back(std::move(feedback));
  }
  const Eigen::MatrixXd B = actuator_rows(plan),
                        R = modal(plan.coupling.damping_rows, plan.coupling.num_damping, plan);
  const Eigen::Map<const Eigen::VectorXd> omega(plan.omega.data(), plan.num_elastic),
      decay(plan.decay.data(), plan.num_elastic);
  // (1 - G_a S B'/M) f = G_d S q + G_v S q' + G_a S (Q / M - (2 decay + R'R / M) q' - omega^2 q)
  const Eigen::MatrixXd loop =
      Eigen::MatrixXd::Identity(num_forces, num_forces) - by_q_ddot * B.transpose() / plan.mass;
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(loop);
  if (!lu.isInvertible()) {
    add_error(faults, scene.feedbacks.front().origin,
              "the acceleration feedback has no solution: its force makes exactly the acceleration that it "
              "answers; "
              "change an acceleration gain");
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

// modes that a dashpot or a feedback acts on or is moved by
std::vector<std::int32_t> coupled_modes(const Plan& plan) {
  const Eigen::MatrixXd R = modal(plan.coupling.damping_rows, plan.coupling.num_damping, plan);
  Eigen::VectorXd share = Eigen::VectorXd::Zero(plan.num_elastic);
  // each kind against its own largest
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

// X75: y' = A y + (0, E Q), y = (q, q_dot) of the coupled modes
struct Generator {
  WideMatrix A;  // (2 n x 2 n)
  WideMatrix E;  // (n x n)
};

Generator generator_of(const Plan& plan) {
  const std::vector<std::int32_t>& modes = plan.coupling.modes;
  const auto n = static_cast<Eigen::Index>(modes.size());
  const auto wide = [&](const Eigen::MatrixXd& rows) -> WideMatrix {
    return rows(Eigen::all, modes).cast<long double>();
  };
  const WideMatrix R = wide(modal(plan.coupling.damping_rows, plan.coupling.num_damping, plan)),
                   B = wide(actuator_rows(plan)), F_q = wide(feedback_rows(plan, Input::kDisplacement)),
                   F_v = wide(feedback_rows(plan, Input::kVelocity)),
                   F_Q = wide(feedback_rows(plan, Input::kLoad));
  const long double mass = plan.mass;
  Generator system;
  system.A = WideMatrix::Zero(2 * n, 2 * n);
  system.A.topRightCorner(n, n).setIdentity();
  system.A.bottomLeftCorner(n, n) = B.transpose() * F_q / mass;
  system.A.bottomRightCorner(n, n) = (B.transpose() * F_v - R.transpose() * R) / mass;
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto mode = static_cast<std::size_t>(modes[static_cast<std::size_t>(k)]);
    const long double omega = plan.omega[mode], decay = plan.decay[mode];
    system.A(n + k, k) -= omega * omega;
    system.A(n + k, n + k) -= 2.0L * decay;
  }
  system.E = (WideMatrix::Identity(n, n) + B.transpose() * F_Q) / mass;
  return system;
}

// X75: columns of the exact propagator, from coordinates in which q and q_dot have one size
void set_exact(Plan& plan) {
  const Generator system = generator_of(plan);
  const Eigen::Index n = system.E.rows();
  const long double h = plan.period;
  Eigen::Matrix<long double, Eigen::Dynamic, 1> size =
      Eigen::Matrix<long double, Eigen::Dynamic, 1>::Ones(2 * n);
  for (Eigen::Index k = 0; k < n; ++k)
    size[k] = std::max<long double>(
        plan.omega[static_cast<std::size_t>(plan.coupling.modes[static_cast<std::size_t>(k)])], 1.0L / h);
  const WideMatrix z = h * (size.asDiagonal() * system.A * size.cwiseInverse().asDiagonal());
  const Phi phi = phi_functions(z);
  const auto unscaled = [&](const WideMatrix& matrix) -> WideMatrix {
    return size.cwiseInverse().asDiagonal() * matrix;
  };
  WideMatrix columns(2 * n, 4 * n);
  columns << unscaled(phi.phi0 * size.asDiagonal()), unscaled(h * phi.phi1.rightCols(n) * system.E),
      unscaled(h * phi.phi2.rightCols(n) * system.E);
  const Eigen::Index stride = (2 * n + kLanes - 1) / kLanes * kLanes;
  plan.coupling.columns.assign(static_cast<std::size_t>(4 * n * stride), 0.0);
  Eigen::Map<Eigen::MatrixXd>(plan.coupling.columns.data(), stride, 4 * n).topRows(2 * n) =
      columns.cast<double>();
}

// X76: q_dot += U tau phi_1(tau W U) (W q_dot + W_q q), tau half a period, U = [R' B'] / M, W = [-R; F_v]
void set_split(Plan& plan) {
  PlanCoupling& coupling = plan.coupling;
  const Eigen::MatrixXd R = modal(coupling.damping_rows, coupling.num_damping, plan), B = actuator_rows(plan);
  const Eigen::Index num_kicks = R.rows() + B.rows();
  Eigen::MatrixXd out(num_kicks, plan.num_elastic), by_q_dot(num_kicks, plan.num_elastic), by_q = by_q_dot;
  out << R / plan.mass, B / plan.mass;
  by_q_dot << -R, feedback_rows(plan, Input::kVelocity);
  by_q << Eigen::MatrixXd::Zero(R.rows(), plan.num_elastic), feedback_rows(plan, Input::kDisplacement);
  const long double tau = 0.5L * plan.period;
  const WideMatrix wide = tau * (by_q_dot * out.transpose()).cast<long double>();
  const Eigen::MatrixXd weight = (tau * phi_functions(wide).phi1).cast<double>();
  coupling.num_kicks = static_cast<std::int32_t>(num_kicks);
  coupling.kick_q_dot_rows = to_rows(weight * by_q_dot, plan);
  coupling.kick_q_rows = to_rows(weight * by_q, plan);
  coupling.kick_out = to_rows(out, plan);
}

}  // namespace

void compile_coupling(const Scene& scene, const Structure& structure, Plan& plan, Faults& faults) {
  Eigen::MatrixXd R = structure.damping_rows;
  if (R.rows() > R.cols()) {
    // as many rows as modes do, with the same R'R
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(R);
    R = qr.matrixQR().topRows(R.cols()).triangularView<Eigen::Upper>();
  }
  if (R.rows() > 0) {
    const Eigen::MatrixXd D = R.transpose() * R;
    const Eigen::VectorXd diagonal = D.diagonal();
    const double coupling = (D - Eigen::MatrixXd(diagonal.asDiagonal())).cwiseAbs().maxCoeff();
    if (coupling <= kUncoupled * diagonal.maxCoeff()) {
      for (Eigen::Index mode = 0; mode < diagonal.size(); ++mode)
        plan.decay[static_cast<std::size_t>(mode)] += 0.5 * diagonal[mode] / plan.mass;
      R.resize(0, R.cols());
    }
  }
  plan.coupling.num_damping = static_cast<std::int32_t>(R.rows());
  plan.coupling.damping_rows = to_rows(R, plan);
  if (!scene.feedbacks.empty()) compile_feedbacks(scene, structure, plan, faults);
  if (R.rows() == 0 && plan.feedbacks.empty()) return;
  std::vector<std::int32_t> modes = coupled_modes(plan);
  if (modes.empty()) return;
  if (modes.size() <= static_cast<std::size_t>(kMaxExactModes)) {
    plan.coupling.path = PlanCoupling::Path::kExact;
    plan.coupling.modes = std::move(modes);
    return;
  }
  plan.coupling.path = PlanCoupling::Path::kSplit;
  for (const Feedback& feedback : scene.feedbacks)
    if (!feedback.acceleration_gain.isZero(0.0))
      add_error(faults, feedback.origin,
                join_text("acceleration feedback couples ", modes.size(), " modes, at most ", kMaxExactModes,
                          " are advanced together; use a smaller model, or displacement and velocity gains"));
}

void set_coupling_period(Plan& plan) {
  if (plan.coupling.path == PlanCoupling::Path::kExact) set_exact(plan);
  if (plan.coupling.path == PlanCoupling::Path::kSplit) set_split(plan);
}

void warn_of_growth(const Scene& scene, const Plan& plan, Faults& faults) {
  if (plan.feedbacks.empty() || plan.coupling.path != PlanCoupling::Path::kExact) return;
  const auto n = static_cast<Eigen::Index>(plan.coupling.modes.size());
  const Eigen::Index stride = static_cast<Eigen::Index>(plan.coupling.columns.size()) / (4 * n);
  const Eigen::MatrixXd once = Eigen::Map<const Eigen::MatrixXd>(plan.coupling.columns.data(), stride, 4 * n)
                                   .topLeftCorner(2 * n, 2 * n);
  const double largest = once.eigenvalues().cwiseAbs().maxCoeff();
  if (largest <= 1.0 + kGrowth) return;
  add_warning(faults, scene.feedbacks.front().origin,
              join_text("the feedback drives a motion that grows by a factor of ",
                        std::exp(std::log(largest) / plan.period),
                        " a second; check the signs and sizes of its gains"));
}

}  // namespace freeflex
