#include "tools/verification/reference/linearised.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

Matrix3d inertia_of(const CartesianSystem& system) {
  Matrix3d inertia = Matrix3d::Zero();
  for (Eigen::Index i = 0; i < system.mass.size(); ++i) {
    const Vector3d r = system.r.col(i);
    inertia += system.mass[i] * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose());
  }
  return inertia;
}

constexpr double kSlack = 1e-9;  // [-] slack for rounding errors of a span, as a fraction of a step

/// Returns the number of equal steps, none longer than `step`, that make up the span.
long whole_steps(double span, double step) { return std::lround(std::ceil(span / step * (1.0 - kSlack))); }

}  // namespace

std::unique_ptr<RivalMethod> Linearised::make(Rival rival, const CartesianSystem& system,
                                              std::string& error) {
  assert(is_linearised(rival));
  if (system.attractor_mu > 0.0) error = "the linearised system does not support an attractor";
  for (const CartesianLink& link : system.links)
    if (link.damping > 0.0)
      error = "the linearised system supports springs and bars only, without dissipation";
  const Eigen::SelfAdjointEigenSolver<Matrix3d> moments(inertia_of(system), Eigen::EigenvaluesOnly);
  if (moments.eigenvalues()[0] <= kNoMoment * moments.eigenvalues()[2])
    error = "the linearised system needs a shape that is not collinear";
  if (!error.empty()) return nullptr;
  return std::unique_ptr<RivalMethod>(new Linearised(rival, system));
}

Linearised::Linearised(Rival rival, const CartesianSystem& system)
    : rival_(rival), system_(system), inertia_(inertia_of(system)), inverse_inertia_(inertia_.inverse()) {
  const Eigen::Index n = system.mass.size();
  root_mass_.resize(3 * n);
  Eigen::MatrixXd motions(3 * n, 6);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double root = std::sqrt(system.mass[i]);
    root_mass_.segment<3>(3 * i).setConstant(root);
    motions.block<3, 3>(3 * i, 0) = root * Matrix3d::Identity();
    for (int a = 0; a < 3; ++a)
      motions.block<3, 1>(3 * i, 3 + a) = root * Vector3d::Unit(a).cross(Vector3d(system.r.col(i)));
  }
  rigid_ =
      Eigen::HouseholderQR<Eigen::MatrixXd>(motions).householderQ() * Eigen::MatrixXd::Identity(3 * n, 6);
  for (const CartesianLink& link : system.links) {
    Row row{3 * link.first, 3 * link.second, {}, {}};
    for (std::size_t a = 0; a < 3; ++a) {
      const double u = link.rest[static_cast<Eigen::Index>(a)] / link.length;
      row.at_first[a] = std::sqrt(link.stiffness / system.mass[link.first]) * u;
      row.at_second[a] = std::sqrt(link.stiffness / system.mass[link.second]) * u;
    }
    rows_.push_back(row);
  }
  force_B_.resize(3, n);
}

void Linearised::set_initial() {
  const Eigen::Index n = root_mass_.size();
  start_ = {Vector3d::Zero(), Vector3d::Zero(), system_.q_WB * Vector3d(inertia_ * system_.spin),
            system_.q_WB};
  y_ = root_mass_.cwiseProduct(system_.initial.head(n));
  y_dot_ = root_mass_.cwiseProduct(system_.initial.tail(n));
}

Vector3d Linearised::spin(const Frame& frame) const {
  return inverse_inertia_ * (frame.q_WB.conjugate() * frame.H_W);
}

bool Linearised::is_loaded() const {
  return std::any_of(system_.loads.begin(), system_.loads.end(), [&](const CartesianLoad& load) {
    return pulse_of(load.history) == nullptr || amplitude(load.history, piece_time_, piece_time_) != 0.0;
  });
}

void Linearised::add_forces(const Frame& frame, double t, Matrix3Xd& force_B) const {
  Map<Matrix3Xd> force(force_B.data(), 3, force_B.cols());
  const Matrix3d R_BW = frame.q_WB.conjugate().toRotationMatrix();
  for (const CartesianLoad& load : system_.loads) {
    const double scale = amplitude(load.history, t, piece_time_);
    if (scale != 0.0) add_load(load, scale, R_BW, Matrix3d::Identity(), force);
  }
}

