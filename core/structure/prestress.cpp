#include "core/structure/prestress.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/structure/link_factor.hpp"
#include "core/structure/true_deformation.hpp"

namespace freeflex {
namespace {

// [-] of the span, [rad]: a displacement so large that its square is far above rounding, so small that its
// fourth power is nothing
constexpr double kAmplitude = 1e-3;

// Modes that are judged one by one: the lowest. What prestress adds is of the size of slopes squared and
// falls against the stiffness of higher ones.
constexpr int kMostModes = 48;
constexpr double kNear = 0.05;  // [-] frequencies of a pair differ by at most this
constexpr int kMostPartners = 2;

// Modes that the internal forces of follower loads stiffen: on a free beam under end thrust frequencies come
// within 1e-4 with eight.
constexpr int kMostFollowed = 24;

// X147: omega_l + omega_u and omega_v differ by at most this share. Further off, the answer is at most five
// times the static one.
constexpr double kResonant = 0.1;
constexpr int kMostMixed = 12;  // of the lowest modes, l and u may differ
constexpr std::size_t kMostResonances = 128;

std::vector<Resonance> choose_resonances(const Structure& structure, int num_modes) {
  const auto first = static_cast<int>(structure.mechanisms.size());
  const Eigen::VectorXd& omega = structure.omega;
  std::vector<Resonance> all;
  for (int v = first; v < num_modes; ++v)
    for (int l = first; l < v; ++l)
      for (int u = l; u < v && all.size() < kMostResonances; ++u)
        if ((l == u || v < first + kMostMixed) &&
            std::abs(omega[l] + omega[u] - omega[v]) <= kResonant * omega[v])
          all.push_back({{l, u, v}});
  return all;
}

std::vector<Prestress::Pair> choose_pairs(const Structure& structure, int& num_modes) {
  const auto num_mechanisms = static_cast<int>(structure.mechanisms.size());
  const auto n = static_cast<int>(structure.omega.size());
  num_modes = std::min(n, num_mechanisms + kMostModes);
  std::vector<Prestress::Pair> pairs;
  for (int l = 0; l < num_modes; ++l) pairs.push_back({l, l});
  for (int l = num_mechanisms; l < num_modes; ++l)
    for (int u = l + 1; u < std::min(num_modes, l + 1 + kMostPartners); ++u)
      if (structure.omega[u] - structure.omega[l] <= kNear * structure.omega[u]) pairs.push_back({l, u});
  return pairs;
}

// The freedoms of one link in every mode: displacements of its points, rotations of the joints at its ends.
class LocalShapes {
 public:
  LocalShapes(const Scene& scene, const Freedoms& freedoms, const LinkFactor& factor,
              const Structure& structure)
      : scene_(scene), freedoms_(freedoms), shapes_(structure.shapes) {
    if (factor.recovery.rows() > 0) turns_ = factor.recovery * shapes_;
    // a joint on a rigid body turns with it   (X64)
    for (int point = 0; point < static_cast<int>(scene.points.size()); ++point) {
      const int body = freedoms.body_of(point);
      if (body < 0 || !freedoms.has_joint(point)) continue;
      const std::vector<int>& points = scene.links[static_cast<std::size_t>(body)].points;
      const Eigen::MatrixXd share = body_rotation(scene, points);
      Eigen::MatrixXd turn = Eigen::MatrixXd::Zero(3, shapes_.cols());
      for (std::size_t k = 0; k < points.size(); ++k)
        turn += share.middleCols<3>(3 * static_cast<Eigen::Index>(k)) *
                shapes_.middleRows<3>(3 * Eigen::Index{points[k]});
      if (const int about = freedoms.about_line(body); about >= 0)
        turn += line_of(scene, points) * turns_.row(about - freedoms.num_displacements());
      turns_.middleRows<3>(freedoms.rotation(point) - freedoms.num_displacements()) = turn;
    }
  }

  // freedoms of rows, those of rigid bodies put in already
  Eigen::RowVectorXd deformation(const DeformationRow& row) const {
    Eigen::RowVectorXd e = Eigen::RowVectorXd::Zero(shapes_.cols());
    for (const auto& [freedom, coefficient] : row.coefficients)
      e += coefficient * (freedom < freedoms_.num_displacements()
                              ? shapes_.row(freedom)
                              : turns_.row(freedom - freedoms_.num_displacements()));
    return e;
  }

