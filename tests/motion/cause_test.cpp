// Each cause of a verdict reports the responsible item, and mentions nothing that the scene does not contain.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>

#include "core/plan/loads/quasi_static.hpp"
#include "service/io/scene/input.hpp"
#include "tests/motion/verdict_bodies.hpp"
#include "tests/motion/verdict_cases.hpp"
#include "tests/motion/watched.hpp"

namespace freeflex::testing {
namespace {

using Level = Verdict::Level;
using Cause = Verdict::Cause;
using Eigen::Vector3d;

// The scene has eleven points of 1 kg on ten beams of 1 m. The lowest bending mode is at 8.785 rad/s. The
// value of EI / L^2 is 22 N.
constexpr double kLowest = 8.785, kBend = 22.0;
Scene free_beam(Fidelity rung) {
  Scene scene;
  for (int k = 0; k <= 10; ++k) add_point(scene, 1.0, {1.0 * k, 0.0, 0.0});
  for (int k = 0; k < 10; ++k)
    add_link(scene, {k, k + 1},
             Beam{.EA = 1e7, .GJ = 2000.0, .EI_y = 2200.0, .EI_z = 2200.0, .y_axis = Vector3d::UnitY()});
  scene.fidelity = rung;
  scene.rate = 500.0;
  scene.initial.modes = {{1, 1e-3, 0.0}, {2, 1e-3, 0.0}};
  return scene;
}
void load(Scene& scene, const std::string& name, const std::vector<PointLoad>& forces,
          Axes axes = Axes::kBody) {
  Load each;
  each.name = name;
  each.axes = axes;
  each.forces = forces;
  scene.loads.push_back(each);
}

// Expects that a text mentions only items of the plan.
void expect_only_what_is_there(const Plan& plan, const std::string& text) {
  const auto has_kind = [&](const char* kind) {
    return std::any_of(plan.links.begin(), plan.links.end(), [&](const PlanLink& link) {
      return traits_of(link.type).name == std::string_view(kind);
    });
  };
  const std::map<std::string, bool> mentioned = {
      {"matrix", has_kind("matrix")},
      {"rigid link", has_kind("rigid")},
      {"plate", has_kind("plate")},
      {"beam", has_kind("beam")},
      {"bar ", has_kind("bar")},
      {"spring", has_kind("spring")},
      {"wheel", !plan.wheels.empty()},
      {"attractor", plan.attractor_mu > 0.0},
      {"gravity", plan.attractor_mu > 0.0},
      {"orbit", plan.attractor_mu > 0.0},
      {"load 1", !plan.histories.empty()},
      {"error budget", !plan.budget.shadows.empty()},
      {"omitted", !plan.features.empty() || plan.unmodelled.lacks_modes != LacksModes::kNone},
      {"leave_out", plan.tolerance > 0.0},
      {"tolerance", plan.tolerance > 0.0 || plan.unmodelled.tolerance > 0.0},
      {"rung is rigid", plan.fidelity == Fidelity::kRigid},
  };
  for (const auto& [word, is_there] : mentioned)
    if (!is_there) {
      EXPECT_EQ(text.find(word), std::string::npos) << word << " in: " << text;
    }
  EXPECT_LT(text.size(), 256U) << "the text is longer than the C interface allows: " << text;
  // each name in quotes must be a name of the plan
  std::set<std::string> names;
  for (const PlanHistory& history : plan.histories) names.insert(history.name);
  for (const PlanLink& link : plan.links) names.insert(link.name);
  for (const PlanWheel& wheel : plan.wheels) names.insert(wheel.name);
  for (std::size_t open = text.find('\''); open != std::string::npos;) {
    const std::size_t close = text.find('\'', open + 1);
    ASSERT_NE(close, std::string::npos) << text;
    EXPECT_TRUE(names.contains(text.substr(open + 1, close - open - 1))) << text;
    open = text.find('\'', close + 1);
  }
}

// Returns the causes that occur during some ticks, each with the first text that reports it. Every text may
// mention only items of the plan.
using Causes = std::map<Cause, std::string>;
Causes causes_of(Watched& watched, int ticks, const Inputs& first = {}) {
  Judgement judgement(watched.plan);
  judgement.take(watched.state, watched.budget);
  Causes causes;
  for (int k = 0; k < ticks; ++k) {
    step(watched.plan, watched.state, k == 0 ? first : Inputs{}, watched.workspace, watched.budget,
         watched.report);
    if (watched.report.status != StepStatus::kOk) break;
    judgement.take(watched.state, watched.budget);
    const Verdict& now = judgement.now();
    if (now.level == Level::kGood) continue;
    const std::string text = text_of(watched.plan, now);
    expect_only_what_is_there(watched.plan, text);
    causes.try_emplace(now.cause, text);
  }
  return causes;
}
void expect_cause(const char* what, const Causes& causes, Cause cause,
                  const std::vector<std::string>& names) {
  const auto found = causes.find(cause);
  if (found == causes.end()) {
    std::string all;
    for (const auto& [each, text] : causes) all += std::to_string(static_cast<int>(each)) + " " + text + "\n";
    ADD_FAILURE() << what << " has not cause " << static_cast<int>(cause) << " but\n" << all;
    return;
  }
  std::printf("%-24s %s\n", what, found->second.c_str());
  for (const std::string& name : names)
    EXPECT_NE(found->second.find(name), std::string::npos)
        << what << ": " << name << " in: " << found->second;
}

// A case holds a scene, the cause that the verdict must report, and the names that the text must contain.
struct Case {
  const char* what;
  Scene scene;
  double end;  // [s]
  Cause cause;
  std::vector<std::string> names;
};

Scene spun(Scene scene, double spin) {
  scene.initial.angular_velocity = {0.0, 0.0, spin};
  return scene;
}

std::vector<Case> cases_of_model_error() {
  std::vector<Case> all;
  Scene thrust = free_beam(Fidelity::kSpinLoaded);
  load(thrust, "small", {{5, {0.0, 1e-9, 0.0}}});
  load(thrust, "thrust", {{0, {20.0 * kBend, 0.0, 0.0}}});
  all.push_back({"thrust", thrust, 4.0, Cause::kStiffness, {"load 'thrust'", "mode "}});
  all.push_back({"spin",
                 spun(free_beam(Fidelity::kSpinLoaded), 0.2 * kLowest),
                 2.0,
                 Cause::kStiffness,
                 {"the spin", "mode "}});
  Scene ends = free_beam(Fidelity::kSpinLoaded);
  ends.initial.modes.clear();
  const double buckles = 1.1 * M_PI * M_PI * kBend;
  load(ends, "squeeze", {{0, {buckles, 0.0, 0.0}}, {10, {-buckles, 0.0, 0.0}}});
  all.push_back({"buckling", ends, 1.0, Cause::kBuckling, {"load 'squeeze'", " (1.398 Hz)", "buckling"}});
  Scene centrifugal = boxed_truss(0.5, 0.0);
  centrifugal.loads.clear();
  all.push_back({"centrifugal", centrifugal, 0.5, Cause::kSpinLoad, {"centrifugal", "spin"}});
  Scene rigid = spun(free_beam(Fidelity::kRigid), 0.1);
  rigid.initial.modes.clear();
  all.push_back({"rigid", rigid, 0.1, Cause::kRigid, {"rigid"}});
  Scene fast = free_beam(Fidelity::kCoupled);
  load(fast, "hum", {{0, {0.0, 1e-6, 0.0}}});
  fast.loads[0].history = SineHistory{fast.rate / 5.0, 0.0};
  all.push_back({"fast load", fast, 0.1, Cause::kFastLoad, {"load 'hum'"}});
  Scene nameless = fast;
  nameless.loads[0].name.clear();
  all.push_back({"fast load without a name", nameless, 0.1, Cause::kFastLoad, {"load 1 "}});
  Scene near = free_beam(Fidelity::kCoupled);
  near.attractor.mu = 1.0;
  near.attractor.position = {0.0, 0.0, -150.0};
  all.push_back({"attractor", near, 0.1, Cause::kAttractor, {"attractor"}});
  Scene bent = free_beam(Fidelity::kSeparated);
  publish_everything(bent);
  bent.initial.modes = {{7, 0.05, 0.0}};
  all.push_back({"deformation", bent, 0.05, Cause::kDeformation, {"mode 7 ("}});
  Scene stretched = spring_pair(1.0, 1.0, 1.0, 100.0);
  stretched.initial.points = {{0, {-0.02, 0.0, 0.0}, Vector3d::Zero()},
                              {1, {0.02, 0.0, 0.0}, Vector3d::Zero()}};
  all.push_back({"size", stretched, 0.1, Cause::kSize, {"mode 1 (2.251 Hz)", " m, "}});
  return all;
}

// Among several loads, the cause reports the load that changes the modal stiffness, not the load that bends
// most.
std::vector<Case> cases_of_several_loads() {
  std::vector<Case> all;
  const std::vector<PointLoad> pair = {{0, {kBend, 0.0, 0.0}}, {10, {-kBend, 0.0, 0.0}}},
                               trim = {{0, {0.0, 0.1, 0.0}}, {5, {0.0, -0.2, 0.0}}, {10, {0.0, 0.1, 0.0}}};
  // the rung `coupled` has the stiffness by these loads
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kSpinLoaded}) {
    Scene both = free_beam(rung);
    load(both, "squeeze", pair);
    load(both, "trim", trim);
    all.push_back({"squeeze beside trim", both, 2.0, Cause::kStiffness, {"load 'squeeze'", "mode "}});
    both.loads[0].history = SineHistory{2.0 * kLowest / (2.0 * M_PI), 0.0};
    all.push_back({"sine beside trim", both, 4.0, Cause::kStiffness, {"load 'squeeze'", "mode "}});
  }
  Scene held = free_beam(Fidelity::kSeparated);
  held.initial.modes.clear();
  load(held, "trim", trim);
  load(held, "squeeze",
       {{0, {0.8 * M_PI * M_PI * kBend, 0.0, 0.0}}, {10, {-0.8 * M_PI * M_PI * kBend, 0.0, 0.0}}});
  load(held, "pull", {{4, {-3.0 * kBend, 0.0, 0.0}}, {6, {3.0 * kBend, 0.0, 0.0}}});
  all.push_back({"buckling beside a pull", held, 0.5, Cause::kBuckling, {"load 'squeeze'"}});
  Scene wheels;
  for (const double mass : {10.0, 1.0, 1.0}) {
    add_point(wheels, mass, {static_cast<double>(wheels.points.size()), 0.0, 0.0});
    wheels.points.back().inertia = 0.1 * mass * Eigen::Matrix3d::Identity();
  }
  for (int k = 0; k < 2; ++k)
    add_link(wheels, {k, k + 1},
             Beam{.EA = 1e5, .GJ = 100.0, .EI_y = 100.0, .EI_z = 100.0, .y_axis = Vector3d::UnitY()});
  wheels.wheels = {{"idle", 1, Vector3d::UnitY(), 0.0, {}}, {"big", 0, Vector3d::UnitZ(), 5.0, {}}};
  wheels.initial.modes = {{1, 1e-3, 0.0}};
  all.push_back(
      {"wheel", wheels, 5.0, Cause::kStiffness, {"the gyroscopic forces that wheel 'big' adds", "mode "}});
  load(wheels, "tiny", {{2, {0.0, 0.0, 1e-6}}});
  all.push_back({"wheel beside a tiny load", wheels, 5.0, Cause::kStiffness, {"wheel 'big'"}});
  all.push_back({"wheel beside a slow spin", spun(wheels, 1e-3), 5.0, Cause::kStiffness, {"wheel 'big'"}});
  return all;
}

