#include "core/plan/unmodelled.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "core/error/command_loads.hpp"
#include "core/plan/loads/histories.hpp"
#include "core/structure/links/link_factor.hpp"
#include "core/structure/masses/particles.hpp"

namespace freeflex {
namespace {

constexpr double kLeastSeparation = 0.05;  // [-] smallest |omega_u^2 - omega_l^2| / omega_l^2 in a divisor

using Products = Eigen::Matrix<double, 1, 6>;

// Returns the coefficients of the products of the components of w in S . X, with S = (w.w) 1 - w w^T.
Products of_spin(const Eigen::Matrix3d& X) {
  Products row;
  for (Eigen::Index k = 0; k < 6; ++k) {
    const auto [a, b] = kAxisPairs[index(k)];
    row[k] = a == b ? X.trace() - X(a, a) : -(X(a, b) + X(b, a));
  }
  return row;
}

// Returns s_lu = sum m b_l x b_u / M, with one column for each mode u.
Eigen::Matrix3Xd crosses_of(const Structure& structure, int l) {
  const Eigen::MatrixXd& shapes = particle_shapes(structure);
  const Eigen::Index size = shapes.rows();
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(3, size);
  for (Eigen::Index i = 0; i < size; i += 3) {
    const Eigen::Vector3d b =
        structure.particles.mass[i / 3] / structure.mass_properties.mass * shapes.block<3, 1>(i, l);
    rows(0, i + 1) = -b[2], rows(0, i + 2) = b[1];
    rows(1, i + 2) = -b[0], rows(1, i) = b[2];
    rows(2, i) = -b[1], rows(2, i + 1) = b[0];
  }
  return rows * shapes;
}

// Returns the index of a pair of modes in Prestress::pairs.
Eigen::Index row_of(const Prestress& prestress, int l, int u) {
  const Prestress::Pair pair{std::min(l, u), std::max(l, u)};
  return std::find(prestress.pairs.begin(), prestress.pairs.end(), pair) - prestress.pairs.begin();
}

// Returns the number of lowest modes that have a geometric stiffness by loads.
int num_stiffened(const Structure& whole) {
  return whole.load_stiffness.empty() ? 0 : static_cast<int>(whole.load_stiffness.front().modes.size());
}

// Computes the stiffness of each pair of modes due to the spin, per product of the components of w. It is the
// geometric stiffness due to the quasi-static response to the centrifugal load. Below the coupled rungs,
// w^T (sum m (b.b 1 - b b^T)) w is subtracted (THEORY X141).
class SpinRows {
 public:
  SpinRows(const Scene& scene, const Structure& whole, const RungTraits& rung, const Eigen::MatrixXd& rows)
      : whole_(whole), rung_(rung), bodies_(rotating_bodies(scene, whole)) {
    // rungs with the spin load already have this stiffness, because it follows from their loads
    prestress_ = Eigen::MatrixXd::Zero(rows.rows(), 6);
    if (rung_.takes_spin_load) return;
    const Prestress& prestress = whole.prestress;
    for (Eigen::Index v = 0; v < whole.omega.size(); ++v)
      if (const double c = whole.mass_properties.mass * whole.omega[v] * whole.omega[v]; c > 0.0) {
        Eigen::VectorXd column = rows.col(v);
        // for the integrated modes, the third derivatives include this stiffness   (THEORY X147)
        for (std::size_t k = 0; k < prestress.pairs.size() && v < prestress.num_shadowed; ++k)
          if (prestress.pairs[k][0] < prestress.num_shadowed &&
              prestress.pairs[k][1] < prestress.num_shadowed)
            column[static_cast<Eigen::Index>(k)] = 0.0;
        prestress_ += column * of_spin(field_moments(whole, v) / c);
      }
  }

  Products row(Eigen::Index pair, int l, int u) const {
    Products row = prestress_.row(pair);
    if (!rung_.couples)
      row -= whole_.mass_properties.mass * of_spin(displacement_moments(whole_, bodies_, l, u));
    return row;
  }

