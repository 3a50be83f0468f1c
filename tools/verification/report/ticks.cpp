#include "tools/verification/report/ticks.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <random>

#include "core/motion.hpp"
#include "core/plan/make_plan.hpp"
#include "core/step/readout.hpp"
#include "core/step/rigid/tick_rotation.hpp"
#include "tools/verification/reference/sundials_solver.hpp"
#include "tools/verification/report/measure.hpp"

namespace freeflex::tools {
namespace {

using Eigen::Matrix3d, Eigen::Quaterniond, Eigen::Vector3d;

struct RandomBody {
  Matrix3d inertia;
  Vector3d spin, wheel;  // [rad/s], [N m s]
  double rate = 0.0;     // [Hz]
};

RandomBody random_body(std::uint64_t seed, int number) {
  std::mt19937_64 engine(1000003 * seed + static_cast<std::uint64_t>(number));
  // uses the raw numbers of the engine, because the C++ standard defines only their sequence
  const auto between = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(engine() >> 11) * 0x1p-53);
  };
  const auto decades = [&](double low, double high) { return std::pow(10.0, between(low, high)); };
  const auto direction = [&] {
    const double x = between(-1, 1), y = between(-1, 1), z = between(-1, 1);
    return Vector3d(x, y, z).normalized();
  };
  const double thin = decades(-6.0, 0.0), other = between(thin, 1.0), a = between(0.3, 1.0),
               last = between(1.0, 1.0 + a);
  const std::array<Vector3d, 3> kinds{Vector3d(thin, 1.0, 1.0 + 0.5 * thin),
                                      Vector3d(1.0, other, 1.0 + other), Vector3d(a, 1.0, last)};
  const Vector3d& moments = kinds[engine() % 3];
  const Vector3d about = direction();
  const Matrix3d axes = Eigen::AngleAxisd(between(0.0, M_PI), about).toRotationMatrix();
  RandomBody body;
  const Matrix3d inertia = axes * moments.asDiagonal() * axes.transpose();
  body.inertia = 0.5 * (inertia + inertia.transpose());
  body.rate = decades(0.0, 4.0);
  const double rotation = decades(-3.0, 0.5);
  body.spin = rotation * body.rate * direction();
  const double share = decades(-2.0, 3.0);
  const Vector3d axis = direction();
  body.wheel = Vector3d::Zero();
  if (engine() % 3 != 0) body.wheel = share * (body.inertia * body.spin).norm() * axis;
  return body;
}

Scene scene_of(const RandomBody& body, bool couples) {
  Scene scene;
  PointMass point;
  point.name = "body";
  point.mass = 1.0;
  point.inertia = body.inertia;
  scene.points.push_back(point);
  scene.publication.points = scene.pushable = {0};
  scene.rate = body.rate;
  scene.fidelity = couples ? Fidelity::kCoupled : Fidelity::kSeparated;
  scene.initial.angular_velocity = body.spin;
  if (!body.wheel.isZero(0.0))
    scene.wheels.push_back({"wheel", 0, body.wheel.normalized(), body.wheel.norm(), {}});
  return scene;
}

/// Computes the attitude of the body after a time [s] by Euler's equations in body axes, with SUNDIALS.
/// Returns an empty text or the error.
std::string rotate_by_sundials(const RandomBody& body, double time, Quaterniond& attitude) {
  const double unit = body.spin.norm();
  const Matrix3d inverse = body.inertia.inverse();
  SmoothProblem problem;
  problem.slope = [&](double, std::span<const double> y, std::span<double> y_dot) {
    const Quaterniond q(y[0], y[1], y[2], y[3]);
    const Vector3d w = unit * Vector3d(y[4], y[5], y[6]), half = 0.5 * w;
    const Quaterniond rate = q * Quaterniond(0.0, half.x(), half.y(), half.z());
    const Vector3d w_dot = inverse * (body.inertia * w + body.wheel).cross(w) / unit;
    const std::array<double, 8> all{rate.w(), rate.x(), rate.y(), rate.z(),
                                    w_dot[0], w_dot[1], w_dot[2], 0.0};
    std::copy(all.begin(), all.end(), y_dot.begin());
  };
  ReferenceOptions options;
  options.tolerance = 1e-12;
  const Vector3d start = body.spin / unit;
  std::vector<double> y{1.0, 0.0, 0.0, 0.0, start[0], start[1], start[2], 0.0};
  SundialsSolver solver(problem, options, {1.0, 1.0}, 0.0, y);
  std::string error = solver.advance(time, y);
  attitude = Quaterniond(y[0], y[1], y[2], y[3]).normalized();
  return error;
}

double energy_of(const Plan& plan, const State& state) { return read_invariants(plan, state).kinetic_rigid; }

