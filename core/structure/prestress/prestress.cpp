#include "core/structure/prestress/prestress.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>

#include "core/structure/links/link_factor.hpp"
#include "core/structure/modes/sparse/sparse_system.hpp"
#include "core/structure/prestress/axial_prestress.hpp"
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

// The number of modes with geometric stiffness due to follower loads. For a free beam under end thrust, the
// frequencies from eight modes have a relative error below 1e-4.
constexpr int kMostFollowed = 24;

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

// Displacements of points and rotations of joints of single links, in every mode.
class LocalShapes {
 public:
  LocalShapes(const Scene& scene, const Freedoms& freedoms, const LinkFactor& factor,
              const Structure& structure)
      : scene_(scene), freedoms_(freedoms), shapes_(structure.shapes) {
    if (structure.rotations.rows() > 0) rotations_ = structure.rotations;
    if (factor.recovery.rows() == 0) return;
    rotations_ = factor.recovery * shapes_;
    rotate_with_bodies(scene, freedoms, shapes_, rotations_);
  }

  // returns the natural deformation of a row in every mode
  Eigen::RowVectorXd deformation(const DeformationRow& row) const {
    Eigen::RowVectorXd e = Eigen::RowVectorXd::Zero(shapes_.cols());
    if (e.size() == 0) return e;  // a row of a matrix without columns begins at an offset from a null pointer
    for (const auto& [freedom, coefficient] : row.coefficients)
      e += coefficient * (freedom < freedoms_.num_displacements()
                              ? shapes_.row(freedom)
                              : rotations_.row(freedom - freedoms_.num_displacements()));
    return e;
  }

  Eigen::Matrix3Xd displacements(const Link& link, int mode) const {
    Eigen::Matrix3Xd V(3, static_cast<Eigen::Index>(link.points.size()));
    for (Eigen::Index k = 0; k < V.cols(); ++k)
      V.col(k) = shapes_.block<3, 1>(3 * Eigen::Index{link.points[static_cast<std::size_t>(k)]}, mode);
    V.colwise() -= Eigen::Vector3d(V.col(0));
    return V;
  }

  // returns the rotations of the joints at the points of a link
  Eigen::Matrix3Xd rotations(int index, int mode) const {
    const Link& link = scene_.links[static_cast<std::size_t>(index)];
    Eigen::Matrix3Xd theta = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(link.points.size()));
    if (!traits_of(link).has_joint_rotations) return theta;
    const int before = freedoms_.num_displacements();
    for (Eigen::Index k = 0; k < theta.cols(); ++k)
      theta.col(k) =
          rotations_.block<3, 1>(freedoms_.rotation(link.points[static_cast<std::size_t>(k)]) - before, mode);
    return theta;
  }

  // returns the rotations of the ends of a beam relative to their joints, about released axes
  Eigen::Matrix3Xd own_rotations(int index, int mode) const {
    const Link& link = scene_.links[static_cast<std::size_t>(index)];
    if (releases_of(link) == Releases{}) return {};
    const Eigen::Matrix3Xd theta = rotations(index, mode);
    Eigen::Matrix3Xd own = Eigen::Matrix3Xd::Zero(3, 2);
    const Eigen::Matrix3d axes = axes_of(scene_, link);
    for (int end = 0; end < 2; ++end)
      for (int axis = 0; axis < 3; ++axis)
        if (const int freedom = freedoms_.released(index, end, axis); freedom >= 0)
          own.col(end) += axes.col(axis) * (rotations_(freedom - freedoms_.num_displacements(), mode) -
                                            axes.col(axis).dot(theta.col(end)));
    return own;
  }

 private:
  const Scene& scene_;
  const Freedoms& freedoms_;
  const Eigen::MatrixXd& shapes_;
  Eigen::MatrixXd rotations_;  // [1/m] (num_rotations x n)
};

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