// Returns cases of errors that cannot be quantified: one for each kind of link, one for a wheel and one for
// omitted modes.
std::vector<Case> cases_of_unquantified_error() {
  std::vector<Case> all;
  all.push_back({"matrix",
                 spun(as_matrix(free_beam(Fidelity::kCoupled)), 0.34 * kLowest),
                 2.0,
                 Cause::kUnquantified,
                 {"inside matrix link 'K'", "the error may be as large as "}});
  Scene rigid = free_beam(Fidelity::kSpinLoaded);
  rigid.links[4].kind = Rigid{};
  rigid.links[4].name = "strut";
  rigid.initial.modes = {{4, 0.03, 0.0}};
  rigid.tolerance = 10.0;
  all.push_back({"rigid link",
                 rigid,
                 0.1,
                 Cause::kUnquantified,
                 {"inside rigid link 'strut'", "the displacement of "}});
  Scene heavy = free_beam(Fidelity::kCoupled);
  std::get<Beam>(heavy.links[9].kind).mass_per_length = 0.5;
  heavy.links[9].name = "boom tip";
  all.push_back(
      {"mass within a beam", spun(heavy, 0.3), 2.0, Cause::kUnquantified, {"mass within beam 'boom tip'"}});
  Scene wheel;
  for (const double x : {0.0, 2.0}) {
    add_point(wheel, 3.0, {x, 0.0, 0.0});
    wheel.points.back().inertia = Vector3d(0.4, 0.5, 0.7).asDiagonal();
  }
  add_link(wheel, {0, 1},
           Beam{.EA = 5e5, .GJ = 700.0, .EI_y = 900.0, .EI_z = 1300.0, .y_axis = Vector3d::UnitY()});
  wheel.wheels = {{"spare", 1, Vector3d::UnitY(), 0.0, {}}, {"rotor", 0, Vector3d::UnitX(), 2.0, {}}};
  wheel.initial.modes = {{5, 1e-4, 0.0}, {6, 1e-4, 0.0}};
  wheel.rate = 2000.0;
  wheel.tolerance = 1e-3;
  all.push_back({"wheel", spun(wheel, 1.0), 2.0, Cause::kUnquantified, {"axis of wheel 'rotor'"}});
  Scene few = free_beam(Fidelity::kSeparated);
  few.modes.count = 4;
  few.initial.modes = {{1, 1e-3, 0.0}};
  all.push_back({"lowest modes alone", few, 0.1, Cause::kNotKept, {"lowest modes"}});
  return all;
}

