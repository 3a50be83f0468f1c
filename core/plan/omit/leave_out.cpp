#include "core/plan/omit/leave_out.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>
#include <set>
#include <string>

#include "core/faults.hpp"
#include "core/plan/arrays.hpp"
#include "core/plan/omit/excitability.hpp"
#include "core/structure/reduce.hpp"

namespace freeflex {
namespace {

std::vector<PlanFeature> all_features() {
  std::vector<PlanFeature> features(kNumFeatures);
  for (int k = 0; k < kNumFeatures; ++k) features[index(k)].feature = static_cast<Feature>(k);
  return features;
}

bool keeps(const Scene& scene, Feature which) {
  return scene.leave_out.keeps[static_cast<std::size_t>(which)];
}

// Returns true if commands push all points in all directions. Such commands excite all modes, so the
// excitability, which takes long to compute in large scenes, is not needed.
bool excites_all(const Scene& scene, const MotionScope& scope) {
  const std::set<int> pushed(scene.pushable.begin(), scene.pushable.end());
  return !scope.binds_plane && pushed.size() == scene.points.size();
}

// Returns true for a mode more than half of whose motion is along the normal   (THEORY 14.5).
bool is_out_of_plane(const Structure& structure, int mode, const Eigen::Vector3d& normal) {
  double along = 0.0, total = 0.0;
  for (Eigen::Index i = 0; i < structure.shapes.rows(); i += 3) {
    const Eigen::Vector3d b = structure.shapes.block<3, 1>(i, mode);
    along += b.dot(normal) * b.dot(normal);
    total += b.squaredNorm();
  }
  return along > 0.5 * total;
}

// Finds the modes and the other features that a scene does not need.
class Unneeded {
 public:
  Unneeded(const Scene& scene, const Structure& structure, const PlanSpec& spec, const Plan& full)
      : scene_(scene),
        full_(full),
        reduced_{spec, share(structure), {}, all_features(), scene.leave_out.horizon} {}

  ReducedSpec find() {
    const bool with_commands = scene_.leave_out.on_need == OnNeed::kKeep;
    reduced_.motion = find_motion_scope(scene_, *reduced_.structure, reduced_.spec.rung, with_commands);
    reduced_.spec.modes.clear();
    reduced_.spec.numbers_modes = true;
    keep_requested_features();
    choose_code();
    choose_modes();
    return std::move(reduced_);
  }

 private:
  PlanFeature& feature(Feature which) { return reduced_.features[static_cast<std::size_t>(which)]; }
  bool keeps(Feature which) const { return freeflex::keeps(scene_, which); }

  void leave(Feature which, int count, std::string why) {
    feature(which).is_left_out = true;
    feature(which).count = count;
    feature(which).why = std::move(why);
  }

  // Widens the scope by each feature that the scene keeps, because commands may then use this feature.
  void keep_requested_features() {
    if (keeps(Feature::kRotation) && !reduced_.motion.has_rotation) {
      reduced_.motion.has_rotation = true;
      reduced_.motion.binds_rotation = false;
      reduced_.motion.why_rotates = "told to stay";
    }
    was_planar_ = reduced_.motion.is_planar;
    if (keeps(Feature::kOutOfPlane) && reduced_.motion.is_planar) {
      reduced_.motion.is_planar = !reduced_.motion.binds_plane;
      reduced_.motion.binds_plane = false;
      reduced_.motion.why_not_planar = "told to stay";
    }
  }

