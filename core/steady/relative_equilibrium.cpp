#include "core/steady/relative_equilibrium.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/faults.hpp"
#include "core/step/coupled/coupled.hpp"
#include "core/step/coupled/stage.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/links/rotations.hpp"
#include "core/step/readout.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// [-] Step of finite differences over the size of the body, for the lowest mode. The steps of all modes have
// the same energy: a step of this size along an axial mode would press slender beams beyond their buckling
// load.
constexpr double kDifference = 1e-5;
constexpr double kLonger = 3.0;  // [-] factor of the steps that check the finite differences
constexpr int kMostIterations = 40;
constexpr int kMostSteps = 16;  // from rest to the spin and loads, if Newton's method fails in one step
// [-] Newton's method has converged when a step is below kFound of the size, or below kNoise and no longer
// decreasing.
constexpr double kFound = 1e-12, kNoise = 1e-8;
constexpr double kLongestStep = 0.1;  // [-] longer steps are shortened to this share of the size
// [-] A motion is steady if what is left of each equation displaces a mode by less than this share of the
// size, or changes the angular momentum and the spin by less than this share.
constexpr double kSteady = 1e-7;
// [-] weight of the steps of unknowns that may be free: the axis in the plane of two equal moments of
// inertia, and mechanisms
constexpr double kMaybeFree = 1e-6;
constexpr double kMostTilt = 10.0;  // [deg] between the axis that was asked for and the one that was found
// [rad] A moment is not balanced if it turns the body by more than this within 1 rad of the lowest mode.
constexpr double kUnbalanced = 1e-6;
// [-] A rate is a rounding error of zero if it is below the first share of the lowest frequency and the
// second share of the faster of the spin and the turning by loads, if there are any. A double eigenvalue of
// zero, that of a free axis, has the square root of the rounding error of the rates.
constexpr double kZeroRate = 1e-5, kZeroOfBody = 1e-4;
// [-] moments below this share of the loads times the size are rounding errors
constexpr double kZeroMoment = 1e-9;
// [-] The accuracy of rates below this share of the lowest frequency and of the spin is relative to that
// share: near buckling a rate goes to zero.
constexpr double kSlow = 1e-2;
constexpr double kUsable = 1e-2;        // [-] motions with a worse accuracy are not reported
constexpr double kJointsFound = 1e-13;  // [rad] last step of the joints
constexpr int kMostRelaxations = 40;

Vec3 vec3_of(const Vector3d& v) { return {v[0], v[1], v[2]}; }
Vector3d vector_of(const Vec3& v) { return {v[0], v[1], v[2]}; }

/// Returns the derivative of f at 0 by central differences of order 4.
template <typename Function>
VectorXd derivative(double step, const Function& f) {
  const auto odd = [&](double k) { return (f(k * step) - f(-k * step)).eval(); };
  return (8.0 * odd(1.0) - odd(2.0)) / (12.0 * step);
}

double sum_of(const std::vector<Vec3>& vectors) {
  double sum = 0.0;
  for (const Vec3& each : vectors) sum += length(each);
  return sum;
}

std::string axis_text(const Vector3d& v) {
  const Vector3d x = (v.array().abs() < 1e-12 * v.norm()).select(Vector3d::Zero(), v);  // no rounding errors
  return join_text(x[0], ",", x[1], ",", x[2]);
}

}  // namespace

