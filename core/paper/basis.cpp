#include "core/paper/basis.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/scene/faults.hpp"
#include "core/structure/eckart_complement.hpp"
#include "core/structure/mass_properties.hpp"

namespace freeflex {
namespace {

// [-] shares this close count as equal, so that rounding does not choose among symmetric loads
constexpr double kEqualShares = 1e-6;

Eigen::VectorXd mass_of_freedoms(const std::vector<PointMass>& points) {
  Eigen::VectorXd mass(3 * static_cast<Eigen::Index>(points.size()));
  for (Eigen::Index i = 0; i < mass.size(); ++i) mass[i] = points[static_cast<std::size_t>(i / 3)].mass;
  return mass;
}

// Orthonormal vectors, made one after the other.
class GramSchmidt {
 public:
  GramSchmidt(Eigen::Index size, Eigen::Index capacity) : vectors_(size, capacity) {}
  Eigen::Index count() const { return count_; }
  Eigen::MatrixXd from(Eigen::Index first) const { return vectors_.middleCols(first, count_ - first); }

  struct Rest {
    Eigen::VectorXd coefficients;  // along the vectors so far
    Eigen::VectorXd y;             // what they do not explain
    double share = 0.0;            // [-] its norm over the norm before
  };

  // y less its part along the vectors, twice and again while a pass takes most of what is there: rounding
  // leaves some of that part beside a small rest
  Rest reduce(const Eigen::VectorXd& y) const {
    constexpr int kMaxPasses = 6;
    constexpr double kMost = 0.5;
    Rest rest{Eigen::VectorXd::Zero(count_), y};
    const double before = y.norm();
    double norm = before;
    for (int pass = 0; pass < kMaxPasses && norm > 0.0; ++pass) {
      const auto vectors = vectors_.leftCols(count_);
      const Eigen::VectorXd along = vectors.transpose() * rest.y;
      rest.y.noalias() -= vectors * along;
      rest.coefficients += along;
      const double last = std::exchange(norm, rest.y.norm());
      if (pass > 0 && norm > kMost * last) break;
    }
    rest.share = before > 0.0 ? norm / before : 0.0;
    return rest;
  }
  void add(const Eigen::VectorXd& rest) { vectors_.col(count_++) = rest.normalized(); }