  Eigen::Matrix3Xd displacements(const Link& link, int mode) const {
    Eigen::Matrix3Xd V(3, static_cast<Eigen::Index>(link.points.size()));
    for (Eigen::Index k = 0; k < V.cols(); ++k)
      V.col(k) = shapes_.block<3, 1>(3 * Eigen::Index{link.points[static_cast<std::size_t>(k)]}, mode);
    V.colwise() -= Eigen::Vector3d(V.col(0));
    return V;
  }

  Eigen::Matrix3Xd rotations(int index, int mode) const {
    const Link& link = scene_.links[static_cast<std::size_t>(index)];
    Eigen::Matrix3Xd theta = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(link.points.size()));
    if (!traits_of(link).turns_joints) return theta;
    const int before = freedoms_.num_displacements();
    for (Eigen::Index k = 0; k < theta.cols(); ++k)
      theta.col(k) =
          turns_.block<3, 1>(freedoms_.rotation(link.points[static_cast<std::size_t>(k)]) - before, mode);
    const auto* beam = std::get_if<Beam>(&link.kind);
    if (beam == nullptr) return theta;
    // an end turns by its own where the joint does not hold it
    const Eigen::Matrix3d axes = beam_axes(span_of(scene_, link), beam->y_axis);
    for (int end = 0; end < 2; ++end)
      for (int axis = 0; axis < 3; ++axis)
        if (const int own = freedoms_.released(index, end, axis); own >= 0)
          theta.col(end) +=
              axes.col(axis) * (turns_(own - before, mode) - axes.col(axis).dot(theta.col(end)));
    return theta;
  }

 private:
  const Scene& scene_;
  const Freedoms& freedoms_;
  const Eigen::MatrixXd& shapes_;
  Eigen::MatrixXd turns_;  // [1/m] (num_rotations x n)
};

// second derivative of the natural deformations along a displacement
Eigen::VectorXd second_order(const TrueLink& link, double span, const Eigen::Matrix3Xd& V,
                             const Eigen::Matrix3Xd& theta) {
  const double size = std::max(V.colwise().norm().maxCoeff() / span, theta.colwise().norm().maxCoeff());
  if (size == 0.0) return Eigen::VectorXd::Zero(link.num_deformations());
  const double scale = kAmplitude / size;
  return (link.deformations(scale * V, scale * theta) + link.deformations(-scale * V, -scale * theta)) /
         (scale * scale);
}

}  // namespace

namespace {

// second order of the natural deformations of one link along pairs of modes, each found once
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
  // h_lu of X140
  const Eigen::VectorXd& of(int l, int u) {
    const auto found = known_.find({l, u});
    if (found != known_.end()) return found->second;
    Eigen::VectorXd h;
    if (l == u) {
      h = second_order(true_, span_, local_.displacements(link_, l), local_.rotations(index_, l));
    } else {
      const Eigen::Matrix3Xd V = local_.displacements(link_, l) + local_.displacements(link_, u),
                             theta = local_.rotations(index_, l) + local_.rotations(index_, u);
      h = 0.5 * (second_order(true_, span_, V, theta) - of(l, l) - of(u, u));
    }
    return known_[{l, u}] = std::move(h);
  }

 private:
  const Link& link_;
  TrueLink true_;
  const LocalShapes& local_;
  int index_;
  double span_ = 0.0;
  std::map<Prestress::Pair, Eigen::VectorXd> known_;
};

// E of pairs under static answers, without axial links and with them; h_lu of X140 a column a pair
struct PairStiffness {
  Eigen::MatrixXd axial, bent;                  // (pairs x answers)
  Eigen::VectorXd axial_quartic, bent_quartic;  // sum D h_lu^2, [N/m^3] (pairs)
  bool has_unseen = false;
};

