// Scenes that must be refused or reported in a message with the expected words. No such scene may run without
// a message.
#include <array>
#include <initializer_list>
#include <memory>

#include "core/error/verdict.hpp"
#include "core/plan/rungs/automatic.hpp"
#include "core/structure/structure.hpp"
#include "service/clock.hpp"
#include "service/io/wire/codec.hpp"
#include "tools/verification/stability/ride.hpp"
#include "tools/verification/stability/scenes.hpp"

namespace freeflex::tools {
namespace {

/// Counts the expected words that a message lacks.
Outcome named(const std::string& message, std::initializer_list<const char*> words) {
  Outcome outcome{0.0, message.empty() ? "no message" : message, {}};
  for (const char* word : words) outcome.measured += message.find(word) == std::string::npos ? 1.0 : 0.0;
  return outcome;
}

Outcome coincident_points(bool is_joined) {
  Scene scene = square_truss(2, 1e4);
  add_point(scene, 1.0, scene.points[3].position);
  for (const int i : {0, 1, 2, 4}) add_link(scene, {i, 8}, Spring{1e4});
  if (is_joined) add_link(scene, {3, 8}, Spring{1e4});
  const Ride ride(scene);
  if (is_joined && ride.has_plan()) return no_answer("a link of zero length was accepted");
  return named(ride.faults_text(), {"in one place", "'p3'", "'p8'"});
}

/// Checks that the verdict on a motion after 0.1 s is not `good`, and names the better rung.
Outcome verdict_of(const Scene& scene) {
  Ride ride(scene);
  if (!ride.has_plan()) return no_answer(ride.faults_text());
  if (!ride.run(100)) return no_answer("a state is not finite");
  const Verdict verdict = ride.verdict();
  // the other text must not contain the words that are looked for
  const bool is_good = verdict.level == Verdict::Level::kGood;
  return named(is_good ? "good" : text_of(ride.plan, verdict), {"the same motion on the rung corotational"});
}

Outcome too_much_spin() {
  Scene scene = square_truss(5, 1e5);
  scene.initial.angular_velocity = {0.0, 0.0, 5.0};
  add_force(scene, 18, {0.48, 0.6, 0.64});
  return verdict_of(scene);
}

Outcome too_much_deformation(Fidelity rung, double force) {
  Scene scene = square_truss(5, 1e5);
  scene.fidelity = rung;
  add_force(scene, 18, force * Eigen::Vector3d(0.48, 0.6, 0.64));
  return verdict_of(scene);
}

/// Checks that the step reports a state that is not finite and leaves the state as it was before the step.
Outcome beyond_numbers() {
  Scene scene = square_truss(3, 1e5);
  scene.fidelity = Fidelity::kCoupled;
  add_force(scene, 10, {0.0, 1e200, 0.0});
  Ride ride(scene);
  if (!ride.has_plan()) return no_answer(ride.faults_text());
  if (ride.run(10'000)) return named("every state was finite", {"not finite"});
  const bool is_kept = ride.positions_W().allFinite();
  return named(
      is_kept ? "the step reports a state that is not finite, and keeps the one before" : "not finite",
      {"not finite", "keeps the one before"});
}

/// Checks that a command at the force limit is accepted and that a command above the limit is refused.
Outcome too_much_force(bool is_over) {
  constexpr double kLimit = 1e6;  // [N]
  Scene scene = square_truss(3, 1e5);
  scene.force_limit = kLimit;
  const Ride ride(scene);
  if (!ride.has_plan()) return no_answer(ride.faults_text());
  const auto table = std::make_unique<io::NameTable>();
  io::fill_name_table(ride.plan, *table);
  const auto command = std::make_unique<ForceCommand>();
  command->sender[0] = 'a';
  command->sequence = 1;
  command->start_tick = -1;
  command->duration_ticks = 1;
  command->num_points = 1;
  command->points[0] = {5, 0, {0.0, is_over ? kLimit * (1.0 + 1e-12) : kLimit, 0.0}};
  std::array<char, 160> text{};
  const io::Reason reason = io::check_command(*command, *table, text);
  if (!is_over) return named(io::reason_name(reason), {"accepted"});
  return named(std::string(io::reason_name(reason)) + ": " + text.data(),
               {"over_limit", "the scene allows at most"});
}

Outcome unmet_tolerance() {
  Scene scene = square_truss(3, 1e5);
  scene.initial.angular_velocity = {0.0, 0.0, 3.0};
  add_force(scene, 10, {5.0, 20.0, 30.0});
  scene.automatic = AutomaticRung{1e-18, {}, {}, 0.2, {}};
  Faults faults;
  const auto structure = build_structure(scene, faults);
  if (!structure) return no_answer("no structure");
  std::vector<PlanRung> tried;
  const auto rung = choose_rung(scene, *structure, tried, faults);
  if (rung) return named(std::string("took ") + name_of(*rung), {"no rung meets"});
  return named(faults.empty() ? "" : faults.back().message, {"no rung meets the tolerance", "corotational"});
}

Outcome bars_at_a_long_period() {
  Scene scene = stiff_truss(1e15, 1.0);
  scene.fidelity = Fidelity::kCorotational;
  const Ride ride(scene);
  if (ride.has_plan()) return no_answer("a plan was made");
  return named(ride.faults_text(), {"corotational", "the stiffest mode"});
}

/// Checks a dashpot that is too fast for the tick. Rungs on which dashpots act at stage times must refuse the
/// dashpot, but the rung `full` must divide the tick and run.
Outcome dashpot_too_fast(Fidelity rung) {
  Scene scene = square_truss(3, 1e5);
  Link dashpot;
  dashpot.name = "damper";
  dashpot.points = {0, 1};
  dashpot.kind = Dashpot{1e5};
  scene.links.push_back(dashpot);
  scene.fidelity = rung;
  add_force(scene, 10, {0.1, 0.2, 0.3});
  Ride ride(scene);
  if (!ride.has_plan()) return named(ride.faults_text(), {"at stage times", "set fidelity: full"});
  if (rung != Fidelity::kFull) return no_answer("a plan was made");
  const bool is_finite = ride.run(200) && ride.positions_W().allFinite();
  return named(is_finite ? format_text("accepted, with %d substeps per tick", ride.plan.coupled.num_substeps)
                         : "not finite",
               {"accepted"});
}

/// Runs the daemon's pacer on the clock of this machine, with a step that takes longer than its period. The
/// pacer must report this.
Outcome unheld_period(const StabilityOptions& options) {
  constexpr double kRateOfScene = 1e6;  // [Hz] the highest rate that a scene may set
  constexpr std::int64_t kMostTicks = 20'000'000;
  Scene scene = square_truss(8, 1e5);
  scene.fidelity = Fidelity::kCorotational;
  scene.rate = kRateOfScene;
  Ride ride(scene);
  if (!ride.has_plan()) return no_answer(ride.faults_text());
  service::MonotonicClock clock;
  service::Pacer pacer(1e9 / kRateOfScene);
  pacer.rebase(clock.now_ns());
  while (pacer.num_slips() == 0 && ride.state().tick < kMostTicks && !options.is_stopped()) {
    clock.sleep_until(pacer.deadline_ns());
    if (!ride.run(1)) return no_answer("a state is not finite");
    pacer.finish_tick(clock.now_ns());
  }
  if (pacer.num_slips() == 0) return named("the period was held", {"does not hold the period"});
  return named(service::slip_text(ride.plan.period, pacer.num_slips()), {"does not hold the period of 1 us"});
}

}  // namespace

void add_refusal_cases(std::vector<StabilityCase>& cases) {
  const auto add = [&cases](const char* name, auto run) {
    cases.push_back({"must be refused or flagged", name, "expected words that are missing", 0.0, true, run});
  };
  using Options = StabilityOptions;
  add("coincident points, joined", [](const Options&) { return coincident_points(true); });
  add("coincident points, not joined", [](const Options&) { return coincident_points(false); });
  add("spin beyond validity", [](const Options&) { return too_much_spin(); });
  add("deformation beyond validity, separated",
      [](const Options&) { return too_much_deformation(Fidelity::kSeparated, 1.2e4); });
  add("deformation beyond validity, coupled",
      // at 1e5 N the truss buckles, and the run stops with a state that is not finite
      [](const Options&) { return too_much_deformation(Fidelity::kCoupled, 3e4); });
  add("a force beyond the range of doubles", [](const Options&) { return beyond_numbers(); });
  add("a force at force_limit is accepted", [](const Options&) { return too_much_force(false); });
  add("a force over force_limit", [](const Options&) { return too_much_force(true); });
  add("a tolerance that no rung meets", [](const Options&) { return unmet_tolerance(); });
  add("corotational at too long a period", [](const Options&) { return bars_at_a_long_period(); });
  add("a dashpot too fast for the stages of the rung coupled",
      [](const Options&) { return dashpot_too_fast(Fidelity::kCoupled); });
  add("a dashpot too fast for the stages of the rung corotational",
      [](const Options&) { return dashpot_too_fast(Fidelity::kCorotational); });
  add("the same dashpot on the rung full is accepted",
      [](const Options&) { return dashpot_too_fast(Fidelity::kFull); });
  add("a period that this machine cannot hold",
      [](const Options& options) { return unheld_period(options); });
}

}  // namespace freeflex::tools
