#include "core/structure/sparse_modes.hpp"

#include <algorithm>
#include <cmath>

#include "core/rounding.hpp"
#include "core/scene/bodies.hpp"
#include "core/scene/faults.hpp"
#include "core/structure/decompositions.hpp"
#include "core/structure/loose_modes.hpp"
#include "core/structure/lowest_modes.hpp"
#include "core/structure/normal_modes.hpp"
#include "core/structure/particles.hpp"
#include "core/structure/sparse_system.hpp"
#include "core/structure/superelement.hpp"

namespace freeflex {
namespace {

// X176: what the lowest elastic frequency is off by: rounding of the rows, and what is left of the vector
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
  rounding = 2.0 * kEpsilon * std::sqrt(rounding) / square;
  ShiftedInverse* const inverse = modes.lowest_inverse();
  if (inverse == nullptr) return 0.0;
  const double shift = inverse->shift(), theta = 1.0 / (square + shift);
  Eigen::VectorXd left = inverse->apply(system.mass * x).col(0) - theta * x.col(0);
  const double error = std::sqrt(std::max(0.0, left.dot(system.mass * left))) / theta;
  // to the next that is not its equal
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
  for (Eigen::Index i = 0; i < mass.size(); ++i) mass[i] = points[static_cast<std::size_t>(i)].mass;
  return mass;
}

}  // namespace

void find_sparse_modes(const Scene& scene, const LinkFactor& factor, const ModesWanted& wanted,
                       const SetupProgress& progress, Structure& structure, Faults& faults) {
  const Freedoms freedoms(scene);
  const MassProperties& body = structure.mass_properties;
  const SparseSystem system = sparse_system(scene, freedoms, factor, body, faults);
  if (has_error(faults)) return;
  LowestModes modes(scene, system, progress, faults);
  if (!modes.find(wanted)) return;
  structure.omega = modes.omega();
  Eigen::MatrixXd x = modes.take_shapes();
  const double rounding = direction_rounding(scene);
  const Eigen::Index num_loose = take_out_mechanisms(scene, system, freedoms, body, rounding, structure, x);
  structure.frequency_accuracy = std::max(accuracy_of(system, modes, x, num_loose), factor.matrices.accuracy);
  const double mass = std::sqrt(body.mass);
  structure.shapes = mass * x.topRows(system.num_displacements);
  const Eigen::VectorXd signs = fix_signs(structure.shapes);
  structure.turns = turns_of(x, freedoms.num_rotations(), mass / system.length * signs);
  turn_with_bodies(scene, freedoms, structure.shapes, structure.turns);
  if (num_loose < structure.omega.size())
    structure.conditioning = structure.omega[structure.omega.size() - 1] / structure.omega[num_loose];
  structure.kept.is_part = true;
  structure.kept.counted_below = modes.counted_below() / (2.0 * std::numbers::pi);
  structure.particles = {masses_of(scene.points), body.r, {}};
  if (!are_point_masses(scene)) structure.particles = find_particles(scene, freedoms, structure);
  structure.matrix_sums = matrix_sums(scene, freedoms, structure);
}

}  // namespace freeflex