// \param answers  [m] (n x answers) elastic coordinates that strain the links
PairStiffness stiffness_of(const Scene& scene, const LinkFactor& factor, const Structure& structure,
                           const std::vector<Prestress::Pair>& pairs, const Eigen::MatrixXd& answers,
                           std::vector<Resonance>& resonances) {
  PairStiffness stiffness;
  stiffness.axial = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(pairs.size()), answers.cols());
  stiffness.bent = stiffness.axial;
  stiffness.axial_quartic = stiffness.bent_quartic = Eigen::VectorXd::Zero(stiffness.axial.rows());
  const Freedoms freedoms(scene);
  const LocalShapes local(scene, freedoms, factor, structure);
  for (int index = 0; index < static_cast<int>(scene.links.size()); ++index) {
    const LinkTraits kind = traits_of(scene.links[static_cast<std::size_t>(index)]);
    if (kind.effect == LinkEffect::kDamps) continue;
    if (kind.effect == LinkEffect::kForbids || !kind.follows_points) {
      stiffness.has_unseen = true;
      continue;
    }
    // a triangle's own bow is not in it
    stiffness.has_unseen = stiffness.has_unseen ||
                           std::holds_alternative<Plate>(scene.links[static_cast<std::size_t>(index)].kind);
    const RowRange range = factor.natural_of[static_cast<std::size_t>(index)];
    Eigen::MatrixXd forces(range.count, structure.omega.size());
    Eigen::VectorXd D(range.count);
    for (int k = 0; k < range.count; ++k) {
      const DeformationRow& row = natural_row(factor, range, k);
      D[k] = row.root_stiffness * row.root_stiffness;
      forces.row(k) = D[k] * local.deformation(row);
    }
    SecondOrders second(scene, index, freedoms, local);
    Eigen::MatrixXd h(second.size(), static_cast<Eigen::Index>(pairs.size()));
    for (Eigen::Index pair = 0; pair < h.cols(); ++pair) {
      const auto [l, u] = pairs[static_cast<std::size_t>(pair)];
      h.col(pair) = second.of(l, u);
    }
    (kind.is_axial ? stiffness.axial : stiffness.bent).noalias() += h.transpose() * (forces * answers);
    (kind.is_axial ? stiffness.axial_quartic : stiffness.bent_quartic) += h.cwiseAbs2().transpose() * D;
    for (Resonance& resonance : resonances) {
      const auto [l, u, v] = resonance.modes;
      double gamma = forces.col(v).dot(second.of(l, u)) + forces.col(l).dot(second.of(u, v)) +
                     forces.col(u).dot(second.of(l, v));
      if (l == u) gamma *= 0.5;
      resonance.gamma += gamma;
      if (!kind.is_axial) resonance.bent_gamma += gamma;
    }
  }
  return stiffness;
}

// X146: what is left when all other modes give way to the forces of second order
Eigen::VectorXd root_quartic(const Structure& structure, const Eigen::VectorXd& held,
                             const Eigen::MatrixXd& rows, int num_modes) {
  Eigen::VectorXd root(num_modes);
  for (Eigen::Index l = 0; l < num_modes; ++l) {
    double left = held[l];
    for (Eigen::Index v = 0; v < structure.omega.size(); ++v)
      if (const double c = structure.mass_properties.mass * structure.omega[v] * structure.omega[v];
          v != l && c > 0.0)
        left -= rows(l, v) * rows(l, v) / c;
    root[l] = std::sqrt(std::max(0.0, 0.5 * left));
  }
  return root;
}

}  // namespace

Prestress find_prestress(const Scene& scene, const LinkFactor& factor, const Structure& structure) {
  Prestress prestress;
  prestress.pairs = choose_pairs(structure, prestress.num_modes);
  const Eigen::Index n = structure.omega.size();
  prestress.resonances = choose_resonances(structure, prestress.num_modes);
  PairStiffness stiffness = stiffness_of(scene, factor, structure, prestress.pairs,
                                         Eigen::MatrixXd::Identity(n, n), prestress.resonances);
  prestress.has_unseen = stiffness.has_unseen;
  prestress.rows = stiffness.axial + stiffness.bent;
  prestress.bent_rows = std::move(stiffness.bent);
  prestress.root_quartic = root_quartic(structure, stiffness.axial_quartic + stiffness.bent_quartic,
                                        prestress.rows, prestress.num_modes);
  prestress.bent_root_quartic =
      root_quartic(structure, stiffness.bent_quartic, prestress.bent_rows, prestress.num_modes);
  return prestress;
}

