#include "tools/verification/reference/body_system.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "tools/verification/reference/rotations.hpp"

namespace freeflex {
namespace {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Map<const Vector3d> at3(const double* from) { return Map<const Vector3d>(from); }
Map<Vector3d> at3(double* to) { return Map<Vector3d>(to); }
Quaterniond quaternion(const double* q) { return {q[0], q[1], q[2], q[3]}; }
void store(const Quaterniond& q, double* to) { to[0] = q.w(), to[1] = q.x(), to[2] = q.y(), to[3] = q.z(); }

/// Returns R - 1 for a quaternion of any length, which keeps the digits of a small rotation.
Matrix3d rotation_less_one(const Quaterniond& q) {
  const Matrix3d cross = cross_matrix(q.vec());
  return 2.0 / q.squaredNorm() * (q.w() * cross + cross * cross);
}

/// Returns the quaternion 2 q^-1 q'. Its vector part is the angular velocity [rad/s] in the axes of the body.
Quaterniond twice_rate(const Quaterniond& q, const Quaterniond& q_dot) {
  Quaterniond rate = q.conjugate() * q_dot;
  rate.coeffs() *= 2.0 / q.squaredNorm();
  return rate;
}

CartesianSystem without_spin(CartesianSystem system) {
  const Eigen::Index n = system.mass.size();
  Map<Matrix3Xd> e(system.initial.data(), 3, n), e_dot(system.initial.data() + 3 * n, 3, n);
  for (Eigen::Index i = 0; i < n; ++i)
    e_dot.col(i) += system.spin.cross(Vector3d(system.r.col(i) + e.col(i)));
  system.spin.setZero();
  return system;
}

/// Returns one for each coordinate of free points and bodies.
std::vector<double> ones(const CartesianSystem& system) {
  std::size_t count = 3 * index(system.mass.size());
  for (int k = 0; k < system.true_geometry->num_bodies(); ++k)
    count = count + 7 - 3 * system.true_geometry->body_frame(k).points().size();
  return std::vector<double>(count, 1.0);
}

}  // namespace

bool BodySystem::fits(const CartesianSystem& system) {
  if (!system.true_geometry || system.true_geometry->num_bodies() == 0 || system.change_forces ||
      !system.massless.points.empty())
    return false;
  std::vector<int> count(index(system.mass.size()), 0);
  for (int k = 0; k < system.true_geometry->num_bodies(); ++k) {
    const FittedFrame& frame = system.true_geometry->body_frame(k);
    if (frame.points().size() < 3 || frame.is_line()) return false;
    for (const int point : frame.points())
      if (++count[index(point)] > 1) return false;
  }
  return true;
}

BodySystem::BodySystem(const CartesianSystem& system)
    : SecondOrderSystem(ones(system)), system_(without_spin(system)) {
  const TrueGeometry& geometry = *system_.true_geometry;
  std::vector<bool> is_free(index(system_.mass.size()), true);
  for (int k = 0; k < geometry.num_bodies(); ++k) {
    Body body;
    body.points = geometry.body_frame(k).points();
    for (const int i : body.points) {
      is_free[index(i)] = false;
      body.mass += system_.mass[i];
      body.centre += system_.mass[i] * system_.r.col(i);
    }
    body.centre /= body.mass;
    body.J.setZero();
    for (const int i : body.points) {
      body.arms.push_back(system_.r.col(i) - body.centre);
      body.J -= system_.mass[i] * cross_matrix(body.arms.back()) * cross_matrix(body.arms.back());
    }
    body.inverse = body.J.inverse();
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(body.J);
    body.axes = eigen.eigenvectors();
    if (body.axes.determinant() < 0.0) body.axes.col(0) *= -1.0;
    body.moments = eigen.eigenvalues();
    bodies_.push_back(std::move(body));
  }
  for (std::size_t i = 0; i < is_free.size(); ++i)
    if (is_free[i]) free_.push_back(static_cast<int>(i));
  is_damped_ = geometry.is_damped() || std::ranges::any_of(system_.links, [](const CartesianLink& link) {
                 return link.damping > 0.0;
               });
  has_moments_ = has_body_moments(system_);
  size_ = system_.r.colwise().norm().maxCoeff();
  double stiffest = 0.0;  // [N/m]
  for (const CartesianLink& link : system_.links) stiffest = std::max(stiffest, link.stiffness);
  for (const double stiffness : geometry.stiffnesses()) stiffest = std::max(stiffest, stiffness);
  rate_ = std::sqrt(stiffest / system_.mass.minCoeff());
  for (auto* columns : {&e_, &e_dot_, &force_}) columns->setZero(3, system_.mass.size());
  rotations_.resize(bodies_.size());
  for (auto* values : {&kick_, &x_one_, &v_one_, &f_one_, &f_before_}) values->resize(size());
}

void BodySystem::set_accuracy(double displacement) {
  system_.true_geometry->set_tolerance(displacement / size_);
}

// e_k = e_c + (R - 1) d_k,   e_k' = e_c' + R (w x d_k)
void BodySystem::place(const double* x, const double* v) {
  for (std::size_t k = 0; k < free_.size(); ++k) {
    e_.col(free_[k]) = at3(x + 3 * k);
    if (v != nullptr) e_dot_.col(free_[k]) = at3(v + 3 * k);
  }
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const double* own = x + at(b);
    const Quaterniond q = quaternion(own + 3);
    const Matrix3d less = rotation_less_one(q), R = less + Matrix3d::Identity();
    rotations_[b] = R;
    for (std::size_t k = 0; k < bodies_[b].points.size(); ++k)
      e_.col(bodies_[b].points[k]) = at3(own) + less * bodies_[b].arms[k];
    if (v == nullptr) continue;
    const Vector3d w = twice_rate(q, quaternion(v + at(b) + 3)).vec();
    for (std::size_t k = 0; k < bodies_[b].points.size(); ++k)
      e_dot_.col(bodies_[b].points[k]) = at3(v + at(b)) + R * w.cross(bodies_[b].arms[k]);
  }
}