 private:
  const Structure& whole_;
  const RungTraits& rung_;
  std::vector<RotatingBody> bodies_;
  Eigen::MatrixXd prestress_;  // (pairs x 6)
};

// The stiffness of pairs of modes that the plan has from fields and loads (THEORY 8.49), as far as load_rows
// and the spin make it appear in the estimate: the part by the modes of the plan, less a part of the true
// one (THEORY X145).
class StiffenedRows {
 public:
  StiffenedRows(const Scene& scene, const Structure& whole, const PlanSpec& spec, const Plan& plan,
                const Eigen::MatrixXd& rows) {
    const Freedoms freedoms(scene);
    for (const int mode : spec.modes) {
      const double stiffness = whole.mass_properties.mass * whole.omega[mode] * whole.omega[mode];
      flexibility_.push_back(stiffness > 0.0 ? 1.0 / stiffness : 0.0);
    }
    for (const LoadStiffness& each : whole.load_stiffness) {
      const bool is_field = each.reference.is_field();
      const PlanStiffening& stiffening = is_field ? plan.field_stiffening
                                         : each.reference.is_command()
                                             ? plan.command_stiffening
                                             : plan.histories[index(each.reference.item)].stiffening;
      if (stiffening.modes.empty()) continue;
      Eigen::VectorXd Q(static_cast<Eigen::Index>(spec.modes.size()));
      if (is_field) {
        const auto [a, b] = kAxisPairs[index(each.reference.component)];
        for (Eigen::Index l = 0; l < Q.size(); ++l)
          Q[l] = (a == b ? 1.0 : 2.0) * field_moments(whole, spec.modes[index(l)])(a, b);
      } else {
        const Eigen::VectorXd f = forces_of(scene, freedoms, whole.mass_properties.r, each.reference);
        Q = whole.shapes(Eigen::all, spec.modes).transpose() * f.head(whole.shapes.rows());
        if (whole.rotations.rows() > 0)
          Q += whole.rotations(Eigen::all, spec.modes).transpose() * f.tail(whole.rotations.rows());
      }
      const double soft = softest_of_load(whole.omega);
      for (Eigen::Index l = 0; l < Q.size(); ++l)
        Q[l] = whole.omega[spec.modes[index(l)]] > soft ? Q[l] * flexibility_[index(l)] : 0.0;
      Eigen::VectorXd row = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(whole.prestress.pairs.size()));
      for (std::size_t k = 0; k < whole.prestress.pairs.size(); ++k) {
        const auto [l, u] = whole.prestress.pairs[k];
        const auto pair = static_cast<Eigen::Index>(k);
        if (std::max(l, u) >= num_stiffened(whole)) continue;
        row[pair] =
            rows(pair, spec.modes).dot(Q) - left_out(std::max(l, u), num_stiffened(whole)) * each.rows(l, u);
        if (std::max(l, u) >= whole.prestress.num_shadowed) continue;
        // the third derivatives of the integrated modes contain the displaced geometry too   (THEORY X147)
        for (std::size_t v = 0; v < spec.modes.size() && spec.modes[v] < whole.prestress.num_shadowed; ++v)
          row[pair] += (rows(row_of(whole.prestress, l, spec.modes[v]), u) +
                        rows(row_of(whole.prestress, u, spec.modes[v]), l)) *
                       Q[static_cast<Eigen::Index>(v)];
      }
      (is_field ? fields_ : loads_).push_back(row);
    }
    plan_pairs(whole, spec);
  }

  // per product of the components of w
  Products by_spin(Eigen::Index pair) const {
    if (fields_.empty()) return Products::Zero();
    Eigen::Matrix3d X;
    for (std::size_t k = 0; k < 6; ++k) {
      const auto [a, b] = kAxisPairs[k];
      X(a, b) = X(b, a) = (a == b ? 1.0 : 0.5) * fields_[k][pair];
    }
    return of_spin(X);
  }

  void append_loads(PlanUnmodelled& unmodelled) const {
    for (const Eigen::VectorXd& row : loads_)
      for (const Eigen::Index pair : pairs_) unmodelled.stiffened_rows.push_back(row[pair]);
  }

