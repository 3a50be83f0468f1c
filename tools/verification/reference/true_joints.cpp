// The rotations of joints have no inertia. Newton's method finds the rotations with the least strain energy
// at given positions (THEORY 10.12):
//   R_j = argmin E_el(p, R_j)
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/verification/reference/rotations.hpp"
#include "tools/verification/reference/true_geometry.hpp"

namespace freeflex {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

void evaluate(const RotatingLink<TrueBeam>& link, const TrueGeometry::PointVectors& e, const auto& frames,
              bool with_stiffness, LinkGradient& result) {
  link.kind.evaluate(e.col(link.points[1]) - e.col(link.points[0]), {frames[0].axes, frames[1].axes},
                     with_stiffness, result);
}

void evaluate(const RotatingLink<TruePlate>& link, const TrueGeometry::PointVectors& e, const auto& frames,
              bool with_stiffness, LinkGradient& result) {
  link.kind.evaluate({e.col(link.points[0]), e.col(link.points[1]), e.col(link.points[2])},
                     {frames[0].axes, frames[1].axes, frames[2].axes}, with_stiffness, result);
}

/// Computes the second derivative with respect to rotations of ends, with the terms that contain moments, by
/// differences of the moments. Without these terms Newton's method converges slowly if links bend far.
void difference_moments(const auto& link, const TrueGeometry::PointVectors& e, auto frames,
                        LinkGradient& result) {
  // [rad] truncation error 1e-6, rounding error 1e-10
  constexpr double kAngle = 1e-6;
  LinkGradient rotated;
  for (std::size_t j = 0; j < link.ends.size(); ++j) {
    const Matrix3d axes = frames[j].axes;
    for (int a = 0; a < 3; ++a) {
      frames[j].axes = Eigen::AngleAxisd(kAngle, Vector3d::Unit(a)) * axes;
      evaluate(link, e, frames, false, rotated);
      for (std::size_t i = 0; i < link.ends.size(); ++i)
        result.stiffness.block<3, 1>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(j) + a) =
            (rotated.moment[i] - result.moment[i]) / kAngle;
    }
    frames[j].axes = axes;
  }
}

}  // namespace

TrueGeometry::Frame TrueGeometry::frame_of_end(const LinkEnd& end) const {
  const auto index = static_cast<std::size_t>(end.joint);
  const TrueJoint& joint = joints_[index];
  const Matrix3d& R = rotations_.matrix[index];
  Frame frame;
  if (joint.num == 3)
    for (int a = 0; a < 3; ++a) frame.add(joint.first + a, R.col(a));
  if (joint.num == 1) frame.add(joint.first, R * bodies_[static_cast<std::size_t>(joint.body)].frame.line());
  frame.axes = R * end.rest;
  int index_of_angle = end.first;
  for (const int axis : end.released) {
    frame.add(index_of_angle, frame.axes.col(axis));
    frame.axes = frame.axes *
                 Eigen::AngleAxisd(rotations_.angle[index_of_angle], Vector3d::Unit(axis)).toRotationMatrix();
    ++index_of_angle;
  }
  return frame;
}

template <typename Kind>
double TrueGeometry::assemble(const RotatingLink<Kind>& link, const PointVectors& e, Tangent tangent,
                              Forces force) const {
  std::array<Frame, 3> frames;
  for (std::size_t i = 0; i < link.ends.size(); ++i) frames[i] = frame_of_end(link.ends[i]);
  LinkGradient result;
  evaluate(link, e, frames, tangent == Tangent::kAtRest, result);
  for (std::size_t i = 0; i < link.ends.size(); ++i) {
    force.col(link.points[i]) -= result.force[i];
    const int body = joints_[static_cast<std::size_t>(link.ends[i].joint)].body;
    if (body >= 0) rotations_.body_moment[static_cast<std::size_t>(body)] -= result.moment[i];
    for (std::size_t k = 0; k < frames[i].num_spins; ++k)
      rotations_.gradient[frames[i].spins[k].first] += frames[i].spins[k].second.dot(result.moment[i]);
  }
  if (tangent == Tangent::kNone) return result.energy;
  if (tangent == Tangent::kPresent) difference_moments(link, e, frames, result);
  for (std::size_t i = 0; i < link.ends.size(); ++i)
    for (std::size_t j = 0; j < link.ends.size(); ++j) {
      const Matrix3d block =
          result.stiffness.block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(j));
      for (std::size_t a = 0; a < frames[i].num_spins; ++a)
        for (std::size_t b = 0; b < frames[j].num_spins; ++b) {
          const auto& [row, spin] = frames[i].spins[a];
          const auto& [column, other] = frames[j].spins[b];
          rotations_.stiffness(row, column) += spin.dot(block * other);
        }
    }
  return result.energy;
}