BodyMoments BodySystem::moments_of(int body, double t, const Matrix3d& R, const Matrix3d& R_CB) const {
  if (!has_moments_) return {};
  return moments_on_body(system_, body, t, piece_time_, R, carrier_rotation(system_, t).transpose(), R_CB);
}

void BodySystem::kicks(double t, const double* x, double* u_dot) {
  place(x, nullptr);
  const auto n = static_cast<std::size_t>(e_.size());
  system_.true_geometry->set_body_rotations(rotations_);
  set_forces(system_, t, piece_time_, {e_.data(), n}, {e_dot_.data(), n}, true, {force_.data(), n});
  if (system_.attractor_mu > 0.0) force_ += attractions(system_, t, e_) * system_.mass.asDiagonal();
  for (std::size_t k = 0; k < free_.size(); ++k)
    at3(u_dot + 3 * k) = force_.col(free_[k]) / system_.mass[free_[k]];
  const Matrix3d R_CB = has_moments_ ? body_rotation(system_, e_) : Matrix3d::Identity();
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Matrix3d& R = rotations_[b];
    Vector3d sum = Vector3d::Zero(),
             moment = R.transpose() * system_.true_geometry->body_moment(static_cast<int>(b));
    for (std::size_t k = 0; k < bodies_[b].points.size(); ++k) {
      const Vector3d force = force_.col(bodies_[b].points[k]);
      sum += force;
      moment += bodies_[b].arms[k].cross(Vector3d(R.transpose() * force));
    }
    moment += moments_of(static_cast<int>(b), t, R, R_CB).load;
    at3(u_dot + at(b)) = sum / bodies_[b].mass;
    at3(u_dot + at(b) + 3) = moment;
    u_dot[at(b) + 6] = 0.0;
  }
}