Scene diverging() {
  Scene scene = watched_truss(Fidelity::kSeparated, 10.0, 0.0);
  scene.loads[0].forces = {{18, {1e120, 0.0, 0.0}}, {14, {-1e120, 0.0, 0.0}}};
  return scene;
}

std::vector<Case> cases_of_the_tick_and_the_budget() {
  std::vector<Case> all;
  Scene tumble = octahedron(1e8);
  for (PointMass& point : tumble.points) point.mass *= 1.0 + 0.2 * point.position.norm();
  tumble.initial.angular_velocity = {0.003, 0.03, 0.002};
  Load spin_up;
  spin_up.name = "spin-up";
  spin_up.forces = {{0, {0.0, 40.0, 0.0}}, {1, {0.0, -40.0, 0.0}}};
  spin_up.axes = Axes::kBody;
  tumble.loads.push_back(spin_up);
  tumble.tolerance = 1.0;
  tumble.fidelity = Fidelity::kCoupled;
  tumble.rate = 50.0;
  all.push_back({"tumble", tumble, 10.0, Cause::kStep, {"the body rotates", "raise the rate to"}});
  Scene shaken = octahedron(1e8);
  shaken.initial.angular_velocity = {0.0, 0.0, 1.0};
  shaken.initial.modes = {{12, 1e-3, 0.0}};
  shaken.tolerance = 1e-3;
  shaken.fidelity = Fidelity::kCoupled;
  shaken.rate = 1000.0;
  all.push_back({"fast vibration", shaken, 2.0, Cause::kStep, {"mode ", "the tick is too long to resolve "}});
  all.push_back({"lost", diverging(), 0.05, Cause::kLost, {"diverged"}});
  all.push_back({"model beside it",
                 watched_truss(Fidelity::kSeparated, 0.5, 0.2),
                 0.45,
                 Cause::kModel,
                 {"error budget"}});
  Scene moved = watched_truss(Fidelity::kSeparated, 0.2, 2.0);
  moved.tolerance = 10.0;
  all.push_back({"position", moved, 2.0, Cause::kPosition, {"position", " m from their true positions"}});
  Scene coarse = boxed_truss(0.7, 0.0);
  coarse.loads.clear();
  for (const int point : {16, 18})
    coarse.initial.points.push_back(
        {point, {0.0, 1e-5 * (point - 17), 1e-5 * (point - 17)}, Vector3d::Zero()});
  coarse.fidelity = Fidelity::kCoupled;
  coarse.rate = 18.0;
  coarse.error_budget.horizon = 10.0;
  coarse.tolerance = 1e-5;
  all.push_back({"integration", coarse, 4.0, Cause::kIntegration, {"raise the rate"}});
  return all;
}

