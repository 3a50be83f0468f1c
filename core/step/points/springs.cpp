#include "core/step/points/springs.hpp"

#include <cstddef>

#include "core/widths.hpp"

namespace freeflex {
namespace {

using Quad = double __attribute__((vector_size(32)));
constexpr std::size_t kQuad = 4;

FREEFLEX_KERNEL void load_to(Quad& to, const double* from) noexcept {
  __builtin_memcpy(&to, from, sizeof(Quad));
}
FREEFLEX_KERNEL void store(const Quad& from, double* to) noexcept {
  __builtin_memcpy(to, &from, sizeof(Quad));
}

/// Sets the square of the length of four vectors (x, y, z, any).
FREEFLEX_KERNEL void squares_of(const Quad* d, Quad& square) noexcept {
  const Quad a = d[0] * d[0], b = d[1] * d[1], c = d[2] * d[2], e = d[3] * d[3];
  const Quad ab_xz = __builtin_shufflevector(a, b, 0, 4, 2, 6),
             ab_y = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const Quad ce_xz = __builtin_shufflevector(c, e, 0, 4, 2, 6),
             ce_y = __builtin_shufflevector(c, e, 1, 5, 3, 7);
  const Quad x = __builtin_shufflevector(ab_xz, ce_xz, 0, 1, 4, 5),
             y = __builtin_shufflevector(ab_y, ce_y, 0, 1, 4, 5),
             z = __builtin_shufflevector(ab_xz, ce_xz, 2, 3, 6, 7);
  square = (x + y) + z;
}

/// [-] Largest change of the square of a length, relative to the square at rest, at which the series of its
/// inverse root gives all digits: a strain of 5 %.
constexpr double kSmallChange = 0.1;

/// Sets L / l from r = (l / L)^2 near 1: the series of (1 + u)^(-1/2), u = r - 1, to the third power, then
/// two steps of Newton's method, which take its error of 0.27 u^4 to 1e-17.
FREEFLEX_KERNEL void inverse_root_near_one(const Quad& r, Quad& root) noexcept {
  const Quad u = r - 1.0, half = 0.5 * r;
  root = (1.0 - 0.5 * u) + (u * u) * (0.375 - 0.3125 * u);
  root = root * (1.5 - half * (root * root));
  root = root * (1.5 - half * (root * root));
}

/// Sets the pull D - D L / l of four springs, and L / l. Divisions and roots take half of the time of a
/// spring, so a series replaces them where all four springs are strained little.
FREEFLEX_KERNEL void pull_of(const PlanPoints& plan, std::size_t s, const Quad& square, Quad& pull,
                             Quad& root) noexcept {
  Quad stiffness, inverse_square;
  load_to(stiffness, plan.stiffness.data() + s);
  load_to(inverse_square, plan.inverse_square.data() + s);
  const Quad r = square * inverse_square, change = (r - 1.0) * (r - 1.0);
  constexpr double kLimit = kSmallChange * kSmallChange;
  if (change[0] < kLimit && change[1] < kLimit && change[2] < kLimit && change[3] < kLimit) {
    inverse_root_near_one(r, root);
    pull = stiffness - stiffness * root;
    return;
  }
  const double* const tension = plan.tension.data() + s;
  for (std::size_t k = 0; k < kQuad; ++k) {
    root[k] = 1.0 / __builtin_sqrt(r[k]);
    pull[k] = stiffness[k] - tension[k] / __builtin_sqrt(square[k]);
  }
}

/// Sets the vectors between the points of four springs.
FREEFLEX_KERNEL void differences(const std::int32_t* first, const std::int32_t* second, const double* x,
                                 Quad* d) noexcept {
  for (std::size_t k = 0; k < kQuad; ++k) {
    Quad from, to;
    load_to(from, x + 3 * static_cast<std::size_t>(first[k]));
    load_to(to, x + 3 * static_cast<std::size_t>(second[k]));
    d[k] = to - from;
  }
}

/// Adds c d.d' / l^2 of four springs to their pulls.
FREEFLEX_KERNEL void add_damping(const PlanPoints& plan, std::size_t s, const Quad* d, const Quad* rate,
                                 const Quad& root, Quad& pull) noexcept {
  Quad damping, inverse_square;
  load_to(damping, plan.damping.data() + s);
  load_to(inverse_square, plan.inverse_square.data() + s);
  Quad along;
  for (std::size_t k = 0; k < kQuad; ++k) {
    const Quad product = d[k] * rate[k];
    along[k] = (product[0] + product[1]) + product[2];
  }
  pull += damping * (along * (root * root * inverse_square));
}

/// Adds the forces of the springs on the points, which have four numbers each, the last of them of no
/// meaning.
template <bool kIsDamped>
FREEFLEX_KERNEL void add_springs(const PlanPoints* plan, const double* __restrict x,
                                 const double* __restrict v, double* __restrict force) noexcept {
  const std::int32_t *first = plan->first.data(), *second = plan->second.data();
  for (std::size_t s = 0; s < plan->first.size(); s += kQuad) {
    Quad d[kQuad], square, pull, root;
    differences(first + s, second + s, x, d);
    squares_of(d, square);
    pull_of(*plan, s, square, pull, root);
    if constexpr (kIsDamped) {
      Quad rate[kQuad];
      differences(first + s, second + s, v, rate);
      add_damping(*plan, s, d, rate, root, pull);
    }
    for (std::size_t k = 0; k < kQuad; ++k) {
      const Quad by = pull[k] * d[k];
      double* const on_first = force + kQuad * static_cast<std::size_t>(first[s + k]);
      double* const on_second = force + kQuad * static_cast<std::size_t>(second[s + k]);
      Quad sum;
      load_to(sum, on_first);
      sum += by;
      store(sum, on_first);
      load_to(sum, on_second);
      sum -= by;
      store(sum, on_second);
    }
  }
}

/// Sets a = load + F / m. Each store covers the first component of the next point, which follows.
FREEFLEX_KERNEL void divide_by_mass(const double* inverse_mass, std::size_t num_points,
                                    const double* __restrict force, const double* __restrict load,
                                    double* __restrict a) noexcept {
  for (std::size_t i = 0; i < num_points; ++i) {
    Quad f, own;
    load_to(f, force + kQuad * i);
    load_to(own, load + 3 * i);
    store(own + inverse_mass[i] * f, a + 3 * i);
  }
}

template <bool kIsDamped>
FREEFLEX_KERNEL void accelerate_points(const PlanPoints* plan, const double* x, const double* v,
                                       const double* load, double* force, double* acceleration) noexcept {
  const std::size_t num_points = plan->inverse_mass.size();
  for (std::size_t k = 0; k < kQuad * num_points; ++k) force[k] = 0.0;
  add_springs<kIsDamped>(plan, x, v, force);
  divide_by_mass(plan->inverse_mass.data(), num_points, force, load, acceleration);
  acceleration[3 * num_points] = 0.0;
}

}  // namespace

void accelerate(const PlanPoints& plan, const double* x, const double* v, const double* load, double* force,
                double* acceleration) noexcept {
  if (plan.damping.empty())
    run<accelerate_points<false>>(&plan, x, v, load, force, acceleration);
  else
    run<accelerate_points<true>>(&plan, x, v, load, force, acceleration);
}

}  // namespace freeflex
