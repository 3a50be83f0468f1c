#include "core/paper/basis.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/faults.hpp"
#include "core/structure/masses/mass_properties.hpp"
#include "core/structure/modes/dense/eckart_complement.hpp"

namespace freeflex {
namespace {

// [-] two remainders are treated as equal if their relative difference is at most this value, so that
// rounding errors do not choose among loads that are equal by symmetry
constexpr double kTie = 1e-6;

Eigen::VectorXd mass_of_freedoms(const std::vector<PointMass>& points) {
  Eigen::VectorXd mass(3 * static_cast<Eigen::Index>(points.size()));
  for (Eigen::Index i = 0; i < mass.size(); ++i) mass[i] = points[index(i / 3)].mass;
  return mass;
}

// Holds orthonormal vectors, each of which is made from a given vector by subtracting the components along
// the earlier ones   (THEORY 11.12).
class GramSchmidt {
 public:
  GramSchmidt(Eigen::Index size, Eigen::Index capacity) : vectors_(size, capacity) {}
  Eigen::Index count() const { return count_; }
  Eigen::MatrixXd from(Eigen::Index first) const { return vectors_.middleCols(first, count_ - first); }

  struct Remainder {
    Eigen::VectorXd coefficients;  // components along the vectors held
    Eigen::VectorXd y;             // the part that is orthogonal to the vectors held
    double fraction = 0.0;         // [-] norm of y over the norm of the given vector
  };

  // Returns y - sum_k v_k (v_k.y), in at least two passes. A pass that removes more than half of the norm is
  // followed by another pass, up to six passes in all, because rounding errors along the vectors v_k are then
  // not small compared with the remainder.
  Remainder reduce(const Eigen::VectorXd& y) const {
    constexpr int kMaxPasses = 6;
    constexpr double kMost = 0.5;
    Remainder remainder{Eigen::VectorXd::Zero(count_), y};
    const double before = y.norm();
    double norm = before;
    for (int pass = 0; pass < kMaxPasses && norm > 0.0; ++pass) {
      const auto vectors = vectors_.leftCols(count_);
      const Eigen::VectorXd along = vectors.transpose() * remainder.y;
      remainder.y.noalias() -= vectors * along;
      remainder.coefficients += along;
      const double last = std::exchange(norm, remainder.y.norm());
      if (pass > 0 && norm > kMost * last) break;
    }
    remainder.fraction = before > 0.0 ? norm / before : 0.0;
    return remainder;
  }
  void add(const Eigen::VectorXd& remainder) { vectors_.col(count_++) = remainder.normalized(); }