void expect_all(const std::vector<Case>& cases) {
  for (const Case& each : cases) {
    SCOPED_TRACE(each.what);
    Watched watched(each.scene);
    expect_cause(each.what, causes_of(watched, static_cast<int>(std::lround(each.end * each.scene.rate))),
                 each.cause, each.names);
  }
}

TEST(Cause, ModelErrorIsAttributedToItsLoadAndMode) { expect_all(cases_of_model_error()); }
TEST(Cause, ModelErrorIsAttributedToTheLoadThatChangesTheModalStiffness) {
  expect_all(cases_of_several_loads());
}
TEST(Cause, QuasiStaticErrorIsAttributedToTheCommandedLoadOrTheSpin) {
  Scene scene = free_beam(Fidelity::kSpinLoaded);
  publish_everything(scene);
  const Plan plan = reduced_plan_of(scene);
  const auto text_of_steady = [&](const std::vector<PointForce>& forces, double spin) {
    std::string error;
    const std::optional<State> state = quasi_static(plan, {forces, {}, {0.0, spin, 0.0}}, error);
    return state ? text_of(plan, judge_steady(plan, *state)) : error;
  };
  const std::string by_load = text_of_steady(
      {{0, 0, {kBend, 0.0, 0.0}}, {10, 0, {-kBend, 0.0, 0.0}}, {5, 0, {0.0, -0.01, 0.0}}}, 0.0);
  EXPECT_NE(by_load.find("that the commanded load causes"), std::string::npos) << by_load;
  const std::string by_spin = text_of_steady(
      {{0, 0, {0.0, 0.01, 0.0}}, {10, 0, {0.0, 0.01, 0.0}}, {5, 0, {0.0, -0.02, 0.0}}}, 0.3 * kLowest);
  EXPECT_NE(by_spin.find("the spin of the body"), std::string::npos) << by_spin;
}
TEST(Cause, UnquantifiedErrorIsAttributedToItsLinkOrWheel) { expect_all(cases_of_unquantified_error()); }
TEST(Cause, TheCauseOfTickOrBudgetErrorIsReportedWithItsRemedy) {
  expect_all(cases_of_the_tick_and_the_budget());
}

