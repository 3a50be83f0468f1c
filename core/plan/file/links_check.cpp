// Consistency checks of links at true geometry, bodies and curvilinear coordinates, before the plan is
// stepped.
#include <algorithm>
#include <cmath>

#include "core/plan/file/plan_check.hpp"
#include "core/step/massless/massless.hpp"

namespace freeflex {
namespace {

/// Checks the parts of a plan against the numbers of points, links, bodies and rotations.
class LinksCheck {
 public:
  explicit LinksCheck(const StepPlan& plan)
      : plan_(plan),
        links_(plan.coupled.links),
        joints_(links_.joints),
        turning_(plan.coupled.turning),
        curve_(plan.coupled.curve),
        num_bodies_(turning_.bodies.size()) {
    for (std::size_t i = 0; i < plan.points.size(); ++i) num_massless_ += is_massless(plan, i) ? 1 : 0;
  }

  std::string find() {
    if (!are_joints()) return "the joints have the wrong size, are out of range or are not finite";
    if (!are_links()) return "a beam, plate or angle spring is out of range or not finite";
    if (!are_bodies()) return "a turning body is out of range or not finite";
    if (!is_curve()) return "the curvilinear coordinates have the wrong size or are out of range";
    const JointState& initial = plan_.initial.joints;
    if (initial.rotation.size() != index(joints_.num_joints) || initial.angle.size() != num_other() ||
        !are_finite(initial.angle) ||
        !std::ranges::all_of(initial.rotation, [](const Quat& q) { return are_finite(q); }))
      return "the initial rotations of joints have the wrong size or are not finite";
    return {};
  }

 private:
  std::size_t n() const { return index(plan_.num_padded); }
  std::size_t num_rotations() const { return index(joints_.num_rotations); }
  // of releases and massless points
  std::size_t num_other() const { return num_rotations() - 3 * index(joints_.num_joints); }
  bool is_point(std::int32_t point) const { return is_index(point, plan_.points.size()); }
  bool is_link(std::int32_t link) const { return is_index(link, plan_.links.size()); }
  bool is_joint(std::int32_t joint) const { return is_index(joint, index(joints_.num_joints) + num_bodies_); }

  bool are_joints() {
    if (joints_.num_joints < 0 || joints_.num_rotations < 0 ||
        std::int64_t{joints_.num_rotations} <
            3 * (std::int64_t{joints_.num_joints} + static_cast<std::int64_t>(num_massless_)))
      return false;
    const std::size_t count = num_rotations();
    const bool has_any = links_.has_joints() || num_bodies_ > 0;
    if (joints_.of_points.size() != (has_any ? plan_.points.size() : 0) ||
        !std::ranges::all_of(joints_.of_points,
                             [&](std::int32_t joint) { return joint == -1 || is_joint(joint); }))
      return false;
    if (joints_.rows.size() != count * n() || !are_finite(joints_.rows) || joints_.order.size() != count ||
        joints_.inverse_pivots.size() != count || !are_finite(joints_.inverse_pivots) ||
        joints_.starts.size() != (count > 0 ? count + 1 : 0) ||
        joints_.lower.size() != joints_.below.size() || !are_finite(joints_.lower) ||
        (count > 0 ? joints_.idle.size() % count != 0 : !joints_.idle.empty()) || !are_finite(joints_.idle))
      return false;
    return is_pattern();
  }

  /// Each column of the factor must lead to later unknowns, in ascending order, and contain what it fills in.
  bool is_pattern() {
    std::vector<std::int32_t>& place = place_;
    place.assign(num_rotations(), -1);
    for (std::size_t k = 0; k < place.size(); ++k) {
      if (!is_index(joints_.order[k], place.size()) || place[index(joints_.order[k])] >= 0) return false;
      place[index(joints_.order[k])] = static_cast<std::int32_t>(k);
    }
    if (!place.empty() &&
        (joints_.starts.front() != 0 || index(joints_.starts.back()) != joints_.below.size()))
      return false;
    for (std::size_t k = 0; k < place.size(); ++k) {
      if (joints_.starts[k] < 0 || joints_.starts[k + 1] < joints_.starts[k] ||
          index(joints_.starts[k + 1]) > joints_.below.size())
        return false;
      auto before = static_cast<std::int32_t>(k);
      for (std::int32_t e = joints_.starts[k]; e < joints_.starts[k + 1]; ++e) {
        if (!is_index(joints_.below[index(e)], place.size())) return false;
        const std::int32_t row = place[index(joints_.below[index(e)])];
        if (row <= before) return false;
        before = row;
      }
    }
    for (std::size_t k = 0; k < place.size(); ++k)
      for (std::int32_t i = joints_.starts[k]; i < joints_.starts[k + 1]; ++i)
        if (!fills(index(place[index(joints_.below[index(i)])]), i + 1, joints_.starts[k + 1])) return false;
    return true;
  }
  /// Returns whether column c, unless it is empty, has all rows of the entries from `first` to `last`.
  bool fills(std::size_t c, std::int32_t first, std::int32_t last) const {
    const auto begin = joints_.below.begin() + joints_.starts[c],
               end = joints_.below.begin() + joints_.starts[c + 1];
    if (begin == end) return true;
    return std::all_of(joints_.below.begin() + first, joints_.below.begin() + last, [&](std::int32_t row) {
      const auto found = std::lower_bound(begin, end, row, [&](std::int32_t a, std::int32_t b) {
        return place_[index(a)] < place_[index(b)];
      });
      return found != end && *found == row;
    });
  }

