#include "core/structure/prestress/load_stiffness.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "core/structure/modes/sparse/sparse_system.hpp"
#include "core/structure/prestress/local_shapes.hpp"
#include "core/structure/prestress/true_deformation.hpp"

namespace freeflex {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Number of modes with geometric stiffness due to loads. It decreases relative to the elastic stiffness of a
// mode as the square of the wavelength. With eleven bending modes in each plane, the frequencies of a free
// beam under an end thrust of 60 EI / L^2 have a relative error of 3e-5.
constexpr Index kMostStiffened = 24;
constexpr Index kMostWithMechanisms = 64;  // the plan has room for as many (PlanStiffening)
constexpr double kDifference = 1e-2;       // [-], [rad] step of differences of order 4
// [-] coordinates of links of one shape agree to this share of the span
constexpr double kSameShape = 1e-9;

// Second derivatives of the natural deformations of a link along its local motions y: the displacements of
// its points from the first one, then the rotations of its joints, then those of released ends, in local
// axes.
class Curvature {
 public:
  Curvature(const TrueLink& link, const Eigen::Matrix3d& axes, Index num_points, Index num_joints,
            bool has_own)
      : link_(link), axes_(axes), num_points_(num_points), num_joints_(num_joints), has_own_(has_own) {}

  // returns H_k (y x y) of each natural deformation k
  std::vector<MatrixXd> matrices(double span) const {
    const Index size = 3 * (num_points_ - 1) + 3 * num_joints_ + (has_own_ ? 6 : 0);
    std::vector<MatrixXd> H(index(link_.num_deformations()), MatrixXd::Zero(size, size));
    const auto along = [&](const VectorXd& y) {
      const auto even = [&](double h) {
        return (deformations(h * y, span) + deformations(-h * y, span)).eval();
      };
      return ((16.0 * even(kDifference) - even(2.0 * kDifference)) / (12.0 * kDifference * kDifference))
          .eval();
    };
    MatrixXd own(link_.num_deformations(), size);
    for (Index i = 0; i < size; ++i) own.col(i) = along(VectorXd::Unit(size, i));
    for (Index i = 0; i < size; ++i)
      for (Index j = i; j < size; ++j) {
        const VectorXd h = i == j ? VectorXd(own.col(i))
                                  : VectorXd(0.5 * (along(VectorXd::Unit(size, i) + VectorXd::Unit(size, j)) -
                                                    own.col(i) - own.col(j)));
        for (std::size_t k = 0; k < H.size(); ++k) H[k](i, j) = H[k](j, i) = h[static_cast<Index>(k)];
      }
    return H;
  }

 private:
  // y has displacements over the span
  VectorXd deformations(const VectorXd& y, double span) const {
    Eigen::Matrix3Xd V = Eigen::Matrix3Xd::Zero(3, num_points_), theta = V, own;
    for (Index k = 1; k < num_points_; ++k) V.col(k) = span * axes_ * y.segment<3>(3 * (k - 1));
    Index at = 3 * (num_points_ - 1);
    for (Index k = 0; k < num_joints_; ++k, at += 3) theta.col(k) = axes_ * y.segment<3>(at);
    if (has_own_) {
      own.resize(3, 2);
      for (Index k = 0; k < 2; ++k, at += 3) own.col(k) = axes_ * y.segment<3>(at);
    }
    return link_.deformations(V, theta, own);
  }
  const TrueLink& link_;
  Eigen::Matrix3d axes_;
  Index num_points_, num_joints_;
  bool has_own_;
};

// The local motions y of a link, and its natural forces.
struct LinkMotion {
  MatrixXd modes;   // (motions x modes)
  MatrixXd forces;  // [N], [N m] (deformations x loads) under the responses
};

// Sums y^T (sum_k s_k H_k) y over links for each reference load   (THEORY 8.50).
class StiffnessSums {
 public:
  StiffnessSums(Index num_modes, Index num_loads, bool uses_blas)
      : uses_blas_(uses_blas),
        motions_(MatrixXd::Zero(kRows, num_modes)),
        pulled_(index(num_loads), motions_),
        sums_(index(num_loads), MatrixXd::Zero(num_modes, num_modes)) {}