RelativeEquilibria::RelativeEquilibria(const StepPlan& plan, std::optional<double> loads_at)
    : plan_(plan), n_(plan.num_elastic) {
  plan_.attractor_mu = 0.0;
  if (!loads_at) plan_.histories.clear();
  tick_ = std::llround(loads_at.value_or(0.0) / plan.period);
  state_ = make_state(plan_);
  workspace_ = make_workspace(plan_);
  for (const PlanPoint& point : plan_.points) size_ = std::max(size_, length(point.r));
  double lowest = std::numeric_limits<double>::infinity();
  for (Index l = 0; l < n_; ++l)
    if (plan_.omega[index(l)] > 0.0) lowest = std::min(lowest, plan_.omega[index(l)]);
  if (!(lowest < std::numeric_limits<double>::infinity())) lowest = 1.0;  // rigid bodies on joints alone
  scale_.resize(n_), step_.resize(n_);
  for (Index l = 0; l < n_; ++l) {
    scale_[l] = std::max(plan_.omega[index(l)], lowest);
    // the largest displacement at q_l = 1, and the largest rotation of a body times the size
    double most = 0.0;
    for (const PlanPoint& point : plan_.points)
      for (std::size_t a = 0; a < 3 && point.row >= 0; ++a)
        most = std::max(most, std::abs(point_rows(plan_, point.row)[a * index(plan_.num_padded) + index(l)]));
    for (const PlanTurningBody& body : plan_.coupled.turning.bodies)
      for (std::size_t a = 0; a < 6; ++a)
        most = std::max(most,
                        (a < 3 ? 1.0 : size_) * std::abs(body.rows[a * index(plan_.num_padded) + index(l)]));
    step_[l] = kDifference * size_ / most * lowest / scale_[l];
  }
  q_ = Vector::Zero(n_);
  const StepLoads loads{plan_, state_.commands_pattern, tick_};
  amplitudes_.resize(static_cast<Index>(plan_.histories.size()));
  for (std::size_t k = 0; k < plan_.histories.size(); ++k) {
    const PlanHistory& history = plan_.histories[k];
    const double amplitude = std::abs(loads.amplitude(history, StageTime::kStart));
    amplitudes_[static_cast<Index>(k)] = loads.amplitude(history, StageTime::kStart);
    const LoadSums& sums = history.pattern.sums;
    const double world = sum_of(sums.force_W) + sum_of(sums.group_force_W) +
                         (sum_of(sums.torque_W) + sum_of(sums.group_torque_W)) / size_;
    const double body = sum_of(sums.force_B) + sum_of(sums.group_force_B) +
                        (sum_of(sums.torque_B) + sum_of(sums.group_torque_B)) / size_;
    has_world_loads_ = has_world_loads_ || amplitude * world > 0.0;
    load_size_ += amplitude * (world + body);
    for (const double torque : history.pattern.wheel_torques)
      has_motor_ = has_motor_ || amplitude * torque != 0.0;
  }
}

// Gives each built-in load a constant share of the value that it keeps.
void RelativeEquilibria::scale_loads(double share) {
  for (std::size_t k = 0; k < plan_.histories.size(); ++k) {
    PlanHistory& history = plan_.histories[k];
    history.kind = PlanHistory::Kind::kTable;
    history.times = {0.0};
    history.values = {share * amplitudes_[static_cast<Index>(k)]};
  }
}

// Why the motion cannot be steady, or an empty text.
std::string RelativeEquilibria::refusal(const Vector3d& spin) const {
  if (n_ == 0) return "the body has no elastic freedom";
  if (plan_.rigid_freedoms == 5 && std::abs(spin.dot(vector_of(plan_.line))) > 1e-6 * spin.norm())
    return "all points lie on a line, about which the body has no inertia; give a spin across this line";
  if (has_motor_)
    return "a load drives a wheel, whose momentum changes; steady loads do not, so take this load out "
           "or give another --at";
  if (has_world_loads_ && spin.norm() > 0.0)
    return "loads in world axes are not steady while the body rotates; write them in body or local axes, or "
           "leave --spin out";
  return {};
}

// Coordinates and momenta of a motion without elastic rates   (THEORY 12.98).
RelativeEquilibria::Vector RelativeEquilibria::steady_state(const Vector& q, const Vector3d& spin) {
  std::copy(q.begin(), q.end(), state_.q.begin());
  std::fill(state_.q_dot.begin(), state_.q_dot.end(), 0.0);
  state_.q_WB = {1.0, 0.0, 0.0, 0.0};
  set_coupled_motion(plan_, vec3_of(spin), state_);
  Vector z = Vector::Zero(2 * n_ + 6);
  z.head(n_) = q;
  for (Index l = 0; l < n_; ++l) z[n_ + l] = state_.coupled.momentum[index(l)];
  z.segment<3>(2 * n_) = vector_of(state_.H_W);
  return z;
}

