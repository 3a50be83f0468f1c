#include "tools/verification/report/measure.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <numbers>
#include <utility>

#include "core/structure/modes/dense/decompositions.hpp"
#include "tools/verification/reference/elastic_error.hpp"

namespace freeflex::tools {
namespace {

/// Fits a cos wt + b sin wt + c by least squares to samples that are kFramePeriod apart. Returns the squared
/// norm of the residual divided by the squared norm of the samples.
double sine_residual(const std::vector<double>& samples, double omega) {
  const auto n = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixX3d columns(n, 3);
  for (Eigen::Index k = 0; k < n; ++k) {
    const double phase = omega * kFramePeriod * static_cast<double>(k);
    columns.row(k) << std::cos(phase), std::sin(phase), 1.0;
  }
  const Eigen::Map<const Eigen::VectorXd> y(samples.data(), n);
  const Eigen::Vector3d c = (columns.transpose() * columns).ldlt().solve(columns.transpose() * y);
  return (y - columns * c).squaredNorm() / y.squaredNorm();
}

/// Returns the point between low and high at which f is smallest, by golden-section search.
double minimise(const std::function<double(double)>& f, double low, double high) {
  const double golden = std::numbers::phi - 1.0;
  double a = high - golden * (high - low), b = low + golden * (high - low);
  double fa = f(a), fb = f(b);
  for (int k = 0; k < 60; ++k) {
    if (fa < fb) {
      high = std::exchange(b, a), fb = fa;
      a = high - golden * (high - low), fa = f(a);
    } else {
      low = std::exchange(a, b), fa = fb;
      b = low + golden * (high - low), fb = f(b);
    }
  }
  return 0.5 * (low + high);
}

}  // namespace

double thread_cpu() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Timing time_work(const std::function<void()>& work, int repeats) {
  constexpr double kLong = 0.3, kOne = 0.015, kBatch = 1e-3;  // [s]
  const double begin = thread_cpu();
  work();
  const double once = thread_cpu() - begin;
  if (once > kLong) return {once, 1};
  // short work is timed in batches, so that the time of reading the clock is negligible
  const int batch = std::max(1, static_cast<int>(kBatch / std::max(once, 1e-9)));
  std::vector<double> samples;
  double total = 0.0;
  while (static_cast<int>(samples.size()) < repeats || total < repeats * kOne) {
    const double start = thread_cpu();
    for (int k = 0; k < batch; ++k) work();
    const double taken = thread_cpu() - start;
    samples.push_back(taken / batch);
    total += taken;
  }
  const auto middle = samples.begin() + static_cast<std::ptrdiff_t>(samples.size() / 2);
  std::nth_element(samples.begin(), middle, samples.end());
  return {*middle, batch * static_cast<int>(samples.size())};
}

double total_energy(const CartesianSystem& system, const CartesianState& state) {
  double energy = invariants(system, state).kinetic;
  for (const CartesianLink& link : system.links) {
    const Eigen::Vector3d d = state.p_W.col(link.second) - state.p_W.col(link.first);
    const double elongation = (d.squaredNorm() - link.length * link.length) / (d.norm() + link.length);
    energy += 0.5 * link.stiffness * elongation * elongation;
  }
  if (system.true_geometry) {
    Eigen::Matrix3Xd unused = Eigen::Matrix3Xd::Zero(3, state.p_W.cols());
    energy +=
        system.true_geometry->add_forces(elastic_displacements(system.mass, system.r, state.p_W), unused);
  }
  return energy;
}

ErrorMeter::ErrorMeter(const CartesianSystem& system, const Structure& structure, double free_from,
                       Trajectory reference)
    : system_(system), reference_(std::move(reference)) {
  u_ = displacements(reference_.end.p_W);
  const Eigen::Vector3d centre = reference_.end.p_W * system.mass / system.mass.sum();
  rotation_ = fit_rotation(system.mass, system.r, reference_.end.p_W.colwise() - centre);
  first_frame_ = static_cast<std::size_t>(std::ceil(free_from / kFramePeriod));
  choose_mode(structure);
  if (weights_.cols() > 0) reference_frequency_ = frequency_of(coordinate(reference_, weights_));
  // the elastic energy is the total energy minus the energy of the rigid motion
  if (!reference_.energy_start) return;
  const CartesianInvariants sum = invariants(system, reference_.end);
  const Eigen::Matrix3d& R = rotation_;
  const Eigen::Vector3d H_B = R.transpose() * sum.angular_momentum;
  const double rigid =
      0.5 * (sum.linear_momentum.squaredNorm() / system.mass.sum() +
             H_B.dot(structure.mass_properties.inertia.completeOrthogonalDecomposition().solve(H_B)));
  elastic_energy_ = total_energy(system, reference_.end) - rigid;
}

Eigen::Matrix3Xd ErrorMeter::displacements(const Eigen::Matrix3Xd& p_W) const {
  return elastic_displacements(system_.mass, system_.r, p_W);
}

double ErrorMeter::elastic(const Eigen::Matrix3Xd& p_W) const {
  return elastic_error(displacements(p_W), u_);
}

double ErrorMeter::position(const Eigen::Matrix3Xd& p_W) const {
  return (p_W - reference_.end.p_W).norm() / std::sqrt(static_cast<double>(p_W.cols()));
}

double ErrorMeter::attitude(const Eigen::Matrix3Xd& p_W) const {
  const Eigen::Vector3d centre = p_W * system_.mass / system_.mass.sum();
  const Eigen::Matrix3d R = fit_rotation(system_.mass, system_.r, p_W.colwise() - centre);
  // computed from the skew part, which keeps the digits of a small angle
  const Eigen::Matrix3d Q = R * rotation_.transpose();
  const Eigen::Vector3d skew(Q(2, 1) - Q(1, 2), Q(0, 2) - Q(2, 0), Q(1, 0) - Q(0, 1));
  return std::atan2(0.5 * skew.norm(), 0.5 * (Q.trace() - 1.0));
}

std::vector<double> ErrorMeter::coordinate(const Trajectory& motion, const Eigen::Matrix3Xd& weights) const {
  std::vector<double> samples;
  for (std::size_t k = first_frame_; k < motion.frames.size(); ++k)
    samples.push_back(displacements(motion.frames[k]).cwiseProduct(weights).sum());
  return samples;
}

void ErrorMeter::choose_mode(const Structure& structure) {
  constexpr std::size_t kFewest = 12;  // smallest number of frames
  constexpr double kFastest = 2.5;     // [rad] largest phase of the mode between two frames
  // the shapes of modes do not give the points that carry the inertia of bodies
  if (reference_.frames.size() < first_frame_ + kFewest || !system_.carried.empty()) return;
  std::vector<Eigen::VectorXd> u;
  for (std::size_t k = first_frame_; k < reference_.frames.size(); ++k) {
    const Eigen::Matrix3Xd now = displacements(reference_.frames[k]);
    u.emplace_back(Eigen::Map<const Eigen::VectorXd>(now.data(), now.size()));
  }
  double largest = 0.0;
  for (Eigen::Index l = 0; l < structure.omega.size(); ++l) {
    const double omega = structure.omega[l];
    if (omega <= 0.0 || omega * kFramePeriod > kFastest) continue;
    Eigen::Matrix3Xd weights =
        Eigen::Map<const Eigen::Matrix3Xd>(structure.shapes.col(l).data(), 3, system_.mass.size());
    for (Eigen::Index i = 0; i < weights.cols(); ++i)
      weights.col(i) *= system_.mass[i] / structure.mass_properties.mass;
    const Eigen::Map<const Eigen::VectorXd> row(weights.data(), weights.size());
    double sum = 0.0;
    for (const Eigen::VectorXd& now : u) sum += std::pow(row.dot(now), 2);
    if (sum <= largest) continue;
    largest = sum;
    weights_ = weights;
    omega_ = omega;
  }
}

std::optional<double> ErrorMeter::frequency_of(const std::vector<double>& samples) const {
  constexpr double
      kWide = 0.2,
      kWrong =
          0.5;  // [-] kWide: searched range about the mode's frequency; kWrong: largest residual of a fit
  constexpr int kScan = 400;
  if (!std::all_of(samples.begin(), samples.end(), [](double y) { return std::isfinite(y); }))
    return std::nullopt;
  const auto residual = [&](double omega) { return sine_residual(samples, omega); };
  const double low = (1.0 - kWide) * omega_, step = 2.0 * kWide * omega_ / kScan;
  int best = 0;
  double least = residual(low);
  for (int k = 1; k <= kScan; ++k)
    if (const double now = residual(low + k * step); now < least) least = now, best = k;
  const double omega = minimise(residual, low + (best - 1) * step, low + (best + 1) * step);
  return residual(omega) < kWrong ? std::optional(omega) : std::nullopt;
}

std::optional<double> ErrorMeter::frequency(const Trajectory& motion) const {
  if (!reference_frequency_) return std::nullopt;
  const std::optional<double> own = frequency_of(coordinate(motion, weights_));
  if (!own) return std::nullopt;
  return std::abs(*own / *reference_frequency_ - 1.0);
}

std::optional<double> ErrorMeter::energy_drift(const Trajectory& motion) const {
  // defined only for a system without damping and external fields
  const bool is_damped = system_.true_geometry && system_.true_geometry->is_damped();
  const bool conserves = !is_damped && system_.gravity_W.isZero() && system_.attractor_mu == 0.0 &&
                         std::all_of(system_.links.begin(), system_.links.end(),
                                     [](const CartesianLink& link) { return link.damping == 0.0; });
  if (!conserves || !motion.energy_start || !motion.energy_end || !(elastic_energy_ > 0.0))
    return std::nullopt;
  return std::abs(*motion.energy_end - *motion.energy_start) / elastic_energy_;
}

}  // namespace freeflex::tools
