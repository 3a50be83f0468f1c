#include "core/step/loads/field.hpp"

#include "core/step/linear/kernels.hpp"

namespace freeflex {

Vec3 gravity_at(const StepPlan& plan, const Vec3& p_W) noexcept {
  if (plan.attractor_mu == 0.0) return plan.gravity_W;
  const Vec3 rho = sub(p_W, plan.attractor_W);
  const double square = dot(rho, rho);
  return scale(-plan.attractor_mu / (square * __builtin_sqrt(square)), rho);
}

Vec3 tidal_acceleration(double mu, const Vec3& rho, const Vec3& x) noexcept {
  // y = |rho + x|^2 / |rho|^2 = 1 + e,  e = (2 rho . x + x . x) / |rho|^2   (THEORY 8.22, 8.23; Battin 1999)
  // y^(-3/2) - 1 = -e (3 + 3 e + e^2) / (y^3 (1 + y^(-3/2)))
  const double square = dot(rho, rho), e = (2.0 * dot(rho, x) + dot(x, x)) / square, y = 1.0 + e;
  const double root = 1.0 / (y * __builtin_sqrt(y));
  const double less_one = -e * (3.0 + e * (3.0 + e)) / (y * y * y * (1.0 + root));
  return scale(-mu / (square * __builtin_sqrt(square)), add_scaled(scale(root, x), less_one, rho));
}

Vec3 gradient_torque(const StepPlan& plan, const Vec3& rho) noexcept {
  const double square = dot(rho, rho);
  return scale(3.0 * plan.attractor_mu / (square * square * __builtin_sqrt(square)),
               cross(rho, multiply(plan.inertia, rho)));
}

std::array<double, 6> field_of(const StepPlan& plan, const Mat3& R_WB, const Vec3& w,
                               const Vec3& p_W) noexcept {
  // -w x (w x r) = (w.w) r - w (w.r)
  Vec3 diagonal{w[1] * w[1] + w[2] * w[2], w[0] * w[0] + w[2] * w[2], w[0] * w[0] + w[1] * w[1]};
  Vec3 off{-w[0] * w[1], -w[0] * w[2], -w[1] * w[2]};
  if (plan.attractor_mu > 0.0) {
    // Gamma = mu / |rho|^3 (3 e e^T - 1)   (THEORY 8.19)
    const Vec3 rho = multiply_transposed(R_WB, sub(p_W, plan.attractor_W));
    const double square = dot(rho, rho);
    const double gradient = plan.attractor_mu / (square * __builtin_sqrt(square));
    const double along = 3.0 * gradient / square;
    for (std::size_t a = 0; a < 3; ++a) diagonal[a] += along * rho[a] * rho[a] - gradient;
    off = add_scaled(off, along, {rho[0] * rho[1], rho[0] * rho[2], rho[1] * rho[2]});
  }
  return {diagonal[0], diagonal[1], diagonal[2], off[0], off[1], off[2]};
}

void add_field(const StepPlan& plan, const Mat3& R_WB, const Vec3& H_W, const Vec3& p_W, double* Q) noexcept {
  const Vec3 w = plan.has_spin_load ? multiply(plan.inverse_inertia, multiply_transposed(R_WB, H_W)) : Vec3{};
  const std::array<double, 6> S = field_of(plan, R_WB, w, p_W);
  const auto n = index(plan.num_padded);
  combine_rows(plan.field_rows.data(), {S[0], S[1], S[2]}, true, n, Q);
  combine_rows(plan.field_rows.data() + 3 * n, scale(2.0, {S[3], S[4], S[5]}), true, n, Q);
}

}  // namespace freeflex