  // decides on damping, gravity, rotation and the rows of points
  void choose_code() {
    const bool damps =
        reduced_.structure->damping_rows.rows() > 0 ||
        std::any_of(full_.decay.begin(), full_.decay.end(), [](double decay) { return decay > 0.0; });
    if (damps)
      feature(Feature::kDamping).why = "modes are damped";
    else if (keeps(Feature::kDamping))
      feature(Feature::kDamping).why = "told to stay";
    else
      leave(Feature::kDamping, 0, "no mode is damped");
    if (!scene_.gravity.isZero(0.0) || scene_.attractor.mu > 0.0)
      feature(Feature::kGravity).why = "the scene has a field";
    else if (keeps(Feature::kGravity))
      feature(Feature::kGravity).why = "told to stay";
    else
      leave(Feature::kGravity, 0, "the scene has no field");
    if (reduced_.motion.has_rotation)
      feature(Feature::kRotation).why = reduced_.motion.why_rotates;
    else
      leave(Feature::kRotation, 0, reduced_.motion.why_rotates);
    const auto without_rows = std::count_if(full_.points.begin(), full_.points.end(),
                                            [](const PlanPoint& point) { return point.row < 0; });
    if (keeps(Feature::kPointRows))
      feature(Feature::kPointRows).why = "told to stay";
    else if (without_rows == 0)
      feature(Feature::kPointRows).why = "every point is read or loaded";
    else
      leave(Feature::kPointRows, static_cast<int>(without_rows), "points that nobody reads or loads");
    PlanSpec& spec = reduced_.spec;
    spec.has_damping = !feature(Feature::kDamping).is_left_out;
    spec.has_gravity = !feature(Feature::kGravity).is_left_out;
    spec.has_rotation = reduced_.motion.has_rotation;
    spec.scope = {reduced_.motion.binds_rotation, reduced_.motion.binds_plane,
                  to_array(reduced_.motion.normal), to_array(reduced_.motion.R_WB)};
  }

  // decides on the modes that nothing excites (THEORY 14.2), separately for those that move along the normal
  // of a plane
  void choose_modes() {
    if (full_.num_elastic == 0) {
      for (const Feature which : {Feature::kOutOfPlane, Feature::kUnreachedModes})
        feature(which).why = "there are no modes";
      return;
    }
    if (excites_all(scene_, reduced_.motion)) {
      reduced_.spec.modes.resize(index(full_.num_elastic));
      std::iota(reduced_.spec.modes.begin(), reduced_.spec.modes.end(), 0);
      feature(Feature::kOutOfPlane).why = reduced_.motion.why_not_planar;
      feature(Feature::kUnreachedModes).why = "commands may push every point any way";
      return;
    }
    reduced_.structure = align_modes(
        scene_, excitability_rows(scene_, *reduced_.structure, reduced_.motion, reduced_.spec.initial),
        reduced_.structure, reduced_.spec.initial);
    const std::vector<int> excited =
        excited_modes(excitability_rows(scene_, *reduced_.structure, reduced_.motion, reduced_.spec.initial),
                      *reduced_.structure);
    int num_out = 0, num_unexcited = 0;
    for (int mode = 0; mode < full_.num_elastic; ++mode) {
      const bool is_excited = std::binary_search(excited.begin(), excited.end(), mode);
      const bool is_out =
          !is_excited && was_planar_ && is_out_of_plane(*reduced_.structure, mode, reduced_.motion.normal);
      const Feature which = is_out ? Feature::kOutOfPlane : Feature::kUnreachedModes;
      if (is_excited || keeps(which))
        reduced_.spec.modes.push_back(mode);
      else
        ++(is_out ? num_out : num_unexcited);
    }
    if (num_out > 0)
      leave(Feature::kOutOfPlane, num_out,
            std::string("shape, loads and spin lie in one plane") +
                (reduced_.motion.binds_plane ? "; commands that leave it are held back" : ""));
    else
      feature(Feature::kOutOfPlane).why = reduced_.motion.why_not_planar.empty()
                                              ? "no mode leaves the plane unreached"
                                              : reduced_.motion.why_not_planar;
    if (num_unexcited > 0)
      leave(Feature::kUnreachedModes, num_unexcited,
            "no load, command, field, feedback or initial state reaches them");
    else
      feature(Feature::kUnreachedModes).why =
          keeps(Feature::kUnreachedModes) ? "told to stay" : "every mode can be reached";
  }