  void add(const LinkMotion& link, const std::vector<MatrixXd>& H) {
    const Index size = link.modes.rows();
    if (at_ + size > kRows) flush();
    motions_.middleRows(at_, size) = link.modes;
    MatrixXd K(size, size);
    for (std::size_t load = 0; load < pulled_.size(); ++load) {
      const auto column = static_cast<Index>(load);
      K.setZero();
      for (std::size_t k = 0; k < H.size(); ++k) K += link.forces(static_cast<Index>(k), column) * H[k];
      pulled_[load].middleRows(at_, size).noalias() = K * link.modes;
    }
    at_ += size;
  }
  std::vector<MatrixXd> finish() {
    flush();
    for (MatrixXd& sum : sums_) sum = (0.5 * (sum + sum.transpose())).eval();
    return std::move(sums_);
  }

 private:
  static constexpr Index kRows = 192;  // more rows would not fit into the caches
  void flush() {
    if (at_ == 0) return;
    for (std::size_t load = 0; load < pulled_.size(); ++load) {
      // BLAS is faster, but is loaded for large scenes only
      sums_[load] += uses_blas_ ? products(motions_, motions_.cols(), pulled_[load])
                                : MatrixXd(motions_.transpose() * pulled_[load]);
      pulled_[load].setZero();
    }
    motions_.setZero();
    at_ = 0;
  }
  bool uses_blas_;
  MatrixXd motions_;
  std::vector<MatrixXd> pulled_, sums_;
  Index at_ = 0;
};

// The local motions of links in the lowest modes and the natural forces of links under the reference loads.
class LinkMotions {
 public:
  LinkMotions(const Scene& scene, const LinkFactor& factor, const Structure& structure, Index num_modes,
              const StaticResponses& responses)
      : scene_(scene), factor_(factor), freedoms_(scene), num_modes_(num_modes) {
    shapes_.resize(structure.shapes.rows(), num_modes + responses.shapes.cols());
    shapes_ << structure.shapes.leftCols(num_modes), responses.shapes;
    if (responses.rotations.rows() > 0) {
      rotations_.resize(responses.rotations.rows(), shapes_.cols());
      rotations_ << structure.rotations.leftCols(num_modes), responses.rotations;
    }
    local_.emplace(scene, freedoms_, factor, shapes_, rotations_);
  }

  // adds the stiffness of a link, whose natural deformations are those of the rows of the factor
  void add(int at, StiffnessSums& sums) {
    const Link& link = scene_.links[index(at)];
    const RowRange range = factor_.natural_of[index(at)];
    LinkMotion motion;
    motion.forces.resize(range.count, shapes_.cols() - num_modes_);
    for (int k = 0; k < range.count; ++k) {
      const DeformationRow& row = natural_row(factor_, range, k);
      motion.forces.row(k) =
          row.root_stiffness * row.root_stiffness * local_->deformation(row).tail(motion.forces.cols());
    }
    if (!traits_of(link).is_axial) return add_bent(at, link, motion, sums);
    // h = (d . d - (u . d)^2) / L   (THEORY 8.54)
    const Vector3d span = span_of(scene_, link), u = span.stableNormalized();
    set_motions(
        3, [&](int mode) { return local_->displacements(link, mode).col(1).eval(); }, motion);
    sums.add(motion, {(Eigen::Matrix3d::Identity() - u * u.transpose()) / span.stableNorm()});
  }

 private:
  template <typename Function>
  void set_motions(Index size, const Function& motion_in, LinkMotion& motion) const {
    motion.modes.resize(size, num_modes_);
    for (Index l = 0; l < num_modes_; ++l) motion.modes.col(l) = motion_in(static_cast<int>(l));
  }

