#include "core/plan/neglect.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/plan/histories.hpp"
#include "core/scene/bodies.hpp"
#include "core/step/loads.hpp"
#include "core/structure/particles.hpp"

namespace freeflex {
namespace {

constexpr double kLeastApart = 0.05;  // [-] of omega_l^2: squares of two frequencies, where they divide

constexpr std::array<std::array<int, 2>, 6> kSpinProducts{{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};
using Products = Eigen::Matrix<double, 1, 6>;

// coefficients of S = w.w 1 - w w^T as those of the products of w
Products of_spin(const Eigen::Matrix3d& X) {
  Products row;
  for (Eigen::Index k = 0; k < 6; ++k) {
    const auto [a, b] = kSpinProducts[static_cast<std::size_t>(k)];
    row[k] = a == b ? X.trace() - X(a, a) : -(X(a, b) + X(b, a));
  }
  return row;
}

Eigen::Matrix3d field_of(const Structure& structure, Eigen::Index mode) {
  Eigen::Matrix3d Y = Eigen::Matrix3d::Zero();  // Y_l of X70
  const Particles& particles = structure.particles;
  const Eigen::MatrixXd& shapes = particle_shapes(structure);
  for (Eigen::Index i = 0; i < particles.mass.size(); ++i)
    Y += particles.mass[i] * particles.r.col(i) * shapes.block<3, 1>(3 * i, mode).transpose();
  Y = (0.5 * (Y + Y.transpose())).eval();
  if (structure.matrix_sums.field.rows() > 0) {
    const Eigen::VectorXd own = structure.matrix_sums.field.col(mode);
    Y += (Eigen::Matrix3d() << own[0], own[3], own[4], own[3], own[1], own[5], own[4], own[5], own[2])
             .finished();
  }
  return Y;
}

// sum m b_l b_u^T over the mass, and what bodies add by the second order of their turn (X194), symmetric part
Eigen::Matrix3d outer_of(const Structure& structure, const std::vector<TurningBody>& bodies, int l, int u) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  const Particles& particles = structure.particles;
  const Eigen::MatrixXd& shapes = particle_shapes(structure);
  for (Eigen::Index i = 0; i < particles.mass.size(); ++i) {
    const double share = particles.mass[i] / structure.mass_properties.mass;
    const Eigen::Vector3d b = shapes.block<3, 1>(3 * i, l), c = shapes.block<3, 1>(3 * i, u);
    sum += 0.5 * share * (b * c.transpose() + c * b.transpose());
  }
  for (const TurningBody& body : bodies) {
    const Eigen::Matrix3d turned = second_order_of_pair(body, l, u) / structure.mass_properties.mass;
    sum += 0.5 * (turned + turned.transpose());
  }
  return sum;
}

// s_lu = sum m b_l x b_u over the mass, a column a mode u
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

// X141: what the spin does to the stiffness of each pair, per product of w
class SpinRows {
 public:
  SpinRows(const Scene& scene, const Structure& whole, const RungTraits& rung, const Eigen::MatrixXd& rows)
      : whole_(whole), rung_(rung), bodies_(turning_bodies(scene, whole)) {
    // internal forces of the static answer to the centrifugal load; on the rung that has it they come with
    // its loads
    prestress_ = Eigen::MatrixXd::Zero(rows.rows(), 6);
    if (rung.takes_spin_load) return;
    const Prestress& prestress = whole.prestress;
    for (Eigen::Index v = 0; v < whole.omega.size(); ++v)
      if (const double c = whole.mass_properties.mass * whole.omega[v] * whole.omega[v]; c > 0.0) {
        Eigen::VectorXd column = rows.col(v);
        // among shadowed modes that is in the third derivatives
        for (std::size_t k = 0; k < prestress.pairs.size() && v < prestress.num_shadowed; ++k)
          if (prestress.pairs[k][0] < prestress.num_shadowed &&
              prestress.pairs[k][1] < prestress.num_shadowed)
            column[static_cast<Eigen::Index>(k)] = 0.0;
        prestress_ += column * of_spin(field_of(whole, v) / c);
      }
  }