// Rates of q, p, H_B and the rotation of the body against axes that rotate with `spin`   (THEORY 12.99).
RelativeEquilibria::Vector RelativeEquilibria::rates(const Vector& z, const Vector3d& spin) {
  CoupledWorkspace& w = workspace_.coupled;
  std::copy_n(z.begin(), n_, w.q.begin());
  std::copy_n(z.begin() + n_, n_, w.p.begin());
  const Vector3d H = z.segment<3>(2 * n_), turn = z.tail<3>();
  const Mat3 R_0 = rotation_matrix(plan_.initial.q_WB);
  const Mat3 R_WB = multiply(R_0, matrix_of(rotation_of(vec3_of(turn)).q));
  for (std::size_t k = 0; k < w.wheels.size(); ++k) w.wheels[k] = plan_.wheels[k].momentum;
  const StageState stage{w.q.data(), w.p.data(), vec3_of(H), R_WB, {}, StageTime::kStart, w.wheels};
  StageRate rate{w.rates[0][0].data(), w.rates[0][1].data()};
  const StepLoads loads{plan_, state_.commands_pattern, tick_};
  for (int k = 0; k < kMostRelaxations; ++k) {
    evaluate(loads, stage, workspace_, rate);
    if (!(w.last_turn > kJointsFound)) break;
  }
  Vector z_dot(z.size());
  for (Index l = 0; l < n_; ++l) {
    const double omega = plan_.omega[index(l)], q = z[l], p = z[n_ + l];
    z_dot[l] = p + rate.rate_q[l];
    z_dot[n_ + l] = -omega * (omega * q) - 2.0 * plan_.decay[index(l)] * p + rate.rate_p[l];
  }
  const Vector3d omega_B = vector_of(rate.w_B);
  z_dot.segment<3>(2 * n_) = H.cross(omega_B) + vector_of(rate.moment_B);
  z_dot.tail<3>() = omega_B - spin - spin.cross(turn);
  return z_dot;
}

// Rates of p [m/s^2] (n) that the acceleration of the rotation causes in a shape at rest, if the angular
// momentum changes by `H_rate` [N m]   (THEORY 15.11).
RelativeEquilibria::Vector RelativeEquilibria::by_acceleration(const Vector& q, const Vector3d& H_rate) {
  const Vector still = steady_state(q, Vector3d::Zero());
  MatrixXd by_spin(n_ + 3, 3);
  for (Index a = 0; a < 3; ++a)
    by_spin.col(a) = (steady_state(q, Vector3d::Unit(a)) - still).segment(n_, n_ + 3);
  const Eigen::Matrix3d inertia = by_spin.bottomRows<3>();
  const Vector3d acceleration =
      Eigen::CompleteOrthogonalDecomposition<Eigen::Matrix3d>(inertia).solve(H_rate);
  return by_spin.topRows(n_) * acceleration;
}

// Renews the factor of the joints near z if they converge slowly there, so that all rates near z have joints
// without error. The joints come from a shape at some distance, because the rate of convergence is seen only
// over several sweeps.
void RelativeEquilibria::renew_joints(const Vector& z, const Vector3d& spin) {
  begin_joints(workspace_.coupled.joints);
  Vector near = z;
  near.head(n_) *= 0.99;
  rates(near, spin);
  rates(z, spin);
}

// Returns p' over the frequencies and the size (n), which is zero in a steady shape   (THEORY 12.98, 15.11).
RelativeEquilibria::Vector RelativeEquilibria::residual_at(const Vector& q, const Vector3d& w) {
  Vector z_dot = rates(steady_state(q, w), w);
  if (may_accelerate_) z_dot.segment(n_, n_) -= by_acceleration(q, z_dot.segment<3>(2 * n_));
  return z_dot.segment(n_, n_).cwiseQuotient(scale_) / size_;
}

// Returns the derivatives of residual_at() by the frequencies times q over the size (n x n). It is the
// negative of the stiffness in units of that of the body at rest.
MatrixXd RelativeEquilibria::stiffness_at(const Vector& q, const Vector3d& w) {
  MatrixXd J(n_, n_);
  for (Index l = 0; l < n_; ++l)
    J.col(l) = derivative(step_[l], [&](double x) { return residual_at(q + x * Vector::Unit(n_, l), w); }) *
               size_ / scale_[l];
  return J;
}

