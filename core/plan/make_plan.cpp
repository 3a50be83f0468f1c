#include "core/plan/make_plan.hpp"

#include <algorithm>
#include <cmath>
#include <new>

#include "core/limits.hpp"
#include "core/plan/check_motion.hpp"
#include "core/plan/compile.hpp"
#include "core/plan/omit/leave_out.hpp"
#include "core/plan/rungs/automatic.hpp"
#include "core/plan/rungs/rates.hpp"
#include "core/plan/rungs/shadow.hpp"
#include "core/plan/start.hpp"

namespace freeflex {
namespace {

// Returns the time at which a load starts to act [s].
double begin_of(const History& history) {
  return std::visit(
      Cases{[](const ConstantHistory&) { return 0.0; }, [](const PulseHistory& pulse) { return pulse.start; },
            [](const SineHistory&) { return 0.0; },
            [](const TableHistory& table) {
              if (table.values.empty() || table.values.front() != 0.0) return 0.0;
              std::size_t k = 1;
              while (k < table.values.size() && table.values[k] == 0.0) ++k;
              return table.times[k - 1];
            }},
      history);
}

// Warns of loads that begin after the horizon over which the rung or the small modes were judged
// (THEORY 12.28).
void warn_of_late_loads(const Scene& scene, const char* judge, double horizon, Faults& faults) {
  for (std::size_t k = 0; k < scene.loads.size(); ++k)
    if (const double begin = begin_of(scene.loads[k].history); begin >= horizon)
      add_warning(faults, scene.loads[k].origin,
                  join_text("load ", quoted(scene.loads[k].name, static_cast<int>(k)), " begins at ", begin,
                            " s, after the horizon of ", horizon, " s, so ", judge,
                            " ignores this load; set a longer horizon"));
}

// Returns the massless points among the given points, each once. Points of rigid links and of links with mass
// are excluded.
std::vector<int> massless_of(const Scene& scene, const ResolvedScene& resolved, std::vector<int> points) {
  std::vector<bool> is_massless(scene.points.size());
  for (std::size_t i = 0; i < scene.points.size(); ++i) is_massless[i] = scene.points[i].mass == 0.0;
  for (std::size_t k = 0; k < scene.links.size(); ++k)
    if (resolved.links[k].is_rigid() || resolved.links[k].has_mass)
      for (const int point : scene.links[k].points) is_massless[index(point)] = false;
  std::erase_if(points, [&](int point) { return !is_massless[index(point)]; });
  std::ranges::sort(points);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

constexpr int kNamed = 8;  // largest number of points that a message lists

// Warns if the scene gives an initial motion of massless points, because their motion follows from that of
// the other points.
void warn_of_massless_start(const Scene& scene, const ResolvedScene& resolved, Faults& faults) {
  std::vector<int> given;
  for (const auto& each : scene.initial.points)
    if (!each.displacement.isZero(0.0) || !each.velocity.isZero(0.0)) given.push_back(each.point);
  const std::vector<int> points = massless_of(scene, resolved, std::move(given));
  if (!points.empty())
    add_warning(
        faults, scene.initial.origin,
        join_text("the initial displacement and velocity of ", points.size() == 1 ? "point " : "points ",
                  point_names(scene, points, kNamed), points.size() == 1 ? ", which has" : ", which have",
                  " no mass, are ignored, because massless points follow the points with mass; displace "
                  "those, or give a mass to the massless points"));
}

// Warns of loads on massless points. No mode includes the deformation due to such a load, because the
// freedoms of massless points are condensed   (THEORY 16.7).
void warn_of_massless_loads(const Scene& scene, const ResolvedScene& resolved, Faults& faults) {
  std::vector<int> loaded(scene.pushable);
  for (const Load& load : scene.loads)
    for (const PointLoad& each : load.forces) loaded.push_back(each.point);
  const std::vector<int> points = massless_of(scene, resolved, std::move(loaded));
  if (points.empty()) return;
  add_warning(
      faults, scene.points[index(points.front())].origin,
      join_text(
          points.size() == 1 ? "point " : "points ", point_names(scene, points, kNamed),
          points.size() == 1 ? " has" : " have",
          " no mass. If a load acts there, the deformation that it causes in the adjacent links is missing "
          "from the position and from the forces of these links; the rest of the structure receives the "
          "full load. Give a mass to the point, or mass to its links"));
}

// Warns if no mode of the structure is kept. Adds an error if the rung needs all modes but only the lowest
// are kept.
void check_kept(const Scene& scene, const Structure& structure, Faults& faults) {
  if (scene.modes.below > 0.0 && structure.omega.size() == 0)
    add_warning(faults, scene.modes.origin,
                join_text("modes: no elastic mode is below ", scene.modes.below,
                          " Hz (the search went up to ", structure.kept.verified_below,
                          " Hz), so this structure moves as a rigid body; raise 'below:', or give 'count:'"));
  if (!scene.modes.is_asked() && structure.kept.is_subset && structure.omega.size() == 0)
    add_warning(faults, scene.points.front().origin,
                join_text("no elastic mode is below half the rate, ", 0.5 * scene.rate,
                          " Hz (the default limit for a structure of so many points; the search went up to ",
                          structure.kept.verified_below,
                          " Hz), so this structure moves as a rigid body; request more modes with modes: "
                          "{count: N}"));
  if (!structure.kept.is_subset || scene.automatic || !traits_of(scene.fidelity).has_true_geometry) return;
  add_error(faults, scene.modes.origin,
            join_text("fidelity: ", name_of(scene.fidelity), " needs all elastic modes, but only the lowest ",
                      structure.omega.size(), " are kept (because of modes:, or of more than ",
                      kMaxDensePoints, " points); set fidelity: separated, spin-loaded or coupled"));
}

// Returns, for each mode of a plan, the index of this mode in the fallback plan.
std::vector<std::int32_t> modes_in_fallback(const std::vector<int>& few, const std::vector<int>& many) {
  std::vector<std::int32_t> modes_in_fallback;
  modes_in_fallback.reserve(few.size());
  for (const int mode : few)
    modes_in_fallback.push_back(
        static_cast<std::int32_t>(std::lower_bound(many.begin(), many.end(), mode) - many.begin()));
  return modes_in_fallback;
}

// Returns the plan without the features that the scene does not need, together with its fallback plan. Sets
// `of_plan` to the structure from which it was compiled.
std::optional<Plan> compile_reduced(const Scene& scene, const Structure& structure, const PlanSpec& spec,
                                    const Plan& full, std::shared_ptr<const Structure>& of_plan,
                                    Faults& faults) {
  ReducedSpec reduced = leave_out_unneeded(scene, structure, spec, full);
  of_plan = reduced.structure;
  std::optional<Plan> plan = compile(scene, *reduced.structure, reduced.spec, faults);
  if (!plan) return std::nullopt;
  if (leave_out_small_modes(scene, *plan, reduced)) {
    plan = compile(scene, *reduced.structure, reduced.spec, faults);
    if (!plan) return std::nullopt;
  }
  plan->features = std::move(reduced.features);
  plan->tolerance = scene.leave_out.tolerance;
  plan->horizon = reduced.horizon;
  if (const std::optional<PlanSpec> open = fallback_spec(scene, reduced)) {
    std::optional<Plan> fallback = compile(scene, *reduced.structure, *open, faults);
    if (!fallback) return std::nullopt;
    plan->fallback.push_back(std::move(*fallback));
    plan->fallback_modes = modes_in_fallback(reduced.spec.modes, open->modes);
  }
  return plan;
}

// Returns the coupled plan without its small modes.
std::optional<Plan> compile_without_small_modes(const Scene& scene, const Structure& structure,
                                                const PlanSpec& spec, const Plan& full, Faults& faults) {
  ReducedSpec reduced = keep_all(scene, structure, spec);
  leave_out_small_modes(scene, full, reduced);
  std::optional<Plan> plan = compile(scene, *reduced.structure, reduced.spec, faults);
  if (!plan) return std::nullopt;
  plan->features = std::move(reduced.features);
  plan->tolerance = scene.leave_out.tolerance;
  plan->horizon = reduced.horizon;
  return plan;
}

// Returns the full plan of a spec, and reports the faults of its motion at `rate` [Hz]. If `rate` is 0, this
// is the rate of the scene.
std::optional<Plan> compile_full(const Scene& scene, const Structure& structure, const PlanSpec& spec,
                                 double rate, Faults& faults) {
  std::optional<Plan> plan = compile(scene, structure, spec, faults);
  if (plan && rate > 0.0 && rate != scene.rate) {
    Plan stepped = *plan;
    set_rate(stepped, rate);
    check_motion(scene, structure, stepped, faults);
  } else if (plan) {
    check_motion(scene, structure, *plan, faults);
  }
  if (has_error(faults)) return std::nullopt;
  return plan;
}

// Returns the plan that `make` returns. If memory runs out, reports an error.
template <typename Make>
std::optional<Plan> within_memory(const Scene& scene, const Structure& structure, Faults& faults,
                                  const Make& make) {
  try {
    return make();
  } catch (const std::bad_alloc&) {
    const double rows = 8e-6 * static_cast<double>(structure.shapes.size());
    add_error(faults, scene.points.empty() ? Origin{} : scene.points.front().origin,
              join_text("memory ran out while the plan of ", scene.points.size(), " points with ",
                        structure.omega.size(),
                        " modes was compiled; if all points are published, their mode-shape "
                        "rows take some ",
                        std::ceil(rows), " MB", kMoreMemory));
    return std::nullopt;
  }
}

std::optional<Plan> make_checked_plan(const Scene& scene, const Structure& structure, double rate,
                                      Faults& faults) {
  check_start(scene, structure, faults);
  check_kept(scene, structure, faults);
  if (scene.automatic || !traits_of(scene.fidelity).has_true_geometry)
    warn_of_massless_loads(scene, structure.resolved, faults);
  warn_of_massless_start(scene, structure.resolved, faults);
  if (scene.leave_out.tolerance > 0.0)
    warn_of_late_loads(scene, "leave_out: tolerance", scene.leave_out.horizon, faults);
  if (scene.automatic) warn_of_late_loads(scene, "fidelity: auto", scene.automatic->horizon, faults);
  if (has_error(faults)) return std::nullopt;

  std::vector<PlanRung> tried;
  std::optional<Fidelity> rung = scene.fidelity;
  if (scene.automatic) rung = choose_rung(scene, structure, tried, faults);
  if (!rung) return std::nullopt;
  const PlanSpec spec = full_spec(scene, structure, *rung);
  // the full plan is compiled first, so that faults of the scene are found even if they concern features that
  // are omitted later
  std::optional<Plan> plan = compile_full(scene, structure, spec, rate, faults);
  if (!plan) return std::nullopt;
  std::shared_ptr<const Structure> of_plan;
  if (may_leave_out(structure, *rung))
    plan = compile_reduced(scene, structure, spec, *plan, of_plan, faults);
  else if (may_leave_out_modes(scene, structure, *rung))
    plan = compile_without_small_modes(scene, structure, spec, *plan, faults);
  else
    plan->features = report_on_full_plan(scene, structure, *rung, faults);
  if (!plan) return std::nullopt;
  plan->tried_rungs = std::move(tried);
  compile_verdict(scene, structure, of_plan ? *of_plan : structure, *plan);
  return plan;
}

}  // namespace

std::optional<Plan> make_full_plan(const Scene& scene, const Structure& structure, Fidelity rung,
                                   Faults& faults) {
  return within_memory(scene, structure, faults, [&] {
    check_start(scene, structure, faults);
    return compile_full(scene, structure, full_spec(scene, structure, rung), 0.0, faults);
  });
}

std::optional<Plan> make_plan(const Scene& scene, const Structure& structure, Faults& faults, double rate) {
  return within_memory(scene, structure, faults,
                       [&] { return make_checked_plan(scene, structure, rate, faults); });
}

}  // namespace freeflex
