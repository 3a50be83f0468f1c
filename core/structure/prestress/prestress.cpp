#include "core/structure/prestress/prestress.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>

#include "core/structure/links/link_factor.hpp"
#include "core/structure/modes/sparse/sparse_system.hpp"
#include "core/structure/prestress/axial_prestress.hpp"
#include "core/structure/prestress/local_shapes.hpp"
#include "core/structure/prestress/quartic.hpp"
#include "core/structure/prestress/true_deformation.hpp"

namespace freeflex {
namespace {

// size of displacements, as a fraction of the span [-], and of rotations [rad] for central differences. The
// square of this size is far above rounding errors, and its fourth power is negligible
constexpr double kAmplitude = 1e-3;

// Number of lowest modes for which the diagonal geometric stiffness is computed. Geometric stiffness is
// proportional to squares of slopes, so in higher modes it decreases relative to the elastic stiffness of the
// mode.
constexpr int kMostModes = 48;
constexpr double kNear = 0.05;  // [-] largest relative difference of the frequencies of a pair
constexpr int kMostPartners = 2;
// Number of modes whose error is integrated at every tick. The cost grows with the cube of this number.
constexpr int kMostShadowed = 16;

void choose_pairs(const Structure& structure, Prestress& prestress) {
  const auto num_mechanisms = static_cast<int>(structure.mechanisms.size());
  const auto n = static_cast<int>(structure.omega.size());
  const int num_modes = prestress.num_modes = std::min(n, num_mechanisms + kMostModes);
  const int num_shadowed = prestress.num_shadowed =
      std::min(n, std::min(num_mechanisms, kMostShadowed) + kMostShadowed);
  std::vector<Prestress::Pair>& pairs = prestress.pairs;
  for (int l = 0; l < num_modes; ++l) pairs.push_back({l, l});
  for (int l = 0; l < num_shadowed; ++l)
    for (int u = l + 1; u < num_shadowed; ++u) pairs.push_back({l, u});
  for (int l = num_mechanisms; l < num_modes; ++l)
    for (int u = std::max(l + 1, l < num_shadowed ? num_shadowed : 0);
         u < std::min(num_modes, l + 1 + kMostPartners); ++u)
      if (structure.omega[u] - structure.omega[l] <= kNear * structure.omega[u]) pairs.push_back({l, u});
}

// motion of a link in a mode
struct LocalShape {
  Eigen::Matrix3Xd V, theta, own;
  LocalShape operator+(const LocalShape& other) const {
    return {V + other.V, theta + other.theta, own.cols() > 0 ? Eigen::Matrix3Xd(own + other.own) : own};
  }
};

// returns the second derivative of the natural deformations along a displacement, by central differences
// (THEORY X140)
Eigen::VectorXd second_order(const TrueLink& link, double span, const LocalShape& shape) {
  const double own = shape.own.cols() > 0 ? shape.own.colwise().norm().maxCoeff() : 0.0;
  const double size =
      std::max({shape.V.colwise().norm().maxCoeff() / span, shape.theta.colwise().norm().maxCoeff(), own});
  if (size == 0.0) return Eigen::VectorXd::Zero(link.num_deformations());
  const double scale = kAmplitude / size;
  return (link.deformations(scale * shape.V, scale * shape.theta, scale * shape.own) +
          link.deformations(-scale * shape.V, -scale * shape.theta, -scale * shape.own)) /
         (scale * scale);
}

// second derivatives of the natural deformations of one link along pairs of modes, each computed once
class SecondOrders {
 public:
  SecondOrders(const Scene& scene, int index, const Freedoms& freedoms, const LocalShapes& local)
      : link_(scene.links[static_cast<std::size_t>(index)]),
        true_(scene, index, freedoms),
        local_(local),
        index_(index) {
    for (const int point : link_.points)
      span_ = std::max(span_, (scene.points[static_cast<std::size_t>(point)].position -
                               scene.points[static_cast<std::size_t>(link_.points.front())].position)
                                  .norm());
  }
  int size() const { return true_.num_deformations(); }
  // returns h_lu   (THEORY X140)
  const Eigen::VectorXd& of(int l, int u) {
    const auto found = known_.find({l, u});
    if (found != known_.end()) return found->second;
    const Eigen::VectorXd h =
        l == u
            ? second_order(true_, span_, shape(l))
            : Eigen::VectorXd(0.5 * (second_order(true_, span_, shape(l) + shape(u)) - of(l, l) - of(u, u)));
    return known_[{l, u}] = h;
  }