  void add_bent(int at, const Link& link, LinkMotion& motion, StiffnessSums& sums) {
    const TrueLink shape(scene_, at, freedoms_);
    const auto num_points = static_cast<Index>(link.points.size());
    const Index num_joints = traits_of(link).has_joint_rotations ? num_points : 0;
    const bool has_own = releases_of(link) != Releases{};
    Eigen::Matrix3Xd rest(3, num_points);
    for (Index k = 0; k < num_points; ++k)
      rest.col(k) = scene_.points[index(link.points[index(k)])].position -
                    scene_.points[index(link.points.front())].position;
    const Eigen::Matrix3d to_local = shape.axes().transpose();
    rest = (to_local * rest).eval();
    const double span = rest.colwise().norm().maxCoeff();
    std::vector<long long> key{static_cast<long long>(link.kind.index()), has_own ? at : -1};
    for (Index k = 3; k < rest.size(); ++k)
      key.push_back(std::llround(rest.data()[k] / (kSameShape * size(span))));
    key.push_back(std::ilogb(size(span)));
    auto& H = known_[key];
    if (H.empty()) H = Curvature(shape, shape.axes(), num_points, num_joints, has_own).matrices(span);
    const auto motion_in = [&](int mode) {
      VectorXd y(H.front().rows());
      Index row = 0;
      const auto put = [&](const Eigen::Matrix3Xd& vectors, Index first, double scale) {
        for (Index k = first; k < vectors.cols(); ++k, row += 3)
          y.segment<3>(row) = scale * (to_local * vectors.col(k));
      };
      put(local_->displacements(link, mode), 1, 1.0 / span);
      if (num_joints > 0) put(local_->rotations(at, mode), 0, 1.0);
      if (has_own) put(local_->own_rotations(at, mode), 0, 1.0);
      return y;
    };
    set_motions(H.front().rows(), motion_in, motion);
    sums.add(motion, H);
  }
  // the power of two below a length
  static double size(double span) { return std::ldexp(1.0, std::ilogb(span)); }

  const Scene& scene_;
  const LinkFactor& factor_;
  Freedoms freedoms_;
  Index num_modes_;
  MatrixXd shapes_, rotations_;  // of the lowest modes, then of the responses
  std::optional<LocalShapes> local_;
  std::map<std::vector<long long>, std::vector<MatrixXd>> known_;
};

}  // namespace

std::vector<LoadStiffness> find_load_stiffness(const Scene& scene, const LinkFactor& factor,
                                               const Structure& structure, const StaticResponses& responses) {
  std::vector<LoadStiffness> all;
  const Index num_modes =
      std::min({structure.omega.size(), static_cast<Index>(structure.mechanisms.size()) + kMostStiffened,
                kMostWithMechanisms});
  if (num_modes == 0 || responses.shapes.cols() == 0) return all;
  LinkMotions motions(scene, factor, structure, num_modes, responses);
  StiffnessSums sums(num_modes, responses.shapes.cols(), factor.is_sparse);
  for (int at = 0; at < static_cast<int>(scene.links.size()); ++at) {
    const LinkTraits kind = traits_of(scene.links[index(at)]);
    if (kind.effect == LinkEffect::kForbids || kind.effect == LinkEffect::kDamps || !kind.follows_points)
      continue;
    motions.add(at, sums);
  }
  std::vector<MatrixXd> rows = sums.finish();
  for (std::size_t k = 0; k < rows.size(); ++k) {
    LoadStiffness& each = all.emplace_back(LoadStiffness{responses.loads[k], {}, std::move(rows[k])});
    for (int l = 0; l < num_modes; ++l) each.modes.push_back(l);
  }
  return all;
}

void rotate_load_stiffness(const MatrixXd& rotation, int first, LoadStiffness& stiffness) {
  const auto begin = std::lower_bound(stiffness.modes.begin(), stiffness.modes.end(), first);
  const auto end = std::lower_bound(begin, stiffness.modes.end(), first + static_cast<int>(rotation.rows()));
  if (begin == end) return;
  // if the stiffness contains only some of the rotated modes, only the block of the rotation for these modes
  // is used
  const Index at = begin - stiffness.modes.begin(), count = end - begin;
  const MatrixXd part = rotation.topLeftCorner(count, count);
  MatrixXd& rows = stiffness.rows;
  rows.middleCols(at, count) = (rows.middleCols(at, count) * part).eval();
  rows.middleRows(at, count) = (part.transpose() * rows.middleRows(at, count)).eval();
}

void reduce_load_stiffness(const std::vector<int>& kept, LoadStiffness& stiffness) {
  std::vector<int> positions, modes;
  for (std::size_t k = 0; k < stiffness.modes.size(); ++k) {
    const auto found = std::lower_bound(kept.begin(), kept.end(), stiffness.modes[k]);
    if (found == kept.end() || *found != stiffness.modes[k]) continue;
    positions.push_back(static_cast<int>(k));
    modes.push_back(static_cast<int>(found - kept.begin()));
  }
  stiffness.rows = stiffness.rows(positions, positions).eval();
  stiffness.modes = std::move(modes);
}

}  // namespace freeflex