Linearised::FrameRate Linearised::rate(const Frame& frame, double t) const {
  FrameRate rate{frame.v_WB, Vector3d::Zero(), Vector3d::Zero(), {}};
  const Vector3d w = spin(frame);
  rate.q_WB_dot = 0.5 * (frame.q_WB * Eigen::Quaterniond(0.0, w.x(), w.y(), w.z())).coeffs();
  if (!is_loaded()) return rate;
  force_B_.setZero();
  add_forces(frame, t, force_B_);
  Vector3d moment = Vector3d::Zero();
  for (Eigen::Index i = 0; i < force_B_.cols(); ++i)
    moment += Vector3d(system_.r.col(i)).cross(Vector3d(force_B_.col(i)));
  rate.a_WB = frame.q_WB * Vector3d(force_B_.rowwise().sum()) / system_.mass.sum();
  rate.moment_W = frame.q_WB * moment;
  return rate;
}

// advances the rigid body by one step of the classical Runge-Kutta method
Linearised::Frame Linearised::advance(const Frame& frame, double t, double h) const {
  const auto moved = [&frame](const FrameRate& rate, double step) {
    Frame to{
        frame.p_WB + step * rate.v_WB, frame.v_WB + step * rate.a_WB, frame.H_W + step * rate.moment_W, {}};
    to.q_WB.coeffs() = (frame.q_WB.coeffs() + step * rate.q_WB_dot).normalized();
    return to;
  };
  const FrameRate k1 = rate(frame, t), k2 = rate(moved(k1, 0.5 * h), t + 0.5 * h),
                  k3 = rate(moved(k2, 0.5 * h), t + 0.5 * h), k4 = rate(moved(k3, h), t + h);
  const auto mean = [](const auto& a, const auto& b, const auto& c, const auto& d) {
    return ((a + 2.0 * b + 2.0 * c + d) / 6.0).eval();
  };
  return moved({mean(k1.v_WB, k2.v_WB, k3.v_WB, k4.v_WB), mean(k1.a_WB, k2.a_WB, k3.a_WB, k4.a_WB),
                mean(k1.moment_W, k2.moment_W, k3.moment_W, k4.moment_W),
                mean(k1.q_WB_dot, k2.q_WB_dot, k3.q_WB_dot, k4.q_WB_dot)},
               h);
}

// Computes the external and centrifugal forces minus their rigid part   (THEORY 13.8):
//   g = (1 - T_m T_m^T) m^-1/2 (F_B - m w x (w x r))
// The columns of T_m are the orthonormal rigid motions in y
void Linearised::elastic_load(const Frame& frame, double t, VectorXd& g) const {
  g.setZero(root_mass_.size());
  const Vector3d w = spin(frame);
  const bool spins = !w.isZero(0.0);
  if (!spins && !is_loaded()) return;
  force_B_.setZero();
  if (is_loaded()) add_forces(frame, t, force_B_);
  for (Eigen::Index i = 0; spins && i < force_B_.cols(); ++i)
    force_B_.col(i) -= system_.mass[i] * w.cross(w.cross(Vector3d(system_.r.col(i))));
  g = Map<const VectorXd>(force_B_.data(), root_mass_.size()).cwiseQuotient(root_mass_);
  g -= rigid_ * (rigid_.transpose() * g);
}

// A = sum a a^T over the springs, a = (.., -sqrt(D / m_i) u, .., sqrt(D / m_j) u, ..)   (THEORY 13.10)
void Linearised::apply(const double* y, double* out) const {
  std::fill(out, out + root_mass_.size(), 0.0);
  for (const Row& row : rows_) {
    const double *y1 = y + row.first, *y2 = y + row.second;
    double *o1 = out + row.first, *o2 = out + row.second;
    const double s = (row.at_second[0] * y2[0] + row.at_second[1] * y2[1] + row.at_second[2] * y2[2]) -
                     (row.at_first[0] * y1[0] + row.at_first[1] * y1[1] + row.at_first[2] * y1[2]);
    for (std::size_t a = 0; a < 3; ++a) {
      o1[a] -= s * row.at_first[a];
      o2[a] += s * row.at_second[a];
    }
  }
}

