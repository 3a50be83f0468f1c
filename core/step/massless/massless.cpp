// Massless points: which they are, and the stiffness over their displacements.
#include "core/step/massless/massless.hpp"

#include <algorithm>
#include <limits>

#include "core/step/links/bar.hpp"
#include "core/step/links/true_links.hpp"
#include "core/step/plan.hpp"

namespace freeflex {
namespace {

// [-] displacement for differences of forces, over the length of the point
constexpr double kProbedLength = 1e-7;

/// Holds the derivatives of the energy of a link by displacements of its points and by rotations of its ends.
struct LinkGradient {
  std::array<Vec3, 4> force{};
  std::array<Vec3, 3> moment{};
};

/// Adds the derivatives, by displacements of the massless points of a link, of the moments on its ends and of
/// the forces on its massless points.
/// \param ends, present  of the link, as many as have unknown rotations
/// \param gradient_at  returns the gradient at the displacements w.massless.probed
template <typename GradientAt>
void add_probes(std::span<const std::int32_t> points, std::span<const PlanLinkEnd> ends,
                std::span<const PresentEnd> present, const PlanJoints& joints, const GradientAt& gradient_at,
                JointWorkspace& w) noexcept {
  if (std::ranges::none_of(points, [&](std::int32_t point) { return w.massless.number(point) >= 0; })) return;
  const std::int32_t first = joints.num_rotations - 3 * static_cast<std::int32_t>(w.massless.points.size());
  const auto before = gradient_at();
  for (const std::int32_t point : points) {
    const std::int32_t number = w.massless.number(point);
    if (number < 0) continue;
    const double length = w.massless.points[index(number)].length;
    for (std::int32_t axis = 0; axis < 3; ++axis) {
      double& x = w.massless.probed[index(point)][index(axis)];
      const double rest = x;
      x += kProbedLength * length;
      const auto after = gradient_at();
      x = rest;
      const std::int32_t own = first + 3 * number + axis;
      for (std::size_t e = 0; e < ends.size(); ++e) {
        const Vec3 change = scale(1.0 / kProbedLength, sub(after.moment[e], before.moment[e]));
        const Mat3& R = w.R[index(ends[e].joint)];
        for (std::size_t a = 0; a < 3; ++a) {
          if (ends[e].joint < joints.num_joints)
            add_to_entry(joints, 3 * ends[e].joint + static_cast<std::int32_t>(a), own,
                         dot({R[a], R[3 + a], R[6 + a]}, change), w.factor);
          if (ends[e].released[a] >= 0)
            add_to_entry(joints, ends[e].released[a], own, dot(present[e].spins[a], change), w.factor);
        }
      }
      for (std::size_t k = 0; k < points.size(); ++k) {
        const std::int32_t other = w.massless.number(points[k]);
        if (other < 0) continue;
        const double share = w.massless.points[index(other)].length / kProbedLength;
        for (std::int32_t a = 0; a < 3 && first + 3 * other + a <= own; ++a)
          add_to_entry(joints, first + 3 * other + a, own,
                       share * (after.force[k][index(a)] - before.force[k][index(a)]), w.factor);
      }
    }
  }
}

}  // namespace

bool is_massless(const StepPlan& plan, std::size_t point) noexcept {
  const std::vector<std::int32_t>& bodies = plan.coupled.turning.of_points;
  return traits_of(plan.fidelity).has_true_geometry &&
         plan.coupled.kinetics.form != PlanKinetics::Form::kSpread && plan.points[point].mass == 0.0 &&
         (bodies.size() <= point || bodies[point] < 0);
}

std::vector<MasslessPoint> find_massless_points(const StepPlan& plan) {
  std::vector<MasslessPoint> result;
  std::vector<double> length(plan.points.size(), std::numeric_limits<double>::infinity());
  const auto measure = [&](const auto& points, std::size_t count) {
    for (std::size_t a = 0; a < count; ++a)
      for (std::size_t b = 0; b < count; ++b) {
        const Vec3 d = sub(plan.points[index(points[b])].r, plan.points[index(points[a])].r);
        if (dot(d, d) > 0.0) length[index(points[a])] = std::min(length[index(points[a])], dot(d, d));
      }
  };
  for (const PlanBar& bar : plan.coupled.bars) measure(std::array{bar.first, bar.second}, 2);
  const PlanTrueLinks& links = plan.coupled.links;
  for (const PlanTrueBeam& beam : links.beams) measure(beam.points, 2);
  for (const PlanTruePlate& plate : links.plates) measure(plate.points, 3);
  for (const PlanTrueAngle& angle : links.angles)
    measure(angle.points, angle.constants.form == AngleConstants::Form::kDihedral ? 4 : 3);
  for (const PlanTrueMatrix& matrix : links.matrices) measure(matrix.points, matrix.points.size());
  for (std::size_t i = 0; i < plan.points.size(); ++i)
    if (is_massless(plan, i)) result.push_back({static_cast<std::int32_t>(i), __builtin_sqrt(length[i])});
  return result;
}

MasslessPoints make_massless_points(const StepPlan& plan) {
  MasslessPoints result;
  result.points = find_massless_points(plan);
  if (result.empty()) return result;
  result.of_points.assign(plan.points.size(), -1);
  for (std::size_t k = 0; k < result.points.size(); ++k)
    result.of_points[index(result.points[k].point)] = static_cast<std::int32_t>(k);
  result.load.resize(result.points.size());
  for (auto* v : {&result.force, &result.probed}) v->resize(plan.points.size());
  return result;
}

void add_massless_stiffness(const PlanTrueLinks& links, std::span<const PlanBar> bars,
                            std::span<const Vec3> rest, std::span<const Vec3> V, const JointState& state,
                            JointWorkspace& w) noexcept {
  const PlanJoints& joints = links.joints;
  std::vector<Vec3>& x = w.massless.probed;
  std::copy(V.begin(), V.end(), x.begin());
  const auto at = [&](std::int32_t point) -> const Vec3& { return x[index(point)]; };
  for (const PlanBar& bar : bars) {
    const auto gradient = [&] {
      const Vec3 force = elastic_force(bar, sub(at(bar.second), at(bar.first)));
      return LinkGradient{{scale(-1.0, force), force}, {}};
    };
    add_probes(std::array{bar.first, bar.second}, {}, {}, joints, gradient, w);
  }
  for (const PlanTrueAngle& angle : links.angles) {
    const std::size_t count = angle.constants.form == AngleConstants::Form::kDihedral ? 4 : 3;
    const auto gradient = [&] {
      Vec3 position[4];
      for (std::size_t k = 0; k < count; ++k)
        position[k] = add(rest[index(angle.points[k])], at(angle.points[k]));
      const AngleGradient g = gradient_of(angle.constants, position);
      return LinkGradient{{g.force[0], g.force[1], g.force[2], g.force[3]}, {}};
    };
    add_probes(std::span(angle.points).first(count), {}, {}, joints, gradient, w);
  }
  for (const PlanTrueBeam& beam : links.beams) {
    const std::array ends{present(beam.ends[0], beam.axes, joints, state, w),
                          present(beam.ends[1], beam.axes, joints, state, w)};
    const auto gradient = [&] {
      const BeamGradient g =
          gradient_of(beam.constants, beam.span, sub(at(beam.points[1]), at(beam.points[0])),
                      beam_end(ends[0]), beam_end(ends[1]));
      return LinkGradient{{scale(-1.0, g.force), g.force}, {g.moment[0], g.moment[1]}};
    };
    add_probes(beam.points, beam.ends, ends, joints, gradient, w);
  }
  for (const PlanTruePlate& plate : links.plates) {
    std::array<PresentEnd, 3> ends;
    Mat3 axes[3];
    for (std::size_t k = 0; k < 3; ++k) {
      ends[k] = present(plate.ends[k], plate.axes, joints, state, w);
      axes[k] = ends[k].axes;
    }
    const auto gradient = [&] {
      const PlateGradient g =
          gradient_of(plate.constants, {at(plate.points[0]), at(plate.points[1]), at(plate.points[2])}, axes);
      return LinkGradient{{g.force[0], g.force[1], g.force[2]}, {g.moment[0], g.moment[1], g.moment[2]}};
    };
    add_probes(plate.points, plate.ends, ends, joints, gradient, w);
  }
  for (const PlanTrueMatrix& matrix : links.matrices) {
    std::array<Vec3, kMostMatrixPoints> position;
    std::array<Mat3, kMostMatrixPoints> R;
    for (std::size_t i = 0; i < matrix.ends.size(); ++i) R[i] = w.R[index(matrix.ends[i].joint)];
    const auto gradient = [&] {
      for (std::size_t i = 0; i < matrix.points.size(); ++i)
        position[i] = add(matrix.constants.arms[i], at(matrix.points[i]));
      MatrixGradient g;
      set_gradient(matrix.constants, {position.data(), matrix.points.size()}, {R.data(), matrix.ends.size()},
                   g);
      return g;
    };
    add_probes(matrix.points, matrix.ends, {}, joints, gradient, w);
  }
}

}  // namespace freeflex