// J w' = moment - tau a - w x (J w + h),   q'' = q' q^-1 q' + q (0, w') / 2
void BodySystem::accelerate(double t, const double* x, const double* v, const double* u_dot,
                            double* f) const {
  std::copy_n(u_dot, 3 * free_.size(), f);
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const double* own = u_dot + at(b);
    std::copy_n(own, 3, f + at(b));
    const Quaterniond q = quaternion(x + at(b) + 3), q_dot = quaternion(v + at(b) + 3);
    const Quaterniond twice = twice_rate(q, q_dot);
    const Vector3d w = twice.vec();
    const BodyMoments moments =
        moments_of(static_cast<int>(b), t, Matrix3d::Identity(), Matrix3d::Identity());
    const Vector3d w_dot = bodies_[b].inverse * (Vector3d(at3(own + 3)) - moments.motor -
                                                 w.cross(bodies_[b].J * w + moments.momentum));
    Quaterniond second = q_dot * twice;
    second.coeffs() += (q * Quaterniond(0.0, w_dot[0], w_dot[1], w_dot[2])).coeffs();
    second.coeffs() *= 0.5;
    store(second, f + at(b) + 3);
  }
}

void BodySystem::forces(double t, const double* x, const double* v, double* f) {
  if (is_damped_) {
    place(x, v);
  }
  kicks(t, x, kick_.data());
  accelerate(t, x, v, kick_.data(), f);
}

void BodySystem::forces(Pair t, const Pair* x, Pair* f) {
  for (int side = 0; side < 2; ++side) {
    for (std::size_t i = 0; i < size(); ++i) x_one_[i] = x[i][side];
    forces(t[side], x_one_.data(), v_one_.data(), f_one_.data());
    for (std::size_t i = 0; i < size(); ++i) f[i][side] = f_one_[i];
  }
}

void BodySystem::to_momenta(double t, const double* x, const double* v, double* u) const {
  std::copy_n(v, size(), u);
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Vector3d w = twice_rate(quaternion(x + at(b) + 3), quaternion(v + at(b) + 3)).vec();
    at3(u + at(b) + 3) =
        bodies_[b].J * w +
        moments_of(static_cast<int>(b), t, Matrix3d::Identity(), Matrix3d::Identity()).momentum;
    u[at(b) + 6] = 0.0;
  }
}

void BodySystem::from_momenta(double t, const double* x, const double* u, double* v) const {
  std::copy_n(u, size(), v);
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Vector3d h =
        moments_of(static_cast<int>(b), t, Matrix3d::Identity(), Matrix3d::Identity()).momentum;
    const Vector3d half = 0.5 * bodies_[b].inverse * (Vector3d(at3(u + at(b) + 3)) - h);
    store(quaternion(x + at(b) + 3) * Quaterniond(0.0, half[0], half[1], half[2]), v + at(b) + 3);
  }
}

void BodySystem::drift(double t, double h, double* x, double* u) const {
  for (std::size_t i = 0; i < 3 * free_.size(); ++i) x[i] += h * u[i];
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Body& body = bodies_[b];
    double *own = x + at(b), *momentum = u + at(b) + 3;
    at3(own) += h * at3(u + at(b));
    Quaterniond q = quaternion(own + 3);
    Vector3d L = body.axes.transpose() * at3(momentum);
    const Vector3d wheels =
        body.axes.transpose() *
        moments_of(static_cast<int>(b), t, Matrix3d::Identity(), Matrix3d::Identity()).momentum;
    constexpr std::array kAxes{0, 1, 2, 1, 0};
    for (const int axis : kAxes) {
      const double angle = (axis == 2 ? h : 0.5 * h) * (L[axis] - wheels[axis]) / body.moments[axis];
      const double half = 0.5 * angle, sine = std::sin(half), cosine = std::cos(half);
      const Vector3d along = sine * body.axes.col(axis);
      q = q * Quaterniond(cosine, along[0], along[1], along[2]);
      const int y = (axis + 1) % 3, z = (axis + 2) % 3;
      const double s = 2.0 * sine * cosine, c = 1.0 - 2.0 * sine * sine, L_y = L[y];
      L[y] = c * L_y + s * L[z];
      L[z] = c * L[z] - s * L_y;
    }
    store(q, own + 3);
    at3(momentum) = body.axes * L;
  }
}

