#include "core/structure/links/link_factor.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "core/limits.hpp"
#include "core/rounding.hpp"
#include "core/scene/bodies.hpp"
#include "core/structure/links/superelement.hpp"
#include "core/structure/modes/dense/decompositions.hpp"
#include "core/structure/modes/dense/null_space.hpp"

namespace freeflex {

Eigen::MatrixXd dense_rows(const DeformationRows& rows, Eigen::Index num_columns, bool unit) {
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows.size()), num_columns);
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (const auto& [freedom, coefficient] : rows[i].coefficients)
      dense(static_cast<Eigen::Index>(i), freedom) +=
          coefficient * (unit ? rows[i].unit_scale : rows[i].root_stiffness);
  return dense;
}

Eigen::MatrixXd rows_times(const DeformationRows& rows, const Eigen::MatrixXd& columns) {
  Eigen::MatrixXd product = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows.size()), columns.cols());
  for (std::size_t i = 0; i < rows.size() && columns.cols() > 0; ++i)
    for (const auto& [freedom, coefficient] : rows[i].coefficients)
      product.row(static_cast<Eigen::Index>(i)) +=
          coefficient * rows[i].root_stiffness * columns.row(freedom);
  return product;
}

int hub_of(const Scene& scene, const Link& link) {
  for (const int point : link.points)
    if (has_attitude(scene.points[index(point)])) return point;
  return -1;
}

namespace {

DeformationRows natural_rows(const Scene& scene, int link_index, const Freedoms& freedoms,
                             MatrixLimits& limits, Faults& faults) {
  const Link& link = scene.links[index(link_index)];
  using Rows = DeformationRows;
  const auto axial = [&] { return Rows{axial_row(scene, link, axial_of(scene, link).stiffness)}; };
  return std::visit(Cases{
                        [&](const Spring&) { return axial(); },
                        [&](const Bar&) { return axial(); },
                        [&](const Beam&) { return beam_rows(scene, link_index, freedoms); },
                        [&](const MatrixLink& matrix) {
                          return is_superelement(matrix)
                                     ? superelement_rows(scene, link_index, freedoms, limits, faults)
                                     : matrix_rows(scene, link, link_index, limits, faults);
                        },
                        [&](const BendingSpring&) { return bending_rows(scene, link); },
                        [&](const TorsionSpring&) { return torsion_rows(scene, link); },
                        [&](const Plate&) { return plate_rows(scene, link, freedoms); },
                        [](const Rigid&) { return Rows{}; },
                        [](const Dashpot&) { return Rows{}; },
                    },
                    link.kind);
}

// Rotations of joints on rigid bodies: theta = J^-1 sum d_k x V_k over the points of the body (THEORY 3.43).
// If these points are on a line, theta_par e_par is added, where theta_par is an additional freedom
// (THEORY 3.44).
class BodyRotations {
 public:
  BodyRotations(const Scene& scene, const Freedoms& freedoms)
      : num_displacements_(freedoms.num_displacements()) {
    for (int point = 0; point < static_cast<int>(scene.points.size()); ++point) {
      const int body = freedoms.body_of(point);
      if (body < 0 || !freedoms.has_joint(point)) continue;
      if (rotations_.count(body) == 0) rotations_[body] = rotation_of_body(scene, freedoms, body);
      body_of_joint_.emplace(freedoms.rotation(point), body);
    }
  }

  void substitute(DeformationRow& row) const {
    if (rotations_.empty()) return;
    std::vector<std::pair<int, double>> kept;
    for (const auto& [freedom, coefficient] : row.coefficients) {
      const auto found = freedom < num_displacements_ ? body_of_joint_.end() : find(freedom);
      if (found == body_of_joint_.end()) {
        kept.emplace_back(freedom, coefficient);
        continue;
      }
      const Rotation& rotation = rotations_.at(found->second);
      for (const auto& [part, weight] : rotation[index(freedom - found->first)])
        kept.emplace_back(part, coefficient * weight);
    }
    row.coefficients = std::move(kept);
  }