 private:
  LocalShape shape(int mode) const {
    return {local_.displacements(link_, mode), local_.rotations(index_, mode),
            local_.own_rotations(index_, mode)};
  }
  const Link& link_;
  TrueLink true_;
  const LocalShapes& local_;
  int index_;
  double span_ = 0.0;
  std::map<Prestress::Pair, Eigen::VectorXd> known_;
};

// Geometric stiffness E_lu of pairs of modes per elastic coordinate. The stiffness from axial links (axial)
// is separate from the stiffness from all other links (bent) (THEORY X140).
struct PairStiffness {
  Eigen::MatrixXd axial, bent;  // (pairs x n)
  // (pairs x n) per rate of the elastic coordinates, from dashpots and viscous links
  Eigen::MatrixXd axial_rate, bent_rate;
  Eigen::VectorXd axial_quartic, bent_quartic;  // [N/m^3] (pairs) sum D h_lu^2
  SquareSums axial_squares, bent_squares;       // for the pairs in `squared`
  bool has_unquantified = false;
};

// sums over springs, bars and dashpots of a large scene, many links at once
class AxialSums {
 public:
  AxialSums(const Scene& scene, const Structure& structure, const std::vector<Prestress::Pair>& pairs,
            PairStiffness& stiffness)
      : scene_(scene), structure_(structure), pairs_(pairs), stiffness_(stiffness) {
    held_ = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(pairs.size()), structure.omega.size());
    damped_ = held_;
  }
  void add(int link) {
    links_.push_back(link);
    if (links_.size() == kAtOnce) flush();
  }
  void finish() {
    flush();
    stiffness_.axial += held_;
    stiffness_.axial_rate += damped_;
  }