  Products row(Eigen::Index pair, int l, int u) const {
    Products row = prestress_.row(pair);
    if (!rung_.couples) row -= whole_.mass_properties.mass * of_spin(outer_of(whole_, bodies_, l, u));
    return row;
  }

 private:
  const Structure& whole_;
  const RungTraits& rung_;
  std::vector<TurningBody> bodies_;
  Eigen::MatrixXd prestress_;  // (pairs x 6)
};

// X141: what Coriolis forces do to mode l by way of the modes that are not its partners, per product of w
struct FarCoriolis {
  Products shift = Products::Zero();  // [-] -4 (w . s_lu)^2 omega_l^2 / (omega_u^2 - omega_l^2) over w^2
  Products reach = Products::Zero();  // [s^2] (2 omega_l w . s_lu / (omega_u^2 - omega_l^2))^2 over w^2
};
FarCoriolis far_coriolis(const Structure& whole, const Prestress& prestress, int l,
                         const Eigen::Matrix3Xd& crosses) {
  FarCoriolis far;
  const double square = whole.omega[l] * whole.omega[l];
  for (int u = 0; u < static_cast<int>(whole.omega.size()) && square > 0.0; ++u) {
    const Prestress::Pair pair{std::min(l, u), std::max(l, u)};
    if (std::find(prestress.pairs.begin(), prestress.pairs.end(), pair) != prestress.pairs.end()) continue;
    double apart = whole.omega[u] * whole.omega[u] - square;
    if (std::abs(apart) < kLeastApart * square) apart = std::copysign(kLeastApart * square, apart);
    const Eigen::Vector3d s = crosses.col(u);
    for (Eigen::Index k = 0; k < 6; ++k) {
      const auto [a, b] = kSpinProducts[static_cast<std::size_t>(k)];
      const double product = (a == b ? 4.0 : 8.0) * square * s[a] * s[b];
      far.shift[k] -= product / apart;
      far.reach[k] += product / (apart * apart);
    }
  }
  return far;
}

// X198: stiffness of a pair per acceleration of the frame and per angular acceleration
Products push_row(const std::vector<TurningBody>& bodies, int l, int u) {
  Products row = Products::Zero();
  for (const TurningBody& body : bodies) {
    row.head<3>() += moved_centre(body, l, u);
    const Eigen::Matrix3d G = second_order_of_pair(body, l, u);
    row.tail<3>() += Eigen::RowVector3d(G(1, 2) - G(2, 1), G(2, 0) - G(0, 2), G(0, 1) - G(1, 0));
  }
  return row;
}

// X143 [m s^2]: what the spin may bend by masses that inner coordinates move, which are no points. Of each
// mode they have sum m b.b less that of the particles, of the body their moment of inertia: Cauchy's
// inequality.
double inner_load(const Scene& scene, const Structure& whole, const std::vector<int>& modes) {
  double moment = 0.0;
  for (const Link& link : scene.links)
    if (const auto* matrix = std::get_if<MatrixLink>(&link.kind);
        matrix != nullptr && matrix->num_inner > 0) {
      const PointMass body = rigid_body_of(scene, link);
      moment += 0.5 * body.inertia.trace() + body.mass * body.offset.squaredNorm();
    }
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

// Forces in a link whose inside nothing tells act on what the mode moves there: a light point between heavy
// ends swings far beyond the rms over the mass. A free beam moves its ends by 2.
double unseen_factor(const Scene& scene, const Structure& whole, int mode) {
  constexpr double kOfABeam = 4.0;
  double most = 0.0;
  for (const Link& link : scene.links)
    if (std::holds_alternative<MatrixLink>(link.kind) || std::holds_alternative<Rigid>(link.kind))
      for (const int point : link.points)
        most = std::max(most, whole.shapes.block<3, 1>(3 * Eigen::Index{point}, mode).squaredNorm());
  return std::max(1.0, most / kOfABeam);
}

// Links whose inside no table tells of, as PlanNeglect::has_unseen counts them.
bool is_unseen(const Link& link) {
  const LinkTraits kind = traits_of(link);
  return kind.effect == LinkEffect::kForbids || std::holds_alternative<MatrixLink>(link.kind) ||
         std::holds_alternative<Plate>(link.kind) || has_mass(link);
}

// Of those the one whose points a mode moves most; -1: none.
std::int32_t unseen_link(const Scene& scene, const Structure& whole, int mode) {
  double most = 0.0;
  std::int32_t found = -1;
  for (std::size_t k = 0; k < scene.links.size(); ++k) {
    if (!is_unseen(scene.links[k])) continue;
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

// X147: third derivatives of the strain energy along the lowest modes that the plan has
void fill_shadow(const Prestress& prestress, const Eigen::MatrixXd& rows, const Eigen::MatrixXd& quartic,
                 const std::vector<int>& modes, PlanNeglect& neglect) {
  const auto row_of = [&](int l, int u) {
    const Prestress::Pair pair{std::min(l, u), std::max(l, u)};
    return std::find(prestress.pairs.begin(), prestress.pairs.end(), pair) - prestress.pairs.begin();
  };
  const auto n = static_cast<std::size_t>(
      std::lower_bound(modes.begin(), modes.end(), prestress.num_shadowed) - modes.begin());
  neglect.num_shadowed = static_cast<std::int32_t>(n);
  for (Eigen::Index form = 0; form < quartic.rows(); form += quartic.cols())
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t b = 0; b < n; ++b) neglect.quartic.forms.push_back(quartic(form + modes[a], modes[b]));
  Eigen::MatrixXi row(n, n);
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = 0; b < n; ++b)
      row(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) =
          static_cast<int>(row_of(modes[a], modes[b]));
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = a; b < n; ++b)
      for (std::size_t c = 0; c < n; ++c) {
        const auto i = static_cast<Eigen::Index>(a), j = static_cast<Eigen::Index>(b),
                   k = static_cast<Eigen::Index>(c);
        const double third =
            rows(row(i, j), modes[c]) + rows(row(j, k), modes[a]) + rows(row(i, k), modes[b]);
        neglect.shadow_rows.push_back(a == b ? 0.5 * third : third);
      }
}

}  // namespace

void compile_neglect(const Scene& scene, const Structure& whole, const PlanSpec& spec, Plan& plan) {
  const RungTraits& rung = traits_of(plan.fidelity);
  PlanNeglect& neglect = plan.neglect;
  neglect.is_known = true;
  neglect.tolerance = scene.tolerance;
  neglect.is_rigid = !rung.has_modes && whole.omega.size() > 0;
  if (!rung.has_modes) return;
  const Prestress& prestress = whole.prestress;
  const Eigen::MatrixXd& rows = rung.has_true_geometry ? prestress.bent_rows : prestress.rows;
  const Eigen::MatrixXd& rate_rows = rung.has_true_geometry ? prestress.bent_rate_rows : prestress.rate_rows;
  const bool damps = !rate_rows.isZero(0.0);
  // what spin and loads do to mass within links, to the inside of mass matrices and to wheels is in no table
  neglect.has_unseen =
      prestress.has_unseen || !scene.wheels.empty() ||
      std::any_of(scene.links.begin(), scene.links.end(), [](const Link& link) { return has_mass(link); });
  if (whole.kept.is_part)
    neglect.lacks_modes = LacksModes::kNotKept;
  else if (spec.modes.size() < static_cast<std::size_t>(whole.omega.size()) &&
           scene.leave_out.tolerance > 0.0)
    neglect.lacks_modes = LacksModes::kSmallOnes;
  std::vector<int> place(static_cast<std::size_t>(whole.omega.size()), -1);
  for (std::size_t k = 0; k < spec.modes.size(); ++k)
    place[static_cast<std::size_t>(spec.modes[k])] = static_cast<int>(k);
  const bool has_unseen_link = std::any_of(scene.links.begin(), scene.links.end(), is_unseen);
  const SpinRows spin(scene, whole, rung, rows);
  const std::vector<TurningBody> bodies = turning_bodies(scene, whole);
  neglect.bodies.inner_load = inner_load(scene, whole, spec.modes);
  int crossed = -1;
  Eigen::Matrix3Xd crosses;
  for (std::size_t k = 0; k < prestress.pairs.size(); ++k) {
    const auto [l, u] = prestress.pairs[k];
    const int at_l = place[static_cast<std::size_t>(l)], at_u = place[static_cast<std::size_t>(u)];
    if (l == u && at_l < 0 && whole.omega[l] > 0.0) {
      const double c = whole.mass_properties.mass * whole.omega[l] * whole.omega[l];
      const auto left_out = static_cast<Eigen::Index>(k);
      append(Eigen::RowVectorXd(rows.row(left_out)(spec.modes) / c), neglect.left_out_rows);
      append(Products(spin.row(left_out, l, u) / c), neglect.left_out_spin);
      neglect.named.left_out.push_back(l + 1);
      neglect.named.left_out_frequency.push_back(whole.omega[l] / (2.0 * M_PI));
    }
    if (at_l < 0 || at_u < 0) continue;
    neglect.pairs.push_back({at_l, at_u});
    if (l == u) {
      const Eigen::VectorXd& root =
          rung.has_true_geometry ? prestress.bent_root_quartic : prestress.root_quartic;
      neglect.root_quartic.push_back(root[l]);
      if (prestress.has_unseen) neglect.bodies.unseen_factor.push_back(unseen_factor(scene, whole, l));
      if (has_unseen_link) neglect.named.links.push_back(unseen_link(scene, whole, l));
      ++neglect.num_judged;
    }
    const auto pair = static_cast<Eigen::Index>(k);
    append(Eigen::RowVectorXd(rows.row(pair)(spec.modes)), neglect.load_rows);
    if (damps) append(Eigen::RowVectorXd(rate_rows.row(pair)(spec.modes)), neglect.rate_rows);
    Products products = spin.row(pair, l, u);
    if (std::exchange(crossed, l) != l) crosses = crosses_of(whole, l);
    if (l == u && !rung.couples) {
      const FarCoriolis far = far_coriolis(whole, prestress, l, crosses);
      products += whole.mass_properties.mass * far.shift;
      append(far.reach, neglect.coriolis_reach);
    }
    append(products, neglect.spin_rows);
    if (!bodies.empty() && !rung.couples) append(push_row(bodies, l, u), neglect.bodies.push_rows);
    append(Eigen::Vector3d(crosses.col(u)), neglect.coriolis_rows);
  }
  fill_shadow(prestress, rows, rung.has_true_geometry ? prestress.bent_quartic : prestress.quartic,
              spec.modes, neglect);
  for (std::int32_t c = 0; c < neglect.num_shadowed; ++c)
    append(of_spin(field_of(whole, spec.modes[static_cast<std::size_t>(c)])), neglect.inertia_rows);
  for (std::size_t k = 0; k < scene.loads.size(); ++k) {
    Array arms;
    const SumsOnPoints sums = sums_of(scene.loads[k], plan);
    set_arms(plan, sums, arms);
    neglect.load_arms.insert(neglect.load_arms.end(), arms.begin(), arms.end());
    if (prestress.has_unseen) neglect.bodies.load_sizes.push_back(size_of_forces(sums));
  }
  if (rung.takes_spin_load || rung.couples) return;
  Eigen::Matrix<double, 6, 6> left_out = Eigen::Matrix<double, 6, 6>::Zero();
  for (int mode = 0; mode < static_cast<int>(whole.omega.size()); ++mode) {
    const Products load = of_spin(field_of(whole, mode));
    const double stiffness = whole.mass_properties.mass * whole.omega[mode] * whole.omega[mode];
    if (place[static_cast<std::size_t>(mode)] >= 0)
      append(load, neglect.spin_loads);
    else if (stiffness > 0.0)
      left_out += load.transpose() * load / (stiffness * stiffness);
  }
  for (Eigen::Index row = 0; row < 6; ++row) append(left_out.row(row), neglect.spin_left_out);
}

}  // namespace freeflex