// Leapfrog on y'' = -A y + g + (t / span) dg   (THEORY 13.9, 13.11):
//   y += h w,   w += h y''(y),   where w is y' half a step ahead of y
void Linearised::leapfrog(double span, double step, std::span<const double> reads, const Read& read) {
  const long count = whole_steps(span, step);
  const double h = span / static_cast<double>(count);
  const Eigen::Index n = y_.size();
  const auto accelerate = [&](double t) {
    apply(y_.data(), acceleration_.data());
    const double fraction = t / span;
    double* a = acceleration_.data();
    const double *g = g_.data(), *dg = dg_.data();
    for (Eigen::Index i = 0; i < n; ++i) a[i] = (g[i] + fraction * dg[i]) - a[i];
  };
  acceleration_.resize(n);
  accelerate(0.0);
  w_ = y_dot_ + 0.5 * h * acceleration_;
  std::size_t next = 0;
  for (long k = 1; k <= count; ++k) {
    double *y = y_.data(), *w = w_.data();
    for (Eigen::Index i = 0; i < n; ++i) y[i] += h * w[i];
    const double t = static_cast<double>(k) * h;
    accelerate(t);
    const double* a = acceleration_.data();
    for (Eigen::Index i = 0; i < n; ++i) w[i] += h * a[i];
    // the motion at the end of this step is extrapolated to the requested time, which is at most half a step
    // away
    for (; next < reads.size() && reads[next] <= t + 0.5 * h; ++next) {
      const double back = reads[next] - t;
      y_ahead_ = y_;
      y_dot_ = w_ - 0.5 * h * acceleration_;
      y_ += back * y_dot_ + 0.5 * back * back * acceleration_;
      y_dot_ += back * acceleration_;
      read(reads[next]);
      y_ = y_ahead_;
    }
  }
  y_dot_ = w_ - 0.5 * h * acceleration_;
  num_applied_ += count + 1;
}

// Takes the exact step of y'' = -A y + g + (t / span) dg   (THEORY 13.9, 13.12, 13.13). With a = g - A y0 and
// X = t sqrt(A):
//   y = y0 + t^2 (1 - cos X) / X^2 a + t sinc X y0' + t^2 (1 - sinc X) / X^2 (t / span) dg
//   y' = t sinc X a + cos X y0' + t (1 - cos X) / X^2 (t / span) dg
// Each product of a function and a vector is computed in a Krylov space   (THEORY 13.14).
std::string Linearised::krylov(double span, const RivalOptions& options, std::span<const double> reads,
                               const Read& read) {
  constexpr int kMostVectors = 256;
  constexpr Eigen::Index kSmall = 128;  // largest number of freedoms for which a Krylov space may become the
                                        // whole space
  const bool is_small = y_.size() <= kSmall;
  const auto operate = [this](const double* from, double* to) { apply(from, to); };
  acceleration_.resize(y_.size());
  apply(y_.data(), acceleration_.data());
  ++num_applied_;
  w_ = g_ - acceleration_;
  // for each vector, its term in the displacements and its term in the velocities, with their tolerances
  using Term = LanczosSpace::Term;
  const double y_error = options.tolerance * options.scale.displacement * root_mass_.norm(),
               y_dot_error = options.tolerance * options.scale.velocity * root_mass_.norm();
  const Term of_force[] = {{WaveFunction::kConstant, span * span, y_error},
                           {WaveFunction::kSinc, span, y_dot_error}};
  const Term of_velocity[] = {{WaveFunction::kSinc, span, y_error}, {WaveFunction::kCos, 1.0, y_dot_error}};
  const Term of_change[] = {{WaveFunction::kRising, span * span, y_error},
                            {WaveFunction::kConstant, span, y_dot_error}};
  const auto build = [&](LanczosSpace& space, const VectorXd& vector, std::span<const Term> terms) {
    const bool is_enough = space.build(operate, vector, span, terms, kMostVectors, is_small);
    num_applied_ += space.num_applied();
    return is_enough;
  };
  if (!build(from_force_, w_, of_force) || !build(from_velocity_, y_dot_, of_velocity) ||
      !build(from_change_, dg_, of_change))
    return "the step needs a Krylov space of more than 256 vectors";
  const VectorXd y_start = y_;
  const auto move_to = [&](double t) {
    const double change = t / span;  // fraction of dg
    y_ = y_start;
    from_force_.add(WaveFunction::kConstant, t, t * t, y_);
    from_velocity_.add(WaveFunction::kSinc, t, t, y_);
    from_change_.add(WaveFunction::kRising, t, change * t * t, y_);
    y_dot_.setZero();
    from_force_.add(WaveFunction::kSinc, t, t, y_dot_);
    from_velocity_.add(WaveFunction::kCos, t, 1.0, y_dot_);
    from_change_.add(WaveFunction::kConstant, t, change * t, y_dot_);
  };
  for (const double t : reads) {
    move_to(t);
    read(t);
  }
  if (reads.empty() || reads.back() < span) move_to(span);
  return {};
}

