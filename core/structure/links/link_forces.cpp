// The forces of links follow from elastic coordinates and their rates. The forces of rigid links depend on
// the loads too.
#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/scene/bodies.hpp"
#include "core/structure/links/link_factor.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

// Returns the end forces and moments of a beam for unit natural forces s_1 to s_6: axial, torsion, symmetric
// and antisymmetric bending about z, symmetric and antisymmetric bending about y.
// f1 = (-s_1, 2 s_4 / L, -2 s_6 / L), f2 = -f1   (THEORY 5.3)
// mu1 = (-s_2, -s_5 + s_6, -s_3 + s_4), mu2 = (s_2, s_5 + s_6, s_3 + s_4)   (THEORY 5.4)
Eigen::Matrix<double, 12, 6> end_forces(double length) {
  Eigen::Matrix<double, 12, 6> forces = Eigen::Matrix<double, 12, 6>::Zero();
  enum { kFx1, kFy1, kFz1, kMx1, kMy1, kMz1, kFx2, kFy2, kFz2, kMx2, kMy2, kMz2 };
  enum { kAxial, kTorsion, kSymmetricZ, kAntisymmetricZ, kSymmetricY, kAntisymmetricY };
  const double shear = 2.0 / length;
  forces(kFx1, kAxial) = forces(kMx1, kTorsion) = -1.0;
  forces(kFx2, kAxial) = forces(kMx2, kTorsion) = 1.0;
  forces(kMz1, kSymmetricZ) = forces(kMy1, kSymmetricY) = -1.0;
  forces(kMz2, kSymmetricZ) = forces(kMy2, kSymmetricY) = 1.0;
  forces(kMz1, kAntisymmetricZ) = forces(kMz2, kAntisymmetricZ) = 1.0;
  forces(kMy1, kAntisymmetricY) = forces(kMy2, kAntisymmetricY) = 1.0;
  forces(kFy1, kAntisymmetricZ) = forces(kFz2, kAntisymmetricY) = shear;
  forces(kFy2, kAntisymmetricZ) = forces(kFz1, kAntisymmetricY) = -shear;
  return forces;
}

// returns the forces -B^T s that the natural forces s of a link exert on its points
Eigen::MatrixXd point_forces(const LinkFactor& factor, const Link& link, RowRange range,
                             const Eigen::MatrixXd& forces) {
  Eigen::MatrixXd on_points =
      Eigen::MatrixXd::Zero(3 * static_cast<Eigen::Index>(link.points.size()), forces.cols());
  for (int k = 0; k < range.count; ++k)
    for (const auto& [freedom, coefficient] : natural_row(factor, range, k).coefficients) {
      const auto position =
          std::find(link.points.begin(), link.points.end(), freedom / 3) - link.points.begin();
      on_points.row(3 * position + freedom % 3) -= coefficient * forces.row(k);
    }
  return on_points;
}

// Returns the published forces of an elastic link from its natural forces, per displacement V or elastic
// coordinate: the tension s = D u . (V_2 - V_1) of a spring or bar (THEORY 5.1), the end forces of a beam
// (THEORY 5.3, 5.4), the resultants of a plate (THEORY 3.37).
Eigen::MatrixXd elastic_forces(const Scene& scene, const LinkFactor& factor, int index,
                               const Eigen::MatrixXd& natural) {
  const Link& link = scene.links[static_cast<std::size_t>(index)];
  using Matrix = Eigen::MatrixXd;
  return std::visit(
      Cases{
          [&](const Spring&) { return natural; },
          [&](const Bar&) { return natural; },
          [&](const Beam&) -> Matrix { return end_forces(span_of(scene, link).stableNorm()) * natural; },
          [&](const MatrixLink&) {
            return point_forces(factor, link, factor.natural_of[static_cast<std::size_t>(index)], natural);
          },
          [&](const BendingSpring&) { return natural; },
          [&](const TorsionSpring&) { return natural; },
          [&](const Plate&) -> Matrix { return plate_resultants(scene, link) * natural; },
          [&](const Rigid&) { return natural; },
          [&](const Dashpot&) { return natural; },
      },
      link.kind);
}

// Returns the constraint shapes g = m^-1 C^T (C m^-1 C^T)^-1, as columns   (THEORY 5.7), by QR of m^-1/2 C^T.
// The multipliers are lambda = g^T (F - K (V + beta_R V') - A_d^T A_d V')   (THEORY 5.6).
Eigen::MatrixXd constraint_shapes(const Scene& scene, const LinkFactor& factor) {
  Eigen::VectorXd root_mass(factor.rows.cols());
  for (Eigen::Index i = 0; i < root_mass.size(); ++i)
    root_mass[i] = std::sqrt(scene.points[static_cast<std::size_t>(i / 3)].mass);
  const Eigen::MatrixXd weighted = root_mass.cwiseInverse().asDiagonal() * factor.constraints.transpose();
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(weighted);
  Eigen::MatrixXd Q = Eigen::MatrixXd::Identity(weighted.rows(), weighted.cols());
  Q.applyOnTheLeft(qr.householderQ());
  const Eigen::MatrixXd R = qr.matrixQR().topRows(weighted.cols()).triangularView<Eigen::Upper>();
  const Eigen::MatrixXd solved = R.triangularView<Eigen::Upper>().solve(Q.transpose());
  return root_mass.cwiseInverse().asDiagonal() * solved.transpose();
}