 private:
  static constexpr std::size_t kAtOnce = 1024;
  void flush() {
    if (links_.empty()) return;
    const AxialOrders orders = axial_orders(scene_, links_, structure_.shapes, pairs_);
    Eigen::VectorXd D(orders.first.rows()), c(orders.first.rows());
    for (Eigen::Index k = 0; k < D.size(); ++k) {
      const Link& link = scene_.links[static_cast<std::size_t>(links_[static_cast<std::size_t>(k)])];
      const Axial axial = axial_of(scene_, link);
      D[k] = axial.stiffness;
      c[k] = axial.damping + link.viscous * axial.stiffness;
    }
    held_ += products(orders.second, orders.second.cols(), D.asDiagonal() * orders.first);
    if (!c.isZero(0.0))
      damped_ += products(orders.second, orders.second.cols(), c.asDiagonal() * orders.first);
    stiffness_.axial_quartic += orders.second.cwiseAbs2().transpose() * D;
    stiffness_.axial_squares.add(orders.second, D);
    links_.clear();
  }
  const Scene& scene_;
  const Structure& structure_;
  const std::vector<Prestress::Pair>& pairs_;
  PairStiffness& stiffness_;
  std::vector<int> links_;
  Eigen::MatrixXd held_, damped_;  // (pairs x n)
};

// returns E_lu = sum_links sum_k s_k h_k,lu per elastic coordinate   (THEORY X140)
// \param squared    indices into `pairs` for which SquareSums are computed
PairStiffness stiffness_of(const Scene& scene, const LinkFactor& factor, const Structure& structure,
                           const std::vector<Prestress::Pair>& pairs, const std::vector<int>& squared) {
  PairStiffness stiffness{{}, {}, {}, {}, {}, {}, SquareSums(squared), SquareSums(squared)};
  stiffness.axial = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(pairs.size()), structure.omega.size());
  stiffness.bent = stiffness.axial_rate = stiffness.bent_rate = stiffness.axial;
  stiffness.axial_quartic = stiffness.bent_quartic = Eigen::VectorXd::Zero(stiffness.axial.rows());
  const Freedoms freedoms(scene);
  const LocalShapes local(scene, freedoms, factor, structure.shapes, structure.rotations);
  AxialSums axial(scene, structure, pairs, stiffness);
  for (int index = 0; index < static_cast<int>(scene.links.size()); ++index) {
    const Link& link = scene.links[static_cast<std::size_t>(index)];
    const LinkTraits kind = traits_of(link);
    const bool damps = kind.effect == LinkEffect::kDamps;
    if (factor.is_sparse && kind.is_axial && kind.effect != LinkEffect::kForbids) {
      axial.add(index);
      continue;
    }
    if (kind.effect == LinkEffect::kForbids || (!damps && !kind.follows_points)) {
      stiffness.has_unquantified = true;
      continue;
    }
    // the bow within a triangle is not included
    stiffness.has_unquantified = stiffness.has_unquantified || kind.hides_forces;
    const RowRange range = factor.natural_of[static_cast<std::size_t>(index)];
    const int count = damps ? 1 : range.count;
    Eigen::MatrixXd forces(count, structure.omega.size());
    Eigen::VectorXd D(count);
    for (int k = 0; k < count; ++k) {
      const DeformationRow row =
          damps ? axial_row(scene, link, axial_of(scene, link).damping) : natural_row(factor, range, k);
      D[k] = row.root_stiffness * row.root_stiffness;
      forces.row(k) = D[k] * local.deformation(row);
    }
    SecondOrders second(scene, index, freedoms, local);
    Eigen::MatrixXd h(second.size(), static_cast<Eigen::Index>(pairs.size()));
    for (Eigen::Index pair = 0; pair < h.cols(); ++pair) {
      const auto [l, u] = pairs[static_cast<std::size_t>(pair)];
      h.col(pair) = second.of(l, u);
    }
    const Eigen::MatrixXd added = h.transpose() * forces;
    if (damps || link.viscous > 0.0)
      (kind.is_axial ? stiffness.axial_rate : stiffness.bent_rate) += (damps ? 1.0 : link.viscous) * added;
    if (damps) continue;
    (kind.is_axial ? stiffness.axial : stiffness.bent) += added;
    (kind.is_axial ? stiffness.axial_quartic : stiffness.bent_quartic) += h.cwiseAbs2().transpose() * D;
    (kind.is_axial ? stiffness.axial_squares : stiffness.bent_squares).add(h, D);
  }
  axial.finish();
  return stiffness;
}

// Returns sqrt(beta_l). beta_l is the fourth-order coefficient of mode l minus the response of all modes v to
// the square of mode l, at zero frequency and at twice the frequency of mode l   (THEORY X146):
//   beta_l = (sum D h_ll^2 - sum_v gamma_v^2 / (M omega_v^2) (2/3 + 1/3 / (1 - 4 omega_l^2 / omega_v^2))) / 2
Eigen::VectorXd root_quartic(const Structure& structure, const Prestress& prestress,
                             const Eigen::VectorXd& held, const Eigen::MatrixXd& rows) {
  // [-] smallest magnitude of 1 - 4 omega_l^2 / omega_v^2 with which the response of a mode v is computed. If
  // the magnitude is smaller, twice the frequency of mode l is near the resonance of mode v, and the
  // integrated error includes the response (THEORY X147).
  constexpr double kLeastOff = 0.2;
  const double M = structure.mass_properties.mass;
  Eigen::VectorXd gamma_of(structure.omega.size());
  Eigen::VectorXd root(prestress.num_modes);
  for (Eigen::Index l = 0; l < prestress.num_modes; ++l) {
    gamma_of = rows.row(l).transpose();
    for (std::size_t k = 0; k < prestress.pairs.size() && l < prestress.num_shadowed; ++k) {
      const auto [a, b] = prestress.pairs[k];
      if ((a != l && b != l) || b >= prestress.num_shadowed) continue;
      gamma_of[a == l ? b : a] += 2.0 * rows(static_cast<Eigen::Index>(k), l);
    }
    double left = held[l];
    const double square = structure.omega[l] * structure.omega[l];
    for (Eigen::Index v = 0; v < structure.omega.size(); ++v) {
      const double own = structure.omega[v] * structure.omega[v];
      if (own == 0.0) continue;
      double off = 1.0 - 4.0 * square / own;
      if (std::abs(off) < kLeastOff) off = std::copysign(kLeastOff, off);
      left -= gamma_of[v] * gamma_of[v] / (M * own) * (2.0 / 3.0 + 1.0 / (3.0 * off));
    }
    root[l] = std::sqrt(std::abs(0.5 * left));
  }
  return root;
}

}  // namespace

