#include "core/plan/leave_out.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <set>

#include "core/plan/arrays.hpp"
#include "core/plan/budget.hpp"
#include "core/plan/motion_scope.hpp"
#include "core/plan/reach.hpp"
#include "core/plan/reduce.hpp"
#include "core/plan/small_modes.hpp"
#include "core/scene/faults.hpp"

namespace freeflex {
namespace {

std::size_t index(Part part) { return static_cast<std::size_t>(part); }

InitialModes initial_modes(const Plan& plan) {
  const Eigen::Map<const Eigen::VectorXd> q(plan.initial.q.data(), plan.num_elastic),
      q_dot(plan.initial.q_dot.data(), plan.num_elastic);
  return {q, q_dot};
}

// most of a mode's motion is along the normal
bool is_out_of_plane(const Structure& structure, int mode, const Eigen::Vector3d& normal) {
  double along = 0.0, whole = 0.0;
  for (Eigen::Index i = 0; i < structure.shapes.rows(); i += 3) {
    const Eigen::Vector3d b = structure.shapes.block<3, 1>(i, mode);
    along += b.dot(normal) * b.dot(normal);
    whole += b.squaredNorm();
  }
  return along > 0.5 * whole;
}

// a scene with its modes aligned to what reaches them, and the choices made on it
class Lean {
 public:
  Lean(const Scene& scene, const Structure& structure, Plan full)
      : scene_(scene), structure_(structure), full_(std::move(full)), initial_(initial_modes(full_)) {
    parts_.resize(kNumParts);
    for (int k = 0; k < kNumParts; ++k) parts_[static_cast<std::size_t>(k)].part = static_cast<Part>(k);
  }

  std::optional<Plan> compile(Faults& faults) {
    if (scene_.fidelity == Fidelity::kRigid || scene_.fidelity >= Fidelity::kCoupled) {
      for (PlanPart& part : parts_)
        part.why = scene_.fidelity == Fidelity::kRigid ? "the rigid rung is advanced whole"
                                                       : "the coupled rungs need a complete set of modes";
      full_.parts = parts_;
      if (scene_.leave_out.tolerance > 0.0)
        add_warning(faults, scene_.leave_out.origin,
                    std::string("leave_out: tolerance has no effect on fidelity ") +
                        name_of(scene_.fidelity) +
                        ", which is advanced whole; leave it out, or take separated or spin-loaded");
      return std::move(full_);
    }
    const bool with_commands = scene_.leave_out.on_need == OnNeed::kKeep;
    const MotionScope open = find_motion_scope(scene_, structure_, true);
    scope_ = find_motion_scope(scene_, structure_, with_commands);
    keep_as_told();
    judge_code();
    judge_modes();
    std::optional<Plan> plan = compile_small(faults);
    if (!plan) return std::nullopt;
    if (scene_.leave_out.on_need == OnNeed::kReplan && is_bound()) {
      std::optional<Plan> wide = compile_wide(open, faults);
      if (!wide) return std::nullopt;
      plan->wide.push_back(std::move(*wide));
      plan->wide_modes = places(kept_, wide_kept_);
    }
    return plan;
  }

 private:
  PlanPart& part(Part which) { return parts_[index(which)]; }
  bool keeps(Part which) const { return scene_.leave_out.keeps[index(which)]; }
  bool is_bound() const { return scope_.binds_rotation || scope_.binds_plane; }

  void leave(Part which, int count, std::string why) {
    part(which).is_left_out = true;
    part(which).count = count;
    part(which).why = std::move(why);
  }

  // a part that is told to stay is one that commands may use
  void keep_as_told() {
    if (keeps(Part::kRotation) && !scope_.turns) {
      scope_.turns = true;
      scope_.binds_rotation = false;
      scope_.why_turns = "told to stay";
    }
    was_planar_ = scope_.is_planar;
    if (keeps(Part::kOutOfPlane) && scope_.is_planar) {
      scope_.is_planar = !scope_.binds_plane;
      scope_.binds_plane = false;
      scope_.why_not_planar = "told to stay";
    }
  }

