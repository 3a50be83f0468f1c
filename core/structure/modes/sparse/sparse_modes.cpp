#include "core/structure/modes/sparse/sparse_modes.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/faults.hpp"
#include "core/rounding.hpp"
#include "core/scene/bodies.hpp"
#include "core/structure/masses/matrix_mass.hpp"
#include "core/structure/masses/particles.hpp"
#include "core/structure/modes/dense/decompositions.hpp"
#include "core/structure/modes/dense/normal_modes.hpp"
#include "core/structure/modes/dense/zero_frequency_modes.hpp"
#include "core/structure/modes/sparse/lowest_modes.hpp"
#include "core/structure/modes/sparse/sparse_system.hpp"

namespace freeflex {
namespace {

// Returns the relative accuracy of the lowest elastic frequency, which is the larger of two errors. The error
// from rounding of rows is 6 eps / omega_1^2 sqrt(sum_k (A y)_k^2 (sum_i |A_ki y_i|)^2) for y^T m y = 1
// (THEORY 16.43). The error from the residual of the vector is the smaller of delta s and delta^2 s / gamma
// (THEORY 16.44), with s = (omega_1^2 + sigma_0^2) / omega_1^2, delta = |y' - theta y|_m / theta, where y' is
// the image of y under the shifted inverse, and gamma = 1 - (omega_1^2 + sigma_0^2) / (omega_2^2 +
// sigma_0^2).
double accuracy_of(const SparseSystem& system, LowestModes& modes, const Eigen::MatrixXd& shapes,
                   Eigen::Index first) {
  if (first >= modes.omega().size()) return 0.0;
  const Eigen::MatrixXd x = shapes.col(first);
  const Eigen::VectorXd strain = exact_product(system.rows, x);
  double rounding = 0.0;
  for (Eigen::Index row = 0; row < system.rows.rows(); ++row) {
    double size = 0.0;
    for (SparseRows::InnerIterator it(system.rows, row); it; ++it)
      size += std::abs(it.value() * x(it.col(), 0));
    rounding += strain[row] * strain[row] * size * size;
  }
  const double square = strain.squaredNorm();
  rounding = 6.0 * kEpsilon * std::sqrt(rounding) / square;
  ShiftedInverse* const inverse = modes.lowest_inverse();
  if (inverse == nullptr) return 0.0;
  const double shift = inverse->shift(), theta = 1.0 / (square + shift);
  Eigen::VectorXd left = inverse->apply(system.mass * x).col(0) - theta * x.col(0);
  const double error = std::sqrt(std::max(0.0, left.dot(system.mass * left))) / theta;
  // finds the next frequency that differs from the lowest
  Eigen::Index next = first + 1;
  const Eigen::VectorXd& omega = modes.omega();
  while (next < omega.size() && omega[next] - omega[first] <= kTogether * omega[next]) ++next;
  const double beyond = next < omega.size() ? omega[next] : modes.next_omega();
  const double gap = 1.0 - (square + shift) / (beyond * beyond + shift);
  const double relative = error * (square + shift) / square;
  return std::max(rounding, std::min(relative, gap > 0.0 ? relative * error / gap : relative));
}

Eigen::VectorXd masses_of(const std::vector<PointMass>& points) {
  Eigen::VectorXd mass(static_cast<Eigen::Index>(points.size()));
  for (Eigen::Index i = 0; i < mass.size(); ++i) mass[i] = points[index(i)].mass;
  return mass;
}

}  // namespace

StaticResponses find_sparse_modes(const Scene& scene, const LinkFactor& factor, const ModesWanted& wanted,
                                  const SetupProgress& progress, Structure& structure, Faults& faults) {
  assert(structure.mass_properties.mass > 0.0 && factor.is_sparse);
  const Freedoms freedoms(scene);
  const MassProperties& body = structure.mass_properties;
  const SparseSystem system = sparse_system(scene, freedoms, factor, body, faults);
  if (has_error(faults)) return {};
  LowestModes modes(scene, system, progress, faults);
  if (!modes.find(wanted)) return {};
  structure.omega = modes.omega();
  Eigen::MatrixXd x = modes.take_shapes();
  const double rounding = direction_rounding(scene);
  const Eigen::Index num_mechanisms =
      separate_mechanisms(scene, system, freedoms, body, rounding, structure, x);
  structure.frequency_accuracy =
      std::max(accuracy_of(system, modes, x, num_mechanisms), factor.matrices.accuracy);
  const double mass = std::sqrt(body.mass);
  structure.shapes = mass * x.topRows(system.num_displacements);
  const Eigen::VectorXd signs = fix_signs(structure.shapes);
  structure.rotations = scaled_rotations(x, freedoms.num_rotations(), mass / system.length * signs);
  rotate_with_bodies(scene, freedoms, structure.shapes, structure.rotations);
  if (num_mechanisms < structure.omega.size())
    structure.conditioning = structure.omega[structure.omega.size() - 1] / structure.omega[num_mechanisms];
  structure.kept.is_subset = true;
  structure.kept.verified_below = modes.verified_below() / (2.0 * std::numbers::pi);
  structure.particles = {masses_of(scene.points), body.r, {}};
  if (!are_point_masses(scene)) structure.particles = find_particles(scene, freedoms, structure);
  structure.matrix_sums = matrix_sums(scene, freedoms, structure);
  ShiftedInverse* const inverse = modes.lowest_inverse();
  if (inverse == nullptr || reference_loads(scene, true).empty()) return {};
  if (progress.report && !progress.report("static responses to loads", 0.0)) {
    add_error(faults, scene.points.front().origin, kSetupEnded);
    return {};
  }
  return static_responses(scene, freedoms, system, body.r, x, structure.omega, *inverse);
}

}  // namespace freeflex