  const Scene& scene_;
  const Plan& full_;
  ReducedSpec reduced_;
  bool was_planar_ = false;  // true: the motion was planar before keep_requested_features
};

}  // namespace

bool may_leave_out(const Structure& structure, Fidelity rung) {
  return traits_of(rung).has_modes && !traits_of(rung).couples && structure.resolved.are_point_masses;
}

bool may_leave_out_modes(const Scene& scene, const Structure& structure, Fidelity rung) {
  return traits_of(rung).couples && !traits_of(rung).has_true_geometry && scene.leave_out.tolerance > 0.0 &&
         structure.resolved.are_point_masses && structure.mass_properties.rigid_freedoms == 6;
}

ReducedSpec keep_all(const Scene& scene, const Structure& structure, const PlanSpec& spec) {
  assert(may_leave_out_modes(scene, structure, spec.rung));
  ReducedSpec reduced{spec, share(structure), find_motion_scope(scene, structure, spec.rung, true),
                      all_features(), scene.leave_out.horizon};
  reduced.spec.numbers_modes = true;
  for (PlanFeature& feature : reduced.features)
    feature.why = "the coupled rung is advanced whole but for small modes";
  return reduced;
}

std::vector<PlanFeature> report_on_full_plan(const Scene& scene, const Structure& structure, Fidelity rung,
                                             Faults& faults) {
  std::vector<PlanFeature> features = all_features();
  const bool has_bodies = !structure.resolved.are_point_masses;
  for (PlanFeature& feature : features)
    feature.why = has_bodies                ? "a scene with bodies or massless points is advanced whole"
                  : traits_of(rung).couples ? "the coupled rungs are advanced whole"
                                            : "the rigid rung is advanced whole";
  if (scene.leave_out.tolerance > 0.0)
    add_warning(
        faults, scene.leave_out.origin,
        has_bodies ? "leave_out: tolerance has no effect on a scene with bodies or massless points, which is "
                     "advanced with all features; remove the tolerance"
                   : std::string("leave_out: tolerance has no effect on fidelity ") + name_of(rung) +
                         ", which is advanced with all features; remove the tolerance, or take separated or "
                         "spin-loaded");
  return features;
}

ReducedSpec leave_out_unneeded(const Scene& scene, const Structure& structure, const PlanSpec& spec,
                               const Plan& full) {
  assert(may_leave_out(structure, spec.rung));
  return Unneeded(scene, structure, spec, full).find();
}

bool leave_out_small_modes(const Scene& scene, const Plan& plan, ReducedSpec& reduced) {
  const bool is_kept = keeps(scene, Feature::kSmallModes);
  const double tolerance = is_kept ? 0.0 : scene.leave_out.tolerance;
  // without a tolerance, no mode is judged and no shapes are needed
  const std::shared_ptr<const Structure> few =
      tolerance > 0.0 ? share_reduced(*reduced.structure, reduced.spec.modes) : reduced.structure;
  SmallModes small = find_small_modes(scene, *few, reduced.motion, plan, tolerance);
  if (is_kept) small.feature.why = "told to stay";
  reduced.horizon = small.horizon;
  reduced.features[static_cast<std::size_t>(Feature::kSmallModes)] = small.feature;
  if (!small.feature.is_left_out) return false;
  std::vector<int> kept;
  for (const int position : small.kept) kept.push_back(reduced.spec.modes[index(position)]);
  PlanSpec& spec = reduced.spec;
  std::set_difference(spec.modes.begin(), spec.modes.end(), kept.begin(), kept.end(),
                      std::back_inserter(spec.static_modes));
  spec.static_loads = load_directions(scene, *reduced.structure, reduced.motion);
  spec.modes = std::move(kept);
  return true;
}

std::optional<PlanSpec> fallback_spec(const Scene& scene, const ReducedSpec& reduced) {
  const bool is_bound = reduced.motion.binds_rotation || reduced.motion.binds_plane;
  if (scene.leave_out.on_need != OnNeed::kReplan || !is_bound) return std::nullopt;
  const MotionScope open = find_motion_scope(scene, *reduced.structure, reduced.spec.rung, true);
  std::vector<int> excited(index(reduced.structure->omega.size()));
  std::iota(excited.begin(), excited.end(), 0);
  if (!excites_all(scene, open))
    excited = excited_modes(excitability_rows(scene, *reduced.structure, open, reduced.spec.initial),
                            *reduced.structure);
  PlanSpec fallback = reduced.spec;
  fallback.modes.clear();
  std::set_union(excited.begin(), excited.end(), reduced.spec.modes.begin(), reduced.spec.modes.end(),
                 std::back_inserter(fallback.modes));
  fallback.static_modes.clear();
  fallback.static_loads.resize(0, 0);
  fallback.has_rotation = open.has_rotation;
  fallback.scope = {};
  fallback.scope.R_WB = reduced.spec.scope.R_WB;
  return fallback;
}

}  // namespace freeflex