  // damping, gravity, rotation, rows of points
  void judge_code() {
    const bool damps =
        structure_.damping_rows.rows() > 0 ||
        std::any_of(full_.decay.begin(), full_.decay.end(), [](double decay) { return decay > 0.0; });
    if (damps)
      part(Part::kDamping).why = "modes are damped";
    else if (keeps(Part::kDamping))
      part(Part::kDamping).why = "told to stay";
    else
      leave(Part::kDamping, 0, "no mode is damped");
    if (!scene_.gravity.isZero(0.0) || scene_.attractor.mu > 0.0)
      part(Part::kGravity).why = "the scene has a field";
    else if (keeps(Part::kGravity))
      part(Part::kGravity).why = "told to stay";
    else
      leave(Part::kGravity, 0, "the scene has no field");
    if (scope_.turns)
      part(Part::kRotation).why = scope_.why_turns;
    else
      leave(Part::kRotation, 0, scope_.why_turns);
    const auto without_rows = std::count_if(full_.points.begin(), full_.points.end(),
                                            [](const PlanPoint& point) { return point.row < 0; });
    if (keeps(Part::kPointRows))
      part(Part::kPointRows).why = "told to stay";
    else if (without_rows == 0)
      part(Part::kPointRows).why = "every point is read or loaded";
    else
      leave(Part::kPointRows, static_cast<int>(without_rows), "points that nobody reads or loads");
    code_.damps = !part(Part::kDamping).is_left_out;
    code_.falls = !part(Part::kGravity).is_left_out;
    code_.turns = scope_.turns;
    code_.scope = {scope_.binds_rotation, scope_.binds_plane, to_array(scope_.normal), to_array(scope_.R_WB)};
  }

  // every mode moves some point some way: no need to look further, which takes long in large scenes
  bool reaches_all(const MotionScope& scope) const {
    const std::set<int> pushed(scene_.pushable.begin(), scene_.pushable.end());
    return !scope.binds_plane && pushed.size() == scene_.points.size();
  }

  // which modes nothing reaches, and of those which move along the normal
  void judge_modes() {
    if (full_.num_elastic == 0) {
      for (const Part which : {Part::kOutOfPlane, Part::kUnreachedModes})
        part(which).why = "there are no modes";
      return;
    }
    if (reaches_all(scope_)) {
      kept_.resize(static_cast<std::size_t>(full_.num_elastic));
      std::iota(kept_.begin(), kept_.end(), 0);
      part(Part::kOutOfPlane).why = scope_.why_not_planar;
      part(Part::kUnreachedModes).why = "commands may push every point any way";
      return;
    }
    align_modes(scene_, reach_rows(scene_, structure_, scope_, initial_), structure_, initial_);
    const std::vector<int> reached =
        reached_modes(reach_rows(scene_, structure_, scope_, initial_), structure_);
    int num_out = 0, num_unreached = 0;
    for (int mode = 0; mode < full_.num_elastic; ++mode) {
      const bool is_reached = std::binary_search(reached.begin(), reached.end(), mode);
      const bool is_out = !is_reached && was_planar_ && is_out_of_plane(structure_, mode, scope_.normal);
      const Part which = is_out ? Part::kOutOfPlane : Part::kUnreachedModes;
      if (is_reached || keeps(which))
        kept_.push_back(mode);
      else
        ++(is_out ? num_out : num_unreached);
    }
    if (num_out > 0)
      leave(Part::kOutOfPlane, num_out,
            std::string("shape, loads and spin lie in one plane") +
                (scope_.binds_plane ? "; commands that leave it are held back" : ""));
    else
      part(Part::kOutOfPlane).why =
          scope_.why_not_planar.empty() ? "no mode leaves the plane unreached" : scope_.why_not_planar;
    if (num_unreached > 0)
      leave(Part::kUnreachedModes, num_unreached,
            "no load, command, field, feedback or initial state reaches them");
    else
      part(Part::kUnreachedModes).why =
          keeps(Part::kUnreachedModes) ? "told to stay" : "every mode can be reached";
  }

  // the plan of some modes, numbered as the scene's
  std::optional<Plan> compile_modes(const Reduced& reduced, const std::vector<int>& kept,
                                    const CodeLeftOut& code, Faults& faults) const {
    Faults repeated;  // of the scene, already said
    std::optional<Plan> plan = compile_plan(reduced.scene, reduced.structure, repeated, code);
    if (!plan) {
      faults.insert(faults.end(), repeated.begin(), repeated.end());
      return std::nullopt;
    }
    for (const int mode : kept) plan->mode_numbers.push_back(mode + 1);
    return plan;
  }

