#include "core/plan/make_plan.hpp"

#include <algorithm>
#include <cmath>
#include <new>

#include "core/limits.hpp"
#include "core/plan/automatic.hpp"
#include "core/plan/budget.hpp"
#include "core/plan/compile.hpp"
#include "core/plan/leave_out.hpp"
#include "core/plan/motion.hpp"
#include "core/plan/start.hpp"
#include "core/scene/bodies.hpp"
#include "core/scene/faults.hpp"

namespace freeflex {
namespace {

// [s] from which a load acts.
double begin_of(const History& history) {
  if (const auto* pulse = std::get_if<PulseHistory>(&history)) return pulse->start;
  const auto* table = std::get_if<TableHistory>(&history);
  if (table == nullptr || table->values.empty() || table->values.front() != 0.0) return 0.0;
  std::size_t k = 1;
  while (k < table->values.size() && table->values[k] == 0.0) ++k;
  return table->times[k - 1];
}

// Says which loads begin after what was judged has ended.
void warn_of_late_loads(const Scene& scene, const char* judge, double horizon, Faults& faults) {
  for (std::size_t k = 0; k < scene.loads.size(); ++k)
    if (const double begin = begin_of(scene.loads[k].history); begin >= horizon)
      add_warning(faults, scene.loads[k].origin,
                  join_text("load ", quoted(scene.loads[k].name, static_cast<int>(k)), " begins at ", begin,
                            " s, after the horizon of ", horizon, " s over which ", judge,
                            " judges, and counts for nothing there; take a longer horizon"));
}

// Of some points, each once, those where nothing that has mass moves at once.
std::vector<int> massless_of(const Scene& scene, std::vector<int> points) {
  std::vector<bool> is_loose(scene.points.size());
  for (std::size_t i = 0; i < scene.points.size(); ++i) is_loose[i] = scene.points[i].mass == 0.0;
  for (const Link& link : scene.links)
    if (std::holds_alternative<Rigid>(link.kind) || has_mass(link))
      for (const int point : link.points) is_loose[static_cast<std::size_t>(point)] = false;
  std::erase_if(points, [&](int point) { return !is_loose[static_cast<std::size_t>(point)]; });
  std::ranges::sort(points);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

constexpr int kNamed = 8;  // points in a message

// Links hold such points where the others are: what they are given at the start is no motion.
void warn_of_massless_start(const Scene& scene, Faults& faults) {
  std::vector<int> given;
  for (const auto& each : scene.initial.points)
    if (!each.displacement.isZero(0.0) || !each.velocity.isZero(0.0)) given.push_back(each.point);
  const std::vector<int> points = massless_of(scene, std::move(given));
  if (!points.empty())
    add_warning(
        faults, scene.initial.origin,
        join_text("the initial displacement and velocity of ", points.size() == 1 ? "point " : "points ",
                  point_names(scene, points, kNamed), points.size() == 1 ? ", which has" : ", which have",
                  " no mass, have no effect: links hold such points where the others are; give those "
                  "the displacement, or these a mass"));
}

// Says which loads act where nothing that has mass moves at once: what they bend there is in no mode (X162).
void warn_of_massless_loads(const Scene& scene, Faults& faults) {
  std::vector<int> loaded(scene.pushable);
  for (const Load& load : scene.loads)
    for (const PointLoad& each : load.forces) loaded.push_back(each.point);
  const std::vector<int> points = massless_of(scene, std::move(loaded));
  if (points.empty()) return;
  add_warning(
      faults, scene.points[static_cast<std::size_t>(points.front())].origin,
      join_text(points.size() == 1 ? "point " : "points ", point_names(scene, points, kNamed),
                points.size() == 1 ? " has" : " have",
                " no mass: what a load there bends of the links at it is not in its place, nor in the "
                "forces of those links; the rest of the structure feels the load as it is. Give a mass "
                "to the point, or mass to its links"));
}

// what needs every mode of a structure that has the lowest alone
void check_kept(const Scene& scene, const Structure& structure, Faults& faults) {
  if (scene.modes.below > 0.0 && structure.omega.size() == 0)
    add_warning(faults, scene.modes.origin,
                join_text("modes: no elastic mode is below ", scene.modes.below, " Hz, nor below ",
                          structure.kept.counted_below,
                          " Hz: this structure moves as a rigid body; give more, in Hz, or count"));
  if (!scene.modes.is_asked() && structure.kept.is_part && structure.omega.size() == 0)
    add_warning(faults, scene.points.front().origin,
                join_text("no elastic mode is below half the rate, ", 0.5 * scene.rate,
                          " Hz, the lowest of a structure "
                          "of so many points that are taken by default, nor below ",
                          structure.kept.counted_below,
                          " Hz: this structure moves as a rigid body; ask for more with modes: {count: N}"));
  if (!structure.kept.is_part || scene.automatic || !traits_of(scene.fidelity).has_true_geometry) return;
  add_error(
      faults, scene.modes.origin,
      join_text("fidelity: ", name_of(scene.fidelity), " needs every elastic mode, of which the lowest ",
                structure.omega.size(), " are kept (modes:, or more than ", kMaxDensePoints,
                " points); take separated, spin-loaded or coupled"));
}

// where the modes of a plan stand among those of a wider one
std::vector<std::int32_t> places(const std::vector<int>& few, const std::vector<int>& many) {
  std::vector<std::int32_t> places;
  places.reserve(few.size());
  for (const int mode : few)
    places.push_back(
        static_cast<std::int32_t>(std::lower_bound(many.begin(), many.end(), mode) - many.begin()));
  return places;
}

// the plan less what the scene does not need, and what commands bring back
std::optional<Plan> compile_lean(const Scene& scene, const Structure& structure, const PlanSpec& spec,
                                 const Plan& whole, Faults& faults) {
  LeanSpec lean = leave_out_unneeded(scene, structure, spec, whole);
  std::optional<Plan> plan = compile(scene, *lean.structure, lean.spec, faults);
  if (!plan) return std::nullopt;
  if (leave_out_small_modes(scene, *plan, lean)) {
    plan = compile(scene, *lean.structure, lean.spec, faults);
    if (!plan) return std::nullopt;
  }
  plan->parts = lean.parts;
  plan->neglect.left_out = lean.small_size;
  plan->tolerance = scene.leave_out.tolerance;
  plan->horizon = lean.horizon;
  if (const std::optional<PlanSpec> open = wide_spec(scene, lean)) {
    std::optional<Plan> wide = compile(scene, *lean.structure, *open, faults);
    if (!wide) return std::nullopt;
    plan->wide.push_back(std::move(*wide));
    plan->wide_modes = places(lean.spec.modes, open->modes);
  }
  return plan;
}

// the coupled plan less its small modes
std::optional<Plan> compile_without_small_modes(const Scene& scene, const Structure& structure,
                                                const PlanSpec& spec, const Plan& whole, Faults& faults) {
  LeanSpec lean = keep_all(scene, structure, spec);
  leave_out_small_modes(scene, whole, lean);
  std::optional<Plan> plan = compile(scene, *lean.structure, lean.spec, faults);
  if (!plan) return std::nullopt;
  plan->parts = lean.parts;
  plan->neglect.left_out = lean.small_size;
  plan->tolerance = scene.leave_out.tolerance;
  plan->horizon = lean.horizon;
  return plan;
}

// the plan of a spec with everything in it, and what is to be said of it
std::optional<Plan> compile_whole(const Scene& scene, const Structure& structure, const PlanSpec& spec,
                                  Faults& faults) {
  std::optional<Plan> plan = compile(scene, structure, spec, faults);
  if (plan) check_motion(scene, structure, *plan, faults);
  if (has_error(faults)) return std::nullopt;
  return plan;
}

// the plan that `make` makes, or a fault where memory does not reach
template <typename Make>
std::optional<Plan> within_memory(const Scene& scene, const Structure& structure, Faults& faults,
                                  const Make& make) {
  try {
    return make();
  } catch (const std::bad_alloc&) {
    const double rows = 8e-6 * static_cast<double>(structure.shapes.size());
    add_error(faults, scene.points.empty() ? Origin{} : scene.points.front().origin,
              join_text("memory ran out while the plan was compiled: ", scene.points.size(), " points with ",
                        structure.omega.size(), " modes, whose rows take some ", std::ceil(rows),
                        " MB where all points are published", kMoreMemory));
    return std::nullopt;
  }
}

std::optional<Plan> make_checked_plan(const Scene& scene, const Structure& structure, Faults& faults) {
  check_start(scene, structure, faults);
  check_kept(scene, structure, faults);
  warn_of_massless_loads(scene, faults);
  warn_of_massless_start(scene, faults);
  if (scene.leave_out.tolerance > 0.0)
    warn_of_late_loads(scene, "leave_out: tolerance", scene.leave_out.horizon, faults);
  if (scene.automatic) warn_of_late_loads(scene, "fidelity: auto", scene.automatic->horizon, faults);
  if (has_error(faults)) return std::nullopt;

  std::vector<PlanRung> tried;
  std::optional<Fidelity> rung = scene.fidelity;
  if (scene.automatic) rung = choose_rung(scene, structure, tried, faults);
  if (!rung) return std::nullopt;
  const PlanSpec spec = whole_spec(scene, structure, *rung);
  // with everything in it first: what is wrong with a scene is said of the scene
  std::optional<Plan> plan = compile_whole(scene, structure, spec, faults);
  if (!plan) return std::nullopt;
  if (may_leave_out(scene, *rung))
    plan = compile_lean(scene, structure, spec, *plan, faults);
  else if (may_leave_out_modes(scene, structure, *rung))
    plan = compile_without_small_modes(scene, structure, spec, *plan, faults);
  else
    plan->parts = account_of_whole(scene, *rung, faults);
  if (!plan) return std::nullopt;
  plan->tried_rungs = std::move(tried);
  compile_budget(scene, structure, *plan, faults);
  if (has_error(faults)) return std::nullopt;
  return plan;
}

}  // namespace

std::optional<Plan> make_whole_plan(const Scene& scene, const Structure& structure, Fidelity rung,
                                    Faults& faults) {
  return within_memory(scene, structure, faults, [&] {
    check_start(scene, structure, faults);
    return compile_whole(scene, structure, whole_spec(scene, structure, rung), faults);
  });
}

std::optional<Plan> make_plan(const Scene& scene, const Structure& structure, Faults& faults) {
  return within_memory(scene, structure, faults, [&] { return make_checked_plan(scene, structure, faults); });
}

}  // namespace freeflex
