// Rotations without inertia: the values of least energy, by Newton's method   (THEORY X150).
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/reference/rotations.hpp"
#include "core/reference/true_geometry.hpp"

namespace freeflex {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

void evaluate(const TurningLink<TrueBeam>& link, const TrueGeometry::Places& e, const auto& frames,
              bool with_stiffness, TurnResult& result) {
  link.kind.evaluate(e.col(link.points[1]) - e.col(link.points[0]), {frames[0].axes, frames[1].axes},
                     with_stiffness, result);
}

void evaluate(const TurningLink<TruePlate>& link, const TrueGeometry::Places& e, const auto& frames,
              bool with_stiffness, TurnResult& result) {
  link.kind.evaluate({e.col(link.points[0]), e.col(link.points[1]), e.col(link.points[2])},
                     {frames[0].axes, frames[1].axes, frames[2].axes}, with_stiffness, result);
}

}  // namespace

TrueGeometry::Frame TrueGeometry::stand(const TurnEnd& end) const {
  const auto index = static_cast<std::size_t>(end.joint);
  const TurnJoint& joint = joints_[index];
  const Matrix3d& R = turns_.rotation[index];
  Frame frame;
  if (joint.num == 3)
    for (int a = 0; a < 3; ++a) frame.add(joint.first + a, R.col(a));
  if (joint.num == 1) frame.add(joint.first, R * bodies_[static_cast<std::size_t>(joint.body)].frame.line());
  frame.axes = R * end.rest;
  int turn = end.first;
  for (const int axis : end.released) {
    frame.add(turn, frame.axes.col(axis));
    frame.axes = frame.axes * Eigen::AngleAxisd(turns_.angle[turn], Vector3d::Unit(axis)).toRotationMatrix();
    ++turn;
  }
  return frame;
}

template <typename Kind>
double TrueGeometry::assemble(const TurningLink<Kind>& link, const Places& e, bool with_stiffness,
                              Forces force) const {
  std::array<Frame, 3> frames;
  for (std::size_t i = 0; i < link.ends.size(); ++i) frames[i] = stand(link.ends[i]);
  TurnResult result;
  evaluate(link, e, frames, with_stiffness, result);
  for (std::size_t i = 0; i < link.ends.size(); ++i) {
    force.col(link.points[i]) -= result.place[i];
    const int body = joints_[static_cast<std::size_t>(link.ends[i].joint)].body;
    if (body >= 0) turns_.body_moment[static_cast<std::size_t>(body)] -= result.moment[i];
    for (std::size_t k = 0; k < frames[i].num_spins; ++k)
      turns_.gradient[frames[i].spins[k].first] += frames[i].spins[k].second.dot(result.moment[i]);
  }
  if (!with_stiffness) return result.energy;
  for (std::size_t i = 0; i < link.ends.size(); ++i)
    for (std::size_t j = 0; j < link.ends.size(); ++j) {
      const Matrix3d block =
          result.stiffness.block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(j));
      for (std::size_t a = 0; a < frames[i].num_spins; ++a)
        for (std::size_t b = 0; b < frames[j].num_spins; ++b) {
          const auto& [row, spin] = frames[i].spins[a];
          const auto& [column, other] = frames[j].spins[b];
          turns_.stiffness(row, column) += spin.dot(block * other);
        }
    }
  return result.energy;
}

double TrueGeometry::assemble(const Places& e, bool with_stiffness, Forces force, VectorXd* energies) const {
  turns_.gradient.setZero(num_turns_);
  if (with_stiffness) turns_.stiffness.setZero(num_turns_, num_turns_);
  turns_.body_moment.assign(bodies_.size(), Vector3d::Zero());
  double energy = 0.0;
  const auto add = [&](const auto& link) {
    const double one = assemble(link, e, with_stiffness, force);
    if (energies != nullptr) (*energies)[link.link] += one;
    energy += one;
  };
  for (const auto& beam : beams_) add(beam);
  for (const auto& plate : plates_) add(plate);
  // a body carries the moments on its joints; what is about the line of its points, the joint's own turn ends
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    if (turns_.body_moment[k].isZero(0.0)) continue;
    const FittedFrame::Fit& fit = turns_.body_fit[k];
    bodies_[k].frame.add_moment(fit, fit.A.transpose() * turns_.body_moment[k], force);
  }
  return energy;
}