double TrueGeometry::assemble(const PointVectors& e, Tangent tangent, Forces force,
                              VectorXd* energies) const {
  rotations_.gradient.setZero(num_rotations_);
  if (tangent != Tangent::kNone) rotations_.stiffness.setZero(num_rotations_, num_rotations_);
  rotations_.body_moment.assign(bodies_.size(), Vector3d::Zero());
  double energy = 0.0;
  const auto add = [&](const auto& link) {
    const double one = assemble(link, e, tangent, force);
    if (energies != nullptr) (*energies)[link.link] += one;
    energy += one;
  };
  for (const auto& beam : beams_) add(beam);
  for (const auto& plate : plates_) add(plate);
  // A body carries the moments on its joints. On a collinear body the moment about the line is zero, because
  // the joint rotates freely about the line
  for (std::size_t k = 0; k < bodies_.size() && given_.empty(); ++k) {
    if (rotations_.body_moment[k].isZero(0.0)) continue;
    const FittedFrame::Fit& fit = rotations_.body_fit[k];
    bodies_[k].frame.add_moment(fit, fit.R.transpose() * rotations_.body_moment[k], force);
  }
  return energy;
}

void TrueGeometry::find_idle_rotations() {
  rotations_.quaternion.assign(joints_.size(), Eigen::Quaterniond::Identity());
  rotations_.matrix.assign(joints_.size(), Matrix3d::Identity());
  rotations_.angle = VectorXd::Zero(num_rotations_);
  idle_.resize(num_rotations_, 0);
  if (num_rotations_ == 0) return;
  const Matrix3Xd rest = Matrix3Xd::Zero(3, r_.cols());
  Matrix3Xd unused = rest;
  rotations_.body_fit = fit_bodies(rest);
  assemble(rest, Tangent::kAtRest, unused, nullptr);
  scale_ = rotations_.stiffness.diagonal().cwiseSqrt();
  for (double& scale : scale_)
    if (scale <= 0.0) scale = std::max(scale_.maxCoeff(), 1.0);
  const MatrixXd scaled =
      scale_.cwiseInverse().asDiagonal() * rotations_.stiffness * scale_.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(scaled);
  // [-] the stiffness is scaled to a unit diagonal, so its eigenvalues below this limit are rounding errors
  constexpr double kIdle = 1e-11;
  const auto count = (eigen.eigenvalues().array() < kIdle).count();
  idle_ = eigen.eigenvectors().leftCols(count);
  rotations_.factor = RotationFactor(pairs_of_rotations(), idle_);
  rotations_.right.resize(num_rotations_ + count);
  rotations_.force.resize(3, r_.cols());
  factor();
}

std::vector<std::pair<int, int>> TrueGeometry::pairs_of_rotations() const {
  std::vector<std::pair<int, int>> pairs;
  const auto add = [&](const auto& link) {
    std::vector<int> own;  // rotations of the link
    for (const LinkEnd& end : link.ends) {
      const Frame frame = frame_of_end(end);
      for (std::size_t k = 0; k < frame.num_spins; ++k) own.push_back(frame.spins[k].first);
    }
    for (const int row : own)
      for (const int column : own) pairs.emplace_back(row, column);
  };
  for (const auto& beam : beams_) add(beam);
  for (const auto& plate : plates_) add(plate);
  return pairs;
}