 private:
  // Returns the part of the stiffness of the plan that counts as neglected [-]: the higher modes lack the
  // stiffness that they have with modes beyond the stiffened ones.
  static double left_out(int mode, int num_modes) {
    const double height = static_cast<double>(mode) / num_modes;
    return 0.1 + 0.9 * height * height;
  }
  void plan_pairs(const Structure& whole, const PlanSpec& spec) {
    const auto has = [&](int mode) { return std::ranges::binary_search(spec.modes, mode); };
    for (std::size_t k = 0; k < whole.prestress.pairs.size(); ++k)
      if (has(whole.prestress.pairs[k][0]) && has(whole.prestress.pairs[k][1]))
        pairs_.push_back(static_cast<Eigen::Index>(k));
  }
  std::vector<double> flexibility_;              // [m/N] of the modes of the plan
  std::vector<Eigen::VectorXd> fields_, loads_;  // [N/m] (pairs)
  std::vector<Eigen::Index> pairs_;              // pairs of the plan
};

// Holds the effect of Coriolis forces on mode l through the modes that are not partners of l, per product of
// the components of w (THEORY X141).
struct FarCoriolis {
  Products shift = Products::Zero();     // [-] -4 (w . s_lu)^2 omega_l^2 / (omega_u^2 - omega_l^2) over w^2
  Products transfer = Products::Zero();  // [s^2] (2 omega_l w . s_lu / (omega_u^2 - omega_l^2))^2 over w^2
};
FarCoriolis far_coriolis(const Structure& whole, const Prestress& prestress, int l,
                         const Eigen::Matrix3Xd& crosses) {
  FarCoriolis far;
  const double square = whole.omega[l] * whole.omega[l];
  for (int u = 0; u < static_cast<int>(whole.omega.size()) && square > 0.0; ++u) {
    const Prestress::Pair pair{std::min(l, u), std::max(l, u)};
    if (std::find(prestress.pairs.begin(), prestress.pairs.end(), pair) != prestress.pairs.end()) continue;
    double separation = whole.omega[u] * whole.omega[u] - square;
    if (std::abs(separation) < kLeastSeparation * square)
      separation = std::copysign(kLeastSeparation * square, separation);
    const Eigen::Vector3d s = crosses.col(u);
    for (Eigen::Index k = 0; k < 6; ++k) {
      const auto [a, b] = kAxisPairs[index(k)];
      const double product = (a == b ? 4.0 : 8.0) * square * s[a] * s[b];
      far.shift[k] -= product / separation;
      far.transfer[k] += product / (separation * separation);
    }
  }
  return far;
}

// Returns the stiffness of a pair of modes per acceleration a_B of the frame and per angular acceleration w':
// a_B . sum m g_lu + w' . G_lu   (THEORY 12.56)
Products push_row(const std::vector<RotatingBody>& bodies, int l, int u) {
  Products row = Products::Zero();
  for (const RotatingBody& body : bodies) {
    row.head<3>() += moved_centre(body, l, u);
    const Eigen::Matrix3d G = second_order_of_pair(body, l, u);
    row.tail<3>() += Eigen::RowVector3d(G(1, 2) - G(2, 1), G(2, 0) - G(0, 2), G(0, 1) - G(1, 0));
  }
  return row;
}

// Returns a bound of the displacement due to the spin, over w^2 [m s^2], for masses on the inner coordinates
// of matrix links, which belong to no point. By Cauchy's inequality this bound is the root of the sum over
// modes of (M - sum m b.b) S / (M omega_l^2)^2. The inner sum is over particles, and S is the second moment
// of mass of the rigid body about its first point   (THEORY X143).
double inner_load(const Structure& whole, const std::vector<int>& modes) {
  double moment = 0.0;
  for (const ResolvedLink& link : whole.resolved.links) moment += link.inner_moment;
  if (moment == 0.0) return 0.0;
  const double mass = whole.mass_properties.mass;
  const Eigen::MatrixXd& shapes = particle_shapes(whole);
  double sum = 0.0;
  for (const int mode : modes) {
    const double square = whole.omega[mode] * whole.omega[mode];
    if (square == 0.0) continue;
    double inside = mass;
    for (Eigen::Index i = 0; i < whole.particles.mass.size(); ++i)
      inside -= whole.particles.mass[i] * shapes.block<3, 1>(3 * i, mode).squaredNorm();
    sum += std::max(0.0, inside) * moment / (mass * mass * square * square);
  }
  return std::sqrt(sum);
}

// Returns the factor max(1, max |b_l|^2 / 4) on the unquantified stiffness of a mode. The inner maximum is
// over the points of matrix links and rigid links, because the internal forces of these links are unknown.
// Here |b_l| of a point is its displacement over the mass-weighted rms. |b_l| is 2 at the ends of a free
// beam, and far more at a light point between heavy ends (THEORY X143).
double unquantified_factor(const Scene& scene, const Structure& whole, int mode) {
  constexpr double kSquareOfBeamEnd = 4.0;
  double most = 0.0;
  for (std::size_t k = 0; k < scene.links.size(); ++k)
    if (const ResolvedLink& link = whole.resolved.links[k]; link.is_rigid() || !link.traits.follows_points)
      for (const int point : scene.links[k].points)
        most = std::max(most, whole.shapes.block<3, 1>(3 * Eigen::Index{point}, mode).squaredNorm());
  return std::max(1.0, most / kSquareOfBeamEnd);
}

// Returns the link with unknown internal forces whose points move most in a mode. Returns -1 if there is no
// such link.
std::int32_t unquantified_link(const Scene& scene, const Structure& whole, int mode) {
  double most = 0.0;
  std::int32_t found = -1;
  for (std::size_t k = 0; k < scene.links.size(); ++k) {
    if (!whole.resolved.links[k].is_unquantified()) continue;
    if (found < 0) found = static_cast<std::int32_t>(k);
    for (const int point : scene.links[k].points) {
      const double square = whole.shapes.block<3, 1>(3 * Eigen::Index{point}, mode).squaredNorm();
      if (square > most) most = square, found = static_cast<std::int32_t>(k);
    }
  }
  return found;
}

template <typename Row>
void append(const Row& row, Array& rows) {
  rows.insert(rows.end(), row.begin(), row.end());
}

// Fills the third derivatives of the strain energy with respect to the lowest modes of the plan,
// Gamma_abc = C_ab,c + C_bc,a + C_ac,b   (THEORY X147), and the forms H_r of the fourth order
// (THEORY X146).
void fill_high_orders(const Prestress& prestress, const Eigen::MatrixXd& rows, const Eigen::MatrixXd& quartic,
                      const std::vector<int>& modes, PlanUnmodelled& unmodelled) {
  const auto n = index(std::lower_bound(modes.begin(), modes.end(), prestress.num_shadowed) - modes.begin());
  unmodelled.num_shadowed = static_cast<std::int32_t>(n);
  for (Eigen::Index form = 0; form < quartic.rows(); form += quartic.cols())
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t b = 0; b < n; ++b)
        unmodelled.quartic_forms.push_back(quartic(form + modes[a], modes[b]));
  Eigen::MatrixXi row(n, n);
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = 0; b < n; ++b)
      row(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) =
          static_cast<int>(row_of(prestress, modes[a], modes[b]));
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = a; b < n; ++b)
      for (std::size_t c = 0; c < n; ++c) {
        const auto i = static_cast<Eigen::Index>(a), j = static_cast<Eigen::Index>(b),
                   k = static_cast<Eigen::Index>(c);
        const double third =
            rows(row(i, j), modes[c]) + rows(row(j, k), modes[a]) + rows(row(i, k), modes[b]);
        unmodelled.shadow_rows.push_back(a == b ? 0.5 * third : third);
      }
}