  bool is_end(const PlanLinkEnd& end) const {
    return is_joint(end.joint) && std::ranges::all_of(end.released, [&](std::int32_t released) {
             return released == -1 || (released >= 3 * joints_.num_joints &&
                                       is_index(released, num_rotations() - 3 * num_massless_));
           });
  }
  bool are_links() const {
    for (const PlanTrueBeam& beam : links_.beams) {
      const BeamConstants& c = beam.constants;
      if (!is_link(beam.link) || !is_point(beam.points[0]) || !is_point(beam.points[1]) ||
          !is_end(beam.ends[0]) || !is_end(beam.ends[1]) || !are_finite(beam.span) ||
          !are_finite(beam.axes) || !std::isfinite(c.length) || !std::isfinite(c.axial) ||
          !std::isfinite(c.torsion) || !are_finite(c.symmetric) || !are_finite(c.antisymmetric) ||
          !are_finite(c.shear) || !are_finite(c.skew_bow))
        return false;
    }
    for (const PlanTruePlate& plate : links_.plates) {
      const PlateConstants& c = plate.constants;
      if (!is_link(plate.link) ||
          !std::ranges::all_of(plate.points, [&](auto point) { return is_point(point); }) ||
          !std::ranges::all_of(plate.ends, [&](const PlanLinkEnd& end) { return is_end(end); }) ||
          !are_finite(plate.axes) || !are_finite(c.axis_x) || !are_finite(c.axis_y) || !are_finite(c.first) ||
          !are_finite(c.second) || !are_finite(c.membrane) || !are_finite(c.bending) ||
          !are_finite(c.curvature) ||
          !std::ranges::all_of(c.gradients, [](const auto& g) { return are_finite(g); }))
        return false;
    }
    for (const PlanTrueAngle& angle : links_.angles) {
      const AngleConstants& c = angle.constants;
      if (!is_link(angle.link) || c.form < AngleConstants::Form::kAngle ||
          c.form > AngleConstants::Form::kDihedral || angle.num_rows < 1 || angle.num_rows > 2 ||
          !std::isfinite(c.stiffness) || !std::isfinite(c.rest_sine) || !std::isfinite(c.rest_cosine) ||
          !std::isfinite(angle.sign))
        return false;
      const std::size_t count = c.form == AngleConstants::Form::kDihedral ? 4 : 3;
      for (std::size_t k = 0; k < count; ++k)
        if (!is_point(angle.points[k]) || !are_finite(angle.rows[0][k]) || !are_finite(angle.rows[1][k]))
          return false;
    }
    return std::ranges::all_of(links_.matrices, [&](const PlanTrueMatrix& each) { return is_matrix(each); });
  }
  bool is_matrix(const PlanTrueMatrix& matrix) const {
    const MatrixConstants& c = matrix.constants;
    const std::size_t count = matrix.points.size(), width = (c.has_rotations ? 6 : 3) * count;
    return is_link(matrix.link) && count >= 2 && count <= kMostMatrixPoints &&
           std::ranges::all_of(matrix.points, [&](auto point) { return is_point(point); }) &&
           matrix.ends.size() == (c.has_rotations ? count : 0) &&
           std::ranges::all_of(matrix.ends,
                               [&](const PlanLinkEnd& end) {
                                 return is_end(end) && std::ranges::all_of(end.released, [](auto each) {
                                          return each == -1;
                                        });
                               }) &&
           c.arms.size() == count &&
           std::ranges::all_of(c.arms, [](const Vec3& d) { return are_finite(d); }) &&
           c.stiffness.size() == width * pad(width) && are_finite(c.stiffness) && are_finite(c.inverse) &&
           are_finite(c.line) && std::isfinite(c.turn_weight) && c.turn_weight >= 0.0;
  }

