// The loops over modes. Elementwise, or in fixed lanes, so that any vector width gives the same bits.
#pragma once

#include <cstddef>
#include <span>

#include "core/step/plan.hpp"

namespace freeflex {

/// Sum of a_l b_l over n (a multiple of kLanes) in kLanes partial sums combined in a fixed order.
double dot_lanes(const double* a, const double* b, std::size_t n) noexcept;

/// Sum of (a_l b_l)^2, in the same lanes.
double dot_squares(const double* a, const double* b, std::size_t n) noexcept;

/// rows (3 x n) times x, in the same lanes.
inline Vec3 contract_rows(const double* rows, const double* x, std::size_t n) noexcept {
  return {dot_lanes(rows, x, n), dot_lanes(rows + n, x, n), dot_lanes(rows + 2 * n, x, n)};
}

/// The three rows of a block of Plan::rows: unit elastic displacements of the point that has the block.
inline const double* point_rows(const Plan& plan, std::int32_t row) noexcept {
  return plan.rows.data() + 3 * index(row) * index(plan.num_padded);
}

/// Elastic displacement, velocity and acceleration of a point.
struct PointMotion {
  Vec3 V{}, V_dot{}, V_ddot{};  // [m], [m/s], [m/s^2] body axes
};
/// rows (3 x num_padded) times q, q' and q'' = Q / M - 2 decay q' - omega^2 q (THEORY 2.5, X53), in the
/// same lanes.
PointMotion contract_motion(const double* rows, const Plan& plan, const double* q, const double* q_dot,
                            const double* Q) noexcept;

/// y = or += f_0 rows_0 + f_1 rows_1 + f_2 rows_2, rows (3 x n)
void combine_rows(const double* rows, const Vec3& f, bool accumulate, std::size_t n, double* y) noexcept;
/// y = or += sum_k weights_k table_k, table (9 x n)
void combine_table(const double* table, const Mat3& weights, bool accumulate, std::size_t n,
                   double* y) noexcept;
/// y = or += s x
void combine_one(const double* x, double s, bool accumulate, std::size_t n, double* y) noexcept;
/// table_ab += rows_a F_b, rows (3 x n), table (9 x n)
void add_outer(const double* rows, const Vec3& F, std::size_t n, double* table) noexcept;

/// V = rows a, W = rows b over all points, in the lanes of dot_lanes; rows (3 num_points x num_padded), of
/// which the num_moving leading columns count.
void contract_points(const Plan& plan, const double* a, const double* b, std::span<Vec3> V,
                     std::span<Vec3> W) noexcept;
/// x = rows^T f, y = rows^T g over all points, summed from the first point to the last; the n leading columns
void project_columns(const Plan& plan, std::size_t n, std::span<const Vec3> f, std::span<const Vec3> g,
                     double* x, double* y) noexcept;
/// The same for the modes; x, y (num_moving)
inline void project_points(const Plan& plan, std::span<const Vec3> f, std::span<const Vec3> g, double* x,
                           double* y) noexcept {
  project_columns(plan, index(plan.num_moving), f, g, x, y);
}
/// The same for modes and constraint shapes; x, y (num_padded)
inline void project_all_points(const Plan& plan, std::span<const Vec3> f, std::span<const Vec3> g, double* x,
                               double* y) noexcept {
  project_columns(plan, index(plan.num_padded), f, g, x, y);
}
/// y = sum_k weights_k row_k over n values; rows begin `stride` apart, count is a multiple of kLanes
void sum_rows(const double* rows, std::size_t stride, const double* weights, std::size_t count, std::size_t n,
              double* y) noexcept;

/// The elastic coordinates of all modes, value and low part.
struct ModalState {
  const double *q, *q_low, *q_dot, *q_dot_low;
};
struct ModalResult {
  double *q, *q_low, *q_dot, *q_dot_low;
};
/// One step of every mode under a load linear from Q^0 to Q^1, y^1 = (C + L) y + w_0 Q^0 + w_1 (Q^1 - Q^0)
/// (THEORY X10), which solves M q'' + c q = Q (5.7) exactly. Returns true when every new value is finite.
bool advance_modes(const Propagator& propagator, std::size_t n, const ModalState& from, const double* Q0,
                   const double* Q1, const ModalResult& to) noexcept;

}  // namespace freeflex
