#include "core/plan/leave_out.hpp"

#include <algorithm>
#include <numeric>
#include <set>
#include <string>

#include "core/plan/arrays.hpp"
#include "core/plan/reach.hpp"
#include "core/scene/bodies.hpp"
#include "core/scene/faults.hpp"
#include "core/structure/reduce.hpp"

namespace freeflex {
namespace {

std::vector<PlanPart> every_part() {
  std::vector<PlanPart> parts(kNumParts);
  for (int k = 0; k < kNumParts; ++k) parts[static_cast<std::size_t>(k)].part = static_cast<Part>(k);
  return parts;
}

bool keeps(const Scene& scene, Part which) { return scene.leave_out.keeps[static_cast<std::size_t>(which)]; }

// every mode moves some point some way: no need to look further, which takes long in large scenes
bool reaches_all(const Scene& scene, const MotionScope& scope) {
  const std::set<int> pushed(scene.pushable.begin(), scene.pushable.end());
  return !scope.binds_plane && pushed.size() == scene.points.size();
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

// what a scene needs neither of modes nor of code
class Unneeded {
 public:
  Unneeded(const Scene& scene, const Structure& structure, const PlanSpec& spec, const Plan& whole)
      : scene_(scene),
        whole_(whole),
        lean_{spec, share(structure), {}, every_part(), scene.leave_out.horizon} {}

  LeanSpec find() {
    const bool with_commands = scene_.leave_out.on_need == OnNeed::kKeep;
    lean_.motion = find_motion_scope(scene_, *lean_.structure, lean_.spec.rung, with_commands);
    lean_.spec.modes.clear();
    lean_.spec.numbers_modes = true;
    keep_as_told();
    judge_code();
    judge_modes();
    return std::move(lean_);
  }

 private:
  PlanPart& part(Part which) { return lean_.parts[static_cast<std::size_t>(which)]; }
  bool keeps(Part which) const { return freeflex::keeps(scene_, which); }

  void leave(Part which, int count, std::string why) {
    part(which).is_left_out = true;
    part(which).count = count;
    part(which).why = std::move(why);
  }

  // a part that is told to stay is one that commands may use
  void keep_as_told() {
    if (keeps(Part::kRotation) && !lean_.motion.turns) {
      lean_.motion.turns = true;
      lean_.motion.binds_rotation = false;
      lean_.motion.why_turns = "told to stay";
    }
    was_planar_ = lean_.motion.is_planar;
    if (keeps(Part::kOutOfPlane) && lean_.motion.is_planar) {
      lean_.motion.is_planar = !lean_.motion.binds_plane;
      lean_.motion.binds_plane = false;
      lean_.motion.why_not_planar = "told to stay";
    }
  }

  // damping, gravity, rotation, rows of points
  void judge_code() {
    const bool damps =
        lean_.structure->damping_rows.rows() > 0 ||
        std::any_of(whole_.decay.begin(), whole_.decay.end(), [](double decay) { return decay > 0.0; });
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
    if (lean_.motion.turns)
      part(Part::kRotation).why = lean_.motion.why_turns;
    else
      leave(Part::kRotation, 0, lean_.motion.why_turns);
    const auto without_rows = std::count_if(whole_.points.begin(), whole_.points.end(),
                                            [](const PlanPoint& point) { return point.row < 0; });
    if (keeps(Part::kPointRows))
      part(Part::kPointRows).why = "told to stay";
    else if (without_rows == 0)
      part(Part::kPointRows).why = "every point is read or loaded";
    else
      leave(Part::kPointRows, static_cast<int>(without_rows), "points that nobody reads or loads");
    PlanSpec& spec = lean_.spec;
    spec.damps = !part(Part::kDamping).is_left_out;
    spec.falls = !part(Part::kGravity).is_left_out;
    spec.turns = lean_.motion.turns;
    spec.scope = {lean_.motion.binds_rotation, lean_.motion.binds_plane, to_array(lean_.motion.normal),
                  to_array(lean_.motion.R_WB)};
  }

  // which modes nothing reaches, and of those which move along the normal
  void judge_modes() {
    if (whole_.num_elastic == 0) {
      for (const Part which : {Part::kOutOfPlane, Part::kUnreachedModes})
        part(which).why = "there are no modes";
      return;
    }
    if (reaches_all(scene_, lean_.motion)) {
      lean_.spec.modes.resize(static_cast<std::size_t>(whole_.num_elastic));
      std::iota(lean_.spec.modes.begin(), lean_.spec.modes.end(), 0);
      part(Part::kOutOfPlane).why = lean_.motion.why_not_planar;
      part(Part::kUnreachedModes).why = "commands may push every point any way";
      return;
    }
    lean_.structure =
        align_modes(scene_, reach_rows(scene_, *lean_.structure, lean_.motion, lean_.spec.initial),
                    lean_.structure, lean_.spec.initial);
    const std::vector<int> reached = reached_modes(
        reach_rows(scene_, *lean_.structure, lean_.motion, lean_.spec.initial), *lean_.structure);
    int num_out = 0, num_unreached = 0;
    for (int mode = 0; mode < whole_.num_elastic; ++mode) {
      const bool is_reached = std::binary_search(reached.begin(), reached.end(), mode);
      const bool is_out =
          !is_reached && was_planar_ && is_out_of_plane(*lean_.structure, mode, lean_.motion.normal);
      const Part which = is_out ? Part::kOutOfPlane : Part::kUnreachedModes;
      if (is_reached || keeps(which))
        lean_.spec.modes.push_back(mode);
      else
        ++(is_out ? num_out : num_unreached);
    }
    if (num_out > 0)
      leave(Part::kOutOfPlane, num_out,
            std::string("shape, loads and spin lie in one plane") +
                (lean_.motion.binds_plane ? "; commands that leave it are held back" : ""));
    else
      part(Part::kOutOfPlane).why = lean_.motion.why_not_planar.empty() ? "no mode leaves the plane unreached"
                                                                        : lean_.motion.why_not_planar;
    if (num_unreached > 0)
      leave(Part::kUnreachedModes, num_unreached,
            "no load, command, field, feedback or initial state reaches them");
    else
      part(Part::kUnreachedModes).why =
          keeps(Part::kUnreachedModes) ? "told to stay" : "every mode can be reached";
  }

  const Scene& scene_;
  const Plan& whole_;
  LeanSpec lean_;
  bool was_planar_ = false;  // but for what is told to stay
};

}  // namespace

bool may_leave_out(const Scene& scene, Fidelity rung) {
  return traits_of(rung).has_modes && !traits_of(rung).couples && are_point_masses(scene);
}

bool may_leave_out_modes(const Scene& scene, const Structure& structure, Fidelity rung) {
  return traits_of(rung).couples && !traits_of(rung).has_true_geometry && scene.leave_out.tolerance > 0.0 &&
         are_point_masses(scene) && structure.mass_properties.rigid_freedoms == 6;
}

LeanSpec keep_all(const Scene& scene, const Structure& structure, const PlanSpec& spec) {
  LeanSpec lean{spec, share(structure), find_motion_scope(scene, structure, spec.rung, true), every_part(),
                scene.leave_out.horizon};
  lean.spec.numbers_modes = true;
  for (PlanPart& part : lean.parts) part.why = "the coupled rung is advanced whole but for small modes";
  return lean;
}

std::vector<PlanPart> account_of_whole(const Scene& scene, Fidelity rung, Faults& faults) {
  std::vector<PlanPart> parts = every_part();
  const bool has_bodies = !are_point_masses(scene);
  for (PlanPart& part : parts)
    part.why = has_bodies                ? "a scene with bodies or massless points is advanced whole"
               : traits_of(rung).couples ? "the coupled rungs are advanced whole"
                                         : "the rigid rung is advanced whole";
  if (scene.leave_out.tolerance > 0.0)
    add_warning(
        faults, scene.leave_out.origin,
        has_bodies ? "leave_out: tolerance has no effect on a scene with bodies or massless points, which is "
                     "advanced whole; leave it out"
                   : std::string("leave_out: tolerance has no effect on fidelity ") + name_of(rung) +
                         ", which is advanced whole; leave it out, or take separated or spin-loaded");
  return parts;
}

LeanSpec leave_out_unneeded(const Scene& scene, const Structure& structure, const PlanSpec& spec,
                            const Plan& whole) {
  return Unneeded(scene, structure, spec, whole).find();
}

bool leave_out_small_modes(const Scene& scene, const Plan& plan, LeanSpec& lean) {
  const bool is_told_to_stay = keeps(scene, Part::kSmallModes);
  const double tolerance = is_told_to_stay ? 0.0 : scene.leave_out.tolerance;
  // without a tolerance nothing is judged, and no shapes are needed
  const std::shared_ptr<const Structure> few =
      tolerance > 0.0 ? share_reduced(*lean.structure, lean.spec.modes) : lean.structure;
  SmallModes small = find_small_modes(scene, *few, lean.motion, plan, tolerance);
  if (is_told_to_stay) small.part.why = "told to stay";
  lean.horizon = small.horizon;
  lean.small_size = small.size;
  lean.parts[static_cast<std::size_t>(Part::kSmallModes)] = small.part;
  if (!small.part.is_left_out) return false;
  std::vector<int> kept;
  for (const int place : small.kept) kept.push_back(lean.spec.modes[static_cast<std::size_t>(place)]);
  PlanSpec& spec = lean.spec;
  std::set_difference(spec.modes.begin(), spec.modes.end(), kept.begin(), kept.end(),
                      std::back_inserter(spec.static_modes));
  spec.static_loads = load_directions(scene, *lean.structure, lean.motion);
  spec.modes = std::move(kept);
  return true;
}

std::optional<PlanSpec> wide_spec(const Scene& scene, const LeanSpec& lean) {
  const bool is_bound = lean.motion.binds_rotation || lean.motion.binds_plane;
  if (scene.leave_out.on_need != OnNeed::kReplan || !is_bound) return std::nullopt;
  const MotionScope open = find_motion_scope(scene, *lean.structure, lean.spec.rung, true);
  std::vector<int> reached(static_cast<std::size_t>(lean.structure->omega.size()));
  std::iota(reached.begin(), reached.end(), 0);
  if (!reaches_all(scene, open))
    reached = reached_modes(reach_rows(scene, *lean.structure, open, lean.spec.initial), *lean.structure);
  PlanSpec wide = lean.spec;
  wide.modes.clear();
  std::set_union(reached.begin(), reached.end(), lean.spec.modes.begin(), lean.spec.modes.end(),
                 std::back_inserter(wide.modes));
  wide.static_modes.clear();
  wide.static_loads.resize(0, 0);
  wide.turns = open.turns;
  wide.scope = {};
  wide.scope.R_WB = lean.spec.scope.R_WB;
  return wide;
}

}  // namespace freeflex
