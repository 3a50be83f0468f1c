#include "core/plan/rungs/kinetics.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/plan/arrays.hpp"
#include "core/structure/masses/matrix_mass.hpp"
#include "core/structure/masses/particles.hpp"

namespace freeflex {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Axes2 = std::array<int, 2>;
constexpr std::array<Axes2, 6> kProducts{{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};
constexpr std::array<Axes2, 3> kCross{{{1, 2}, {2, 0}, {0, 1}}};  // along x, a x b is a_1 b_2 - a_2 b_1

// Puts the particles of mass matrices into the rows from the given particle on.
void append_matrices(const std::vector<MatrixMass>& matrices, Eigen::Index next, LinearParticles& all) {
  for (const MatrixMass& matrix : matrices) {
    const auto& [mass, r, b] = matrix.beyond;
    all.mass.segment(next, mass.size()) = mass;
    all.r.middleCols(next, mass.size()) = r;
    all.b.middleRows(3 * next, b.rows()).leftCols(b.cols()) = b;
    next += mass.size();
  }
}

// Returns the particles of all but the rotations of bodies: point masses, centres of mass of bodies and parts
// of links   (THEORY 12.108), and what mass matrices add   (THEORY 12.121).
LinearParticles spread_mass(const Scene& scene, const Structure& structure, const PlanTurning& turning,
                            const std::vector<MatrixMass>& matrices) {
  const std::vector<CarriedMass> carried = carried_masses(scene, Freedoms(scene));
  std::vector<Eigen::Index> kept;
  for (std::size_t p = 0; p < carried.size(); ++p)
    if (carried[p].link >= 0 || turning.of_points[index(carried[p].point)] < 0)
      kept.push_back(static_cast<Eigen::Index>(p));
  const auto num_kept = static_cast<Eigen::Index>(kept.size()), n = structure.shapes.cols();
  const auto num_linear = num_kept + static_cast<Eigen::Index>(turning.bodies.size());
  Eigen::Index count = num_linear;
  for (const MatrixMass& matrix : matrices) count += matrix.beyond.mass.size();
  LinearParticles all{Eigen::VectorXd(count), Eigen::Matrix3Xd(3, count), Eigen::MatrixXd(3 * count, n)};
  for (Eigen::Index k = 0; k < num_kept; ++k) {
    const Eigen::Index p = kept[index(k)];
    all.mass[k] = structure.particles.mass[p];
    all.r.col(k) = structure.particles.r.col(p);
    all.b.middleRows<3>(3 * k) = structure.particles.shapes.middleRows<3>(3 * p);
  }
  for (Eigen::Index k = num_kept; k < num_linear; ++k) {
    const PlanTurningBody& body = turning.bodies[index(k - num_kept)];
    const auto stride = static_cast<Eigen::Index>(body.rows.size()) / 6;
    all.mass[k] = body.mass;
    all.r.col(k) = Eigen::Map<const Eigen::Vector3d>(body.centre.data());
    all.b.middleRows<3>(3 * k) = Eigen::Map<const RowMatrix>(body.rows.data(), 3, stride).leftCols(n);
  }
  append_matrices(matrices, num_linear, all);
  return all;
}

// Returns all particles. Their shapes are first those of the modes, then those of the constraints, which are
// zero if there are bodies.
LinearParticles all_mass(const Structure& structure, const std::vector<MatrixMass>& matrices,
                         const Eigen::MatrixXd& shapes) {
  const Particles& particles = structure.particles;
  if (particles.shapes.rows() == 0 && matrices.empty()) return {particles.mass, particles.r, shapes};
  const Eigen::Index first = particles.mass.size();
  Eigen::Index count = first;
  for (const MatrixMass& matrix : matrices) count += matrix.beyond.mass.size();
  LinearParticles all{Eigen::VectorXd(count), Eigen::Matrix3Xd(3, count),
                      Eigen::MatrixXd::Zero(3 * count, shapes.cols())};
  all.mass.head(first) = particles.mass;
  all.r.leftCols(first) = particles.r;
  all.b.topLeftCorner(3 * first, structure.omega.size()) = particles.shapes;
  append_matrices(matrices, first, all);
  return all;
}

// Returns the row for `axis` of each point.
Eigen::MatrixXd along(const Eigen::MatrixXd& shapes, int axis) {
  return shapes(Eigen::seq(axis, Eigen::last, 3), Eigen::all);
}

// Fills the tables over pairs of modes k, l (THEORY 12.48), including the second-order displacement g_kl of
// bodies (THEORY 12.47):
//   X_kl = sum m b_k x b_l, G_kl = sum m r x g_kl,
//   Z_kl,ab = sum m (b_k,a b_l,b + r_a g_kl,b), symmetric in a and b.
class Tables {
 public:
  Tables(const LinearParticles& all, const std::vector<MatrixMass>& matrices,
         const std::vector<RotatingBody>& bodies, StepPlan& plan)
      : plan_(plan), num_(plan.num_elastic), num_all_(all.b.cols()) {
    plan.coupled.kinetics.num_tables = bodies.empty() ? kPointTables : kBodyTables;
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = index(axis);
      b_[i] = along(all.b, axis);
      weighted_[i] = all.mass.asDiagonal() * b_[i].leftCols(num_);
    }
    set_moments(all, matrices);
    plan.coupled.kinetics.tables.assign(index(plan.num_moving) * stride(), 0.0);
    for (int k = 0; k < 3; ++k) put(k, outer(kCross[at(k)]) - outer(flipped(kCross[at(k)])));
    for (int k = 0; k < 6; ++k) {
      const Axes2 axes = kProducts[at(k)];
      put(3 + k, 0.5 * (outer(axes) + outer(flipped(axes)) + second_order_sum(bodies, axes) +
                        second_order_sum(bodies, flipped(axes))));
    }
    for (int k = 0; k < 3 && !bodies.empty(); ++k)
      put(9 + k, second_order_sum(bodies, kCross[at(k)]) - second_order_sum(bodies, flipped(kCross[at(k)])));
  }

 private:
  static std::size_t at(int k) { return index(k); }
  static Axes2 flipped(const Axes2& axes) { return {axes[1], axes[0]}; }
  std::size_t stride() const { return at(plan_.coupled.kinetics.num_tables) * index(plan_.num_padded); }

  // Y_l,ab = sum m r_a b_l,b, symmetric in a and b   (THEORY 8.15)
  void set_moments(const LinearParticles& all, const std::vector<MatrixMass>& matrices) {
    const Eigen::Matrix3Xd mr = all.r * all.mass.asDiagonal();
    for (std::size_t k = 0; k < kProducts.size(); ++k) {
      const auto& [a, b] = kProducts[k];
      Eigen::RowVectorXd row = 0.5 * (mr.row(a) * b_[at(b)] + mr.row(b) * b_[at(a)]);
      for (const MatrixMass& matrix : matrices)
        row.head(matrix.moments.cols()) += matrix.moments.row(static_cast<Eigen::Index>(k));
      append_row(plan_, row, plan_.coupled.kinetics.moments);
    }
  }

  // Returns the sum m b_k,a b_l,b.
  Eigen::MatrixXd outer(const Axes2& axes) const {
    return weighted_[at(axes[0])].transpose() * b_[at(axes[1])];
  }

  // Returns the sum m r_a g_kl,b, which is zero for constraint shapes.
  Eigen::MatrixXd second_order_sum(const std::vector<RotatingBody>& bodies, const Axes2& axes) const {
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(num_, num_all_);
    for (const RotatingBody& body : bodies) sum.leftCols(num_) += second_order(body, axes[0], axes[1]);
    return sum;
  }

  void put(int table, const Eigen::MatrixXd& values) {
    Array& tables = plan_.coupled.kinetics.tables;
    const std::size_t n = index(plan_.num_padded);
    for (Eigen::Index k = 0; k < num_; ++k) {
      const Array row = padded(plan_, values.row(k).transpose());
      std::copy(row.begin(), row.end(),
                tables.begin() + static_cast<std::ptrdiff_t>(index(k) * stride() + at(table) * n));
    }
  }

  StepPlan& plan_;
  Eigen::Index num_, num_all_;
  std::array<Eigen::MatrixXd, 3> b_, weighted_;  // (P x num_all), (P x num)
};

}  // namespace