void TrueGeometry::find_idle_turns() {
  turns_.joint.assign(joints_.size(), Eigen::Quaterniond::Identity());
  turns_.rotation.assign(joints_.size(), Matrix3d::Identity());
  turns_.angle = VectorXd::Zero(num_turns_);
  idle_.resize(num_turns_, 0);
  if (num_turns_ == 0) return;
  const Matrix3Xd rest = Matrix3Xd::Zero(3, r_.cols());
  Matrix3Xd unused = rest;
  turns_.body_fit = fit_bodies(rest);
  assemble(rest, true, unused, nullptr);
  scale_ = turns_.stiffness.diagonal().cwiseSqrt();
  for (double& scale : scale_)
    if (scale <= 0.0) scale = std::max(scale_.maxCoeff(), 1.0);
  const MatrixXd scaled =
      scale_.cwiseInverse().asDiagonal() * turns_.stiffness * scale_.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(scaled);
  constexpr double kIdle = 1e-11;  // [-] of a stiffness with unit diagonal: nothing but rounding
  const auto count = (eigen.eigenvalues().array() < kIdle).count();
  idle_ = eigen.eigenvectors().leftCols(count);
  factor();
}

void TrueGeometry::factor() const {
  const VectorXd inverse = scale_.cwiseInverse();
  MatrixXd scaled = inverse.asDiagonal() * turns_.stiffness * inverse.asDiagonal();
  if (idle_.cols() > 0) {
    scaled -= (idle_ * (idle_.transpose() * scaled)).eval();
    scaled -= ((scaled * idle_) * idle_.transpose()).eval();
    scaled += idle_ * idle_.transpose();
  }
  turns_.factor.compute(scaled);
}

VectorXd TrueGeometry::newton_step(const Places& e) const {
  const VectorXd inverse = scale_.cwiseInverse();
  VectorXd right = -inverse.cwiseProduct(turns_.gradient);
  if (idle_.cols() > 0) {
    // what strains nothing stays with the body as a whole
    VectorXd present = turns_.angle;
    const Matrix3d A = body_.fit(r_ + e).A;
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const TurnJoint& joint = joints_[k];
      const Vector3d vector = rotation_vector(A.transpose() * turns_.rotation[k]);
      if (joint.num == 3) present.segment<3>(joint.first) = vector;
      if (joint.num == 1)
        present[joint.first] = vector.dot(bodies_[static_cast<std::size_t>(joint.body)].frame.line());
    }
    right -= idle_ * (idle_.transpose() * (right + scale_.cwiseProduct(present)));
  }
  return inverse.cwiseProduct(turns_.factor.solve(right));
}

void TrueGeometry::turn(const VectorXd& step) const {
  constexpr double kLargest = 0.5;  // [rad] at once
  const double largest = step.cwiseAbs().maxCoeff();
  const VectorXd taken = largest > kLargest ? VectorXd(step * (kLargest / largest)) : step;
  turns_.angle += taken;  // of joints it is not used
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const TurnJoint& joint = joints_[k];
    if (joint.num == 0) continue;
    const Vector3d vector =
        joint.num == 3
            ? Vector3d(taken.segment<3>(joint.first))
            : Vector3d(taken[joint.first] * bodies_[static_cast<std::size_t>(joint.body)].frame.line());
    if (joint.num == 3) turns_.angle.segment<3>(joint.first).setZero();
    if (joint.num == 1) turns_.angle[joint.first] = 0.0;
    turns_.joint[k] = (turns_.joint[k] * quaternion_of(vector)).normalized();
    turns_.rotation[k] = turns_.joint[k].toRotationMatrix();
  }
}