 private:
  Eigen::MatrixXd vectors_;
  Eigen::Index count_ = 0;
};

// rigid motions in y = sqrt(m) V
GramSchmidt rigid_vectors(const Eigen::VectorXd& root_mass, const MassProperties& properties,
                          Eigen::Index capacity) {
  GramSchmidt vectors(root_mass.size(), capacity);
  const Eigen::MatrixXd rigid = root_mass.asDiagonal() * rigid_motions(properties);
  for (const auto& column : rigid.colwise()) vectors.add(vectors.reduce(column).y);
  return vectors;
}

// the same, then what rigid links forbid
GramSchmidt inelastic_vectors(const Eigen::VectorXd& root_mass, const MassProperties& properties,
                              const Eigen::MatrixXd& constraints) {
  GramSchmidt vectors = rigid_vectors(root_mass, properties, root_mass.size());
  for (const auto& row : constraints.rowwise())
    vectors.add(vectors.reduce(row.transpose().cwiseQuotient(root_mass)).y);
  return vectors;
}

// shapes by other means meet (2.6) to a rounding of the largest displacement; here to one of their own terms
void take_out_rigid_motion(const std::vector<PointMass>& points, const MassProperties& properties,
                           Eigen::MatrixXd& shapes) {
  const Eigen::VectorXd root_mass = mass_of_freedoms(points).cwiseSqrt();
  const GramSchmidt rigid = rigid_vectors(root_mass, properties, properties.rigid_freedoms);
  for (auto column : shapes.colwise())
    column = rigid.reduce(root_mass.cwiseProduct(column)).y.cwiseQuotient(root_mass);
}

// (2.6), (3.3) and the constraints, as they came out
void measure(const std::vector<PointMass>& points, const MassProperties& properties,
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
  // over the most that any displacement with sum m b.b = M can stretch the link
  const Eigen::VectorXd reach = std::sqrt(properties.mass) *
                                (constraints * mass.cwiseSqrt().cwiseInverse().asDiagonal()).rowwise().norm();
  if (constraints.rows() > 0)
    basis.constraint_residual = (reach.cwiseInverse().asDiagonal() * (constraints * b)).cwiseAbs().maxCoeff();
}

// by force groups; as numbered, then, where an explicit recipe falls short, in another order
Basis basis_of_groups(const Scene& scene, const Structure& structure, const LinkFactor& factor,
                      Recipe recipe) {
  const MassProperties& properties = structure.mass_properties;
  const auto num_expected = static_cast<std::size_t>(structure.omega.size());
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

// the shape that an explicit recipe needs; empty when it is there
std::string missing_shape(Recipe recipe, ShapeClass shape) {
  // pairs of points balance themselves whatever the shape; what acts along or across a line or plane needs it
  const bool fits = (recipe != Recipe::kCollinear && recipe != Recipe::kPlanar) ||
                    shape == ShapeClass::kPoint || recipe == recipe_of(shape);
  if (fits) return {};
  return join_text("the ", name_of(recipe), " recipe needs a ", name_of(recipe), " shape, this one is ",
                   name_of(shape), "; use the ", name_of(recipe_of(shape)), " or the formal recipe");
}

}  // namespace

Choice independent_groups(const Eigen::MatrixXd& constraints, const Eigen::MatrixXd& groups) {
  GramSchmidt forces(groups.rows(), groups.rows());
  for (const auto& row : constraints.rowwise()) forces.add(forces.reduce(row.transpose()).y);
  Choice choice;
  for (int l = 0; l < groups.cols(); ++l) {
    const GramSchmidt::Rest rest = forces.reduce(groups.col(l));
    if (rest.share > kDependent) {
      forces.add(rest.y);
      choice.kept.push_back(l);
      choice.least_kept = std::min(choice.least_kept, rest.share);
    } else {
      choice.skipped.push_back(l);
      choice.most_skipped = std::max(choice.most_skipped, rest.share);
    }
  }
  return choice;
}

Choice independent_loads(const std::vector<PointMass>& points, const MassProperties& properties,
                         const Eigen::MatrixXd& constraints) {
  // what of each unit load neither accelerates the body nor works on a rigid link, in y = sqrt(m) V
  const Eigen::VectorXd root_mass = mass_of_freedoms(points).cwiseSqrt();
  const Eigen::MatrixXd before = inelastic_vectors(root_mass, properties, constraints).from(0);
  Eigen::MatrixXd rest = Eigen::MatrixXd::Identity(root_mass.size(), root_mass.size());
  for (int pass = 0; pass < 2; ++pass) rest -= before * (before.transpose() * rest);

  Choice choice;
  Eigen::VectorXd share = rest.colwise().norm();
  while (true) {
    const double largest = share.maxCoeff();
    if (largest <= kDependent) break;
    // the first of equals, rounding apart
    int next = 0;
    while (share[next] < (1.0 - kEqualShares) * largest) ++next;
    choice.kept.push_back(next);
    choice.least_kept = std::min(choice.least_kept, share[next]);
    const Eigen::VectorXd vector = rest.col(next) / share[next];
    for (int pass = 0; pass < 2; ++pass) {
      const Eigen::RowVectorXd along = vector.transpose() * rest;
      rest.noalias() -= vector * along;
    }
    share = rest.colwise().norm();
    for (const int kept : choice.kept) share[kept] = 0.0;
  }
  for (int l = 0; l < share.size(); ++l)
    if (std::find(choice.kept.begin(), choice.kept.end(), l) == choice.kept.end())
      choice.skipped.push_back(l);
  choice.most_skipped = share.maxCoeff();
  return choice;
}

Basis orthonormalise(const std::vector<PointMass>& points, const MassProperties& properties,
                     const Eigen::MatrixXd& constraints, const Eigen::MatrixXd& groups,
                     const Choice& choice) {
  const Eigen::VectorXd root_mass = mass_of_freedoms(points).cwiseSqrt();
  const double root_total = std::sqrt(properties.mass);
  // what is no elastic motion goes first and is dropped in the end
  GramSchmidt vectors = inelastic_vectors(root_mass, properties, constraints);
  const Eigen::Index num_before = vectors.count();

  Basis basis;
  basis.choice = choice;
  const auto rank = static_cast<Eigen::Index>(choice.kept.size());
  basis.coefficients = Eigen::MatrixXd::Zero(rank, groups.cols());
  // beta = (M / m) f (3.2) in the vectors so far (3.4); these have unit length, b has sqrt(M)
  const auto expand = [&](int l) {
    GramSchmidt::Rest rest = vectors.reduce(properties.mass * groups.col(l).cwiseQuotient(root_mass));
    const Eigen::Index count = vectors.count() - num_before;
    basis.coefficients.col(l).head(count) = rest.coefficients.tail(count) / root_total;
    return rest;
  };
  for (Eigen::Index next = 0; next < rank; ++next) {
    const int l = choice.kept[static_cast<std::size_t>(next)];
    const GramSchmidt::Rest rest = expand(l);
    basis.coefficients(next, l) = rest.y.norm() / root_total;
    vectors.add(rest.y);
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
    if (basis.numbering.empty()) take_out_rigid_motion(scene.points, structure.mass_properties, basis.shapes);
    measure(scene.points, structure.mass_properties, factor.constraints, basis);
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

Eigen::MatrixXd change_of_basis(const std::vector<PointMass>& points, const Basis& from, const Basis& to) {
  const Eigen::VectorXd mass = mass_of_freedoms(points);
  return to.shapes.transpose() * mass.asDiagonal() * from.shapes / (mass.sum() / 3.0);
}

}  // namespace freeflex