  std::optional<Plan> compile_small(Faults& faults) {
    const Reduced exact = reduce(scene_, structure_, initial_, kept_);
    std::optional<Plan> plan = compile_modes(exact, kept_, code_, faults);
    if (!plan) return std::nullopt;
    Scene judged = exact.scene;
    if (keeps(Part::kSmallModes)) judged.leave_out.tolerance = 0.0;
    SmallModes small = find_small_modes(judged, exact.structure, scope_, *plan);
    if (keeps(Part::kSmallModes)) small.part.why = "told to stay";
    part(Part::kSmallModes) = small.part;
    if (small.part.is_left_out) {
      std::vector<int> all(exact.structure.omega.size()), gone, kept;
      std::iota(all.begin(), all.end(), 0);
      std::set_difference(all.begin(), all.end(), small.kept.begin(), small.kept.end(),
                          std::back_inserter(gone));
      for (const int mode : small.kept) kept.push_back(kept_[static_cast<std::size_t>(mode)]);
      kept_ = std::move(kept);
      Reduced few = reduce(scene_, structure_, initial_, kept_);
      keep_static_link_forces(exact.structure, gone, load_directions(scene_, structure_, scope_),
                              few.structure);
      if (plan = compile_modes(few, kept_, code_, faults); !plan) return std::nullopt;
    }
    plan->parts = parts_;
    plan->tolerance = scene_.leave_out.tolerance;
    plan->horizon = small.horizon;
    return plan;
  }

  // everything that commands can reach
  std::optional<Plan> compile_wide(const MotionScope& open, Faults& faults) {
    std::vector<int> reached(static_cast<std::size_t>(structure_.omega.size()));
    std::iota(reached.begin(), reached.end(), 0);
    if (!reaches_all(open))
      reached = reached_modes(reach_rows(scene_, structure_, open, initial_), structure_);
    std::set_union(reached.begin(), reached.end(), kept_.begin(), kept_.end(),
                   std::back_inserter(wide_kept_));
    CodeLeftOut code = code_;
    code.turns = open.turns;
    code.scope = {};
    code.scope.R_WB = code_.scope.R_WB;
    return compile_modes(reduce(scene_, structure_, initial_, wide_kept_), wide_kept_, code, faults);
  }

  static std::vector<std::int32_t> places(const std::vector<int>& few, const std::vector<int>& many) {
    std::vector<std::int32_t> places;
    for (const int mode : few)
      places.push_back(
          static_cast<std::int32_t>(std::lower_bound(many.begin(), many.end(), mode) - many.begin()));
    return places;
  }

  const Scene& scene_;
  Structure structure_;
  Plan full_;
  InitialModes initial_;
  MotionScope scope_;
  bool was_planar_ = false;  // but for what is told to stay
  CodeLeftOut code_;
  std::vector<int> kept_, wide_kept_;
  std::vector<PlanPart> parts_;
};

/// [s] from which a load acts.
double begin_of(const History& history) {
  if (const auto* pulse = std::get_if<PulseHistory>(&history)) return pulse->start;
  const auto* table = std::get_if<TableHistory>(&history);
  if (table == nullptr || table->values.empty() || table->values.front() != 0.0) return 0.0;
  std::size_t k = 1;
  while (k < table->values.size() && table->values[k] == 0.0) ++k;
  return table->times[k - 1];
}

/// Says which loads begin after what was judged has ended.
void warn_of_late_loads(const Scene& scene, const char* judge, double horizon, Faults& faults) {
  for (std::size_t k = 0; k < scene.loads.size(); ++k)
    if (const double begin = begin_of(scene.loads[k].history); begin >= horizon)
      add_warning(faults, scene.loads[k].origin,
                  join_text("load ", quoted(scene.loads[k].name, static_cast<int>(k)), " begins at ", begin,
                            " s, after the horizon of ", horizon, " s over which ", judge,
                            " judges, and counts for nothing there; take a longer horizon"));
}

}  // namespace

std::optional<Plan> compile_lean_plan(const Scene& given, const Structure& structure, Faults& faults) {
  Scene scene = given;
  std::vector<PlanRung> tried;
  if (scene.leave_out.tolerance > 0.0)
    warn_of_late_loads(scene, "leave_out: tolerance", scene.leave_out.horizon, faults);
  if (scene.automatic) {
    warn_of_late_loads(scene, "fidelity: auto", scene.automatic->horizon, faults);
    const std::optional<Fidelity> rung = choose_rung(scene, structure, tried, faults);
    if (!rung) return std::nullopt;
    scene.fidelity = *rung;
  }
  // with everything in it first: what is wrong with a scene is said of the scene
  std::optional<Plan> full = compile_plan(scene, structure, faults);
  if (!full) return std::nullopt;
  std::optional<Plan> plan = Lean(scene, structure, std::move(*full)).compile(faults);
  if (!plan) return std::nullopt;
  plan->tried_rungs = std::move(tried);
  compile_budget(scene, structure, *plan, faults);
  if (has_error(faults)) return std::nullopt;
  return plan;
}

const char* name_of(Part part) {
  static constexpr std::array<const char*, kNumParts> kNames{
      "damping", "gravity", "rotation", "out_of_plane", "unreached_modes", "small_modes", "point_rows"};
  return kNames[index(part)];
}

}  // namespace freeflex