 private:
  // coefficients of freedoms for each component of a rotation
  using Rotation = std::array<std::vector<std::pair<int, double>>, 3>;

  static Rotation rotation_of_body(const Scene& scene, const Freedoms& freedoms, int body) {
    const std::vector<int>& points = scene.links[index(body)].points;
    const Eigen::MatrixXd share = body_rotation(scene, points);
    const Eigen::Vector3d line = line_of(scene, points);
    Rotation rotation;
    for (Eigen::Index component = 0; component < 3; ++component) {
      auto& parts = rotation[index(component)];
      for (std::size_t k = 0; k < points.size(); ++k)
        for (int axis = 0; axis < 3; ++axis)
          parts.emplace_back(3 * points[k] + axis, share(component, 3 * static_cast<Eigen::Index>(k) + axis));
      if (freedoms.about_line(body) >= 0) parts.emplace_back(freedoms.about_line(body), line[component]);
    }
    return rotation;
  }

  // returns the joint to which a rotation belongs if a body determines the rotation, else end()
  std::map<int, int>::const_iterator find(int freedom) const {
    auto after = body_of_joint_.upper_bound(freedom);
    if (after == body_of_joint_.begin()) return body_of_joint_.end();
    --after;
    return freedom < after->first + 3 ? after : body_of_joint_.end();
  }

