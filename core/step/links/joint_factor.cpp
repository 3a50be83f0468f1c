#include "core/step/links/joint_factor.hpp"

#include <algorithm>

namespace freeflex {
namespace {

// [-] A pivot below this share of its diagonal entry is not used: it may be a rounding error.
constexpr double kSmallestPivot = 1e-10;

std::int32_t slot_of(const PlanJoints& joints, const JointFactor& factor, std::int32_t a,
                     std::int32_t b) noexcept {
  if (a < 0 || b < 0) return -1;
  const std::int32_t first = factor.place[index(a)], second = factor.place[index(b)];
  if (first == second) return first;
  const std::size_t column = index(std::min(first, second));
  const std::int32_t row = first > second ? a : b;
  for (std::int32_t e = joints.starts[column]; e < joints.starts[column + 1]; ++e)
    if (joints.below[index(e)] == row) return joints.num_rotations + e;
  return -1;  // the column is that of an idle rotation
}

void add_slots(const PlanJoints& joints, std::span<const std::int32_t> unknowns, JointFactor& factor) {
  for (std::size_t a = 0; a < unknowns.size(); ++a)
    for (std::size_t b = 0; b <= a; ++b)
      factor.slots.push_back(slot_of(joints, factor, unknowns[a], unknowns[b]));
}

void add_to_slot(std::int32_t slot, double value, JointFactor& factor) noexcept {
  const std::size_t n = factor.diagonal.size();
  if (slot < 0) return;
  (index(slot) < n ? factor.diagonal[index(slot)] : factor.lower[index(slot) - n]) += value;
}

std::int32_t unknown_of(const PlanLinkEnd& end, std::size_t axis, std::int32_t num_joints) noexcept {
  return end.joint < num_joints ? 3 * end.joint + static_cast<std::int32_t>(axis) : -1;
}

/// Returns whether three columns from k on have the same rows below them.
bool have_same_rows(const PlanJoints& joints, std::size_t k) {
  if (k + 3 > index(joints.num_rotations)) return false;
  const auto rows = [&](std::size_t column) {
    return std::span(joints.below)
        .subspan(index(joints.starts[column]), index(joints.starts[column + 1] - joints.starts[column]));
  };
  const auto a = rows(k), b = rows(k + 1), c = rows(k + 2);
  return a.size() == c.size() + 2 && b.size() == c.size() + 1 && a[0] == joints.order[k + 1] &&
         a[1] == joints.order[k + 2] && b[0] == joints.order[k + 2] && std::ranges::equal(c, a.subspan(2)) &&
         std::ranges::equal(c, b.subspan(1));
}

}  // namespace

std::array<std::int32_t, kBeamUnknowns> unknowns_of(const PlanTrueBeam& beam,
                                                    std::int32_t num_joints) noexcept {
  std::array<std::int32_t, kBeamUnknowns> result;
  for (std::size_t end = 0; end < 2; ++end)
    for (std::size_t a = 0; a < 3; ++a) {
      result[3 * end + a] = unknown_of(beam.ends[end], a, num_joints);
      result[6 + 3 * end + a] = beam.ends[end].released[a];
    }
  return result;
}

std::array<std::int32_t, kPlateUnknowns> unknowns_of(const PlanTruePlate& plate,
                                                     std::int32_t num_joints) noexcept {
  std::array<std::int32_t, kPlateUnknowns> result;
  for (std::size_t end = 0; end < 3; ++end)
    for (std::size_t a = 0; a < 3; ++a) result[3 * end + a] = unknown_of(plate.ends[end], a, num_joints);
  return result;
}

std::vector<std::int32_t> unknowns_of(const PlanTrueMatrix& matrix, std::int32_t num_joints) {
  std::vector<std::int32_t> result;
  for (const PlanLinkEnd& end : matrix.ends)
    for (std::size_t a = 0; a < 3; ++a) result.push_back(unknown_of(end, a, num_joints));
  return result;
}

JointFactor make_joint_factor(const PlanTrueLinks& links) {
  const PlanJoints& joints = links.joints;
  const std::size_t n = index(joints.num_rotations);
  JointFactor factor;
  factor.lower.resize(joints.lower.size());
  for (auto* v : {&factor.inverse_pivots, &factor.diagonal}) v->resize(n);
  for (auto* v : {&factor.place, &factor.at}) v->resize(n);
  for (std::size_t k = 0; k < n; ++k) factor.place[index(joints.order[k])] = static_cast<std::int32_t>(k);

  for (std::size_t k = 0; k < n; k += factor.widths.back())
    factor.widths.push_back(have_same_rows(joints, k) ? 3 : 1);
  for (const PlanTrueBeam& beam : links.beams)
    add_slots(joints, unknowns_of(beam, joints.num_joints), factor);
  for (const PlanTruePlate& plate : links.plates)
    add_slots(joints, unknowns_of(plate, joints.num_joints), factor);
  for (const PlanTrueMatrix& matrix : links.matrices)
    add_slots(joints, unknowns_of(matrix, joints.num_joints), factor);
  return factor;
}

void add_to_entry(const PlanJoints& joints, std::int32_t a, std::int32_t b, double value,
                  JointFactor& factor) noexcept {
  add_to_slot(slot_of(joints, factor, a, b), value, factor);
}

void clear_stiffness(JointFactor& factor) noexcept {
  std::fill(factor.diagonal.begin(), factor.diagonal.end(), 0.0);
  std::fill(factor.lower.begin(), factor.lower.end(), 0.0);
}

void add_stiffness(std::span<const std::int32_t> slots, std::span<const Vec3> axes,
                   std::span<const std::uint8_t> ends, std::span<const double> K, std::size_t num_ends,
                   JointFactor& factor) noexcept {
  const std::size_t width = 3 * num_ends;
  std::size_t next = 0;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    Vec3 row[3] = {};  // axes[a] times K
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < width; ++j)
        row[j / 3][j % 3] += axes[a][i] * K[(3 * std::size_t{ends[a]} + i) * width + j];
    for (std::size_t b = 0; b <= a; ++b, ++next) {
      add_to_slot(slots[next], dot(row[ends[b]], axes[b]), factor);
    }
  }
}