// Newton's method for q and the axis of the spin. Without spin, or if the body may accelerate, q alone is
// unknown   (THEORY 12.98, 15.11).
std::string RelativeEquilibria::solve(double rate, Vector& q, Vector3d& spin) {
  const Index num_axis = rate > 0.0 && !may_accelerate_ ? 3 : 0;
  // unknowns: scale_ q over the size, w over the rate; residuals: p' over scale_ and the size, H' over that
  // of a point mass at the size, and |w|^2
  const double moment = plan_.mass * size_ * size_ * rate * rate;
  const auto residual = [&](const Vector& at_q, const Vector3d& w) {
    if (num_axis == 0) return residual_at(at_q, w);
    const Vector z_dot = rates(steady_state(at_q, w), w);
    Vector r(n_ + 4);
    r.head(n_) = z_dot.segment(n_, n_).cwiseQuotient(scale_) / size_;
    r.tail<4>() << z_dot.segment<3>(2 * n_) / moment, w.squaredNorm() / (rate * rate) - 1.0;
    return r;
  };
  double last = std::numeric_limits<double>::infinity();
  for (int k = 0; k < kMostIterations; ++k) {
    renew_joints(steady_state(q, spin), spin);
    const Vector r = residual(q, spin);
    if (!r.allFinite()) return "no steady motion was found: the accelerations are not finite";
    MatrixXd J(r.size(), n_ + num_axis);
    if (num_axis == 0) J = stiffness_at(q, spin);
    for (Index l = 0; num_axis > 0 && l < n_; ++l)
      J.col(l) = derivative(step_[l], [&](double x) { return residual(q + x * Vector::Unit(n_, l), spin); }) *
                 size_ / scale_[l];
    for (Index a = 0; a < num_axis; ++a)
      J.col(n_ + a) =
          derivative(1e-4 * rate, [&](double x) { return residual(q, spin + x * Vector3d::Unit(a)); }) * rate;
    const Vector step = step_of(J, r);
    if (!step.allFinite()) return "no steady motion was found: the accelerations are not finite";
    const Vector in_q = step.head(n_).cwiseQuotient(scale_) * size_;
    double length = in_q.cwiseQuotient(step_).lpNorm<Eigen::Infinity>() * kDifference;
    if (num_axis > 0) length = std::max(length, step.tail<3>().norm());
    const double share = std::min(1.0, kLongestStep / length);
    q += share * in_q;
    if (num_axis > 0) spin += share * rate * step.tail<3>();
    if (length < kFound || (length < kNoise && length > 0.5 * last)) {
      const Vector left = residual(q, spin);
      const double of_q = left.head(n_).cwiseQuotient(scale_).lpNorm<Eigen::Infinity>();
      const double of_spin = num_axis > 0 ? left.tail<4>().lpNorm<Eigen::Infinity>() : 0.0;
      if (std::max(of_q, of_spin) < kSteady) return {};
      break;
    }
    last = length;
  }
  return "no steady motion was found: the links do not hold this spin or these loads, or Newton's method "
         "does not converge; try a smaller spin or smaller loads";
}

// The step that solves J step = -r. Unknowns that no equation determines stay.
RelativeEquilibria::Vector RelativeEquilibria::step_of(const MatrixXd& J, const Vector& r) const {
  const Index count = J.cols();
  MatrixXd weighted(J.rows() + count, count);
  weighted << J, MatrixXd::Zero(count, count);
  for (Index k = 0; k < count; ++k)
    if (k >= n_ || plan_.omega[index(k)] == 0.0) weighted(J.rows() + k, k) = kMaybeFree;
  Vector right = Vector::Zero(J.rows() + count);
  right.head(J.rows()) = -r;
  return Eigen::CompleteOrthogonalDecomposition<MatrixXd>(weighted).solve(right);
}

// The rate below which eigenvalues are rounding errors of zero [1/s].
double RelativeEquilibria::zero_rate(const MatrixXd& A, double spin) const {
  const double lowest = scale_.minCoeff();
  // the rate at which loads along axes of the world turn the body
  const double turned =
      has_world_loads_ ? std::sqrt(lowest * A.block<3, 3>(2 * n_, 2 * n_ + 3).cwiseAbs().maxCoeff()) : 0.0;
  const double of_body = kZeroOfBody * std::max(spin, turned);
  return of_body > 0.0 ? std::min(of_body, kZeroRate * lowest) : kZeroRate * lowest;
}