LacksModes lacks_modes(const Scene& scene, const Structure& whole, const PlanSpec& spec) {
  if (whole.kept.is_subset) return LacksModes::kNotKept;
  const bool is_reduced = spec.modes.size() < index(whole.omega.size());
  return is_reduced && scene.leave_out.tolerance > 0.0 ? LacksModes::kSmallModes : LacksModes::kNone;
}

// Fills the arms of the built-in loads and, if the forces inside some links are unknown, the sizes of these
// loads.
void fill_loads(const Scene& scene, bool has_unquantified, Plan& plan) {
  PlanUnmodelled& unmodelled = plan.unmodelled;
  for (std::size_t k = 0; k < scene.loads.size(); ++k) {
    Array arms;
    const SumsOnPoints sums = sums_of(scene.loads[k], plan);
    set_arms(plan, num_armed(unmodelled), sums, arms);
    unmodelled.load_arms.insert(unmodelled.load_arms.end(), arms.begin(), arms.end());
    if (has_unquantified) unmodelled.bodies.load_sizes.push_back(size_of_forces(sums));
  }
}

// Fills the centrifugal load on the modes of the plan, and the response of the omitted modes to this load.
// \param index_in_plan  (modes of the structure) index of each mode in the plan; -1: omitted
void fill_spin_loads(const Structure& whole, const std::vector<int>& index_in_plan,
                     PlanUnmodelled& unmodelled) {
  Eigen::Matrix<double, 6, 6> left_out = Eigen::Matrix<double, 6, 6>::Zero();
  for (int mode = 0; mode < static_cast<int>(whole.omega.size()); ++mode) {
    const Products load = of_spin(field_moments(whole, mode));
    const double stiffness = whole.mass_properties.mass * whole.omega[mode] * whole.omega[mode];
    if (index_in_plan[index(mode)] >= 0)
      append(load, unmodelled.spin_loads);
    else if (stiffness > 0.0)
      left_out += load.transpose() * load / (stiffness * stiffness);
  }
  for (Eigen::Index row = 0; row < 6; ++row) append(left_out.row(row), unmodelled.spin_left_out);
}