void add_stiffness(std::span<const std::int32_t> slots, const MatrixConstants& matrix,
                   std::span<const Mat3> turns, JointFactor& factor) noexcept {
  const std::size_t n = 6 * turns.size(), width = pad(n);
  const auto entry = [&](std::size_t a, std::size_t i, std::size_t b, std::size_t j) {
    return matrix.stiffness[(6 * a + 3 + i) * width + 6 * b + 3 + j];
  };
  for (std::size_t a = 0; a < turns.size(); ++a)
    for (std::size_t b = 0; b <= a; ++b) {
      Mat3 K;
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) K[3 * i + j] = entry(a, i, b, j);
      const Mat3 right = multiply(K, turns[b]);
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3 && 3 * b + j <= 3 * a + i; ++j) {
          const std::size_t row = 3 * a + i;
          const Mat3& O = turns[a];
          add_to_slot(slots[row * (row + 1) / 2 + 3 * b + j],
                      O[i] * right[j] + O[3 + i] * right[3 + j] + O[6 + i] * right[6 + j], factor);
        }
    }
}

void factor_stiffness(const PlanJoints& joints, JointFactor& factor) noexcept {
  const auto column_of = [&](std::size_t k) {
    return std::pair{index(joints.starts[k]), index(joints.starts[k + 1])};
  };
  factor.is_definite = true;
  double largest = 0.0;
  for (const double entry : factor.diagonal) largest = std::max(largest, magnitude(entry));
  std::copy(factor.diagonal.begin(), factor.diagonal.end(), factor.inverse_pivots.begin());
  for (std::size_t k = 0; k < factor.diagonal.size(); ++k) {
    if (joints.inverse_pivots[k] == 0.0) {  // an idle rotation, whose column is empty
      factor.inverse_pivots[k] = 0.0;
      continue;
    }
    if (factor.inverse_pivots[k] < -kSmallestPivot * factor.diagonal[k]) factor.is_definite = false;
    const auto [first, last] = column_of(k);
    double below = 0.0;
    for (std::size_t i = first; i < last; ++i) below = std::max(below, magnitude(factor.lower[i]));
    // a pivot that bounds the entries of the factor, l^2 d <= largest; that of a definite K_tt is not changed
    const double pivot = std::max({magnitude(factor.inverse_pivots[k]), below * (below / largest),
                                   kSmallestPivot * magnitude(factor.diagonal[k])});
    factor.inverse_pivots[k] = 1.0 / pivot;
    for (std::size_t i = first; i < last; ++i) {
      const std::size_t c = index(factor.place[index(joints.below[i])]);
      const double value = factor.lower[i], share = value * factor.inverse_pivots[k];
      factor.inverse_pivots[c] -= share * value;
      const auto [first_of_c, last_of_c] = column_of(c);
      for (std::size_t e = first_of_c; e < last_of_c; ++e)
        factor.at[index(joints.below[e])] = static_cast<std::int32_t>(e);
      if (first_of_c == last_of_c) continue;
      for (std::size_t j = i + 1; j < last; ++j)
        factor.lower[index(factor.at[index(joints.below[j])])] -= share * factor.lower[j];
    }
    for (std::size_t i = first; i < last; ++i) factor.lower[i] *= factor.inverse_pivots[k];
  }
  factor.is_renewed = true;
}

