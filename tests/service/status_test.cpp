// These tests compare the figures that FREEFLEX_STATUS gives on a motion with closed forms.
#include "service/status.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/service/rig.hpp"
#include "tests/support/omissions.hpp"

namespace freeflex::testing {
namespace {

using freeflex_msgs::status_t;
using service::Mode;
using service::NotJudged;
using service::Snapshot;
using service::StatusReporter;

/// Reports the status of a state that the test itself steps.
struct Report {
  explicit Report(const Scene& scene) : Report(plan_of(scene)) {}
  explicit Report(Plan given) : plan(std::move(given)), motion(plan, kMotionAlone) {
    snapshot.free.take(motion);
  }
  Report(const Report&) = delete;  // the motion refers to the plan

  void run(int ticks, std::span<const ForceCommand> commands = {}) {
    for (int k = 0; k < ticks; ++k) {
      ASSERT_EQ(motion.advance(k == 0 ? commands : std::span<const ForceCommand>{}).status, StepStatus::kOk);
      snapshot.free.take(motion);
    }
  }
  status_t now() { return now(motion.state()); }
  status_t now(const MotionState& state) {
    snapshot.motion = state;
    snapshot.mode = Mode::kRunning;
    return reporter.report(snapshot, 1);
  }

  Plan plan;
  Motion motion;
  service::Identity identity;
  std::unique_ptr<service::Output> output = std::make_unique<service::Output>(plan);
  std::unique_ptr<service::SharedBlock> shared = std::make_unique<service::SharedBlock>();
  service::IngressCounts ingress;
  StatusReporter reporter{plan, identity, *output, *shared, ingress};
  Snapshot snapshot;
};

/// Returns two points of 1 kg, 1 m apart, joined by a spring of k = 100 N/m, at rest and each displaced by 2
/// mm outwards. The mode has omega^2 = 2 k / m.
Scene stretched_pair() {
  Scene scene = spring_pair(1.0, 1.0, 1.0, 100.0);
  publish_everything(scene);
  scene.initial.points.push_back({0, Eigen::Vector3d(-2e-3, 0.0, 0.0), Eigen::Vector3d::Zero()});
  scene.initial.points.push_back({1, Eigen::Vector3d(2e-3, 0.0, 0.0), Eigen::Vector3d::Zero()});
  return scene;
}

TEST(Status, PublishesTheEnergiesAndDisplacementsOfAStretchedPair) {
  Report report(stretched_pair());
  const status_t status = report.now();
  const double potential = 0.5 * 100.0 * 4e-3 * 4e-3;           // [J] the spring is stretched by 4 mm
  EXPECT_NEAR(status.potential, potential, 1e-14 * potential);  // a few rounding errors
  EXPECT_EQ(status.kinetic_rigid, 0.0);
  EXPECT_NEAR(status.max_displacement, 2e-3, 1e-17);
  EXPECT_NEAR(status.displacement_ratio, 2e-3 / 0.5, 1e-15);
  EXPECT_EQ(status.spin_ratio, 0.0);
  EXPECT_EQ(status.fault, "");
  EXPECT_EQ(status.rate, 1000.0);
}

TEST(Status, SpinRatioHasItsClosedFormForAStretchedPair) {
  Scene scene = stretched_pair();
  scene.initial.angular_velocity = Eigen::Vector3d(0.0, 0.0, 0.3);
  Report report(scene);
  const double expected = 0.3 * 0.3 / 200.0 * 0.5 / 2e-3;
  EXPECT_NEAR(report.now().spin_ratio, expected,
              1e-13 * expected);  // for the rounding error of omega_1 in the set-up
}

TEST(Status, SpinWithoutDisplacementIsPublishedAsAFiniteNumber) {
  Scene scene = spring_pair(1.0, 1.0, 1.0, 100.0);
  publish_everything(scene);
  scene.initial.angular_velocity = Eigen::Vector3d(0.0, 0.0, 0.3);
  Report report(scene);
  EXPECT_EQ(report.now().spin_ratio, 1e9);
}

TEST(Status, PublishesTheCurrentAndTheWorstVerdictWithTheirFigures) {
  Report report(reduced_plan_of(stretched_pair()));
  Verdict& now = report.snapshot.verdict;
  now.level = Verdict::Level::kWatch;
  now.cause = Verdict::Cause::kAttitude;
  now.tick = 7;
  now.error = {.position = 1e-5, .attitude = 2e-3, .deformation = 1e-4};
  now.own_error = 1e-6;
  now.displacement_now = 1e-3;
  now.scale = 2e-3;
  report.snapshot.worst = now;
  report.snapshot.worst.level = Verdict::Level::kOutside;
  report.snapshot.worst.tick = 5;
  report.snapshot.not_judged = NotJudged::kJudged;
  report.snapshot.num_late = 3;
  const status_t status = report.now();
  EXPECT_EQ(status.validity, status_t::WATCH);
  EXPECT_EQ(status.worst_validity, status_t::OUTSIDE);
  EXPECT_EQ(status.worst_validity_tick, 5);
  EXPECT_NE(status.validity_cause.find("the attitude is 0.002 rad"), std::string::npos)
      << status.validity_cause;
  EXPECT_EQ(status.worst_validity_cause, status.validity_cause);
  EXPECT_EQ(status.judged_tick, 7);
  EXPECT_EQ(status.judged_every, 1);
  EXPECT_EQ(status.judgements_late, 3);
  EXPECT_EQ(status.position_error, 1e-5);
  EXPECT_EQ(status.attitude_error, 2e-3);
  EXPECT_EQ(status.deformation_error, 1e-4);
  EXPECT_EQ(status.shadow_error, 1e-6);
  EXPECT_EQ(status.displacement_now, 1e-3);
  EXPECT_EQ(status.error_scale, 2e-3);
}

/// Returns the status of a motion that has no verdict for the given reason.
status_t unjudged(const Scene& scene, NotJudged why, std::int64_t verdict_tick = -1) {
  Report report(reduced_plan_of(scene));
  Verdict& verdict = report.snapshot.verdict;
  verdict.tick = verdict_tick;
  if (verdict_tick >= 0) verdict.level = Verdict::Level::kWatch, verdict.cause = Verdict::Cause::kAttitude;
  report.snapshot.worst = verdict;
  report.snapshot.not_judged = why;
  return report.now();
}

TEST(Status, WithoutAVerdictItIsNotJudgedAndTheCauseIsGiven) {
  Scene scene_that_is_off = stretched_pair();
  scene_that_is_off.verdict.is_off = true;
  const struct {
    Scene scene;
    NotJudged why;
    const char* cause;
  } cases[] = {
      {stretched_pair(), NotJudged::kNotYet, "no tick is judged yet"},
      {stretched_pair(), NotJudged::kProcessors, "fewer than 3"},
      {stretched_pair(), NotJudged::kBehind, "too far behind the simulation"},
      {stretched_pair(), NotJudged::kOff, "the daemon was started with --verdict off"},
      {scene_that_is_off, NotJudged::kOff, "the scene has verdict: off"},
  };
  for (const auto& each : cases) {
    const status_t status = unjudged(each.scene, each.why);
    EXPECT_EQ(status.validity, status_t::NOT_JUDGED) << each.cause;
    EXPECT_EQ(status.worst_validity, status_t::NOT_JUDGED) << each.cause;
    EXPECT_EQ(status.worst_validity_cause, "");
    EXPECT_EQ(status.worst_validity_tick, -1);
    EXPECT_EQ(status.judged_tick, -1);
    EXPECT_NE(status.validity_cause.find(each.cause), std::string::npos) << status.validity_cause;
  }
  // feedback of the acceleration has no better plan
  Scene fed = stretched_pair();
  fed.feedbacks.push_back(
      {"f", 0, 0, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero(), -0.1 * Eigen::Matrix3d::Identity(), {}});
  const status_t status = unjudged(fed, NotJudged::kOff);
  EXPECT_NE(status.validity_cause.find("no better plan supports the scene: acceleration feedback"),
            std::string::npos)
      << status.validity_cause;
  EXPECT_EQ(status.judged_every, 0);
}

// A thread that has fallen behind has old verdicts. They must not be published as present ones, but the worst
// of them stays.
TEST(Status, OfTheVerdictsFromBeforeTheThreadFellBehindOnlyTheWorstIsPublished) {
  const status_t status = unjudged(stretched_pair(), NotJudged::kBehind, 7);
  EXPECT_EQ(status.validity, status_t::NOT_JUDGED);
  EXPECT_EQ(status.worst_validity, status_t::WATCH);
  EXPECT_NE(status.worst_validity_cause, "");
  EXPECT_NE(status.validity_cause.find("RESET judges again"), std::string::npos) << status.validity_cause;
}

TEST(Status, TheTruncationBoundIsMinusOneIfThePlanOmitsModes) {
  EXPECT_EQ(Report(stretched_pair()).now().truncation_bound, 0.0);
  Report report(stretched_pair());
  PlanFeature left_out;
  left_out.feature = Feature::kSmallModes;
  left_out.is_left_out = true;
  left_out.count = 1;
  report.plan.features.push_back(left_out);
  StatusReporter reduced{report.plan, report.identity, *report.output, *report.shared, report.ingress};
  report.snapshot.motion = report.motion.state();
  EXPECT_EQ(reduced.report(report.snapshot, 1).truncation_bound, -1.0);
}

TEST(Status, DriftIsMeasuredFromTheEndOfThePush) {
  Scene scene = octahedron();
  publish_everything(scene);
  Report report(scene);
  EXPECT_EQ(report.now().energy_drift, 0.0) << "without energy there is no drift";
  ForceCommand push = make_push(1);
  push.duration_ticks = 100;
  report.run(50, {&push, 1});
  EXPECT_EQ(report.now().energy_drift, 0.0) << "the drift is zero during a push";
  report.run(60);
  EXPECT_GT(report.now().kinetic_rigid, 0.0);
  report.run(1000);
  const status_t free = report.now();
  // the drift of energy and momentum due to rounding errors is far smaller than this bound, but if the work
  // of the push were included, the drift would be 1
  EXPECT_LT(free.energy_drift, 1e-12);
  EXPECT_LT(free.momentum_drift, 1e-12);
  EXPECT_LT(free.eckart_residual, 1e-13);
}

// in lockstep a daemon may take a thousand steps before its first report
TEST(Status, DriftIsMeasuredFromTheStartEvenIfTheFirstReportIsLate) {
  Report report(stretched_pair());
  report.run(1000);
  MotionState larger = report.motion.state();
  for (auto* each : {&larger.q, &larger.q_dot})
    for (double& x : *each) x *= 1.001;
  EXPECT_NEAR(report.now(larger).energy_drift, 2.001e-3, 1e-9);
}

TEST(Status, AnOrbitKeepsItsEnergy) {
  Scene scene = stretched_pair();
  scene.rate = 0.1;
  scene.attractor.mu = 3.986004418e14;
  scene.initial.points.clear();
  scene.initial.position = {7e6, 0.0, 0.0};
  scene.initial.velocity = {0.0, 9000.0, 0.0};
  Scene point = scene;
  point.points.resize(1);
  point.points[0].position = Eigen::Vector3d::Zero();
  point.links.clear();
  point.publication.links.clear();
  point.publication.points = point.pushable = {0};
  Report report(point);
  report.run(2000);
  EXPECT_GT(std::abs(report.now().kinetic_rigid / (0.5 * 9000.0 * 9000.0) - 1.0), 0.1)
      << "the altitude has changed";
  EXPECT_LT(report.now().energy_drift, 1e-13);
}

TEST(Status, FreeFallKeepsItsEnergy) {
  Scene scene = stretched_pair();
  scene.gravity = Eigen::Vector3d(0.0, 0.0, -9.81);
  Report report(scene);
  report.run(1001);
  // the drift is relative to the 0.8 mJ of the oscillation. 96 J of kinetic energy and of potential energy
  // cancel, with 8 rounding errors
  EXPECT_LT(report.now().energy_drift, 8 * 2.2e-16 * 96.0 / 0.8e-3);
}

TEST(Status, DissipatedEnergyIsNotCountedAsDrift) {
  Scene scene = stretched_pair();
  scene.damping.modal_ratio = 0.1;
  Report report(scene);
  report.run(510);
  EXPECT_EQ(report.now().energy_drift, 0.0);
}

TEST(Status, RejectionsByTheIngressAndByTheLoopAreAddedForEachReason) {
  Report report(stretched_pair());
  report.shared->rejections[10] = 3;
  report.shared->received = 12;
  report.output->num_rejected[17] = 2;
  report.output->num_rejected[10] = 1;
  report.output->num_accepted = 6;
  report.ingress.restarts = 4;
  report.ingress.hangs = 3;
  report.output->num_dropped[0] = 7;
  report.output->num_dropped[1] = 8;
  report.output->num_dropped[2] = 9;
  report.shared->dropped_answers = 5;
  const status_t status = report.now();
  EXPECT_EQ(status.states_dropped, 7);
  EXPECT_EQ(status.points_dropped, 8);
  EXPECT_EQ(status.loads_dropped, 9);
  EXPECT_EQ(status.answers_dropped, 5);
  EXPECT_EQ(status.commands_received, 12);
  EXPECT_EQ(status.commands_accepted, 6);
  EXPECT_EQ(status.ingress_restarts, 4);
  EXPECT_EQ(status.ingress_hangs, 3);
  ASSERT_EQ(status.num_rejections, 2);
  EXPECT_EQ(status.rejections[0].reason, 10);
  EXPECT_EQ(status.rejections[0].count, 4);
  EXPECT_EQ(status.rejections[1].reason, 17);
  EXPECT_EQ(status.rejections[1].count, 2);
}

TEST(Status, AFaultIsPublishedWithItsTickAndCommand) {
  Snapshot snapshot;
  snapshot.mode = Mode::kFault;
  snapshot.fault.tick = 77;
  snapshot.fault.num_commands = 2;
  snapshot.fault.sender = {'p', 'i', 'd'};
  snapshot.fault.sequence = 9;
  const std::string text = service::fault_text(snapshot);
  for (const char* part : {"tick 77", "not finite", "pid with sequence number 9", "RESET"}) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  }
}

TEST(Status, ImpossibleCountsFromTheIngressAreLimited) {
  service::ReportedCount count;
  EXPECT_EQ(count.take(-5), 0);
  EXPECT_EQ(count.take(INT64_MIN), 0);
  EXPECT_EQ(count.take(10), 10);
  EXPECT_EQ(count.take(3), 10) << "a count never decreases";
  EXPECT_EQ(count.take(INT64_MAX), 10 + service::ReportedCount::kMostAtOnce);
  Report report(stretched_pair());
  report.shared->received.store(-7);
  report.shared->rejections[3].store(INT64_MIN);
  EXPECT_EQ(report.now().commands_received, 0);
  EXPECT_EQ(report.now().num_rejections, 0);
}

}  // namespace
}  // namespace freeflex::testing