// Jacobian of the rates, in coordinates that all are velocities [1/s]   (THEORY 12.100).
MatrixXd RelativeEquilibria::linearise(const Vector& z, const Vector3d& spin, double stretch) {
  const Index size = 2 * n_ + 3 + (has_world_loads_ ? 3 : 0);
  const double lowest = scale_.minCoeff(), mass_size = plan_.mass * size_;
  Vector step(size), scale(size);
  step.head(n_) = step_, scale.head(n_) = scale_;
  step.segment(n_, n_) = scale_.cwiseProduct(step_), scale.segment(n_, n_).setOnes();
  step.segment<3>(2 * n_).setConstant(1e-4 * lowest * mass_size * size_);
  scale.segment<3>(2 * n_).setConstant(1.0 / mass_size);
  if (has_world_loads_) step.tail<3>().setConstant(1e-4), scale.tail<3>().setConstant(size_ * lowest);
  MatrixXd A(size, size);
  for (Index k = 0; k < size; ++k)
    A.col(k) =
        derivative(stretch * step[k],
                   [&](double x) { return rates(z + x * Vector::Unit(z.size(), k), spin).head(size).eval(); })
            .cwiseProduct(scale) /
        scale[k];
  return A;
}

// Rates and shares of the eigenvectors   (THEORY 12.101). Returns the error, or an empty text.
std::string RelativeEquilibria::set_motions(const Vector& z, RelativeEquilibrium& motion) {
  renew_joints(z, motion.spin);
  const MatrixXd A = linearise(z, motion.spin, 1.0), longer = linearise(z, motion.spin, kLonger);
  if (!A.allFinite() || !longer.allFinite())
    return "the small motions were not found: the accelerations near the steady motion are not finite";
  const Eigen::EigenSolver<MatrixXd> eigen(A), check(longer, false);
  if (eigen.info() != Eigen::Success || check.info() != Eigen::Success)
    return "the small motions were not found: their eigenvalues do not converge";
  const Eigen::Matrix3d inverse_inertia =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(plan_.inverse_inertia.data());
  const double spin = motion.spin.norm(), zero = zero_rate(A, spin), lowest = scale_.minCoeff();
  const double slow = kSlow * (spin > 0.0 ? std::min(spin, lowest) : lowest);
  for (Index k = 0; k < eigen.eigenvalues().size(); ++k) {
    SmallMotion small;
    small.rate = eigen.eigenvalues()[k];
    if (small.rate.imag() < 0.0) continue;
    const Eigen::VectorXcd v = eigen.eigenvectors().col(k);
    const Vector energy = v.head(n_).cwiseAbs2() + v.segment(n_, n_).cwiseAbs2();
    // H^T I^-1 H over the mass
    const Eigen::Vector3cd H = v.segment<3>(2 * n_) * size_;
    const double of_body = plan_.mass * std::real(H.dot(inverse_inertia * H));
    Index mode = 0;
    const double most = energy.maxCoeff(&mode), sum = energy.sum() + of_body;
    small.mode = of_body > most ? -1 : static_cast<std::int32_t>(mode);
    small.share = sum > 0.0 ? std::max(most, of_body) / sum : 1.0;
    // a body with another attitude or spin, or another shape of a mechanism, moves steadily too
    if (std::abs(small.rate) < zero) continue;
    const double change = (check.eigenvalues().array() - small.rate).abs().minCoeff();
    motion.accuracy = std::max(motion.accuracy, change / std::max(std::abs(small.rate), slow));
    motion.motions.push_back(small);
  }
  if (motion.accuracy > kUsable)
    return join_text(
        "the small motions were not found: differences determine them to ", motion.accuracy,
        " only, because some links are much stiffer than others, or because the points of a mechanism "
        "have come to a line");
  std::sort(motion.motions.begin(), motion.motions.end(), [](const SmallMotion& a, const SmallMotion& b) {
    return std::pair(a.rate.imag(), a.rate.real()) < std::pair(b.rate.imag(), b.rate.real());
  });
  return {};
}