namespace {

void compile_offsets(const Scene& scene, const Structure& structure, const std::vector<MatrixMass>& matrices,
                     StepPlan& plan) {
  const Freedoms freedoms(scene);
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const PointMass& point = scene.points[i];
    if (point.mass == 0.0 || point.offset.isZero(0.0)) continue;
    PlanOffset body{point.mass, to_array(point.offset), {}};
    const int first = freedoms.rotation(static_cast<int>(i)) - freedoms.num_displacements();
    for (int axis = 0; axis < 3; ++axis)
      append_row(plan, row_of(structure.rotations, first + axis), body.rows);
    plan.coupled.kinetics.offsets.push_back(std::move(body));
  }
  for (const MatrixMass& matrix : matrices) {
    const RotatingBody rest = rotating_body(scene, structure, matrix);
    if (rest.arm.isZero(0.0)) continue;
    PlanOffset body{matrix.mass, to_array(Eigen::Vector3d(rest.arm / matrix.mass)), {}};
    for (Eigen::Index axis = 0; axis < 3; ++axis) append_row(plan, row_of(rest.theta, axis), body.rows);
    plan.coupled.kinetics.offsets.push_back(std::move(body));
  }
}

}  // namespace

PlanKinetics::Form kinetic_form(const Structure& structure, const StepPlan& plan) {
  using Form = PlanKinetics::Form;
  if (traits_of(plan.fidelity).has_true_geometry && structure.resolved.have_links_mass())
    return Form::kSpread;
  if (!plan.coupled.turning.bodies.empty()) return Form::kTurning;
  // without bodies all points are point masses or have no mass   (THEORY 12.115)
  if (traits_of(plan.fidelity).has_true_geometry) return Form::kComplete;
  if (!structure.resolved.are_point_masses) return Form::kTables;
  const int num_points = static_cast<int>(plan.points.size());
  if (plan.num_elastic == 3 * num_points - plan.rigid_freedoms) return Form::kComplete;
  return kPointTables * plan.num_elastic < kTablesPerPoint * num_points ? Form::kTables : Form::kPoints;
}

