#include "tools/verification/reference/spring_network.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/step/array.hpp"
#include "tools/verification/reference/elastic_error.hpp"

namespace freeflex {
namespace {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

/// Returns whether the forces of the load are constant vectors in world axes, except for jumps at the edges
/// of its pulse.
bool is_piecewise_constant(const CartesianLoad& load) {
  const bool has_constant_amplitude =
      std::visit(Cases{[](const ConstantHistory&) { return true; }, [](const PulseHistory&) { return true; },
                       [](const SineHistory&) { return false; }, [](const TableHistory&) { return false; }},
                 load.history);
  return has_constant_amplitude && load.axes == Axes::kWorld && load.torques.empty();
}

double root(double square) { return std::sqrt(square); }
Pair root(Pair square) { return Pair{std::sqrt(square[0]), std::sqrt(square[1])}; }

}  // namespace

std::unique_ptr<SpringNetwork> SpringNetwork::make(const CartesianSystem& system, std::string& error) {
  if (system.attractor_mu > 0.0) {
    error = "these methods do not support an attractor";
    return nullptr;
  }
  std::unique_ptr<SpringNetwork> network(new SpringNetwork(system));
  for (const CartesianLink& link : system.links) {
    if (link.damping > 0.0) {
      error = "these methods support springs and bars only, without dissipation";
      return nullptr;
    }
    network->ends_.push_back({3 * link.first, 3 * link.second});
    network->stiffness_.push_back(link.stiffness);
    network->stiffness_length_.push_back(link.stiffness * link.length);
  }
  for (auto* values : {&network->constant_, &network->x_one_, &network->f_one_})
    values->resize(network->size());
  return network;
}

void SpringNetwork::begin_piece(double start, double end) {
  piece_time_ = 0.5 * (start + end);
  std::fill(constant_.begin(), constant_.end(), 0.0);
  varying_.clear();
  for (const CartesianLoad& load : system_->loads) {
    if (!is_piecewise_constant(load)) {
      varying_.push_back(&load);
      continue;
    }
    const double scale = amplitude(load.history, piece_time_, piece_time_);
    for (const PointLoad& item : load.forces)
      for (std::int32_t a = 0; a < 3; ++a) constant_[index(3 * item.point + a)] += scale * item.force[a];
  }
}

void SpringNetwork::add_varying(double t, const double* x, double* f) const {
  Map<Matrix3Xd> force(f, 3, system_->mass.size());
  Matrix3d R_WB = Matrix3d::Identity();
  if (system_->needs_body_axes) {
    const Map<const Matrix3Xd> X(x, 3, system_->mass.size());
    const Vector3d centre = X * system_->mass / system_->mass.sum();
    R_WB = fit_rotation(system_->mass, system_->r, X.colwise() - centre);
  }
  for (const CartesianLoad* load : varying_)
    add_load(*load, amplitude(load->history, t, piece_time_), Matrix3d::Identity(), R_WB, force);
}

template <typename Number>
void SpringNetwork::add_springs(const Number* x, Number* f) const {
  const std::size_t count = ends_.size();
  const End* ends = ends_.data();
  const double *k = stiffness_.data(), *kL = stiffness_length_.data();
  for (std::size_t s = 0; s < count; ++s) {
    const Number *x1 = x + ends[s].first, *x2 = x + ends[s].second;
    Number *f1 = f + ends[s].first, *f2 = f + ends[s].second;
    const Number d0 = x2[0] - x1[0], d1 = x2[1] - x1[1], d2 = x2[2] - x1[2];
    // tension over length, D (l - L) / l; k is D   (THEORY 13.1)
    const Number pull = k[s] - kL[s] / root(d0 * d0 + d1 * d1 + d2 * d2);
    const Number p0 = pull * d0, p1 = pull * d1, p2 = pull * d2;
    f1[0] += p0;
    f1[1] += p1;
    f1[2] += p2;
    f2[0] -= p0;
    f2[1] -= p1;
    f2[2] -= p2;
  }
}

void SpringNetwork::forces(double t, const double* x, const double*, double* f) {
  std::copy(constant_.begin(), constant_.end(), f);
  add_springs(x, f);
  if (!varying_.empty()) add_varying(t, x, f);
}

void SpringNetwork::forces(Pair t, const Pair* x, Pair* f) {
  for (std::size_t i = 0; i < constant_.size(); ++i) f[i] = Pair{constant_[i], constant_[i]};
  add_springs(x, f);
  if (varying_.empty()) return;
  for (int side = 0; side < 2; ++side) {
    for (std::size_t i = 0; i < x_one_.size(); ++i) x_one_[i] = x[i][side];
    std::fill(f_one_.begin(), f_one_.end(), 0.0);
    add_varying(t[side], x_one_.data(), f_one_.data());
    for (std::size_t i = 0; i < f_one_.size(); ++i) f[i][side] += f_one_[i];
  }
}

SparsePattern SpringNetwork::make_pattern() {
  const std::size_t num_points = size() / 3;
  std::vector<std::set<std::int32_t>> neighbours(num_points);
  for (std::size_t i = 0; i < num_points; ++i) neighbours[i].insert(static_cast<std::int32_t>(i));
  for (const End& end : ends_) {
    neighbours[index(end.first / 3)].insert(end.second / 3);
    neighbours[index(end.second / 3)].insert(end.first / 3);
  }
  SparsePattern pattern;
  const auto n = static_cast<std::int64_t>(size());
  column_sizes_.clear();
  std::vector<std::int64_t> starts;  // index of the first entry of each point
  for (std::size_t j = 0; j < num_points; ++j) {
    starts.push_back(static_cast<std::int64_t>(pattern.rows.size()));
    column_sizes_.push_back(1 + 3 * static_cast<std::int64_t>(neighbours[j].size()));
    for (std::int64_t b = 0; b < 3; ++b) {
      pattern.column_starts.push_back(static_cast<std::int64_t>(pattern.rows.size()));
      pattern.rows.push_back(3 * static_cast<std::int64_t>(j) + b);
      for (const std::int64_t i : neighbours[j])
        for (std::int64_t a = 0; a < 3; ++a) pattern.rows.push_back(n + 3 * i + a);
    }
  }
  velocity_columns_ = static_cast<std::int64_t>(pattern.rows.size());
  for (std::int64_t c = 0; c < n; ++c) {
    pattern.column_starts.push_back(static_cast<std::int64_t>(pattern.rows.size()));
    pattern.rows.insert(pattern.rows.end(), {c, n + c});
  }
  pattern.column_starts.push_back(static_cast<std::int64_t>(pattern.rows.size()));
  blocks_.clear();
  for (const End& end : ends_) {
    const std::int32_t i = end.first / 3, j = end.second / 3;
    const auto start = [&](std::int32_t row, std::int32_t column) {
      const auto& set = neighbours[index(column)];
      return starts[index(column)] + 1 + 3 * std::distance(set.begin(), set.find(row));
    };
    blocks_.push_back({start(i, i), start(j, i), start(i, j), start(j, j)});
  }
  return pattern;
}

void SpringNetwork::jacobian(const double* x, const double*, std::span<double> values) {
  std::fill(values.begin(), values.end(), 0.0);
  for (std::size_t s = 0; s < ends_.size(); ++s) {
    const auto [first, second] = ends_[s];
    const Vector3d d(x[second] - x[first], x[second + 1] - x[first + 1], x[second + 2] - x[first + 2]);
    const double l = d.norm(), kL_over_l = stiffness_length_[s] / l;
    const Matrix3d S =
        (stiffness_[s] - kL_over_l) * Matrix3d::Identity() + kL_over_l / (l * l) * d * d.transpose();
    const auto add = [&](std::int64_t start, std::int32_t row, std::int32_t column, double sign) {
      const double weight = sign * inverse_mass()[index(row)];
      const std::int64_t stride = column_sizes_[index(column / 3)];
      for (std::int64_t b = 0; b < 3; ++b)
        for (std::int64_t a = 0; a < 3; ++a) values[index(start + b * stride + a)] += weight * S(a, b);
    };
    add(blocks_[s][0], first, first, -1.0);
    add(blocks_[s][1], second, first, 1.0);
    add(blocks_[s][2], first, second, 1.0);
    add(blocks_[s][3], second, second, -1.0);
  }
  for (std::size_t k = index(velocity_columns_); k < values.size(); k += 2) values[k] = 1.0;
}

void SpringNetwork::initial(std::span<double> x, std::span<double> v) const {
  const Eigen::Index n = system_->mass.size();
  const CartesianState start = freeflex::to_world(*system_, 0.0, {system_->initial.data(), index(6 * n)});
  Map<Matrix3Xd>(x.data(), 3, n) = start.p_W.colwise() - system_->p_WB;
  Map<Matrix3Xd>(v.data(), 3, n) = start.v_W.colwise() - system_->v_WB;
}

void SpringNetwork::to_world(double t, std::span<const double> x, std::span<const double> v,
                             CartesianState& state) const {
  const Eigen::Index n = system_->mass.size();
  const Vector3d p = system_->p_WB + t * system_->v_WB + 0.5 * t * t * system_->gravity_W;
  const Vector3d v_fall = system_->v_WB + t * system_->gravity_W;
  state.time = t;
  state.p_W = Map<const Matrix3Xd>(x.data(), 3, n).colwise() + p;
  state.v_W = Map<const Matrix3Xd>(v.data(), 3, n).colwise() + v_fall;
}

std::size_t SpringNetwork::memory() const {
  return ends_.size() * (sizeof(End) + 2 * sizeof(double)) + 2 * size() * sizeof(double);
}

}  // namespace freeflex