// Appends a mode that the plan leaves out, with the loads and spins that displace it.
void append_left_out(const Structure& whole, int mode, const Eigen::RowVectorXd& loads,
                     const Products& products, PlanUnmodelled& unmodelled) {
  const double c = whole.mass_properties.mass * whole.omega[mode] * whole.omega[mode];
  append(Eigen::RowVectorXd(loads / c), unmodelled.left_out_rows);
  append(Products(products / c), unmodelled.left_out_spin);
  unmodelled.named.left_out.push_back(mode + 1);
  unmodelled.named.left_out_frequency.push_back(whole.omega[mode] / (2.0 * M_PI));
}

// Sets the tables of what links at true geometry do not neglect to zero.
void clear_neglected(PlanUnmodelled& unmodelled) {
  for (Array* neglected :
       {&unmodelled.load_rows, &unmodelled.rate_rows, &unmodelled.spin_rows, &unmodelled.root_quartic,
        &unmodelled.shadow_rows, &unmodelled.quartic_forms, &unmodelled.bodies.unquantified_factor})
    std::fill(neglected->begin(), neglected->end(), 0.0);
}

}  // namespace

// Returns whether the rung has the true geometry of every link. A matrix has none.
bool has_true_links_only(const Structure& structure, const RungTraits& rung) {
  return rung.has_true_geometry &&
         std::ranges::all_of(structure.resolved.links,
                             [](const ResolvedLink& link) { return link.traits.follows_points; });
}

