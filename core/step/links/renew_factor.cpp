// The stiffness over the rotations of joints at the present shape.
#include "core/step/links/true_links.hpp"

namespace freeflex {
namespace {

constexpr double kProbe = 1e-7;  // [rad] rotation for the differences of moments

/// Returns a vector after a rotation by kProbe about an axis of the body.
Vec3 probe(const Vec3& a, std::size_t axis) noexcept {
  Vec3 unit{};
  unit[axis] = kProbe;
  return add(a, cross(unit, a));
}

/// Sets K to the symmetric part of the derivative of the moments m_a, in axes that rotate with their end, by
/// rotations of the ends:
///   K_ab = dm_a / d(rotation of b) - delta_ab [e x] m_a   (THEORY 12.73)
/// \param moments_at  returns the moments if end `b` is rotated about `axis` by kProbe
/// \param K  [N m] (3 num_ends x 3 num_ends)
template <std::size_t num_ends, typename MomentsAt>
void set_stiffness(const std::array<Vec3, num_ends>& m, const MomentsAt& moments_at,
                   std::span<double> K) noexcept {
  constexpr std::size_t n = 3 * num_ends;
  std::array<double, n * n> columns;
  for (std::size_t b = 0; b < num_ends; ++b)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::array<Vec3, num_ends> probed = moments_at(b, axis);
      Vec3 unit{};
      unit[axis] = 1.0;
      for (std::size_t a = 0; a < num_ends; ++a) {
        Vec3 column = scale(1.0 / kProbe, sub(probed[a], m[a]));
        if (a == b) column = sub(column, cross(unit, m[a]));
        for (std::size_t i = 0; i < 3; ++i) columns[(3 * a + i) * n + 3 * b + axis] = column[i];
      }
    }
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) K[i * n + j] = 0.5 * (columns[i * n + j] + columns[j * n + i]);
}

/// Sets the axes about which the unknown rotations of an end turn it, and the number of the end.
template <std::size_t count>
void set_spins(const PlanLinkEnd& end, const PresentEnd& at, std::uint8_t number, const JointWorkspace& w,
               std::size_t releases_at, std::array<Vec3, count>& spins,
               std::array<std::uint8_t, count>& end_of) noexcept {
  const Mat3& R = w.R[index(end.joint)];
  for (std::size_t a = 0; a < 3; ++a) {
    spins[3 * std::size_t{number} + a] = {R[a], R[3 + a], R[6 + a]};
    end_of[3 * std::size_t{number} + a] = number;
    if (releases_at == 0) continue;
    spins[releases_at + a] = at.spins[a];
    end_of[releases_at + a] = number;
  }
}

// The functions below add the stiffness of one link and take its slots from the front of `slots`.

void add_beam_stiffness(const PlanTrueBeam& beam, const PlanJoints& joints, std::span<const Vec3> V,
                        const JointState& state, std::span<const std::int32_t>& slots,
                        JointWorkspace& w) noexcept {
  const Vec3 d = sub(V[index(beam.points[1])], V[index(beam.points[0])]);
  PresentEnd ends[2];
  BeamEnd axes[2];
  std::array<Vec3, kBeamUnknowns> spins;
  std::array<std::uint8_t, kBeamUnknowns> end_of;
  for (std::uint8_t k = 0; k < 2; ++k) {
    ends[k] = present(beam.ends[k], beam.axes, joints, state, w);
    axes[k] = beam_end(ends[k]);
    set_spins(beam.ends[k], ends[k], k, w, 6U + 3U * k, spins, end_of);
  }
  const auto moments = [&](const BeamEnd& first, const BeamEnd& second) {
    const BeamGradient g = gradient_of(beam.constants, beam.span, d, first, second);
    return std::array<Vec3, 2>{g.moment[0], g.moment[1]};
  };
  std::array<double, 36> K;
  set_stiffness<2>(
      moments(axes[0], axes[1]),
      [&](std::size_t b, std::size_t axis) {
        BeamEnd turned[2] = {axes[0], axes[1]};
        turned[b] = {probe(axes[b].n, axis), probe(axes[b].y, axis)};
        return moments(turned[0], turned[1]);
      },
      K);
  const std::size_t count = kBeamUnknowns * (kBeamUnknowns + 1) / 2;
  add_stiffness(slots.first(count), spins, end_of, K, 2, w.factor);
  slots = slots.subspan(count);
}