  int num_displacements_;
  std::map<int, Rotation> rotations_;  // body -> rotation
  std::map<int, int> body_of_joint_;   // first rotation of the joint -> body
};

// Warns of each redundant rigid link. A rigid link is redundant if one of its rows is a linear combination of
// the rows that are kept   (THEORY 3.42)
void warn_of_redundant_links(const Scene& scene, const Eigen::ColPivHouseholderQR<Eigen::MatrixXd>& qr,
                             const std::vector<int>& link_of, Faults& faults) {
  constexpr double kTakesPart = 1e-6;  // [-] fraction of a unit row: smaller coefficients are rounding errors
  const Eigen::Index rank = qr.rank(), num_redundant = qr.cols() - rank;
  if (num_redundant == 0) return;
  const Eigen::MatrixXd shares = qr.matrixR()
                                     .topLeftCorner(rank, rank)
                                     .triangularView<Eigen::Upper>()
                                     .solve(qr.matrixR().topRightCorner(rank, num_redundant));
  const auto link_at = [&](Eigen::Index column) {
    return link_of[index(qr.colsPermutation().indices()[column])];
  };
  const auto name = [&](int link) { return called(scene.links[index(link)], link); };
  // link -> number of its redundant rows, and the links that forbid the same motions
  std::map<int, std::pair<int, std::set<int>>> redundant;
  for (Eigen::Index k = 0; k < num_redundant; ++k) {
    auto& [count, others] = redundant[link_at(rank + k)];
    ++count;
    for (Eigen::Index column = 0; column < rank; ++column)
      if (std::abs(shares(column, k)) > kTakesPart && link_at(column) != link_at(rank + k))
        others.insert(link_at(column));
  }
  for (const auto& [link, found] : redundant) {
    std::string others;
    for (const int other : found.second) others += (others.empty() ? "" : ", ") + name(other);
    add_warning(
        faults, scene.links[index(link)].origin,
        join_text("rigid link ", name(link), " is redundant, because ",
                  found.first == 1 ? "a freedom that it removes"
                                   : join_text(found.first, " freedoms that it removes"),
                  found.first == 1 ? " is" : " are", " removed by ", others,
                  " already. The motion is the same without it, but the distribution of forces among these "
                  "links is undetermined"));
  }
}

// sets the independent constraints C V = 0 by column-pivoted QR   (THEORY 3.42, 4.5) and warns of redundant
// links
void set_constraints(const Scene& scene, const Freedoms& freedoms, double rounding, LinkFactor& factor,
                     Faults& faults) {
  DeformationRows all;
  std::vector<int> link_of;
  for (std::size_t i = 0; i < scene.links.size(); ++i) {
    if (!is_rigid(scene.links[i])) continue;
    const DeformationRows rows = rigid_rows(scene, scene.links[i], freedoms);
    all.insert(all.end(), rows.begin(), rows.end());
    link_of.insert(link_of.end(), rows.size(), static_cast<int>(i));
  }
  const Eigen::Index num_columns =
      are_point_masses(scene) ? freedoms.num_displacements() : freedoms.num_all();
  factor.constraints.resize(0, num_columns);
  if (all.empty()) return;
  for (DeformationRow& row : all) row.unit_scale = 1.0;
  Eigen::MatrixXd rows = dense_rows(all, num_columns, true);
  rows.rowwise().normalize();
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(rows.transpose());
  qr.setThreshold(4.0 * static_cast<double>(num_columns) * rounding);
  const Eigen::Index rank = qr.rank();
  std::vector<int> kept;
  for (Eigen::Index k = 0; k < rank; ++k) kept.push_back(static_cast<int>(qr.colsPermutation().indices()[k]));
  warn_of_redundant_links(scene, qr, link_of, faults);
  std::sort(kept.begin(), kept.end());
  factor.constraints = rows(kept, Eigen::all);
  for (const int row : kept) factor.constraint_link.push_back(link_of[index(row)]);
}

Eigen::MatrixXd stack(const Eigen::MatrixXd& upper, const Eigen::MatrixXd& lower) {
  Eigen::MatrixXd both(upper.rows() + lower.rows(), upper.cols());
  both << upper, lower;
  return both;
}

// Returns the damping rows A_d = (sqrt(c_d) B_d; sqrt(tau) A_link)   (THEORY 3.47) of dashpots and viscous
// links. The tension of a dashpot is c_d u . (V_2' - V_1')   (THEORY 3.45), and the forces of a viscous link
// are s = D (e + tau e') (THEORY 3.46). The dissipation function is V'^T A_d^T A_d V' / 2   (THEORY 3.48).
DeformationRows damping_deformations(const Scene& scene, const LinkFactor& factor) {
  DeformationRows rows;
  for (std::size_t i = 0; i < scene.links.size(); ++i) {
    const Link& link = scene.links[i];
    if (traits_of(link).effect == LinkEffect::kDamps)
      rows.push_back(axial_row(scene, link, axial_of(scene, link).damping));
    if (link.viscous == 0.0) continue;
    const RowRange range = factor.natural_of[i];
    for (int k = range.first; k < range.first + range.count; ++k) {
      rows.push_back(factor.natural[index(k)]);
      rows.back().root_stiffness *= std::sqrt(link.viscous);
    }
  }
  return rows;
}

// constraints of all rigid links as unit rows, and the link of each row
struct Forbidden {
  DeformationRows rows;
  std::vector<int> link_of;
};
Forbidden forbidden_by(const Scene& scene, const Freedoms& freedoms) {
  Forbidden all;
  for (std::size_t i = 0; i < scene.links.size(); ++i) {
    if (!is_rigid(scene.links[i])) continue;
    const DeformationRows rows = rigid_rows(scene, scene.links[i], freedoms);
    all.rows.insert(all.rows.end(), rows.begin(), rows.end());
    all.link_of.insert(all.link_of.end(), rows.size(), static_cast<int>(i));
  }
  for (DeformationRow& row : all.rows) {
    row.root_stiffness = row.unit_scale = 1.0;
    double square = 0.0;
    for (const auto& [freedom, coefficient] : row.coefficients) square += coefficient * coefficient;
    for (auto& [freedom, coefficient] : row.coefficients) coefficient /= std::sqrt(square);
  }
  return all;
}

// returns the sets of rows that shared freedoms join; rows of two different sets have no freedom in common
std::vector<std::vector<int>> joined_sets(const DeformationRows& rows, int num_freedoms) {
  std::vector<int> parent(index(num_freedoms));
  for (int k = 0; k < num_freedoms; ++k) parent[index(k)] = k;
  const auto root = [&](int k) {
    while (parent[index(k)] != k) k = parent[index(k)] = parent[static_cast<std::size_t>(parent[index(k)])];
    return k;
  };
  for (const DeformationRow& row : rows)
    for (const auto& [freedom, coefficient] : row.coefficients)
      parent[index(root(freedom))] = root(row.coefficients.front().first);
  std::map<int, std::vector<int>> sets;
  for (std::size_t k = 0; k < rows.size(); ++k)
    sets[root(rows[k].coefficients.front().first)].push_back(static_cast<int>(k));
  std::vector<std::vector<int>> all;
  all.reserve(sets.size());
  for (auto& [first, set] : sets) all.push_back(std::move(set));
  return all;
}

// adds the independent rows of a set of constraints to `kept` and warns of redundant links   (THEORY 3.42)
void keep_independent(const Scene& scene, const Forbidden& all, const std::vector<int>& set, double threshold,
                      std::vector<int>& kept, Faults& faults) {
  std::map<int, int> column_of;
  for (const int k : set)
    for (const auto& [freedom, coefficient] : all.rows[index(k)].coefficients)
      column_of.emplace(freedom, static_cast<int>(column_of.size()));
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(set.size()),
                                               static_cast<Eigen::Index>(column_of.size()));
  std::vector<int> link_of;
  for (std::size_t k = 0; k < set.size(); ++k) {
    const auto at = index(set[k]);
    for (const auto& [freedom, coefficient] : all.rows[at].coefficients)
      rows(static_cast<Eigen::Index>(k), column_of.at(freedom)) += coefficient;
    link_of.push_back(all.link_of[at]);
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(rows.transpose());
  qr.setThreshold(threshold);
  for (Eigen::Index k = 0; k < qr.rank(); ++k) kept.push_back(set[index(qr.colsPermutation().indices()[k])]);
  warn_of_redundant_links(scene, qr, link_of, faults);
}

}  // namespace