double ns_per_tick(const Plan& plan, std::int64_t ticks) {
  Motion motion(plan, kMotionAlone);
  const double before = thread_cpu();
  for (std::int64_t k = 0; k < ticks; ++k) motion.advance();
  return 1e9 * (thread_cpu() - before) / static_cast<double>(ticks);
}

void move(const RandomBody& body, const Plan& plan, TickRow& row) {
  Motion motion(plan);
  const State& state = motion.state();
  RigidLoads loads;
  loads.wheels.h[0] = wheel_momentum_B(plan, state);
  const TickRotation rotation = rotation_in_tick(plan, state, rotation_matrix(state.q_WB), loads);
  row.substeps = rotation.total > kShortRotation ? substeps_for(rotation.substep_angle) : 1;
  constexpr double kMostTicks = 3000.0, kMostRotation = 2e4, kMostTime = 100.0;
  const double of_reference = kMostRotation / std::max(rotation.total, rotation.substep_angle);
  // a verdict needs one step of the shadow
  row.ticks = std::max<std::int64_t>(
      plan.verdict.shadows.front().ticks,
      static_cast<std::int64_t>(std::clamp(std::min(kMostTime * body.rate, of_reference), 1.0, kMostTicks)));
  const double start = energy_of(plan, state);
  for (std::int64_t k = 0; k < row.ticks; ++k) {
    if (motion.advance().status != StepStatus::kOk) {
      row.error = "a state is not finite";
      row.level = Verdict::Level::kOutside;
      return;
    }
  }
  row.ns_per_tick = ns_per_tick(plan, std::min<std::int64_t>(row.ticks, 300));
  row.level = motion.worst().tick < 0 ? Verdict::Level::kGood : motion.worst().level;
  row.energy_error = std::abs(energy_of(plan, state) / start - 1.0);
  // unless the verdict is `good`, the rotation may be larger than the reference can follow
  if (row.level != Verdict::Level::kGood) return;
  Quaterniond right;
  row.error = rotate_by_sundials(body, static_cast<double>(row.ticks) / body.rate, right);
  const Quat& q = state.q_WB;
  if (row.error.empty()) row.attitude_error = right.angularDistance(Quaterniond(q[0], q[1], q[2], q[3]));
}

}  // namespace

std::vector<TickRow> study_ticks(std::uint64_t seed, int count,
                                 const std::function<bool(double)>& keep_going) {
  std::vector<TickRow> rows;
  for (int number = 0; number < count && keep_going(static_cast<double>(number) / count); ++number) {
    const RandomBody body = random_body(seed, number);
    TickRow row;
    row.number = number;
    row.rate = body.rate;
    row.rotation = body.spin.norm() / body.rate;
    row.wheel = body.wheel.norm() / (body.inertia * body.spin).norm();
    const Vector3d moments = Eigen::SelfAdjointEigenSolver<Matrix3d>(body.inertia).eigenvalues();
    row.inertia_ratio = moments[2] / moments[0];
    const Scene scene = scene_of(body, number % 2 == 1);
    Faults faults;
    const auto structure = build_structure(scene, faults);
    const auto plan = structure ? make_plan(scene, *structure, faults) : std::nullopt;
    if (plan)
      move(body, *plan, row);
    else
      row.error = "no plan";
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<TickBin> bin_ticks(const std::vector<TickRow>& rows) {
  constexpr int kBins = 7;  // each bin is half a decade wide, and the first begins at 1 mrad
  std::vector<TickBin> bins;
  for (int k = 0; k < kBins; ++k) {
    TickBin bin;
    bin.from = std::pow(10.0, 0.5 * k - 3.0);
    bin.to = std::pow(10.0, 0.5 * k - 2.5);
    std::vector<double> costs;
    for (const TickRow& row : rows) {
      if (row.rotation < bin.from || row.rotation >= bin.to) continue;
      ++bin.count;
      ++(row.level == Verdict::Level::kGood    ? bin.num_good
         : row.level == Verdict::Level::kWatch ? bin.num_watch
                                               : bin.num_outside);
      costs.push_back(row.ns_per_tick);
      if (row.level != Verdict::Level::kGood) continue;
      if (row.attitude_error > bin.worst_attitude) bin.worst_attitude = row.attitude_error;
      if (row.energy_error > bin.worst_energy) bin.worst_energy = row.energy_error;
    }
    if (!costs.empty()) {
      std::nth_element(costs.begin(), costs.begin() + static_cast<std::ptrdiff_t>(costs.size() / 2),
                       costs.end());
      bin.ns_per_tick = costs[costs.size() / 2];
    }
    bins.push_back(bin);
  }
  return bins;
}

}  // namespace freeflex::tools