std::vector<FollowerStiffness> find_follower_stiffness(const Scene& scene, const LinkFactor& factor,
                                                       const Structure& structure) {
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
  Eigen::MatrixXd answers(n, 0);
  for (int load = 0; load < static_cast<int>(scene.loads.size()); ++load) {
    const Load& each = scene.loads[static_cast<std::size_t>(load)];
    if (each.axes != Axes::kLocal) continue;
    Eigen::VectorXd Q = Eigen::VectorXd::Zero(n);
    for (const PointLoad& force : each.forces)
      Q += structure.shapes.middleRows<3>(3 * Eigen::Index{force.point}).transpose() * force.force;
    answers.conservativeResize(n, answers.cols() + 1);
    answers.rightCols<1>() = flexibility.cwiseProduct(Q);
    all.push_back({load, {}, Eigen::MatrixXd(num_modes, num_modes), Eigen::MatrixXd(num_modes, num_modes)});
    for (int l = 0; l < num_modes; ++l) all.back().modes.push_back(l);
  }
  if (all.empty()) return all;
  std::vector<Resonance> none;
  const PairStiffness stiffness = stiffness_of(scene, factor, structure, pairs, answers, none);
  for (std::size_t k = 0; k < all.size(); ++k)
    for (std::size_t pair = 0; pair < pairs.size(); ++pair) {
      const auto [l, u] = pairs[pair];
      const auto row = static_cast<Eigen::Index>(pair), column = static_cast<Eigen::Index>(k);
      const double bent = stiffness.bent(row, column), whole = bent + stiffness.axial(row, column);
      all[k].bent_rows(l, u) = all[k].bent_rows(u, l) = bent;
      all[k].rows(l, u) = all[k].rows(u, l) = whole;
    }
  return all;
}

void turn_follower_stiffness(const Eigen::MatrixXd& turn, int first, FollowerStiffness& stiffness) {
  const auto begin = std::lower_bound(stiffness.modes.begin(), stiffness.modes.end(), first);
  const auto end = std::lower_bound(begin, stiffness.modes.end(), first + static_cast<int>(turn.rows()));
  if (begin == end) return;
  // of modes that are there in part, only their own part
  const Eigen::Index at = begin - stiffness.modes.begin(), count = end - begin;
  for (Eigen::MatrixXd* rows : {&stiffness.rows, &stiffness.bent_rows}) {
    const Eigen::MatrixXd part = turn.topLeftCorner(count, count);
    rows->middleCols(at, count) = (rows->middleCols(at, count) * part).eval();
    rows->middleRows(at, count) = (part.transpose() * rows->middleRows(at, count)).eval();
  }
}

void reduce_follower_stiffness(const std::vector<int>& kept, FollowerStiffness& stiffness) {
  std::vector<int> places, modes;
  for (std::size_t k = 0; k < stiffness.modes.size(); ++k) {
    const auto found = std::lower_bound(kept.begin(), kept.end(), stiffness.modes[k]);
    if (found == kept.end() || *found != stiffness.modes[k]) continue;
    places.push_back(static_cast<int>(k));
    modes.push_back(static_cast<int>(found - kept.begin()));
  }
  stiffness.rows = stiffness.rows(places, places).eval();
  stiffness.bent_rows = stiffness.bent_rows(places, places).eval();
  stiffness.modes = std::move(modes);
}

namespace {

// modes of the cluster swing alike, so each may have all that its fellows have together
void bound_resonances(int first, int count, std::vector<Resonance>& resonances) {
  const auto place = [&](int mode) { return mode >= first && mode < first + count ? first : mode; };
  const std::vector<Resonance> before = resonances;
  for (Resonance& to : resonances) {
    double square = 0.0, bent_square = 0.0;
    for (const Resonance& from : before) {
      bool is_alike = true;
      for (std::size_t k = 0; k < 3; ++k) is_alike = is_alike && place(from.modes[k]) == place(to.modes[k]);
      if (!is_alike) continue;
      square += from.gamma * from.gamma;
      bent_square += from.bent_gamma * from.bent_gamma;
    }
    if (std::any_of(to.modes.begin(), to.modes.end(),
                    [&](int mode) { return mode >= first && mode < first + count; }))
      to.gamma = std::sqrt(square), to.bent_gamma = std::sqrt(bent_square);
  }
}

}  // namespace

void turn_prestress(const Eigen::MatrixXd& turn, int first, Prestress& prestress) {
  const auto count = static_cast<int>(turn.rows());
  // of any mode of their space, at most that
  for (Eigen::VectorXd* root : {&prestress.root_quartic, &prestress.bent_root_quartic}) {
    const Eigen::Index num_judged = std::clamp<Eigen::Index>(root->size() - first, 0, count);
    if (num_judged > 0)
      root->segment(first, num_judged).setConstant(root->segment(first, num_judged).maxCoeff());
  }
  bound_resonances(first, count, prestress.resonances);
  for (Eigen::MatrixXd* rows : {&prestress.rows, &prestress.bent_rows}) {
    rows->middleCols(first, count) = (rows->middleCols(first, count) * turn).eval();
    // E <- turn^T E turn over the pairs that are there
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
                    (has_l ? turn(a - first, l - first) : 1.0) * (has_u ? turn(b - first, u - first) : 1.0));
    }
  }
}

}  // namespace freeflex