void add_plate_stiffness(const PlanTruePlate& plate, const PlanJoints& joints, std::span<const Vec3> V,
                         const JointState& state, std::span<const std::int32_t>& slots,
                         JointWorkspace& w) noexcept {
  Vec3 d[3];
  Mat3 axes[3];
  std::array<Vec3, kPlateUnknowns> spins;
  std::array<std::uint8_t, kPlateUnknowns> end_of;
  for (std::uint8_t k = 0; k < 3; ++k) {
    d[k] = V[index(plate.points[k])];
    const PresentEnd end = present(plate.ends[k], plate.axes, joints, state, w);
    axes[k] = end.axes;
    set_spins(plate.ends[k], end, k, w, 0, spins, end_of);
  }
  const auto moments = [&](const Mat3(&ends)[3]) {
    const PlateGradient g = gradient_of(plate.constants, d, ends);
    return std::array<Vec3, 3>{g.moment[0], g.moment[1], g.moment[2]};
  };
  std::array<double, 81> K;
  set_stiffness<3>(
      moments(axes),
      [&](std::size_t b, std::size_t axis) {
        Mat3 turned[3] = {axes[0], axes[1], axes[2]};
        for (std::size_t k = 0; k < 3; ++k) {
          const Vec3 column = probe({axes[b][k], axes[b][3 + k], axes[b][6 + k]}, axis);
          for (std::size_t i = 0; i < 3; ++i) turned[b][3 * i + k] = column[i];
        }
        return moments(turned);
      },
      K);
  const std::size_t count = kPlateUnknowns * (kPlateUnknowns + 1) / 2;
  add_stiffness(slots.first(count), spins, end_of, K, 3, w.factor);
  slots = slots.subspan(count);
}

void add_matrix_stiffness(const PlanTrueMatrix& matrix, std::span<const Vec3> V,
                          std::span<const std::int32_t>& slots, JointWorkspace& w) noexcept {
  if (matrix.ends.empty()) return;
  const std::size_t num_ends = matrix.ends.size();
  std::array<Vec3, kMostMatrixPoints> x;
  std::array<Mat3, kMostMatrixPoints> turns;
  for (std::size_t i = 0; i < num_ends; ++i) {
    x[i] = add(matrix.constants.arms[i], V[index(matrix.points[i])]);
    turns[i] = w.R[index(matrix.ends[i].joint)];
  }
  MatrixGradient g;
  set_gradient(matrix.constants, {x.data(), num_ends}, {turns.data(), num_ends}, g);
  for (std::size_t i = 0; i < num_ends; ++i) turns[i] = multiply_transposed(g.R, turns[i]);
  const std::size_t unknowns = 3 * num_ends, count = unknowns * (unknowns + 1) / 2;
  add_stiffness(slots.first(count), matrix.constants, {turns.data(), num_ends}, w.factor);
  slots = slots.subspan(count);
}

}  // namespace

void renew_factor(const PlanTrueLinks& links, std::span<const PlanBar> bars, std::span<const Vec3> rest,
                  std::span<const Vec3> V, const JointState& state, JointWorkspace& w) noexcept {
  clear_stiffness(w.factor);
  std::span<const std::int32_t> slots = w.factor.slots;
  for (const PlanTrueBeam& beam : links.beams) add_beam_stiffness(beam, links.joints, V, state, slots, w);
  for (const PlanTruePlate& plate : links.plates)
    add_plate_stiffness(plate, links.joints, V, state, slots, w);
  for (const PlanTrueMatrix& matrix : links.matrices) add_matrix_stiffness(matrix, V, slots, w);
  if (!w.massless.empty()) add_massless_stiffness(links, bars, rest, V, state, w);
  factor_stiffness(links.joints, w.factor);
}

}  // namespace freeflex