 private:
  Eigen::MatrixXd vectors_;
  Eigen::Index count_ = 0;
};

// returns the rigid motions in y = sqrt(m) V, orthonormal
GramSchmidt rigid_vectors(const Eigen::VectorXd& root_mass, const MassProperties& properties,
                          Eigen::Index capacity) {
  GramSchmidt vectors(root_mass.size(), capacity);
  const Eigen::MatrixXd rigid = root_mass.asDiagonal() * rigid_motions(properties);
  for (const auto& column : rigid.colwise()) vectors.add(vectors.reduce(column).y);
  return vectors;
}

// returns the rigid motions, followed by the displacements that rigid links forbid, m^-1/2 C^T, all as
// orthonormal vectors
GramSchmidt inelastic_vectors(const Eigen::VectorXd& root_mass, const MassProperties& properties,
                              const Eigen::MatrixXd& constraints) {
  GramSchmidt vectors = rigid_vectors(root_mass, properties, root_mass.size());
  for (const auto& row : constraints.rowwise())
    vectors.add(vectors.reduce(row.transpose().cwiseQuotient(root_mass)).y);
  return vectors;
}

// Removes the rigid motion that rounding errors leave in the shapes. Only the shapes of recipes without force
// groups need this. Before the removal, these shapes meet the conditions (THEORY 2.15) within a rounding
// error of the largest displacement; after it, they meet each condition within a rounding error of its own
// terms.
void remove_rigid_motion(const std::vector<PointMass>& points, const MassProperties& properties,
                         Eigen::MatrixXd& shapes) {
  const Eigen::VectorXd root_mass = mass_of_freedoms(points).cwiseSqrt();
  const GramSchmidt rigid = rigid_vectors(root_mass, properties, properties.rigid_freedoms);
  for (auto column : shapes.colwise())
    column = rigid.reduce(root_mass.cwiseProduct(column)).y.cwiseQuotient(root_mass);
}

// measures how well the basis meets the conditions (THEORY 2.15, 4.3) and the constraints
// (THEORY 11.28, 11.29)
void measure_residuals(const std::vector<PointMass>& points, const MassProperties& properties,
                       const Eigen::MatrixXd& constraints, Basis& basis) {
  const Eigen::VectorXd mass = mass_of_freedoms(points);
  const Eigen::MatrixXd& b = basis.shapes;
  const Eigen::MatrixXd y = mass.cwiseSqrt().asDiagonal() * b;
  if (b.cols() == 0) return;
  basis.gram_error = (y.transpose() * y / properties.mass - Eigen::MatrixXd::Identity(b.cols(), b.cols()))
                         .cwiseAbs()
                         .maxCoeff();
  for (Eigen::Index l = 0; l < b.cols(); ++l) {
    Eigen::Vector3d force = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();
    double force_size = 0.0, moment_size = 0.0;
    for (Eigen::Index i = 0; i < properties.r.cols(); ++i) {
      const Eigen::Vector3d momentum = mass[3 * i] * b.block<3, 1>(3 * i, l);
      force += momentum;
      moment += properties.r.col(i).cross(momentum);
      force_size += momentum.norm();
      moment_size += properties.r.col(i).norm() * momentum.norm();
    }
    basis.force_residual = std::max(basis.force_residual, force.norm() / force_size);
    if (moment_size > 0.0)
      basis.moment_residual = std::max(basis.moment_residual, moment.norm() / moment_size);
  }
  // for each constraint, the largest |C b| over all displacements b with sum m b.b = M, which is
  // sqrt(M) |C m^-1/2|
  const Eigen::VectorXd largest_stretch =
      std::sqrt(properties.mass) *
      (constraints * mass.cwiseSqrt().cwiseInverse().asDiagonal()).rowwise().norm();
  if (constraints.rows() > 0)
    basis.constraint_residual =
        (largest_stretch.cwiseInverse().asDiagonal() * (constraints * b)).cwiseAbs().maxCoeff();
}

// Makes a basis of force groups with the numbering of the scene. If an explicit recipe is incomplete with
// this numbering, tries another numbering and keeps the better one
Basis basis_of_groups(const Scene& scene, const Structure& structure, const LinkFactor& factor,
                      Recipe recipe) {
  const MassProperties& properties = structure.mass_properties;
  const auto num_expected = index(structure.omega.size());
  std::vector<int> numbering(scene.points.size());
  std::iota(numbering.begin(), numbering.end(), 0);
  Eigen::MatrixXd groups = force_groups(recipe, scene.points, properties, numbering);
  Choice choice = recipe == Recipe::kFormal ? independent_loads(scene.points, properties, factor.constraints)
                                            : independent_groups(factor.constraints, groups);
  const auto rank_as_numbered = static_cast<int>(choice.kept.size());
  if (recipe != Recipe::kFormal && choice.kept.size() < num_expected) {
    const std::vector<int> other = find_numbering(recipe, properties);
    const Eigen::MatrixXd other_groups = force_groups(recipe, scene.points, properties, other);
    const Choice other_choice = independent_groups(factor.constraints, other_groups);
    if (other_choice.kept.size() > choice.kept.size()) {
      numbering = other;
      groups = other_groups;
      choice = other_choice;
    }
  }
  Basis basis = orthonormalise(scene.points, properties, factor.constraints, groups, choice);
  if (choice.kept.size() < num_expected) basis.flat_window = flattest_window(recipe, properties, numbering);
  basis.numbering = numbering;
  basis.rank_as_numbered = rank_as_numbered;
  return basis;
}

// Returns an empty string if the recipe applies to the shape, otherwise a message that names the shape that
// the recipe needs
std::string missing_shape(Recipe recipe, ShapeClass shape) {
  // The spatial recipe uses only forces on pairs of points, which are in equilibrium for any shape. The
  // collinear and the planar recipe also use forces normal to a line or plane, so all points must lie on that
  // line or plane
  const bool fits = (recipe != Recipe::kCollinear && recipe != Recipe::kPlanar) ||
                    shape == ShapeClass::kPoint || recipe == recipe_of(shape);
  if (fits) return {};
  return join_text("the ", name_of(recipe), " recipe needs a ", name_of(recipe), " shape, but this shape is ",
                   name_of(shape), "; use the ", name_of(recipe_of(shape)), " or the formal recipe");
}

}  // namespace

Choice independent_groups(const Eigen::MatrixXd& constraints, const Eigen::MatrixXd& groups) {
  GramSchmidt forces(groups.rows(), groups.rows());
  for (const auto& row : constraints.rowwise()) forces.add(forces.reduce(row.transpose()).y);
  Choice choice;
  for (int l = 0; l < groups.cols(); ++l) {
    const GramSchmidt::Remainder remainder = forces.reduce(groups.col(l));
    if (remainder.fraction > kDependent) {
      forces.add(remainder.y);
      choice.kept.push_back(l);
      choice.least_kept = std::min(choice.least_kept, remainder.fraction);
    } else {
      choice.skipped.push_back(l);
      choice.most_skipped = std::max(choice.most_skipped, remainder.fraction);
    }
  }
  return choice;
}

Choice independent_loads(const std::vector<PointMass>& points, const MassProperties& properties,
                         const Eigen::MatrixXd& constraints) {
  // the part of each unit load that neither accelerates the body nor does work on displacements that rigid
  // links forbid, in the coordinates y = sqrt(m) V
  const Eigen::VectorXd root_mass = mass_of_freedoms(points).cwiseSqrt();
  const Eigen::MatrixXd before = inelastic_vectors(root_mass, properties, constraints).from(0);
  Eigen::MatrixXd remainder = Eigen::MatrixXd::Identity(root_mass.size(), root_mass.size());
  for (int pass = 0; pass < 2; ++pass) remainder -= before * (before.transpose() * remainder);

  Choice choice;
  Eigen::VectorXd fraction = remainder.colwise().norm();
  while (true) {
    const double largest = fraction.maxCoeff();
    if (largest <= kDependent) break;
    // take the first of the loads whose remainders equal the largest one except for rounding errors
    int next = 0;
    while (fraction[next] < (1.0 - kTie) * largest) ++next;
    choice.kept.push_back(next);
    choice.least_kept = std::min(choice.least_kept, fraction[next]);
    const Eigen::VectorXd vector = remainder.col(next) / fraction[next];
    for (int pass = 0; pass < 2; ++pass) {
      const Eigen::RowVectorXd along = vector.transpose() * remainder;
      remainder.noalias() -= vector * along;
    }
    fraction = remainder.colwise().norm();
    for (const int kept : choice.kept) fraction[kept] = 0.0;
  }
  for (int l = 0; l < fraction.size(); ++l)
    if (std::find(choice.kept.begin(), choice.kept.end(), l) == choice.kept.end())
      choice.skipped.push_back(l);
  choice.most_skipped = fraction.maxCoeff();
  return choice;
}

Basis orthonormalise(const std::vector<PointMass>& points, const MassProperties& properties,
                     const Eigen::MatrixXd& constraints, const Eigen::MatrixXd& groups,
                     const Choice& choice) {
  const Eigen::VectorXd root_mass = mass_of_freedoms(points).cwiseSqrt();
  const double root_total = std::sqrt(properties.mass);
  // the rigid motions and the forbidden displacements come first, and are not part of the basis
  GramSchmidt vectors = inelastic_vectors(root_mass, properties, constraints);
  const Eigen::Index num_before = vectors.count();

  Basis basis;
  basis.choice = choice;
  const auto rank = static_cast<Eigen::Index>(choice.kept.size());
  basis.coefficients = Eigen::MatrixXd::Zero(rank, groups.cols());
  // Expands beta = (M / m) f in the vectors made before (THEORY 4.2, 11.11). The division by sqrt(M) is
  // needed because these vectors have length one, but b has length sqrt(M)
  const auto expand = [&](int l) {
    GramSchmidt::Remainder remainder =
        vectors.reduce(properties.mass * groups.col(l).cwiseQuotient(root_mass));
    const Eigen::Index count = vectors.count() - num_before;
    basis.coefficients.col(l).head(count) = remainder.coefficients.tail(count) / root_total;
    return remainder;
  };
  for (Eigen::Index next = 0; next < rank; ++next) {
    const int l = choice.kept[index(next)];
    const GramSchmidt::Remainder remainder = expand(l);
    basis.coefficients(next, l) = remainder.y.norm() / root_total;
    vectors.add(remainder.y);
  }
  for (const int l : choice.skipped) expand(l);
  basis.shapes = root_total * (root_mass.cwiseInverse().asDiagonal() * vectors.from(num_before));
  return basis;
}

Basis find_basis(const Scene& scene, const Structure& structure, const LinkFactor& factor, Recipe recipe,
                 std::string& why_not) {
  why_not = missing_shape(recipe, shape_class(scene.points, structure.mass_properties));
  Basis basis;
  if (why_not.empty()) {
    if (recipe == Recipe::kModes) {
      basis.shapes = structure.shapes;
    } else if (recipe == Recipe::kHouseholder) {
      const EckartComplement complement(RootMass(scene.points), structure.mass_properties.mass,
                                        rigid_motions(structure.mass_properties), factor.constraints,
                                        Eigen::MatrixXd(structure.shapes.rows(), 0));
      basis.shapes =
          complement.shapes(Eigen::MatrixXd::Identity(complement.dimension(), complement.dimension()));
    } else {
      basis = basis_of_groups(scene, structure, factor, recipe);
    }
    if (basis.numbering.empty()) remove_rigid_motion(scene.points, structure.mass_properties, basis.shapes);
    measure_residuals(scene.points, structure.mass_properties, factor.constraints, basis);
  }
  basis.recipe = recipe;
  basis.num_expected = static_cast<int>(structure.omega.size());
  return basis;
}

Basis find_basis(const Scene& scene, const Structure& structure, const LinkFactor& factor) {
  std::string why_not;
  const Recipe own = recipe_of(shape_class(scene.points, structure.mass_properties));
  Basis basis = find_basis(scene, structure, factor, own, why_not);
  if (basis.is_complete()) return basis;
  return find_basis(scene, structure, factor, Recipe::kFormal, why_not);
}

// a = b*^T m b / M   (THEORY 11.14)
Eigen::MatrixXd change_of_basis(const std::vector<PointMass>& points, const Basis& from, const Basis& to) {
  const Eigen::VectorXd mass = mass_of_freedoms(points);
  return to.shapes.transpose() * mass.asDiagonal() * from.shapes / (mass.sum() / 3.0);
}

}  // namespace freeflex