  bool are_bodies() const {
    const auto is_body = [&](std::int32_t body) { return is_index(body, num_bodies_); };
    const bool is_spread = plan_.coupled.kinetics.form == PlanKinetics::Form::kSpread;
    const bool has_any = num_bodies_ > 0 || is_spread;
    if (turning_.of_points.size() != (has_any ? plan_.points.size() : 0) ||
        turning_.of_carriers.size() != (has_any ? plan_.particles.all.size() : 0) ||
        turning_.of_attitudes.size() != (num_bodies_ > 0 ? plan_.particles.attitude_points.size() : 0) ||
        !std::ranges::all_of(turning_.of_points, [&](auto body) { return body == -1 || is_body(body); }) ||
        !std::ranges::all_of(turning_.of_carriers,
                             [&](auto body) { return is_body(body) || (is_spread && body == -1); }) ||
        !std::ranges::all_of(turning_.of_attitudes, is_body))
      return false;
    std::size_t next = 0;
    for (std::size_t b = 0; b < num_bodies_; ++b) {
      const PlanTurningBody& body = turning_.bodies[b];
      const bool is_matrix = is_spread && body.count == 0;  // first is a point
      if ((is_matrix ? !is_point(body.first) : index(std::max(body.first, 0)) != next || body.count < 1) ||
          body.rows.size() != 6 * n() || !are_finite(body.rows) || !are_finite(body.centre) ||
          !are_finite(body.inertia) || !std::isfinite(body.mass))
        return false;
      next += index(body.count);
      if (next > turning_.points.size()) return false;
      for (std::size_t k = next - index(body.count); k < next; ++k)
        // a ball joint is in the lists of its bodies, and belongs to the first
        if (!is_point(turning_.points[k]) || turning_.of_points[index(turning_.points[k])] < 0 ||
            turning_.of_points[index(turning_.points[k])] > static_cast<std::int32_t>(b))
          return false;
    }
    return next == turning_.points.size();
  }

  bool is_curve() const {
    const std::size_t strains = curve_.links.size() + 3 * curve_.plates.size(), count = curve_.modes.size();
    const std::size_t padded = (strains + kLanes - 1) / kLanes * kLanes;
    if (curve_.weights.size() != count * padded || !are_finite(curve_.weights) ||
        curve_.is_axial.size() != count || curve_.filter.size() != curve_.stiff.size() ||
        !are_finite(curve_.filter) || !std::ranges::is_sorted(curve_.modes) ||
        !std::ranges::is_sorted(curve_.stiff) || (curve_.is_filtered && curve_.stiff.empty()))
      return false;
    for (const std::int32_t k : curve_.stiff)
      if (k < 0 || index(k) >= count) return false;
    for (const std::int32_t mode : curve_.modes)
      if (mode < 0 || mode >= plan_.num_elastic || !(plan_.omega[index(mode)] > 0.0)) return false;
    for (const PlanCurveLink& link : curve_.links) {
      const bool is_beam = link.joints[0] >= 0;
      if (!is_point(link.points[0]) || !is_point(link.points[1]) || !are_finite(link.direction) ||
          !(link.length > 0.0) || !std::isfinite(link.length) ||
          (is_beam && (!is_joint(link.joints[0]) || !is_joint(link.joints[1]))))
        return false;
    }
    return std::ranges::all_of(curve_.plates, [&](const PlanCurvePlate& plate) {
      return std::ranges::all_of(plate.points, [&](auto point) { return is_point(point); }) &&
             std::ranges::all_of(plate.gradients, [](const auto& g) { return are_finite(g); });
    });
  }

  const StepPlan& plan_;
  const PlanTrueLinks& links_;
  const PlanJoints& joints_;
  const PlanTurning& turning_;
  const PlanCurve& curve_;
  std::size_t num_bodies_, num_massless_ = 0;
  std::vector<std::int32_t> place_;  // (num_rotations) place of each unknown in the order
};

}  // namespace

std::string find_link_inconsistency(const StepPlan& plan) { return LinksCheck(plan).find(); }

}  // namespace freeflex