SparsePattern BodySystem::make_pattern() {
  const auto n = static_cast<std::int64_t>(size());
  SparsePattern pattern;
  for (std::int64_t c = 0; c < 2 * n; ++c) {
    pattern.column_starts.push_back(static_cast<std::int64_t>(pattern.rows.size()));
    pattern.rows.push_back(c < n ? c : c - n);
    for (std::int64_t row = n; row < 2 * n; ++row) pattern.rows.push_back(row);
  }
  pattern.column_starts.push_back(static_cast<std::int64_t>(pattern.rows.size()));
  return pattern;
}

void BodySystem::jacobian(const double* x, const double* v, std::span<double> values) {
  constexpr double kDifference = 1e-7;  // [-]
  const std::size_t n = size();
  std::copy_n(x, n, x_one_.begin());
  std::copy_n(v, n, v_one_.begin());
  forces(piece_time_, x, v, f_before_.data());
  auto value = values.begin();
  const auto add_column = [&](double& variable, double difference) {
    const double before = std::exchange(variable, variable + difference);
    forces(piece_time_, x_one_.data(), v_one_.data(), f_one_.data());
    variable = before;
    for (std::size_t i = 0; i < n; ++i) *value++ = (f_one_[i] - f_before_[i]) / difference;
  };
  const auto scale = [&](std::size_t c) {
    return c >= at(0) && (c - at(0)) % 7 >= 3 ? kDifference : kDifference * size_;
  };
  for (std::size_t c = 0; c < n; ++c) {
    *value++ = 0.0;
    add_column(x_one_[c], scale(c));
  }
  for (std::size_t c = 0; c < n; ++c) {
    *value++ = 1.0;
    add_column(v_one_[c], scale(c) * rate_);
  }
  std::fill(v_one_.begin(), v_one_.end(), 0.0);
}

void BodySystem::initial(std::span<double> x, std::span<double> v) const {
  const Eigen::Index n = system_.mass.size();
  const Map<const Matrix3Xd> e(system_.initial.data(), 3, n), e_dot(system_.initial.data() + 3 * n, 3, n);
  for (std::size_t k = 0; k < free_.size(); ++k) {
    at3(x.data() + 3 * k) = e.col(free_[k]);
    at3(v.data() + 3 * k) = e_dot.col(free_[k]);
  }
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Body& body = bodies_[b];
    Vector3d p = Vector3d::Zero(), v_c = p, L = p;
    for (const int i : body.points)
      p += system_.mass[i] / body.mass * e.col(i), v_c += system_.mass[i] / body.mass * e_dot.col(i);
    const FittedFrame::Fit fit = system_.true_geometry->body_frame(static_cast<int>(b)).fit(system_.r + e);
    for (std::size_t k = 0; k < body.points.size(); ++k)
      L += system_.mass[body.points[k]] *
           body.arms[k].cross(Vector3d(fit.R.transpose() * (e_dot.col(body.points[k]) - v_c)));
    at3(x.data() + at(b)) = p;
    at3(v.data() + at(b)) = v_c;
    const Quaterniond q(fit.R);
    const Vector3d half = 0.5 * body.inverse * L;
    store(q, x.data() + at(b) + 3);
    store(q * Quaterniond(0.0, half[0], half[1], half[2]), v.data() + at(b) + 3);
  }
}

void BodySystem::to_world(double t, std::span<const double> x, std::span<const double> v,
                          CartesianState& state) const {
  BodySystem& self = const_cast<BodySystem&>(*this);  // work arrays
  self.place(x.data(), v.data());
  const Matrix3d R = system_.q_WB.toRotationMatrix();
  const Vector3d p = system_.p_WB + t * system_.v_WB + 0.5 * t * t * system_.gravity_W;
  state.time = t;
  state.p_W = (R * (system_.r + e_)).colwise() + p;
  state.v_W = (R * e_dot_).colwise() + Vector3d(system_.v_WB + t * system_.gravity_W);
  if (!is_damped_) self.e_dot_.setZero();
}

std::size_t BodySystem::memory() const {
  return system_.links.size() * sizeof(CartesianLink) + system_.true_geometry->memory() +
         (4 * size() + static_cast<std::size_t>(3 * e_.size())) * sizeof(double);
}

}  // namespace freeflex