TEST(Cause, ErrorAfterACommandIsAttributedToTheCommandAndOmittedModes) {
  Scene scene = free_beam(Fidelity::kSeparated);
  scene.publication.points = {10};
  scene.pushable = {10};
  scene.leave_out.tolerance = 0.2;
  Watched watched(scene);
  ForceCommand command = make_command(1, 1, Axes::kBody, 50);
  add_force(command, 10, {0.0, 0.1, 0.0});
  expect_cause("pushed omitted modes", causes_of(watched, 500, {std::span(&command, 1)}), Cause::kTruncation,
               {"omitted modes", "small_modes", "commanded load", "leave_out: tolerance"});
  Scene pushed = free_beam(Fidelity::kSpinLoaded);
  pushed.pushable = {0};
  Watched by_command(pushed);
  ForceCommand thrust = make_command(0, 1, Axes::kBody);
  add_force(thrust, 0, {20.0 * kBend, 0.0, 0.0});
  expect_cause("commanded thrust", causes_of(by_command, 1000, {std::span(&thrust, 1)}), Cause::kStiffness,
               {"the commanded load", "mode "});
}

TEST(Cause, TheCauseForAPlanWithoutTablesStatesThatItHasNone) {
  Watched watched(free_beam(Fidelity::kSeparated));
  watched.plan.unmodelled = {};
  expect_cause("no tables", causes_of(watched, 10), Cause::kUnknown, {"no tables for the verdict"});
}