std::vector<FittedFrame::Fit> TrueGeometry::fit_bodies(const Places& e) const {
  std::vector<FittedFrame::Fit> fits;
  for (const TrueBody& body : bodies_) fits.push_back(body.frame.fit(r_ + e));
  return fits;
}

void TrueGeometry::follow_bodies(const Places& e) const {
  turns_.body_fit = fit_bodies(e);
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const TurnJoint& joint = joints_[k];
    if (joint.body < 0) continue;
    const auto body = static_cast<std::size_t>(joint.body);
    const Matrix3d& A = turns_.body_fit[body].A;
    Matrix3d& R = turns_.rotation[k];
    const Vector3d& line = bodies_[body].frame.line();
    // on a line the body says where its line points, and the joint keeps its turn about it
    R = joint.num == 0 ? A : Matrix3d(smallest_rotation(R * line, A * line) * R);
    turns_.joint[k] = Eigen::Quaterniond(R).normalized();
  }
}

bool TrueGeometry::relax(const Places& e) const {
  constexpr int kMost = 60;            // steps
  constexpr double kSmall = 1e-14;     // [rad] below the rounding of the rotations
  constexpr double kRounding = 1e-10;  // [rad] steps under this that no longer shrink are rounding
  constexpr double kSlow = 0.05;       // [-] a contraction above this asks for a new factor
  double last = std::numeric_limits<double>::infinity();
  bool with_stiffness = false;
  Matrix3Xd unused = Matrix3Xd::Zero(3, r_.cols());
  for (int k = 0; k < kMost; ++k) {
    assemble(e, with_stiffness, unused, nullptr);
    if (with_stiffness) factor();
    const VectorXd step = newton_step(e);
    const double size = step.cwiseAbs().maxCoeff();
    if (!std::isfinite(size)) return false;
    turn(step);
    if (size <= kSmall || (size < kRounding && size > 0.5 * last)) return true;
    with_stiffness = size > kSlow * last || size > kSlow;
    last = size;
  }
  return false;
}

double TrueGeometry::add_forces(const Places& e, Forces force) const {
  double energy = add_angles(e, force, nullptr) + add_matrices(e, force, nullptr);
  if (joints_.empty()) return energy;
  follow_bodies(e);
  if (num_turns_ > 0 && !relax(e)) {
    // anew, from joints that turn with the body
    const Matrix3d A = body_.fit(r_ + e).A;
    std::fill(turns_.joint.begin(), turns_.joint.end(), Eigen::Quaterniond(A));
    std::fill(turns_.rotation.begin(), turns_.rotation.end(), A);
    turns_.angle.setZero();
    follow_bodies(e);
    if (!relax(e)) force.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  energy += assemble(e, false, force, nullptr);
  return energy;
}

VectorXd TrueGeometry::energies(const Places& e) const {
  VectorXd energies = VectorXd::Zero(num_links_);
  Matrix3Xd unused = Matrix3Xd::Zero(3, r_.cols());
  add_forces(e, unused);
  add_angles(e, unused, &energies);
  add_matrices(e, unused, &energies);
  if (!joints_.empty()) assemble(e, false, unused, &energies);
  return energies;
}

Matrix3d TrueGeometry::local_rotation(int point, const Places& e) const {
  const auto index = static_cast<std::size_t>(point);
  if (joint_of_[index] >= 0) return turns_.rotation[static_cast<std::size_t>(joint_of_[index])];
  // surroundings on a line do not say how they turn about it: as the body does
  const Matrix3d A = body_.fit(r_ + e).A;
  return A * surroundings_[index].fit(A.transpose() * (r_ + e)).A;
}

void TrueGeometry::add_followers(const std::vector<PointLoad>& loads, double scale, const Places& e,
                                 Forces force) const {
  for (const PointLoad& load : loads)
    force.col(load.point) += scale * (local_rotation(load.point, e) * load.force);
}

}  // namespace freeflex