void compile_unmodelled(const Scene& scene, const Structure& whole, const PlanSpec& spec, Plan& plan) {
  assert(plan.omega.size() == index(plan.num_padded));
  const RungTraits& rung = traits_of(plan.fidelity);
  PlanUnmodelled& unmodelled = plan.unmodelled;
  unmodelled.is_known = true;
  unmodelled.tolerance = scene.tolerance;
  unmodelled.is_rigid = !rung.has_modes && whole.omega.size() > 0;
  if (!rung.has_modes) return;
  const Prestress& prestress = whole.prestress;
  const Eigen::MatrixXd& rows = rung.has_true_geometry ? prestress.bent_rows : prestress.rows;
  const Eigen::MatrixXd& rate_rows = rung.has_true_geometry ? prestress.bent_rate_rows : prestress.rate_rows;
  const bool damps = !rate_rows.isZero(0.0);
  // no table includes the effect of spin and loads on mass within links, on mass inside matrices, and on
  // wheels
  const bool is_modelled = has_true_links_only(whole, rung);
  unmodelled.has_unquantified = !is_modelled && (prestress.has_unquantified || !scene.wheels.empty() ||
                                                 whole.resolved.have_links_mass());
  unmodelled.lacks_modes = lacks_modes(scene, whole, spec);
  std::vector<int> index_in_plan(index(whole.omega.size()), -1);
  for (std::size_t k = 0; k < spec.modes.size(); ++k)
    index_in_plan[index(spec.modes[k])] = static_cast<int>(k);
  const bool has_unquantified_link = std::ranges::any_of(
      whole.resolved.links, [](const ResolvedLink& link) { return link.is_unquantified(); });
  const SpinRows spin(scene, whole, rung, rows);
  const StiffenedRows stiffened(scene, whole, spec, plan, rows);
  const std::vector<RotatingBody> bodies = rotating_bodies(scene, whole);
  unmodelled.bodies.inner_load = inner_load(whole, spec.modes);
  int crossed = -1;
  Eigen::Matrix3Xd crosses;
  for (std::size_t k = 0; k < prestress.pairs.size(); ++k) {
    const auto [l, u] = prestress.pairs[k];
    const int at_l = index_in_plan[index(l)], at_u = index_in_plan[index(u)];
    if (l == u && at_l < 0 && whole.omega[l] > 0.0)
      append_left_out(whole, l, rows.row(static_cast<Eigen::Index>(k))(spec.modes),
                      spin.row(static_cast<Eigen::Index>(k), l, u), unmodelled);
    if (at_l < 0 || at_u < 0) continue;
    unmodelled.pairs.push_back({at_l, at_u});
    if (l == u) {
      const Eigen::VectorXd& root =
          rung.has_true_geometry ? prestress.bent_root_quartic : prestress.root_quartic;
      unmodelled.root_quartic.push_back(root[l]);
      if (prestress.has_unquantified)
        unmodelled.bodies.unquantified_factor.push_back(unquantified_factor(scene, whole, l));
      if (has_unquantified_link) unmodelled.named.links.push_back(unquantified_link(scene, whole, l));
      ++unmodelled.num_judged;
    }
    const auto pair = static_cast<Eigen::Index>(k);
    append(Eigen::RowVectorXd(rows.row(pair)(spec.modes)), unmodelled.load_rows);
    if (damps) append(Eigen::RowVectorXd(rate_rows.row(pair)(spec.modes)), unmodelled.rate_rows);
    Products products = spin.row(pair, l, u) - stiffened.by_spin(pair);
    if (std::exchange(crossed, l) != l) crosses = crosses_of(whole, l);
    if (l == u && !rung.couples) {
      const FarCoriolis far = far_coriolis(whole, prestress, l, crosses);
      products += whole.mass_properties.mass * far.shift;
      append(far.transfer, unmodelled.coriolis_transfer);
    }
    append(products, unmodelled.spin_rows);
    if (!bodies.empty() && !rung.couples) append(push_row(bodies, l, u), unmodelled.bodies.push_rows);
    append(Eigen::Vector3d(crosses.col(u)), unmodelled.coriolis_rows);
  }
  stiffened.append_loads(unmodelled);
  fill_high_orders(prestress, rows, rung.has_true_geometry ? prestress.bent_quartic : prestress.quartic,
                   spec.modes, unmodelled);
  for (std::int32_t c = 0; c < unmodelled.num_shadowed; ++c)
    append(of_spin(field_moments(whole, spec.modes[index(c)])), unmodelled.inertia_rows);
  fill_loads(scene, prestress.has_unquantified, plan);
  if (!rung.takes_spin_load && !rung.couples) fill_spin_loads(whole, index_in_plan, unmodelled);
  if (is_modelled) clear_neglected(unmodelled);
}

}  // namespace freeflex