// Geometric stiffness E_lu of pairs of modes under static responses. The stiffness from axial links (axial)
// is separate from the stiffness from all other links (bent) (THEORY X140).
struct PairStiffness {
  Eigen::MatrixXd axial, bent;  // (pairs x responses)
  // (pairs x responses) per rate of the responses, from dashpots and viscous links
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
  void finish(const Eigen::MatrixXd& responses) {
    flush();
    if (!held_.isZero(0.0)) stiffness_.axial += held_ * responses;
    if (!damped_.isZero(0.0)) stiffness_.axial_rate += damped_ * responses;
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

// returns E_lu = sum_links sum_k s_k h_k,lu   (THEORY X140)
// \param responses  [m] (n x responses) elastic coordinates that strain the links
// \param squared    indices into `pairs` for which SquareSums are computed
PairStiffness stiffness_of(const Scene& scene, const LinkFactor& factor, const Structure& structure,
                           const std::vector<Prestress::Pair>& pairs, const Eigen::MatrixXd& responses,
                           const std::vector<int>& squared) {
  PairStiffness stiffness{{}, {}, {}, {}, {}, {}, SquareSums(squared), SquareSums(squared)};
  stiffness.axial = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(pairs.size()), responses.cols());
  stiffness.bent = stiffness.axial_rate = stiffness.bent_rate = stiffness.axial;
  stiffness.axial_quartic = stiffness.bent_quartic = Eigen::VectorXd::Zero(stiffness.axial.rows());
  const Freedoms freedoms(scene);
  const LocalShapes local(scene, freedoms, factor, structure);
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
    const Eigen::MatrixXd added = h.transpose() * (forces * responses);
    if (damps || link.viscous > 0.0)
      (kind.is_axial ? stiffness.axial_rate : stiffness.bent_rate) += (damps ? 1.0 : link.viscous) * added;
    if (damps) continue;
    (kind.is_axial ? stiffness.axial : stiffness.bent) += added;
    (kind.is_axial ? stiffness.axial_quartic : stiffness.bent_quartic) += h.cwiseAbs2().transpose() * D;
    (kind.is_axial ? stiffness.axial_squares : stiffness.bent_squares).add(h, D);
  }
  axial.finish(responses);
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
  const Eigen::Index n = structure.omega.size();
  PairStiffness stiffness = stiffness_of(scene, factor, structure, prestress.pairs,
                                         Eigen::MatrixXd::Identity(n, n), shadowed_pairs(prestress));
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

// returns the stiffness E_lu due to the quasi-static internal forces under each follower load at amplitude 1
// (THEORY X145)
std::vector<FollowerStiffness> find_follower_stiffness(const Scene& scene, const LinkFactor& factor,
                                                       const Structure& structure) {
  assert(structure.shapes.cols() == structure.omega.size() && structure.shapes.rows() > 0);
  std::vector<FollowerStiffness> all;
  const auto n = static_cast<int>(structure.omega.size());
  const int num_modes = std::min(n, static_cast<int>(structure.mechanisms.size()) + kMostFollowed);
  std::vector<Prestress::Pair> pairs;
  for (int l = 0; l < num_modes; ++l)
    for (int u = l; u < num_modes; ++u) pairs.push_back({l, u});
  Eigen::VectorXd flexibility = Eigen::VectorXd::Zero(n);
  for (int l = 0; l < n; ++l)
    if (const double omega = structure.omega[l]; omega > 0.0)
      flexibility[l] = 1.0 / (structure.mass_properties.mass * omega * omega);
  Eigen::MatrixXd responses(n, 0);
  for (int load = 0; load < static_cast<int>(scene.loads.size()); ++load) {
    const Load& each = scene.loads[static_cast<std::size_t>(load)];
    if (each.axes != Axes::kLocal) continue;
    Eigen::VectorXd Q = Eigen::VectorXd::Zero(n);
    for (const PointLoad& force : each.forces)
      Q += structure.shapes.middleRows<3>(3 * Eigen::Index{force.point}).transpose() * force.force;
    responses.conservativeResize(n, responses.cols() + 1);
    responses.rightCols<1>() = flexibility.cwiseProduct(Q);
    all.push_back({load, {}, Eigen::MatrixXd(num_modes, num_modes), Eigen::MatrixXd(num_modes, num_modes)});
    for (int l = 0; l < num_modes; ++l) all.back().modes.push_back(l);
  }
  if (all.empty()) return all;
  const PairStiffness stiffness = stiffness_of(scene, factor, structure, pairs, responses, {});
  for (std::size_t k = 0; k < all.size(); ++k)
    for (std::size_t pair = 0; pair < pairs.size(); ++pair) {
      const auto [l, u] = pairs[pair];
      const auto row = static_cast<Eigen::Index>(pair), column = static_cast<Eigen::Index>(k);
      const double bent = stiffness.bent(row, column), total = bent + stiffness.axial(row, column);
      all[k].bent_rows(l, u) = all[k].bent_rows(u, l) = bent;
      all[k].rows(l, u) = all[k].rows(u, l) = total;
    }
  return all;
}

void rotate_follower_stiffness(const Eigen::MatrixXd& rotation, int first, FollowerStiffness& stiffness) {
  const auto begin = std::lower_bound(stiffness.modes.begin(), stiffness.modes.end(), first);
  const auto end = std::lower_bound(begin, stiffness.modes.end(), first + static_cast<int>(rotation.rows()));
  if (begin == end) return;
  // if the stiffness contains only some of the rotated modes, only the block of the rotation for these modes
  // is used
  const Eigen::Index at = begin - stiffness.modes.begin(), count = end - begin;
  for (Eigen::MatrixXd* rows : {&stiffness.rows, &stiffness.bent_rows}) {
    const Eigen::MatrixXd part = rotation.topLeftCorner(count, count);
    rows->middleCols(at, count) = (rows->middleCols(at, count) * part).eval();
    rows->middleRows(at, count) = (part.transpose() * rows->middleRows(at, count)).eval();
  }
}

void reduce_follower_stiffness(const std::vector<int>& kept, FollowerStiffness& stiffness) {
  std::vector<int> positions, modes;
  for (std::size_t k = 0; k < stiffness.modes.size(); ++k) {
    const auto found = std::lower_bound(kept.begin(), kept.end(), stiffness.modes[k]);
    if (found == kept.end() || *found != stiffness.modes[k]) continue;
    positions.push_back(static_cast<int>(k));
    modes.push_back(static_cast<int>(found - kept.begin()));
  }
  stiffness.rows = stiffness.rows(positions, positions).eval();
  stiffness.bent_rows = stiffness.bent_rows(positions, positions).eval();
  stiffness.modes = std::move(modes);
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
