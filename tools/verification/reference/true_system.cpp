#include "tools/verification/reference/true_system.hpp"

#include <algorithm>
#include <cmath>

namespace freeflex {
namespace {

using Eigen::Map;
using Eigen::Matrix3Xd;

/// Returns the system in a carrier that does not rotate: e' of the rotating carrier becomes
/// e' + w_C x (r + e)   (THEORY 10.1).
CartesianSystem without_spin(CartesianSystem system) {
  const Eigen::Index n = system.mass.size();
  Map<Matrix3Xd> e(system.initial.data(), 3, n), e_dot(system.initial.data() + 3 * n, 3, n);
  for (Eigen::Index i = 0; i < n; ++i)
    e_dot.col(i) += system.spin.cross(Eigen::Vector3d(system.r.col(i) + e.col(i)));
  system.spin.setZero();
  return system;
}

}  // namespace

TrueSystem::TrueSystem(const CartesianSystem& system)
    : SecondOrderSystem(system), systems_{without_spin(system), without_spin(system)} {
  const auto is_damped = [](const CartesianLink& link) { return link.damping > 0.0; };
  const auto& geometry = system.true_geometry;
  depends_on_velocities_ = std::any_of(system.links.begin(), system.links.end(), is_damped) ||
                           (geometry && geometry->depends_on_velocities()) ||
                           static_cast<bool>(system.change_forces);
  for (auto* values : {&x_one_, &v_one_, &f_one_, &f_before_}) values->resize(size());
  size_ = system.r.colwise().norm().maxCoeff();
  double stiffest = 0.0;  // [N/m]
  for (const CartesianLink& link : system.links) stiffest = std::max(stiffest, link.stiffness);
  if (geometry)
    for (const double stiffness : geometry->stiffnesses()) stiffest = std::max(stiffest, stiffness);
  velocity_ = size_ * std::sqrt(stiffest / system.mass.minCoeff());
}

void TrueSystem::begin_piece(double start, double end) { piece_time_ = 0.5 * (start + end); }

// an error of a rotation moves points by at most this error times the size of the structure
void TrueSystem::set_accuracy(double displacement) {
  for (CartesianSystem& system : systems_)
    if (system.true_geometry) system.true_geometry->set_tolerance(displacement / size_);
}

void TrueSystem::forces_of(CartesianSystem& system, double t, const double* x, const double* v,
                           double* f) const {
  const std::size_t n = size();
  accelerations(system, t, piece_time_, {x, n}, {v, n}, {f, n});
  for (std::size_t i = 0; i < n; ++i) f[i] *= system.mass[static_cast<Eigen::Index>(i / 3)];
}

void TrueSystem::forces(double t, const double* x, const double* v, double* f) {
  forces_of(systems_[0], t, x, v, f);
}

void TrueSystem::forces(Pair t, const Pair* x, Pair* f) {
  for (int side = 0; side < 2; ++side) {
    for (std::size_t i = 0; i < size(); ++i) x_one_[i] = x[i][side];
    forces_of(systems_[static_cast<std::size_t>(side)], t[side], x_one_.data(), v_one_.data(), f_one_.data());
    for (std::size_t i = 0; i < size(); ++i) f[i][side] = f_one_[i];
  }
}

SparsePattern TrueSystem::make_pattern() {
  const auto n = static_cast<std::int64_t>(size());
  SparsePattern pattern;
  const auto begin_column = [&] {
    pattern.column_starts.push_back(static_cast<std::int64_t>(pattern.rows.size()));
  };
  for (std::int64_t c = 0; c < 2 * n; ++c) {
    begin_column();
    pattern.rows.push_back(c < n ? c : c - n);
    if (c < n || depends_on_velocities_)
      for (std::int64_t row = n; row < 2 * n; ++row) pattern.rows.push_back(row);
    else
      pattern.rows.push_back(c);
  }
  begin_column();
  return pattern;
}

void TrueSystem::jacobian(const double* x, const double* v, std::span<double> values) {
  constexpr double kDifference = 1e-7;  // [-] fraction of the size of the structure
  std::fill(values.begin(), values.end(), 0.0);
  const std::size_t n = size();
  std::copy_n(x, n, x_one_.begin());
  std::copy_n(v, n, v_one_.begin());
  forces(piece_time_, x, v, f_before_.data());
  auto value = values.begin();
  const auto add_column = [&](double& variable, double difference) {
    const double before = std::exchange(variable, variable + difference);
    forces(piece_time_, x_one_.data(), v_one_.data(), f_one_.data());
    variable = before;
    for (std::size_t i = 0; i < n; ++i)
      *value++ = inverse_mass()[i] * (f_one_[i] - f_before_[i]) / difference;
  };
  for (std::size_t c = 0; c < n; ++c) {
    *value++ = 0.0;
    add_column(x_one_[c], kDifference * size_);
  }
  for (std::size_t c = 0; c < n; ++c) {
    *value++ = 1.0;
    if (depends_on_velocities_)
      add_column(v_one_[c], kDifference * velocity_);
    else
      *value++ = 0.0;
  }
  std::fill(v_one_.begin(), v_one_.end(), 0.0);
}

void TrueSystem::initial(std::span<double> x, std::span<double> v) const {
  const Eigen::VectorXd& start = systems_[0].initial;
  std::copy_n(start.data(), x.size(), x.begin());
  std::copy_n(start.data() + x.size(), v.size(), v.begin());
}

void TrueSystem::to_world(double t, std::span<const double> x, std::span<const double> v,
                          CartesianState& state) const {
  const CartesianSystem& system = systems_[0];
  const Eigen::Index n = system.mass.size();
  const Eigen::Matrix3d R = system.q_WB.toRotationMatrix();
  const Eigen::Vector3d p = system.p_WB + t * system.v_WB + 0.5 * t * t * system.gravity_W;
  const Eigen::Vector3d v_fall = system.v_WB + t * system.gravity_W;
  state.time = t;
  state.p_W.resize(3, n);
  state.v_W.resize(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    state.p_W.col(i) = p + R * (system.r.col(i) + Map<const Eigen::Vector3d>(x.data() + 3 * i));
    state.v_W.col(i) = v_fall + R * Map<const Eigen::Vector3d>(v.data() + 3 * i);
  }
}

std::size_t TrueSystem::memory() const {
  const CartesianSystem& system = systems_[0];
  const std::size_t links = system.links.size() * sizeof(CartesianLink) +
                            (system.true_geometry ? system.true_geometry->memory() : 0);
  return 2 * (links + 4 * size() * sizeof(double));
}

}  // namespace freeflex