Freedoms::Freedoms(const Scene& scene) : num_displacements_(3 * static_cast<int>(scene.points.size())) {
  for (const Link& link : scene.links)
    if (traits_of(link).has_joint_rotations)
      joints_.insert(joints_.end(), link.points.begin(), link.points.end());
  for (std::size_t point = 0; point < scene.points.size(); ++point)
    if (has_attitude(scene.points[point])) joints_.push_back(static_cast<int>(point));
  std::sort(joints_.begin(), joints_.end());
  joints_.erase(std::unique(joints_.begin(), joints_.end()), joints_.end());
  add_releases(scene);
  add_bodies(scene);
  for (int i = 0; i < static_cast<int>(scene.links.size()); ++i) {
    const int of_link = freeflex::num_inner(scene.links[index(i)]);
    if (of_link == 0) continue;
    inner_.emplace(i, num_all());
    num_inner_ += of_link;
  }
}

void Freedoms::add_releases(const Scene& scene) {
  const int first = num_all();
  int next = first;
  for (std::size_t i = 0; i < scene.links.size(); ++i) {
    const Releases releases = releases_of(scene.links[i]);
    if (releases == Releases{}) continue;
    std::array<int, 6> none{};
    none.fill(-1);
    if (released_.empty()) released_.resize(scene.links.size(), none);
    for (std::size_t end = 0; end < 2; ++end)
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (releases[end][axis]) released_[i][3 * end + axis] = next++;
  }
  num_released_ = next - first;
}

void Freedoms::add_bodies(const Scene& scene) {
  std::vector<int> on_line;
  for (int i = 0; i < static_cast<int>(scene.links.size()); ++i) {
    const Link& link = scene.links[index(i)];
    if (!is_body(link) || hub_of(scene, link) >= 0) continue;
    if (!line_of(scene, link.points).isZero(0.0))
      on_line.push_back(i);
    else
      for (const int point : link.points) body_of_.emplace(point, i);  // keeps the first body in the list
  }
  for (const int body : on_line) {
    bool rotates_joint = false;
    for (const int point : scene.links[index(body)].points)
      rotates_joint = (body_of_.emplace(point, body).second && has_joint(point)) || rotates_joint;
    if (rotates_joint) about_line_.emplace(body, num_all());
  }
}

int Freedoms::body_of(int point) const {
  const auto found = body_of_.find(point);
  return found == body_of_.end() ? -1 : found->second;
}