void Linearised::write_state(const Frame& frame, double t, CartesianState& state) const {
  const Matrix3d R = frame.q_WB.toRotationMatrix();
  const Vector3d w = spin(frame);
  const Vector3d p = system_.p_WB + t * system_.v_WB + 0.5 * t * t * system_.gravity_W + frame.p_WB;
  const Vector3d v = system_.v_WB + t * system_.gravity_W + frame.v_WB;
  state.time = t;
  state.p_W.resize(3, system_.mass.size());
  state.v_W.resize(3, system_.mass.size());
  for (Eigen::Index i = 0; i < system_.mass.size(); ++i) {
    const double root = root_mass_[3 * i];
    const Vector3d x = Vector3d(system_.r.col(i)) + y_.segment<3>(3 * i) / root;
    state.p_W.col(i) = p + R * x;
    state.v_W.col(i) = v + R * (w.cross(x) + y_dot_.segment<3>(3 * i) / root);
  }
}

double Linearised::load_step(const RivalOptions& options) const {
  // The load is taken as linear in time over a step. If the body rotates by 0.02 rad within a step, the load
  // deviates from this line by a fraction of 5e-5
  constexpr double kLongest = 0.1, kRotation = 0.02;  // [s], [rad]
  if (rival_ == Rival::kKrylov) return options.step;
  const double spin_rate = system_.spin.norm();
  return std::max(options.step, spin_rate > 0.0 ? std::min(kLongest, kRotation / spin_rate) : kLongest);
}

std::size_t Linearised::memory() const {
  const int spaces =
      rival_ == Rival::kKrylov ? from_force_.size() + from_velocity_.size() + from_change_.size() : 0;
  constexpr std::size_t kVectors = 7;
  return rows_.size() * sizeof(Row) + (kVectors + index(spaces)) * sizeof(double) * index(y_.size());
}

std::string Linearised::step(const Frame& frame, double t, double span, const RivalOptions& options,
                             std::span<const double> times, std::size_t& next, const RivalSink& sink) {
  elastic_load(frame, t, g_);
  elastic_load(frame_end_, t + span, dg_);
  dg_ -= g_;
  std::vector<double> reads;
  for (std::size_t i = next; i < times.size() && times[i] <= t + span * (1.0 + kSlack); ++i)
    reads.push_back(std::min(times[i] - t, span));
  const Read read = [&](double from_start) {
    write_state(from_start == span ? frame_end_ : advance(frame, t, from_start), times[next], state_);
    sink(next++, state_);
  };
  if (rival_ == Rival::kKrylov) {
    if (std::string error = krylov(span, options, reads, read); !error.empty()) return error;
  } else {
    leapfrog(span, options.step, reads, read);
  }
  return y_.allFinite() ? ""
                        : "the state is not finite, because the step exceeds the method's stability limit";
}

RivalRun Linearised::run(std::span<const double> times, const RivalOptions& options, const RivalSink& sink) {
  set_initial();
  num_applied_ = 0;
  RivalRun run;
  Frame frame = start_;
  std::size_t next = 0;
  double piece_start = 0.0;
  for (const double end : piece_ends(system_, times.back())) {
    piece_time_ = 0.5 * (piece_start + end);
    const long count = whole_steps(end - piece_start, load_step(options));
    const double span = (end - piece_start) / static_cast<double>(count);
    for (long k = 0; k < count && run.error.empty(); ++k) {
      const double t = piece_start + static_cast<double>(k) * span;
      frame_end_ = advance(frame, t, span);
      run.error = options.is_stopped && options.is_stopped()
                      ? "stopped"
                      : step(frame, t, span, options, times, next, sink);
      run.num_steps += rival_ == Rival::kLeapfrog ? whole_steps(span, options.step) : 1;
      frame = frame_end_;
    }
    if (!run.error.empty()) return run;
    piece_start = end;
  }
  run.num_evaluations = num_applied_;
  run.memory = memory();
  return run;
}

}  // namespace freeflex
