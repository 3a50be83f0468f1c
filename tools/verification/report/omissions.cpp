#include "tools/verification/report/omissions.hpp"

#include <algorithm>
#include <array>

#include "core/motion.hpp"
#include "core/plan/file/plan_bytes.hpp"
#include "core/plan/make_plan.hpp"
#include "tools/verification/report/measure.hpp"

namespace freeflex::tools {
namespace {

constexpr double kTolerance = 1e-3;  // [-] tolerance for small modes if the scene gives none
constexpr int kTurns = 15;
constexpr double kTurn = 4e-3;  // [s] least CPU time of one plan in one turn

/// Steps a plan and returns the CPU time of a tick [s].
class Stepper {
 public:
  explicit Stepper(const Plan& plan) : motion_(plan, kMotionAlone) {
    time(1);
    while (time(ticks_) * static_cast<double>(ticks_) < kTurn && ticks_ < (std::int64_t{1} << 40))
      ticks_ *= 2;
  }
  double time() { return time(ticks_); }

 private:
  double time(std::int64_t ticks) {
    const double start = thread_cpu();
    for (std::int64_t k = 0; k < ticks; ++k)
      if (motion_.advance().status != StepStatus::kOk) motion_.reset();
    return (thread_cpu() - start) / static_cast<double>(ticks);
  }

  Motion motion_;
  std::int64_t ticks_ = 1;
};

double median(std::array<double, kTurns> values) {
  std::nth_element(values.begin(), values.begin() + kTurns / 2, values.end());
  return values[kTurns / 2];
}

/// Times two plans in turns, so that both meet the same state of the machine.
void time_in_turns(const Plan& with, const Plan& without, OmissionRow& row) {
  Stepper a(with), b(without);
  std::array<double, kTurns> ns_with{}, ns_without{}, ratios{};
  for (std::size_t turn = 0; turn < kTurns; ++turn) {
    ns_with[turn] = 1e9 * a.time();
    ns_without[turn] = 1e9 * b.time();
    ratios[turn] = ns_without[turn] / ns_with[turn];
  }
  row.ns_with = median(ns_with);
  row.ns_without = median(ns_without);
  row.ratio = median(ratios);
  row.bytes_with = static_cast<double>(plan_to_bytes(with).size());
  row.bytes_without = static_cast<double>(plan_to_bytes(without).size());
}

std::optional<Plan> plan_with(Scene scene, const Structure& structure, OnNeed on_need,
                              std::optional<Feature> kept = std::nullopt) {
  scene.leave_out.on_need = on_need;
  if (kept) scene.leave_out.keeps[static_cast<std::size_t>(*kept)] = true;
  Faults faults;
  return make_plan(scene, structure, faults);
}

}  // namespace

std::string omission_name(const OmissionRow& row) {
  return row.feature ? name_of(*row.feature) : "second_plan";
}

std::vector<OmissionRow> study_omissions(const Scene& given, const std::function<bool(double)>& keep_going) {
  std::vector<OmissionRow> rows;
  Faults faults;
  const std::optional<Structure> structure = build_structure(given, faults);
  if (!structure) return rows;
  Scene scene = given;
  const std::optional<Plan> as_written = plan_with(scene, *structure, scene.leave_out.on_need);
  if (scene.leave_out.tolerance == 0.0) scene.leave_out.tolerance = kTolerance;
  const std::optional<Plan> without = plan_with(scene, *structure, OnNeed::kRefuse);
  if (!as_written || !without || without->features.size() != kNumFeatures) return rows;
  for (int k = 0; k <= kNumFeatures && keep_going(static_cast<double>(k) / (kNumFeatures + 1)); ++k) {
    OmissionRow row;
    row.scene = scene.name;
    if (k == kNumFeatures) {
      const std::optional<Plan> keep = plan_with(scene, *structure, OnNeed::kKeep),
                                replan = plan_with(scene, *structure, OnNeed::kReplan);
      row.is_default = !as_written->fallback.empty();
      if (keep && replan && !replan->fallback.empty())
        time_in_turns(*keep, *replan, row);
      else
        row.why = "no command needs an omitted feature";
    } else {
      row.feature = static_cast<Feature>(k);
      const auto at = index(k);
      const PlanFeature& feature = without->features[at];
      row.is_default = as_written->features[at].is_left_out;
      row.count = feature.count;
      if (!feature.is_left_out)
        row.why = feature.why;
      else if (const std::optional<Plan> with = plan_with(scene, *structure, OnNeed::kRefuse, row.feature))
        time_in_turns(*with, *without, row);
      else
        row.why = "no plan has this feature";
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace freeflex::tools