int Freedoms::about_line(int link) const {
  const auto found = about_line_.find(link);
  return found == about_line_.end() ? -1 : found->second;
}

bool Freedoms::has_joint(int point) const {
  return std::binary_search(joints_.begin(), joints_.end(), point);
}

int Freedoms::rotation(int point) const {
  assert(has_joint(point));
  const auto joint = std::lower_bound(joints_.begin(), joints_.end(), point) - joints_.begin();
  return num_displacements_ + 3 * static_cast<int>(joint);
}

// eps max(1, max |coordinate| / length of the shortest link)   (THEORY 4.5)
double direction_rounding(const Scene& scene) {
  double largest = 0.0;
  for (const PointMass& point : scene.points)
    largest = std::max(largest, point.position.cwiseAbs().maxCoeff());
  double shortest = std::numeric_limits<double>::infinity();
  for (const Link& link : scene.links) {
    if (!traits_of(link).follows_points) continue;
    const auto length = [&](std::size_t from, std::size_t to) {
      return (scene.points[index(link.points[to])].position - scene.points[index(link.points[from])].position)
          .stableNorm();
    };
    // the length of a rigid body is its size, because some of its points may coincide
    if (is_body(link)) {
      double size = 0.0;
      for (std::size_t k = 1; k < link.points.size(); ++k) size = std::max(size, length(0, k));
      shortest = std::min(shortest, size);
    } else {
      for (std::size_t k = 1; k < link.points.size(); ++k) shortest = std::min(shortest, length(k - 1, k));
    }
  }
  return kEpsilon * std::max(1.0, largest / shortest);
}

namespace {

// Sets the natural deformations of all links. Returns the rows of links that act on displacements only, then
// the rows of all other links
std::pair<DeformationRows, DeformationRows> set_natural(const Scene& scene, const Freedoms& freedoms,
                                                        LinkFactor& factor, Faults& faults) {
  const BodyRotations bodies(scene, freedoms);
  factor.num_freedoms = freedoms.num_all();
  DeformationRows direct, with_rotations;
  for (std::size_t i = 0; i < scene.links.size(); ++i) {
    DeformationRows rows = natural_rows(scene, static_cast<int>(i), freedoms, factor.matrices, faults);
    factor.natural_of.push_back({static_cast<int>(factor.natural.size()), static_cast<int>(rows.size())});
    for (DeformationRow& row : rows) {
      bodies.substitute(row);
      (traits_of(scene.links[i]).has_joint_rotations ? with_rotations : direct).push_back(row);
      factor.natural.push_back(std::move(row));
    }
  }
  return {std::move(direct), std::move(with_rotations)};
}

}  // namespace

// K = A^T A, A = sqrt(D) B   (THEORY 3.2), with e = B V the rows of `natural`   (THEORY 3.1)
LinkFactor factor_links(const Scene& scene, bool with_recovery, Faults& faults) {
  LinkFactor factor;
  const Freedoms freedoms(scene);
  const auto [direct, with_rotations] = set_natural(scene, freedoms, factor, faults);
  set_constraints(scene, freedoms, direction_rounding(scene), factor, faults);
  factor.damping_rows = dense_rows(damping_deformations(scene, factor),
                                   3 * static_cast<Eigen::Index>(scene.points.size()), false);
  const Eigen::Index num_displacements = freedoms.num_displacements();
  if (!are_point_masses(scene)) {  // rows are condensed when modes are computed (THEORY 16.7)
    factor.rows.resize(0, num_displacements);
    return factor;
  }
  factor.rows = dense_rows(direct, num_displacements, false);
  factor.unit_rows = dense_rows(direct, num_displacements, true);
  if (with_rotations.empty()) return factor;

  // Rotations are condensed   (THEORY 3.21, 3.22). The rank of the columns of rotations depends on geometry
  // only, so it is computed from unit rows
  const Condensed unit =
      condense(dense_rows(with_rotations, factor.num_freedoms, true), num_displacements, -1, false);
  Condensed condensed = condense(dense_rows(with_rotations, factor.num_freedoms, false), num_displacements,
                                 unit.rank, with_recovery);
  factor.rows = stack(factor.rows, condensed.rows);
  factor.unit_rows = stack(factor.unit_rows, unit.rows);
  factor.recovery = std::move(condensed.recovery);
  return factor;
}