void TrueGeometry::factor() const {
  rotations_.factor.compute(rotations_.stiffness, scale_);
  rotations_.ratio = 0.0;
}

void TrueGeometry::newton_step(const Matrix3d& R_body) const {
  const Eigen::Index idle = idle_.cols();
  VectorXd& right = rotations_.right;
  right.head(num_rotations_) = -rotations_.gradient.cwiseQuotient(scale_);
  if (idle > 0) {
    // rotations that strain no link follow the body as a whole
    VectorXd& present = rotations_.step;
    present = rotations_.angle;
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const TrueJoint& joint = joints_[k];
      const Vector3d vector = rotation_vector(R_body.transpose() * rotations_.matrix[k]);
      if (joint.num == 3) present.segment<3>(joint.first) = vector;
      if (joint.num == 1)
        present[joint.first] = vector.dot(bodies_[static_cast<std::size_t>(joint.body)].frame.line());
    }
    present.array() *= scale_.array();
    right.tail(idle).noalias() = -idle_.transpose() * present;
  }
  rotations_.factor.solve({right.data(), static_cast<std::size_t>(right.size())});
  rotations_.step = right.head(num_rotations_).cwiseQuotient(scale_);
}

void TrueGeometry::rotate() const {
  constexpr double kLargest = 0.5;  // [rad] largest rotation in one step
  VectorXd& taken = rotations_.step;
  const double largest = taken.cwiseAbs().maxCoeff();
  if (largest > kLargest) taken *= kLargest / largest;
  rotations_.angle += taken;  // used for released ends only
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const TrueJoint& joint = joints_[k];
    if (joint.num == 0) continue;
    const Vector3d vector =
        joint.num == 3
            ? Vector3d(taken.segment<3>(joint.first))
            : Vector3d(taken[joint.first] * bodies_[static_cast<std::size_t>(joint.body)].frame.line());
    if (joint.num == 3) rotations_.angle.segment<3>(joint.first).setZero();
    if (joint.num == 1) rotations_.angle[joint.first] = 0.0;
    rotations_.quaternion[k] = (rotations_.quaternion[k] * quaternion_of(vector)).normalized();
    rotations_.matrix[k] = rotations_.quaternion[k].toRotationMatrix();
  }
}

std::vector<FittedFrame::Fit> TrueGeometry::fit_bodies(const PointVectors& e) const {
  std::vector<FittedFrame::Fit> fits;
  for (const TrueBody& body : bodies_) fits.push_back(body.frame.fit(r_ + e));
  return fits;
}

void TrueGeometry::follow_bodies(const PointVectors& e) const {
  if (given_.empty()) rotations_.body_fit = fit_bodies(e);
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const TrueJoint& joint = joints_[k];
    if (joint.body < 0) continue;
    const auto body = static_cast<std::size_t>(joint.body);
    const Matrix3d& R_body = given_.empty() ? rotations_.body_fit[body].R : given_[body];
    Matrix3d& R = rotations_.matrix[k];
    const Vector3d& line = bodies_[body].frame.line();
    // a collinear body determines the direction of its line, and the joint keeps its rotation about this line
    R = joint.num == 0 ? R_body : Matrix3d(smallest_rotation(R * line, R_body * line) * R);
    rotations_.quaternion[k] = Eigen::Quaterniond(R).normalized();
  }
}