void compile_kinetics(const Scene& scene, const Structure& structure, const Eigen::MatrixXd& shapes,
                      PlanKinetics::Form form, StepPlan& plan) {
  assert(is_coupled(plan));
  plan.coupled.kinetics.form = form;
  if (!has_tables(plan.coupled.kinetics)) return;
  // the constructor writes the tables into the plan
  if (form == PlanKinetics::Form::kSpread) {
    const std::vector<MatrixMass> matrices = matrix_masses(scene, structure, true);
    const Tables tables(spread_mass(scene, structure, plan.coupled.turning, matrices), matrices, {}, plan);
    return;
  }
  const std::vector<MatrixMass> matrices = matrix_masses(scene, structure, false);
  std::vector<RotatingBody> bodies = rotating_bodies(scene, structure);
  for (const MatrixMass& matrix : matrices)
    if (matrix.mass > 0.0) bodies.push_back(rotating_body(scene, structure, matrix));
  const Tables tables(all_mass(structure, matrices, shapes), matrices, bodies, plan);
  compile_offsets(scene, structure, matrices, plan);
}

bool keeps_rotation_about_line(const Structure& structure) {
  constexpr double kRounding = 1e-8;  // [-] over the size of the modes; shapes are exact to 1e-12 or better
  const MassProperties& body = structure.mass_properties;
  const Eigen::MatrixXd& b = particle_shapes(structure);
  if (body.rigid_freedoms != 5 || b.cols() == 0) return true;
  Eigen::MatrixXd second_order_sum(b.rows(), b.cols()), weighted = b;
  for (Eigen::Index i = 0; i < structure.particles.mass.size(); ++i) {
    for (Eigen::Index l = 0; l < b.cols(); ++l)
      second_order_sum.block<3, 1>(3 * i, l) = body.line.cross(Eigen::Vector3d(b.block<3, 1>(3 * i, l)));
    weighted.middleRows<3>(3 * i) *= structure.particles.mass[i] / body.mass;
  }
  const Eigen::MatrixXd left = second_order_sum - b * (weighted.transpose() * second_order_sum);
  return left.norm() <= kRounding * std::max(1.0, second_order_sum.norm());
}

}  // namespace freeflex