Eigen::MatrixXd scaled_rotations(const Eigen::MatrixXd& motions, int num_rotations,
                                 const Eigen::VectorXd& factors) {
  // if there are no columns, Eigen would form an invalid pointer
  if (motions.cols() == 0) return Eigen::MatrixXd(num_rotations, 0);
  return motions.bottomRows(num_rotations) * factors.asDiagonal();
}

void rotate_with_bodies(const Scene& scene, const Freedoms& freedoms, DeformationRows& rows) {
  const BodyRotations bodies(scene, freedoms);
  for (DeformationRow& row : rows) bodies.substitute(row);
}

LinkFactor factor_links_sparse(const Scene& scene, Faults& faults) {
  LinkFactor factor;
  factor.is_sparse = true;
  const Freedoms freedoms(scene);
  set_natural(scene, freedoms, factor, faults);
  factor.damping = damping_deformations(scene, factor);
  const Forbidden all = forbidden_by(scene, freedoms);
  const double threshold = 4.0 * direction_rounding(scene);
  std::vector<int> kept;
  for (const std::vector<int>& set : joined_sets(all.rows, freedoms.num_all())) {
    if (set.size() > std::size_t{kMostJoinedConstraints}) {
      const int link = all.link_of[index(set.front())];
      add_error(faults, scene.links[index(link)].origin,
                join_text("rigid link ", called(scene.links[index(link)], link),
                          " and the rigid links joined to it impose ", set.size(),
                          " constraints together, but at most ", kMostJoinedConstraints,
                          " can be handled in a scene of this size; replace them by one point with "
                          "inertia, or by stiff beams"));
      continue;
    }
    keep_independent(scene, all, set, threshold * static_cast<double>(3 * set.size()), kept, faults);
  }
  std::sort(kept.begin(), kept.end());
  for (const int row : kept) {
    factor.constraint_rows.push_back(all.rows[index(row)]);
    factor.constraint_link.push_back(all.link_of[index(row)]);
  }
  return factor;
}

// s = D e   (THEORY 5.2)
Eigen::MatrixXd natural_forces(const LinkFactor& factor, int link) {
  const RowRange range = factor.natural_of[index(link)];
  const Eigen::Index num_displacements = factor.rows.cols();
  Eigen::MatrixXd forces = Eigen::MatrixXd::Zero(range.count, num_displacements);
  for (int k = 0; k < range.count; ++k) {
    const DeformationRow& row = natural_row(factor, range, k);
    for (const auto& [freedom, coefficient] : row.coefficients) {
      if (freedom < num_displacements)
        forces(k, freedom) += coefficient;
      else
        forces.row(k) += coefficient * factor.recovery.row(freedom - num_displacements);
    }
    forces.row(k) *= row.root_stiffness * row.root_stiffness;
  }
  return forces;
}

Eigen::MatrixXd natural_forces(const LinkFactor& factor, const Structure& structure, int link) {
  if (structure.rotations.rows() == 0 && !factor.is_sparse)
    return natural_forces(factor, link) * structure.shapes;
  const RowRange range = factor.natural_of[index(link)];
  const Eigen::Index num_displacements = structure.shapes.rows();
  Eigen::MatrixXd forces = Eigen::MatrixXd::Zero(range.count, structure.shapes.cols());
  if (forces.cols() == 0) return forces;
  for (int k = 0; k < range.count; ++k) {
    const DeformationRow& row = natural_row(factor, range, k);
    for (const auto& [freedom, coefficient] : row.coefficients)
      forces.row(k) +=
          coefficient * (freedom < num_displacements ? structure.shapes.row(freedom)
                                                     : structure.rotations.row(freedom - num_displacements));
    forces.row(k) *= row.root_stiffness * row.root_stiffness;
  }
  return forces;
}

}  // namespace freeflex