// returns the forces of a rigid link per multiplier: the tension of a link of two points, or the forces -C^T
// on the points of a body (THEORY 5.6)
Eigen::MatrixXd rigid_forces(const LinkFactor& factor, const Link& link, const std::vector<int>& columns) {
  const auto num_points = static_cast<Eigen::Index>(link.points.size());
  Eigen::MatrixXd on_points(3 * num_points, static_cast<Eigen::Index>(columns.size()));
  for (std::size_t c = 0; c < columns.size(); ++c)
    for (Eigen::Index k = 0; k < num_points; ++k)
      on_points.block<3, 1>(3 * k, static_cast<Eigen::Index>(c)) =
          -factor.constraints
               .block<1, 3>(columns[c], 3 * Eigen::Index{link.points[static_cast<std::size_t>(k)]})
               .transpose();
  if (num_points > 2) return on_points;
  // the unit row of two points contains the direction divided by sqrt(2), so the tension is lambda / sqrt(2)
  return Eigen::MatrixXd::Constant(1, static_cast<Eigen::Index>(columns.size()), std::sqrt(0.5));
}

}  // namespace

// dashpot: s = c_d u . (V_2' - V_1')   (THEORY 3.45); link with a relaxation time: s = D (e + tau e')
// (THEORY 3.46)
void set_link_forces(const Scene& scene, const LinkFactor& factor, Structure& structure) {
  assert(structure.shapes.rows() == 3 * static_cast<Eigen::Index>(scene.points.size()) &&
         structure.damping_rows.cols() == structure.shapes.cols());
  const Eigen::MatrixXd& b = structure.shapes;
  // constraints whose multipliers are the forces of published rigid links
  std::vector<int> columns;
  for (const int index : scene.publication.links)
    for (std::size_t row = 0; row < factor.constraint_link.size(); ++row)
      if (factor.constraint_link[row] == index) columns.push_back(static_cast<int>(row));
  Eigen::MatrixXd shapes(factor.rows.cols(), 0);
  if (!columns.empty()) shapes = constraint_shapes(scene, factor)(Eigen::all, columns);
  structure.constraint_shapes = shapes;

  Eigen::Index next_column = 0;
  for (const int index : scene.publication.links) {
    const Link& link = scene.links[static_cast<std::size_t>(index)];
    LinkForceRows force;
    force.link = index;
    const LinkEffect effect = traits_of(link).effect;
    if (effect == LinkEffect::kDamps) {
      force.rows = Eigen::MatrixXd::Zero(1, b.cols());
      force.rate_rows = force.rows;
      for (const auto& [freedom, coefficient] : axial_row(scene, link, 1.0).coefficients)
        force.rate_rows += axial_of(scene, link).damping * coefficient * b.row(freedom);
    } else if (effect == LinkEffect::kForbids) {
      std::vector<int> own;
      for (std::size_t row = 0; row < factor.constraint_link.size(); ++row)
        if (factor.constraint_link[row] == index) own.push_back(static_cast<int>(row));
      const Eigen::MatrixXd per_multiplier = rigid_forces(factor, link, own);
      const auto num_own = static_cast<Eigen::Index>(own.size());
      const Eigen::MatrixXd g = shapes.middleCols(next_column, num_own);
      force.load_rows = Eigen::MatrixXd::Zero(per_multiplier.rows(), shapes.cols());
      force.load_rows.middleCols(next_column, num_own) = per_multiplier;
      next_column += num_own;
      force.rows = -per_multiplier * ((factor.rows * g).transpose() * (factor.rows * b));
      if (factor.damping_rows.rows() > 0)
        force.rate_rows = -per_multiplier * ((factor.damping_rows * g).transpose() * structure.damping_rows);
    } else {
      force.rows =
          are_point_masses(scene) && !factor.is_sparse
              ? Eigen::MatrixXd(elastic_forces(scene, factor, index, natural_forces(factor, index)) * b)
              : elastic_forces(scene, factor, index, natural_forces(factor, structure, index));
      if (link.viscous > 0.0) force.rate_rows = link.viscous * force.rows;
    }
    // s = D (e + (beta_R + tau) e')   (THEORY 5.5), because stiffness-proportional Rayleigh damping acts as a
    // dashpot in parallel with every spring. The damping changes the forces of rigid links too
    if (scene.damping.beta > 0.0 && !force.rows.isZero(0.0)) {
      if (force.rate_rows.rows() == 0)
        force.rate_rows = Eigen::MatrixXd::Zero(force.rows.rows(), force.rows.cols());
      force.rate_rows += scene.damping.beta * force.rows;
    }
    structure.link_forces.push_back(std::move(force));
  }
}

}  // namespace freeflex