// Elastic displacements of all points [m]. Without true geometry they are linear, and zero if the plan has no
// rows of a point.
Eigen::Matrix3Xd RelativeEquilibria::displacements() const {
  const bool is_true = traits_of(plan_.fidelity).has_true_geometry;
  Eigen::Matrix3Xd all = Eigen::Matrix3Xd::Zero(3, static_cast<Index>(plan_.points.size()));
  for (Index i = 0; i < all.cols(); ++i) {
    const std::int32_t row = plan_.points[index(i)].row;
    if (is_true)
      all.col(i) = vector_of(workspace_.coupled.V[index(i)]);
    else if (row >= 0)
      all.col(i) = vector_of(contract_rows(point_rows(plan_, row), state_.q.data(), index(plan_.num_padded)));
  }
  return all;
}

// Follows the steady motion from the shape of `q` to the whole spin and loads in equal steps. Returns the
// error, or an empty text.
std::string RelativeEquilibria::follow(const Vector3d& asked, int num_steps, Vector& q, Vector3d& spin) {
  const double rate = asked.norm();
  spin = asked;
  for (int k = 1; k <= num_steps; ++k) {
    const double share = static_cast<double>(k) / num_steps;
    spin *= rate > 0.0 ? share * rate / spin.norm() : 1.0;
    scale_loads(share);
    if (std::string error = solve(share * rate, q, spin); !error.empty()) return error;
  }
  const double tilt =
      rate > 0.0 ? std::atan2(spin.cross(asked).norm(), spin.dot(asked)) * 180.0 / std::numbers::pi : 0.0;
  if (tilt <= kMostTilt) return {};
  return join_text(
      "a free body rotates steadily only about a principal axis, and the nearest one is ",
      axis_text(spin.normalized()), ", ", tilt,
      " degrees from the axis of --spin; give a spin about a principal axis, which freeflex modes "
      "prints");
}

// Follows the motion from the last one or, if that fails, from rest.
std::string RelativeEquilibria::follow_from_last(const Vector3d& asked, Vector& q, Vector3d& spin) {
  std::string error = refusal(asked);
  if (!error.empty()) return error;
  q = q_;
  error = follow(asked, 1, q, spin);
  if (error.empty() || (asked.norm() == 0.0 && load_size_ == 0.0)) return error;
  q.setZero();
  return follow(asked, kMostSteps, q, spin);
}

RelativeEquilibrium RelativeEquilibria::respond(const Vector3d& spin) {
  RelativeEquilibrium motion;
  motion.spin = spin;
  may_accelerate_ = true;
  Vector q;
  motion.error = follow_from_last(spin, q, motion.spin);
  may_accelerate_ = false;
  if (!motion.error.empty()) return motion;
  may_accelerate_ = true;
  const Eigen::EigenSolver<MatrixXd> eigen(stiffness_at(q, spin), false);
  may_accelerate_ = false;
  // at rest without loads, all eigenvalues are -1
  motion.is_unstable = eigen.info() != Eigen::Success || eigen.eigenvalues().real().maxCoeff() >= 0.0;
  rates(steady_state(q, spin), spin);
  motion.displacements = displacements();
  return motion;
}

RelativeEquilibrium RelativeEquilibria::find(const Vector3d& asked) {
  RelativeEquilibrium motion;
  motion.spin = asked;
  Vector q;
  motion.error = follow_from_last(asked, q, motion.spin);
  if (!motion.error.empty()) return motion;
  const Vector z = steady_state(q, motion.spin);
  const Vector3d moment = rates(z, motion.spin).segment<3>(2 * n_);
  // under spin, solve() has checked the moment
  if (asked.isZero(0.0) && moment.norm() > kZeroMoment * load_size_ * size_) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> inverse(
        plan_.inverse_inertia.data());
    motion.acceleration = inverse * moment;
  }
  if (const double lowest = scale_.minCoeff(); motion.acceleration.norm() > kUnbalanced * lowest * lowest) {
    motion.error =
        join_text("the loads turn the body: their moment about the centre of mass of the deformed body is ",
                  axis_text(moment), " N m, which accelerates it by ", motion.acceleration.norm(),
                  " rad/s^2; steady loads have no moment");
    return motion;
  }
  q_ = q;
  motion.displacements = displacements();
  motion.error = set_motions(z, motion);
  return motion;
}

}  // namespace freeflex
