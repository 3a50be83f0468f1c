#include "tools/verification/reference/cartesian.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "tools/verification/reference/elastic_error.hpp"

namespace freeflex {
namespace {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

/// Adds the forces of springs, bars and dashpots along their true directions. An undeformed link from point i
/// to point j has the length L [m] and the direction u   (THEORY 10.2, 10.3, 10.5):
///   d = e_j - e_i,   l = |L u + d|,   elongation = (2 L u.d + |d|^2) / (l + L)
///   s = D elongation + c l',   l' = (L u + d).d' / l;   a tension s pulls i along (L u + d) / l towards j
void add_link_forces(const CartesianSystem& system, std::span<const double> e, std::span<const double> e_dot,
                     std::span<double> force) {
  for (const CartesianLink& link : system.links) {
    const auto i = 3 * index(link.first);
    const auto j = 3 * index(link.second);
    double d[3], x[3];
    double rest_d = 0.0, d_d = 0.0, x_x = 0.0;
    for (std::size_t a = 0; a < 3; ++a) {
      d[a] = e[j + a] - e[i + a];
      x[a] = link.rest[static_cast<Eigen::Index>(a)] + d[a];
      rest_d += link.rest[static_cast<Eigen::Index>(a)] * d[a];
      d_d += d[a] * d[a];
      x_x += x[a] * x[a];
    }
    const double l = std::sqrt(x_x);
    // this form of the elongation has no difference of lengths, so no digits are lost
    double tension = link.stiffness * (2.0 * rest_d + d_d) / (l + link.length);
    if (link.damping > 0.0) {
      double rate = 0.0;
      for (std::size_t a = 0; a < 3; ++a) rate += x[a] * (e_dot[j + a] - e_dot[i + a]);
      tension += link.damping * rate / l;
    }
    const double tension_over_l = tension / l;
    for (std::size_t a = 0; a < 3; ++a) {
      force[i + a] += tension_over_l * x[a];
      force[j + a] -= tension_over_l * x[a];
    }
  }
}

// [m/s^2] g(p) = -mu (p - p_A) / |p - p_A|^3   (THEORY 10.7)
Vector3d attraction(const CartesianSystem& system, const Vector3d& p_W) {
  const Vector3d rho = p_W - system.attractor_W;
  return -system.attractor_mu / std::pow(rho.norm(), 3) * rho;
}

}  // namespace

Matrix3d carrier_rotation(const CartesianSystem& system, double t) {
  const double rate = system.spin.norm();
  if (rate == 0.0) return system.q_WB.toRotationMatrix();
  const Eigen::AngleAxisd rotation(rate * t, system.spin / rate);
  return system.q_WB.toRotationMatrix() * rotation.toRotationMatrix();
}

double amplitude(const History& history, double t, double piece_time) {
  return std::visit(
      Cases{[](const ConstantHistory&) { return 1.0; },
            [&](const PulseHistory& pulse) {
              return piece_time >= pulse.start && piece_time < pulse.start + pulse.duration ? 1.0 : 0.0;
            },
            [&](const SineHistory& sine) { return std::sin(2.0 * M_PI * sine.frequency * t + sine.phase); },
            [&](const TableHistory& table) {
              const auto& [times, values] = table;
              if (t <= times.front()) return values.front();
              if (t >= times.back()) return values.back();
              const auto next = index(std::upper_bound(times.begin(), times.end(), t) - times.begin());
              const double share = (t - times[next - 1]) / (times[next] - times[next - 1]);
              return values[next - 1] + share * (values[next] - values[next - 1]);
            }},
      history);
}

void add_load(const CartesianLoad& load, double scale, const Matrix3d& R_CW, const Matrix3d& R_CB,
              Map<Matrix3Xd>& force) {
  const Matrix3d& R = load.axes == Axes::kWorld ? R_CW : R_CB;
  for (const PointLoad& item : load.forces) force.col(item.point) += scale * (R * item.force);
  for (const auto& torque : load.torques) {
    // the torque is rotated into body axes, and the force on each point is rotated from body axes into
    // carrier axes
    const Vector3d torque_B = scale * (R_CB.transpose() * (R * torque.torque));
    for (std::size_t k = 0; k < torque.points.size(); ++k) {
      force.col(torque.points[k]) += R_CB * (torque.force_per_torque[k] * torque_B);
    }
  }
}

double impulse(const History& history, double t, double piece_time) {
  return std::visit(
      Cases{[&](const ConstantHistory&) { return t; },
            [&](const PulseHistory& pulse) {
              if (piece_time < pulse.start) return 0.0;
              return piece_time < pulse.start + pulse.duration ? t - pulse.start : pulse.duration;
            },
            [&](const SineHistory& sine) {
              const double rate = 2.0 * M_PI * sine.frequency;
              return (std::cos(sine.phase) - std::cos(rate * t + sine.phase)) / rate;
            },
            [&](const TableHistory& table) {
              // the amplitude is linear between the rows, so trapezoids are exact
              double sum = 0.0, from = 0.0;
              for (const double time : table.times) {
                const double to = std::clamp(time, 0.0, t);
                sum += 0.5 * (to - from) * (amplitude(history, from, from) + amplitude(history, to, to));
                from = to;
              }
              return sum + (t - from) * amplitude(history, t, t);
            }},
      history);
}

bool has_body_moments(const CartesianSystem& system) {
  return !system.wheels.empty() || std::ranges::any_of(system.loads, [](const CartesianLoad& load) {
    return !load.body_torques.empty();
  });
}

BodyMoments moments_on_body(const CartesianSystem& system, int body, double t, double piece_time,
                            const Matrix3d& R, const Matrix3d& R_CW, const Matrix3d& R_CB) {
  BodyMoments moments;
  for (const CartesianWheel& wheel : system.wheels)
    if (wheel.body == body) moments.momentum += wheel.momentum * wheel.axis;
  for (const CartesianLoad& load : system.loads) {
    for (const auto& [wheel, torque] : load.wheel_torques) {
      const CartesianWheel& on = system.wheels[index(wheel)];
      if (on.body != body) continue;
      moments.momentum += torque * impulse(load.history, t, piece_time) * on.axis;
      moments.motor += torque * amplitude(load.history, t, piece_time) * on.axis;
    }
    for (const auto& [on, torque] : load.body_torques) {
      if (on != body) continue;
      const Matrix3d& axes = load.axes == Axes::kWorld ? R_CW : load.axes == Axes::kBody ? R_CB : R;
      moments.load += amplitude(load.history, t, piece_time) * (R.transpose() * (axes * torque));
    }
  }
  return moments;
}

Matrix3d body_rotation(const CartesianSystem& system, const Eigen::Ref<const Matrix3Xd>& e) {
  if (!system.needs_body_axes) return Matrix3d::Identity();
  const Vector3d mean = e * system.mass / system.mass.sum();
  return fit_rotation(system.mass, system.r, (system.r + e).colwise() - mean);
}

namespace {

/// Adds the moments of wheels and loads on bodies as forces on their points   (THEORY 10.29):
///   L = T - tau a - w x (h a)
void add_body_moments(const CartesianSystem& system, double t, double piece_time, const Matrix3Xd& E,
                      const Matrix3Xd& E_dot, const Matrix3d& R_CW, const Matrix3d& R_CB,
                      Map<Matrix3Xd>& force) {
  Matrix3Xd v = E_dot;
  for (Eigen::Index i = 0; i < v.cols(); ++i)
    v.col(i) += system.spin.cross(Vector3d(system.r.col(i) + E.col(i)));
  for (int body = 0; body < system.true_geometry->num_bodies(); ++body) {
    const FittedFrame& frame = system.true_geometry->body_frame(body);
    if (frame.points().size() < 3) continue;
    const FittedFrame::Fit fit = frame.fit(system.r + E);
    const BodyMoments moments = moments_on_body(system, body, t, piece_time, fit.R, R_CW, R_CB);
    frame.add_moment(fit, moments.load - moments.motor - frame.spin(fit, v).cross(moments.momentum), force);
  }
}

}  // namespace

void set_forces(const CartesianSystem& system, double t, double piece_time, std::span<const double> e,
                std::span<const double> e_dot, bool leaves_moments, std::span<double> result) {
  const Eigen::Index n = system.mass.size();
  const Map<const Matrix3Xd> E(e.data(), 3, n), E_dot(e_dot.data(), 3, n);
  Map<Matrix3Xd> force(result.data(), 3, n);
  force.setZero();
  add_link_forces(system, e, e_dot, result);
  if (system.true_geometry) {
    system.true_geometry->add_forces(E, force);
    system.true_geometry->add_damping(E, E_dot, force);
  }
  if (!system.loads.empty() || !system.wheels.empty()) {
    const Matrix3d R_CW = carrier_rotation(system, t).transpose(), R_CB = body_rotation(system, E);
    for (const CartesianLoad& load : system.loads) {
      const double scale = amplitude(load.history, t, piece_time);
      if (scale == 0.0) continue;
      if (load.axes == Axes::kLocal)
        system.true_geometry->add_followers(load.forces, scale, E, force);
      else
        add_load(load, scale, R_CW, R_CB, force);
    }
    if (!leaves_moments && has_body_moments(system))
      add_body_moments(system, t, piece_time, E, E_dot, R_CW, R_CB, force);
  }
  if (system.change_forces) {
    const Matrix3Xd x = system.r + E;
    Matrix3Xd v = E_dot;
    for (Eigen::Index i = 0; i < n; ++i) v.col(i) += system.spin.cross(Vector3d(x.col(i)));
    system.change_forces(t, x, v, force);
  }
}

void place_massless(const CartesianSystem& system, double t, double piece_time, std::span<double> e) {
  constexpr int kMost = 60;  // steps
  // [-] over the size: of the differences; of the last step; of a step for which a new inverse is not worth
  // it
  constexpr double kDifference = 1e-7, kLast = 1e-15, kWorth = 1e-10;
  constexpr double kLongest = 0.05;  // [-] longer steps are shortened, over the size
  constexpr double kSlow = 0.05;     // [-] the inverse is renewed after a step that is longer than this share
  CartesianMassless& held = system.massless;
  if (held.points.empty()) return;
  const Eigen::Index count = 3 * static_cast<Eigen::Index>(held.points.size());
  const double size = system.r.colwise().norm().maxCoeff();
  const std::vector<double> e_dot(e.size(), 0.0);
  std::vector<double> force(e.size());
  if (held.e.size() != count || !held.e.allFinite()) held.e = Eigen::VectorXd::Zero(count);
  const auto forces_at = [&](const Eigen::VectorXd& x) {
    Eigen::VectorXd f(count);
    for (Eigen::Index k = 0; k < count; ++k) e[3 * index(held.points[index(k / 3)]) + index(k % 3)] = x[k];
    set_forces(system, t, piece_time, e, e_dot, false, force);
    for (Eigen::Index k = 0; k < count; ++k)
      f[k] = force[3 * index(held.points[index(k / 3)]) + index(k % 3)];
    return f;
  };
  double last = 0.0;
  bool is_slow = false;
  for (int step = 0; step < kMost; ++step) {
    const Eigen::VectorXd f = forces_at(held.e);
    if (held.inverse.cols() != count || is_slow) {
      Eigen::MatrixXd K(count, count);
      for (Eigen::Index k = 0; k < count; ++k)
        K.col(k) = (forces_at(held.e - kDifference * size * Eigen::VectorXd::Unit(count, k)) - f) /
                   (kDifference * size);
      held.inverse = K.inverse();
    }
    Eigen::VectorXd change = held.inverse * f;
    const double length = change.cwiseAbs().maxCoeff();
    if (length > kLongest * size) change *= kLongest * size / length;
    held.e += change;
    if (length <= kLast * size || (step > 0 && length < kWorth * size && length > 0.5 * last)) {
      forces_at(held.e);
      return;
    }
    is_slow = (step > 0 || length > kLongest * size) && length > kWorth * size && length > kSlow * last;
    last = length;
  }
  forces_at(Eigen::VectorXd::Constant(count, std::nan("")));
}

// The carrier falls with the constant acceleration g_W, which is the attraction at the start. So each point
// accelerates relative to the carrier by its own attraction minus g_W:
//   e'' += R_WC^T (g(p_W,i) - g_W)   (THEORY 10.7)
Matrix3Xd attractions(const CartesianSystem& system, double t, const Eigen::Ref<const Matrix3Xd>& e) {
  const Matrix3d R_WC = carrier_rotation(system, t);
  const Vector3d p_WC = system.p_WB + t * system.v_WB + 0.5 * t * t * system.gravity_W;
  Matrix3Xd result(3, e.cols());
  for (Eigen::Index i = 0; i < e.cols(); ++i)
    result.col(i) = R_WC.transpose() *
                    (attraction(system, p_WC + R_WC * (system.r.col(i) + e.col(i))) - system.gravity_W);
  return result;
}

void accelerations(const CartesianSystem& system, double t, double piece_time, std::span<const double> given,
                   std::span<const double> e_dot, std::span<double> e_ddot) {
  std::vector<double> placed;
  std::span<const double> e = given;
  if (!system.massless.points.empty()) {
    placed.assign(given.begin(), given.end());
    place_massless(system, t, piece_time, placed);
    e = placed;
  }
  set_forces(system, t, piece_time, e, e_dot, false, e_ddot);
  const Eigen::Index n = system.mass.size();
  const Map<const Matrix3Xd> E(e.data(), 3, n), E_dot(e_dot.data(), 3, n);
  Map<Matrix3Xd> force(e_ddot.data(), 3, n);
  for (Eigen::Index i = 0; i < n; ++i)
    if (system.mass[i] > 0.0) force.col(i) /= system.mass[i];
  if (system.attractor_mu > 0.0) force += attractions(system, t, E);
  // Coriolis and centrifugal acceleration in the rotating carrier   (THEORY 10.6)
  for (Eigen::Index i = 0; i < n && !system.spin.isZero(0.0); ++i) {
    const Vector3d x = system.r.col(i) + E.col(i);
    force.col(i) -= system.spin.cross(2.0 * Vector3d(E_dot.col(i)) + system.spin.cross(x));
  }
  if (system.true_geometry) system.true_geometry->constrain(E, E_dot, force);
  for (const int point : system.massless.points) force.col(point).setZero();
}

std::vector<double> discontinuities(const CartesianSystem& system, double end) {
  std::vector<double> times;
  for (const CartesianLoad& load : system.loads) {
    std::visit(Cases{[](const ConstantHistory&) {}, [](const SineHistory&) {},
                     [&](const PulseHistory& pulse) {
                       times.insert(times.end(), {pulse.start, pulse.start + pulse.duration});
                     },
                     [&](const TableHistory& table) {
                       times.insert(times.end(), table.times.begin(), table.times.end());
                     }},
               load.history);
  }
  std::erase_if(times, [end](double t) { return t <= 0.0 || t >= end; });
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

CartesianState to_world(const CartesianSystem& system, double t, std::span<const double> given) {
  const Eigen::Index n = system.mass.size();
  std::vector<double> y(given.begin(), given.end());
  place_massless(system, t, t, std::span(y).first(3 * index(n)));
  const Map<const Matrix3Xd> E(y.data(), 3, n), E_dot(y.data() + 3 * n, 3, n);
  const Matrix3d R = carrier_rotation(system, t);
  const Vector3d p = system.p_WB + t * system.v_WB + 0.5 * t * t * system.gravity_W;
  const Vector3d v = system.v_WB + t * system.gravity_W;
  CartesianState state{t, Matrix3Xd(3, n), Matrix3Xd(3, n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector3d x = system.r.col(i) + E.col(i);
    state.p_W.col(i) = p + R * x;
    state.v_W.col(i) = v + R * (E_dot.col(i) + system.spin.cross(x));
  }
  return state;
}

double strain_energy(const CartesianSystem& system, std::span<const double> given) {
  std::vector<double> e(given.begin(), given.end());
  place_massless(system, 0.0, 0.0, e);
  const Map<const Matrix3Xd> E(e.data(), 3, system.mass.size());
  double energy = 0.0;
  for (const CartesianLink& link : system.links) {
    const Vector3d d = E.col(link.second) - E.col(link.first);
    const double elongation =
        (2.0 * link.rest.dot(d) + d.squaredNorm()) / ((link.rest + d).norm() + link.length);
    energy += 0.5 * link.stiffness * elongation * elongation;
  }
  if (system.true_geometry) {
    Matrix3Xd unused = Matrix3Xd::Zero(3, E.cols());
    energy += system.true_geometry->add_forces(E, unused);
  }
  return energy;
}

CartesianInvariants invariants(const CartesianSystem& system, const CartesianState& state) {
  CartesianInvariants sum;
  const Vector3d centre = state.p_W * system.mass / system.mass.sum();
  for (Eigen::Index i = 0; i < system.mass.size(); ++i) {
    const Vector3d momentum = system.mass[i] * state.v_W.col(i);
    sum.kinetic += 0.5 * momentum.dot(state.v_W.col(i));
    sum.linear_momentum += momentum;
    sum.angular_momentum += Vector3d(state.p_W.col(i) - centre).cross(momentum);
  }
  return sum;
}

}  // namespace freeflex