Prestress find_prestress(const Scene& scene, const LinkFactor& factor, const Structure& structure) {
  assert(structure.shapes.cols() == structure.omega.size());
  Prestress prestress;
  choose_pairs(structure, prestress);
  PairStiffness stiffness =
      stiffness_of(scene, factor, structure, prestress.pairs, shadowed_pairs(prestress));
  prestress.has_unquantified = stiffness.has_unquantified;
  prestress.rows = stiffness.axial + stiffness.bent;
  prestress.bent_rows = std::move(stiffness.bent);
  prestress.rate_rows = stiffness.axial_rate + stiffness.bent_rate;
  prestress.bent_rate_rows = std::move(stiffness.bent_rate);
  prestress.root_quartic =
      root_quartic(structure, prestress, stiffness.axial_quartic + stiffness.bent_quartic, prestress.rows);
  prestress.bent_root_quartic =
      root_quartic(structure, prestress, stiffness.bent_quartic, prestress.bent_rows);
  const Eigen::MatrixXd bent = stiffness.bent_squares.finish();
  prestress.quartic =
      quartic_forms(structure, prestress, stiffness.axial_squares.finish() + bent, prestress.rows);
  prestress.bent_quartic = quartic_forms(structure, prestress, bent, prestress.bent_rows);
  return prestress;
}

void rotate_prestress(const Eigen::MatrixXd& rotation, int first, Prestress& prestress) {
  const auto count = static_cast<int>(rotation.rows());
  // the largest value is an upper bound for every mode in the space of the rotated modes
  for (Eigen::VectorXd* root : {&prestress.root_quartic, &prestress.bent_root_quartic}) {
    const Eigen::Index num_judged = std::clamp<Eigen::Index>(root->size() - first, 0, count);
    if (num_judged > 0)
      root->segment(first, num_judged).setConstant(root->segment(first, num_judged).maxCoeff());
  }
  rotate_quartic_forms(rotation, first, prestress.quartic);
  rotate_quartic_forms(rotation, first, prestress.bent_quartic);
  for (Eigen::MatrixXd* rows :
       {&prestress.rows, &prestress.bent_rows, &prestress.rate_rows, &prestress.bent_rate_rows}) {
    rows->middleCols(first, count) = (rows->middleCols(first, count) * rotation).eval();
    // E <- rotation^T E rotation over the pairs that are present
    const Eigen::MatrixXd before = *rows;
    const auto add_share = [&](Eigen::Index to, int l, int u, double share) {
      for (std::size_t k = 0; k < prestress.pairs.size(); ++k)
        if (prestress.pairs[k] == Prestress::Pair{std::min(l, u), std::max(l, u)})
          rows->row(to) += share * before.row(static_cast<Eigen::Index>(k));
    };
    for (std::size_t k = 0; k < prestress.pairs.size(); ++k) {
      const auto [l, u] = prestress.pairs[k];
      const bool has_l = l >= first && l < first + count, has_u = u >= first && u < first + count;
      if (!has_l && !has_u) continue;
      const auto row = static_cast<Eigen::Index>(k);
      rows->row(row).setZero();
      for (int a = has_l ? first : l; a < (has_l ? first + count : l + 1); ++a)
        for (int b = has_u ? first : u; b < (has_u ? first + count : u + 1); ++b)
          add_share(row, a, b,
                    (has_l ? rotation(a - first, l - first) : 1.0) *
                        (has_u ? rotation(b - first, u - first) : 1.0));
    }
  }
}

}  // namespace freeflex