// This is a regression test. On a scene without a matrix link and without a rigid link, a verdict reported
// such a link as the cause.
TEST(Cause, ErrorInAShippedSceneIsAttributedOnlyToItsOwnContents) {
  for (const char* name : {"boom.yaml", "satellite.yaml", "rotor.yaml", "network.yaml", "ring.yaml",
                           "mast.yaml", "truss104.yaml", "truss-s1.yaml", "truss-s4.yaml", "truss-s5.yaml"}) {
    const io::SceneResult read = io::read_scene(std::string(FREEFLEX_SOURCE_DIR) + "/service/scenes/" + name);
    ASSERT_TRUE(read.scene) << name;
    for (const double spin : {0.0, 0.3}) {
      SCOPED_TRACE(name);
      Scene scene = *read.scene;
      scene.tolerance = 0.0;
      scene.initial.angular_velocity.z() += spin;
      Watched watched(scene);
      for (const auto& [cause, text] : causes_of(watched, static_cast<int>(1.5 * scene.rate)))
        std::printf("%-15s %s\n", name, text.c_str());
    }
  }
}

TEST(Cause, ErrorInARandomStructureIsAttributedOnlyToItsOwnContents) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kCoupled}) {
      Scene scene = RandomScene(seed).judged();
      scene.fidelity = rung;
      Watched watched(scene);
      causes_of(watched, 500);
    }
    Scene bodies = RandomBodies(seed).scene();
    Watched watched(bodies);
    causes_of(watched, 500);
  }
}

TEST(Cause, TheErrorIsReportedAsAPercentageOfAStatedScale) {
  Plan plan = reduced_plan_of(free_beam(Fidelity::kSeparated));
  Verdict verdict;
  verdict.error = 1.2e-6, verdict.scale = 1e-3, verdict.displacement_now = 1e-4;
  EXPECT_EQ(error_text(plan, verdict), "0.12 % of the recent peak displacement, 0.001 m");
  verdict.displacement_now = 1e-3;
  EXPECT_EQ(error_text(plan, verdict), "0.12 % of the displacement, 0.001 m");
  plan.unmodelled.tolerance = 1e-3;
  EXPECT_EQ(error_text(plan, verdict), "0.12 % of the tolerance, 0.001 m");
  verdict.error = 2.53e-3;
  EXPECT_EQ(error_text(plan, verdict), "250 % of the tolerance, 0.001 m");
  verdict.error = 0.5;
  EXPECT_EQ(error_text(plan, verdict), "more than 10 times the tolerance, 0.001 m");
  plan.unmodelled.is_known = false;
  EXPECT_EQ(error_text(plan, verdict), "not known");
  EXPECT_EQ(share_text(0.0, 0.0), "0 % of");
}

TEST(Cause, ErrorOfFastLoadsIsAttributedToTheLargestAndNeverToAZeroLoad) {
  Scene scene = free_beam(Fidelity::kCoupled);
  scene.initial.modes.clear();
  const auto fast_load = [&](const char* name, double force) {
    load(scene, name, {{0, {0.0, force, 0.0}}});
    scene.loads.back().history = SineHistory{0.4 * scene.rate, 0.0};
  };
  fast_load("zero", 0.0);
  Watched without(scene);
  EXPECT_TRUE(causes_of(without, 50).empty());
  fast_load("hum", 1e-12);
  fast_load("buzz", 10.0);
  for (const Fidelity rung : {Fidelity::kRigid, Fidelity::kSeparated, Fidelity::kCoupled}) {
    scene.fidelity = rung;
    Watched watched(scene);
    expect_cause("fast loads", causes_of(watched, 50), Cause::kFastLoad, {"load 'buzz'"});
  }
}