namespace {

/// Points to three columns of a factor that have the same rows below them: a, b and c without the entries
/// among the three, which are b_a, c_a and c_b.
struct ThreeColumns {
  const double *a, *b, *c;
  double b_a, c_a, c_b;
  std::span<const std::int32_t> rows;
};
ThreeColumns three_columns(const PlanJoints& joints, const double* lower, std::size_t k) noexcept {
  const double *a = lower + joints.starts[k], *b = lower + joints.starts[k + 1],
               *c = lower + joints.starts[k + 2];
  const auto first = joints.below.begin() + joints.starts[k + 2],
             last = joints.below.begin() + joints.starts[k + 3];
  return {a + 2, b + 1, c, a[0], a[1], b[0], {first, last}};
}

}  // namespace

void solve_stiffness(const PlanJoints& joints, const JointFactor& factor, double* x) noexcept {
  const double* const lower = (factor.is_renewed ? factor.lower : joints.lower).data();
  const double* const inverse = (factor.is_renewed ? factor.inverse_pivots : joints.inverse_pivots).data();
  const auto at = [&](std::size_t k) -> double& { return x[index(joints.order[k])]; };
  std::size_t k = 0;
  for (const std::uint8_t width : factor.widths) {
    if (width == 3) {
      const ThreeColumns L = three_columns(joints, lower, k);
      const double x_a = at(k), x_b = at(k + 1) -= L.b_a * x_a;
      const double x_c = at(k + 2) -= L.c_a * x_a + L.c_b * x_b;
      for (std::size_t i = 0; i < L.rows.size(); ++i)
        x[index(L.rows[i])] -= L.a[i] * x_a + L.b[i] * x_b + L.c[i] * x_c;
    } else {
      const double value = at(k);
      for (std::size_t e = index(joints.starts[k]); e < index(joints.starts[k + 1]); ++e)
        x[index(joints.below[e])] -= lower[e] * value;
    }
    k += width;
  }
  for (auto width = factor.widths.rbegin(); width != factor.widths.rend(); ++width) {
    k -= *width;
    if (*width == 3) {
      const ThreeColumns L = three_columns(joints, lower, k);
      Vec3 sums{};
      for (std::size_t i = 0; i < L.rows.size(); ++i)
        sums = add_scaled(sums, x[index(L.rows[i])], {L.a[i], L.b[i], L.c[i]});
      const double x_c = at(k + 2) = at(k + 2) * inverse[k + 2] - sums[2];
      const double x_b = at(k + 1) = at(k + 1) * inverse[k + 1] - (sums[1] + L.c_b * x_c);
      at(k) = at(k) * inverse[k] - (sums[0] + L.b_a * x_b + L.c_a * x_c);
    } else {
      double value = at(k) * inverse[k];
      for (std::size_t e = index(joints.starts[k]); e < index(joints.starts[k + 1]); ++e)
        value -= lower[e] * x[index(joints.below[e])];
      at(k) = value;
    }
  }
}

}  // namespace freeflex