bool TrueGeometry::relax(const PointVectors& e) const {
  constexpr int kMost = 60;  // steps
  // [rad] a step of at most this size is below the rounding error of rotations
  constexpr double kSmall = 1e-14;
  // [rad] below this size, a step that no longer shrinks is a rounding error
  constexpr double kRounding = 1e-10;
  // [rad] below this size, a new factor is not worth its cost
  constexpr double kWorth = 1e-12;
  // [-] if a step is larger than this fraction of the previous step, a new factor is needed
  constexpr double kSlow = 0.05;
  // [rad] Above this size, the tangent without the terms that contain moments is taken, because it is
  // positive definite. The full one leads to other equilibria from joints that are far from theirs.
  constexpr double kNear = 0.01;
  double last = 0.0;
  Tangent tangent = Tangent::kNone;
  const Matrix3d R_body = idle_.cols() > 0 ? body_.fit(r_ + e).R : Matrix3d::Identity();
  for (int k = 0; k < kMost; ++k) {
    assemble(e, tangent, rotations_.force, nullptr);
    if (tangent != Tangent::kNone) factor();
    newton_step(R_body);
    const double size = rotations_.step.cwiseAbs().maxCoeff();
    if (!std::isfinite(size)) return false;
    rotate();
    // The steps form a geometric series with the ratio of this step to the last. The first step takes the
    // largest ratio since the last factor, with a factor of ten for safety   (THEORY 13.19)
    double ratio = rotations_.ratio > 0.0 ? 10.0 * rotations_.ratio : 1.0;
    if (k > 0) {
      ratio = size / last;
      if (last > kWorth) rotations_.ratio = std::max(rotations_.ratio, ratio);
    }
    if (size <= kSmall || (ratio < kSlow && size * ratio <= tolerance_) ||
        (k > 0 && size < kRounding && ratio > 0.5))
      return true;
    const bool is_slow = size > kWorth && ((k > 0 && ratio > kSlow) || size > kSlow);
    tangent = !is_slow ? Tangent::kNone : size < kNear ? Tangent::kPresent : Tangent::kAtRest;
    last = size;
  }
  return false;
}

double TrueGeometry::add_forces(const PointVectors& e, Forces force) const {
  double energy = add_angles(e, force, nullptr) + add_matrices(e, force, nullptr);
  if (joints_.empty()) return energy;
  follow_bodies(e);
  if (num_rotations_ > 0 && !relax(e)) {
    // Newton's method starts again from joints that rotate with the body
    const Matrix3d R_body = body_.fit(r_ + e).R;
    std::fill(rotations_.quaternion.begin(), rotations_.quaternion.end(), Eigen::Quaterniond(R_body));
    std::fill(rotations_.matrix.begin(), rotations_.matrix.end(), R_body);
    rotations_.angle.setZero();
    follow_bodies(e);
    if (!relax(e)) force.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  energy += assemble(e, Tangent::kNone, force, nullptr);
  return energy;
}

VectorXd TrueGeometry::energies(const PointVectors& e) const {
  VectorXd energies = VectorXd::Zero(num_links_);
  Matrix3Xd unused = Matrix3Xd::Zero(3, r_.cols());
  add_forces(e, unused);
  add_angles(e, unused, &energies);
  add_matrices(e, unused, &energies);
  if (!joints_.empty()) assemble(e, Tangent::kNone, unused, &energies);
  return energies;
}

std::size_t TrueGeometry::memory() const {
  const auto entries = static_cast<std::size_t>(damping_.size() + 2 * rotations_.stiffness.size());
  return entries * sizeof(double) + beams_.size() * sizeof(beams_[0]) + plates_.size() * sizeof(plates_[0]) +
         (angles_.size() + dihedrals_.size()) * sizeof(TrueAngle) + joints_.size() * sizeof(TrueJoint);
}

Matrix3d TrueGeometry::local_rotation(int point, const PointVectors& e) const {
  const auto index = static_cast<std::size_t>(point);
  if (joint_of_[index] >= 0) return rotations_.matrix[static_cast<std::size_t>(joint_of_[index])];
  // Collinear surroundings do not define the rotation about their line, so about the line the rotation is
  // that of the body
  const Matrix3d R_body = body_.fit(r_ + e).R;
  return R_body * surroundings_[index].fit(R_body.transpose() * (r_ + e)).R;
}

void TrueGeometry::add_followers(const std::vector<PointLoad>& loads, double scale, const PointVectors& e,
                                 Forces force) const {
  for (const PointLoad& load : loads)
    force.col(load.point) += scale * (local_rotation(load.point, e) * load.force);
}

}  // namespace freeflex