TEST(Cause, ACommandIsTheCauseOfTruncationOnlyIfItMovesOmittedModesMost) {
  Scene scene = free_beam(Fidelity::kSeparated);
  scene.publication.points = {10};
  scene.pushable = {10};
  scene.leave_out.tolerance = 0.2;
  Watched watched(scene);
  watched.plan.unmodelled.left_out = 1e-4;
  ForceCommand command = make_command(1, 1, Axes::kBody, 50);
  add_force(command, 10, {0.0, 1e-12, 0.0});
  const Causes causes = causes_of(watched, 100, {std::span(&command, 1)});
  expect_cause("a negligible push", causes, Cause::kTruncation, {"would move"});
}

// No mode is omitted and the second-order terms of every link are known. Only the change of stiffness between
// two ticks is unknown.
TEST(Cause, ErrorOfAModeTooFastForTheTickIsNotAttributedToOmittedModes) {
  Scene scene = free_beam(Fidelity::kSeparated);
  Watched watched(scene);
  ResponsibleFinder finder(watched.plan);
  ModalLeaders leaders;
  leaders.unquantified = watched.plan.num_elastic - 1;
  const std::string last = "mode " + std::to_string(watched.plan.num_elastic) + " (";
  Verdict verdict;
  verdict.level = Level::kWatch, verdict.cause = Cause::kUnquantified, verdict.scale = 1e-3,
  verdict.unquantified = 1e-4;
  ASSERT_FALSE(watched.plan.unmodelled.has_unquantified);
  verdict.responsible = finder.of_unquantified(leaders, watched.state);
  const std::string fast = text_of(watched.plan, verdict);
  EXPECT_NE(fast.find(last), std::string::npos) << fast;
  EXPECT_NE(fast.find("raise the rate"), std::string::npos) << fast;
  EXPECT_EQ(fast.find("omitted"), std::string::npos) << fast;
  EXPECT_NE(fast.find("; the error may be as large as 10 % of the "), std::string::npos) << fast;
  verdict.unquantified = 2e-2;
  const std::string large = text_of(watched.plan, verdict);
  EXPECT_NE(large.find("; the error may be more than 10 times the "), std::string::npos) << large;
  watched.plan.unmodelled.lacks_modes = LacksModes::kSmallModes;
  verdict.responsible = finder.of_unquantified(leaders, watched.state);
  EXPECT_NE(text_of(watched.plan, verdict).find("omitted modes"), std::string::npos);
}

TEST(Cause, LongNamesWithACommonBeginningStayDistinct) {
  Scene scene = free_beam(Fidelity::kSeparated);
  const std::string name = "main-engine-thrust-of-the-upper-stage-";
  for (const char* end : {"A", "B"}) load(scene, name + end, {{0, {0.0, 1.0, 0.0}}});
  const Plan plan = reduced_plan_of(scene);
  Verdict verdict;
  verdict.level = Level::kWatch, verdict.cause = Cause::kStiffness, verdict.scale = 1.0;
  std::set<std::string> texts;
  for (const std::int32_t load : {0, 1}) {
    verdict.responsible = {Responsible::Agent::kLoad, load, 1, 1.0};
    texts.insert(text_of(plan, verdict));
  }
  EXPECT_EQ(texts.size(), 2U) << *texts.begin();
}

// The text must not report "watch: ... 2 %" if 2 % is the limit of "good".
TEST(Cause, AFigureAboveALimitIsNeverRoundedToTheLimit) {
  EXPECT_EQ(share_text(0.0203, 1.0), "2.03 % of");
  EXPECT_EQ(share_text(0.02003, 1.0), "2.003 % of");
  EXPECT_EQ(share_text(0.2012, 1.0), "20.1 % of");
  EXPECT_EQ(share_text(0.02, 1.0), "2 % of");
  EXPECT_EQ(share_text(0.0197, 1.0), "2 % of");
  EXPECT_EQ(share_text(0.0213, 1.0), "2.1 % of");
}

}  // namespace
}  // namespace freeflex::testing
