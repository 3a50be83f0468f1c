#include "tests/reference/kinds.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>

#include "core/motion.hpp"
#include "core/step/readout.hpp"
#include "tests/reference/true_geometry.hpp"
#include "tools/verification/reference/elastic_error.hpp"
#include "tools/verification/reference/integrate.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kFineTick = 1.0 / 32.0;  // [ms]

Matrix3Xd positions(const Plan& plan, const MotionState& state) {
  Matrix3Xd p(3, static_cast<Eigen::Index>(plan.points.size()));
  for (Eigen::Index i = 0; i < p.cols(); ++i)
    p.col(i) = Eigen::Map<const Vector3d>(read_point(plan, state, static_cast<int>(i)).p_W.data());
  return p;
}

struct Run {
  Matrix3Xd p_W;              // [m] at kEnd
  double displacement = 0.0;  // [m] largest
  double rate = 0.0;          // [rad/s] largest
};

Run run_rung(Scene scene, double tick_ms) {
  scene.fidelity = Fidelity::kCorotational;
  scene.rate = 1000.0 / tick_ms;
  const Plan plan = compile(scene);
  Motion motion(plan, kMotionAlone);
  Run run;
  for (long k = 0; k < std::lround(kEnd * scene.rate); ++k) {
    const StepStatus status = motion.advance().status;
    EXPECT_EQ(status, StepStatus::kOk) << "tick " << k << " of " << tick_ms << " ms";
    if (status != StepStatus::kOk) return {};
    for (std::size_t i = 0; i < scene.points.size(); ++i)
      run.displacement =
          std::max(run.displacement, length(read_point(plan, motion.state(), static_cast<int>(i)).V_B));
    run.rate = std::max(run.rate, length(motion.state().coupled.w_B));
  }
  run.p_W = positions(plan, motion.state());
  return run;
}

// Returns the positions of the reference at kEnd. Sets `accuracy` [m] to the largest distance of a point from
// that of a run with 30 times the tolerance.
Matrix3Xd run_reference(const Specimen& specimen, Eigen::Index num_points, double& accuracy) {
  CartesianSystem system = true_geometry_of(specimen.points.value_or(specimen.scene));
  if (specimen.complete) specimen.complete(system);
  const double times[] = {kEnd};
  ReferenceOptions options;
  options.method = ReferenceMethod::kAdams;
  options.tolerance = 1e-12;
  const ReferenceRun run = integrate(system, times, options);
  EXPECT_EQ(run.error, "");
  if (run.states.empty()) return Matrix3Xd::Zero(3, num_points);
  options.tolerance *= 30.0;
  options.scale = run.scale;
  const ReferenceRun coarse = integrate(system, times, options);
  EXPECT_EQ(coarse.error, "");
  accuracy = (run.states.at(0).p_W - coarse.states.at(0).p_W).colwise().norm().maxCoeff();
  return run.states[0].p_W.leftCols(num_points);
}

double distance(const Matrix3Xd& a, const Matrix3Xd& b) { return (a - b).colwise().norm().maxCoeff(); }

// Returns the rotation that takes the points of one motion to those of the other best [rad].
double rotation_between(const Matrix3Xd& a, const Matrix3Xd& b) {
  const VectorXd ones = VectorXd::Ones(a.cols());
  const Vector3d mean_a = a.rowwise().mean(), mean_b = b.rowwise().mean();
  const Eigen::Matrix3d R = fit_rotation(ones, a.colwise() - mean_a, b.colwise() - mean_b);
  // the sine keeps small angles
  return 0.5 * Vector3d(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1)).norm();
}

}  // namespace

KindErrors errors_of(const Kind& kind, unsigned seed) {
  Random random(seed);
  const Specimen specimen = kind.make(random);
  const Structure structure = build(specimen.scene);
  const Run fine = run_rung(specimen.scene, kFineTick);
  KindErrors errors{specimen.truth};
  Matrix3Xd truth = fine.p_W;
  if (specimen.truth != Truth::kFine) truth = run_reference(specimen, fine.p_W.cols(), errors.accuracy);
  errors.accuracy /= fine.displacement;
  errors.deflection = fine.displacement / structure.mass_properties.r.colwise().norm().maxCoeff();
  errors.rotation = fine.rate * kEnd;
  errors.phase = 1e-3 * structure.omega.maxCoeff();
  for (std::size_t k = 0; k < kTicks.size(); ++k) {
    const Run run = run_rung(specimen.scene, kTicks[k]);
    if (run.p_W.cols() == 0) {
      errors.error[k] = HUGE_VAL;
      continue;
    }
    errors.error[k] = distance(run.p_W, truth) / fine.displacement;
    if (kTicks[k] == 1.0) errors.attitude = rotation_between(run.p_W, truth);
  }
  errors.order = std::log2(errors.error[2] / errors.error[3]);
  if (specimen.whole) {
    Specimen whole{*specimen.whole};
    double unused = 0.0;
    errors.whole = distance(run_reference(whole, truth.cols(), unused), truth) / fine.displacement;
  }
  return errors;
}

namespace {

double median(const std::vector<KindErrors>& all, const std::function<double(const KindErrors&)>& value) {
  std::vector<double> values;
  for (const KindErrors& each : all) values.push_back(value(each));
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

const char* text_of(Truth truth) {
  switch (truth) {
    case Truth::kCartesian:
      return "points";
    case Truth::kCopy:
      return "copy";
    case Truth::kForces:
      return "forces";
    default:
      return "fine";
  }
}

}  // namespace

void print_row(const Kind& kind, const std::vector<KindErrors>& all) {
  const auto middle = [&](auto value) { return median(all, value); };
  std::printf("| %s | %s | %.1f %% | %.1f | %.2f |", kind.name, text_of(all[0].truth),
              100.0 * middle([](const KindErrors& e) { return e.deflection; }),
              middle([](const KindErrors& e) { return e.rotation; }),
              middle([](const KindErrors& e) { return e.phase; }));
  double worst = 0.0, accuracy = 0.0, whole = 0.0;
  for (const KindErrors& each : all) {
    worst = std::max(worst, each.error[2]);
    accuracy = std::max(accuracy, each.accuracy);
    whole = std::max(whole, each.whole);
  }
  for (std::size_t k = 0; k < kTicks.size(); ++k) {
    std::printf(" %.0e", middle([&](const KindErrors& e) { return e.error[k]; }));
    if (kTicks[k] == 1.0) std::printf(" (%.0e)", worst);
    std::printf(" |");
  }
  std::printf(" %.1f | %.0e |\n", middle([](const KindErrors& e) { return e.order; }),
              middle([](const KindErrors& e) { return e.attitude; }));
  if (accuracy > 0.0)
    std::printf("  with 30 times the tolerance, the reference differs by up to %.0e\n", accuracy);
  if (whole > 0.0) std::printf("  the structure without superelements differs by up to %.0e\n", whole);
}

void check(const Kind& kind, const KindErrors& errors) {
  EXPECT_LT(errors.error[2], kind.error);
  // below this size the reference counts
  if (errors.error[3] > 20.0 * errors.accuracy) {
    EXPECT_GT(errors.order, kind.order);
  }
  EXPECT_LT(errors.accuracy, 2e-8);
}

}  // namespace freeflex::testing
