#include "core/structure/masses/rigid_bodies.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <numeric>

#include "core/scene/bodies.hpp"
#include "core/scene/link_kinds.hpp"

namespace freeflex {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

// [-] A body whose smallest moment of inertia is below this share of the largest has no inertia about an
// axis.
constexpr double kThin = 1e-9;

// Returns whether a point has a rotation of its own that moves mass: with an attitude, or at the end of a
// mass matrix.
bool turns_with(const ResolvedScene& resolved, std::size_t point) {
  return resolved.has_attitude[point] || resolved.has_rotary_mass[point];
}

bool is_damped(const Scene& scene) {
  const Damping& damping = scene.damping;
  return damping.modal_ratio > 0.0 || !damping.mode_ratios.empty() || damping.alpha > 0.0 ||
         damping.beta > 0.0 || std::ranges::any_of(scene.links, [](const Link& link) {
           return traits_of(link).effect == LinkEffect::kDamps || link.viscous > 0.0 ||
                  link.loss_factor > 0.0;
         });
}

// Sets of points that turn as one body. Points with an attitude are sets of their own until a rigid link
// joins them to others. A point without attitude that rigid links of several sets share is a ball joint, and
// belongs to each of them   (THEORY 12.123).
class Sets {
 public:
  Sets(const Scene& scene, const ResolvedScene& resolved, Faults& faults)
      : parent_(scene.points.size() + scene.links.size()), links_of_(scene.points.size()) {
    std::iota(parent_.begin(), parent_.end(), 0);
    const int num_points = static_cast<int>(scene.points.size());
    for (int k = 0; k < static_cast<int>(scene.links.size()); ++k)
      if (is_rigid(scene.links[index(k)]))
        for (const int point : scene.links[index(k)].points) links_of_[index(point)].push_back(k);
    for (int k = 0; k < static_cast<int>(scene.links.size()); ++k) {
      const Link& link = scene.links[index(k)];
      if (!is_rigid(link)) continue;
      // a link whose points are all joints has a set without a point of its own
      const auto is_own = [&](int point) { return !may_be_joint(resolved, point); };
      const auto own = std::ranges::find_if(link.points, is_own);
      const int first = own == link.points.end() ? num_points + k : *own;
      parent_[index(root(num_points + k))] = root(first);
      for (const int point : link.points)
        if (is_own(point)) parent_[index(root(point))] = root(first);
    }
    for (int i = 0; i < num_points; ++i) add_point(scene, resolved, i, num_points, faults);
  }

  const std::map<int, std::vector<int>>& all() const { return sets_; }
  // Returns the number of sets that a point belongs to.
  int count(int point) const {
    if (links_of_[index(point)].size() < 2) return 1;
    int count = 0;
    for (const auto& [root, points] : sets_) count += std::ranges::binary_search(points, point) ? 1 : 0;
    return count;
  }

 private:
  bool may_be_joint(const ResolvedScene& resolved, int point) const {
    return links_of_[index(point)].size() > 1 && !resolved.has_attitude[index(point)];
  }
  void add_point(const Scene& scene, const ResolvedScene& resolved, int point, int num_points,
                 Faults& faults) {
    if (!may_be_joint(resolved, point)) {
      if (turns_with(resolved, index(point)) || !links_of_[index(point)].empty())
        sets_[root(point)].push_back(point);
      return;
    }
    std::vector<int> roots;
    for (const int k : links_of_[index(point)])
      if (std::ranges::find(roots, root(num_points + k)) == roots.end())
        roots.push_back(root(num_points + k));
    for (const int each : roots) sets_[each].push_back(point);
    if (roots.size() > 1 && (resolved.have_links_mass() || resolved.has_rotary_mass[index(point)]))
      refuse(scene, point,
             "which cannot be combined with mass matrices or links that have spread mass; "
             "add lumped: true to these links",
             faults);
    if (roots.size() > 1 && is_damped(scene))
      refuse(scene, point,
             "which cannot be combined with dashpots or damping of links or modes; take these out", faults);
    if (roots.size() > 1 && !scene.feedbacks.empty())
      refuse(scene, point, "which cannot be combined with feedback; take the feedback out", faults);
  }
  void refuse(const Scene& scene, int point, const std::string& cause, Faults& faults) const {
    const std::vector<int>& links = links_of_[index(point)];
    const Link &one = scene.links[index(links[0])], &other = scene.links[index(links[1])];
    add_error(
        faults, other.origin,
        join_text("rigid links ", called(one, links[0]), " and ", called(other, links[1]), " share point ",
                  quoted(scene.points[index(point)].name, point), ", a ball joint, ", cause,
                  ", give the point inertia, which joins the links to one body, or set fidelity: "
                  "coupled or a lower rung"));
  }
  int root(int i) const {
    while (parent_[index(i)] != i) i = parent_[index(i)];
    return i;
  }
  std::vector<int> parent_;
  std::vector<std::vector<int>> links_of_;  // rigid links of each point
  std::map<int, std::vector<int>> sets_;
};

// (3 x n) elastic rotation of a body per coordinate: that of its first point with an attitude, otherwise that
// which fits its points best.
MatrixXd rotation_of(const Scene& scene, const Structure& structure, const Freedoms& freedoms,
                     const std::vector<int>& points) {
  for (const int point : points)
    if (turns_with(structure.resolved, index(point)))
      return structure.rotations.middleRows<3>(freedoms.rotation(point) - freedoms.num_displacements());
  const MatrixXd weights = body_rotation(scene, points);
  MatrixXd rotation = MatrixXd::Zero(3, structure.shapes.cols());
  for (std::size_t k = 0; k < points.size(); ++k)
    rotation += weights.middleCols<3>(3 * static_cast<Eigen::Index>(k)) *
                structure.shapes.middleRows<3>(3 * Eigen::Index{points[k]});
  return rotation;
}

// Returns why a body without inertia about an axis is no rod, with the remedy, or an empty text. The roll of
// a rod moves nothing and turns nothing   (THEORY 12.118).
std::string thin_refusal(const Scene& scene, const Structure& structure, const RigidBody& body,
                         const Vector3d& moments) {
  if (!(moments[1] > kThin * moments[2]))
    return ", so no equation determines its rotation; give mass to a second point of it";
  const Freedoms freedoms(scene);
  for (const int point : body.points) {
    const std::string who = join_text("point ", quoted(scene.points[index(point)].name, point));
    if (structure.resolved.has_attitude[index(point)])
      return join_text(" through its centre of mass, but ", who,
                       " has inertia or an offset, so its attitude would need an equation about this axis; "
                       "give it inertia about this axis, of which 1e-3 of the largest is enough");
    if (body.points.size() > 2 && freedoms.has_joint(point))
      return join_text(", and it turns the beam or plate at ", who,
                       ", so no equation determines its rotation about the line of its points; add a point "
                       "with mass off the line");
  }
  if (line_of(scene, body.points).isZero(0.0))
    return ", the line of its masses, but has a point beside this line, so no equation determines its "
           "rotation about the line; give mass to that point, of which 1e-3 of the largest is enough";
  if (structure.resolved.have_links_mass())
    return ", which cannot be combined with links that have spread mass; add lumped: true to these links";
  return {};
}

// Returns the bodies of the mass matrices whose only point is among the given ones. They turn with it
// (THEORY 12.121). Their offsets are from the centre of mass of the structure.
std::vector<PointMass> matrices_on(const Scene& scene, const Structure& structure,
                                   const std::vector<int>& points) {
  std::vector<PointMass> bodies;
  for (const Link& link : scene.links) {
    if (!moves_with_its_point(link) || !std::ranges::binary_search(points, link.points.front())) continue;
    bodies.push_back(rigid_body_of(scene, link));
    bodies.back().offset += structure.mass_properties.r.col(link.points.front());
  }
  return bodies;
}

// Adds an error if rigid links join an end of a mass matrix to point masses on one line. Such a link is a rod
// (THEORY 12.118), about whose ends it does not turn, but the end is a body.
void refuse_rod_at_end(const Scene& scene, const Structure& structure, const std::vector<int>& points,
                       int end, Faults& faults) {
  const auto has_attitude = [&](int i) { return bool{structure.resolved.has_attitude[index(i)]}; };
  if (points.size() < 2 || std::ranges::any_of(points, has_attitude) || line_of(scene, points).isZero(0.0))
    return;
  add_error(
      faults, scene.points[index(end)].origin,
      join_text("point ", quoted(scene.points[index(end)].name, end),
                " is an end of a mass matrix and of a rigid link whose points are on one line, which this "
                "fidelity does not support; use a stiff bar in place of the rigid link, add a point "
                "beside the line to it, or set fidelity: coupled or a lower rung"));
}

// Returns the body of a set of points.
RigidBody body_of(const Scene& scene, const Structure& structure, const Sets& sets,
                  const std::vector<int>& points, Faults& faults) {
  std::vector<PointMass> parts = matrices_on(scene, structure, points);
  for (const int point : points) {
    parts.push_back(scene.points[index(point)]);
    parts.back().offset = structure.mass_properties.centres.col(point);
    // the bodies of a ball joint share its mass
    if (const int count = sets.count(point); count > 1) parts.back().mass /= count;
  }
  RigidBody body;
  body.points = points;
  for (const PointMass& part : parts) {
    body.mass += part.mass;
    body.centre += part.mass * part.offset;
  }
  if (body.mass > 0.0)
    body.centre /= body.mass;
  else
    body.centre = structure.mass_properties.r.col(points.front());
  for (const PointMass& part : parts) {
    const Vector3d d = part.offset - body.centre;
    body.inertia += part.inertia + part.mass * (d.squaredNorm() * Matrix3d::Identity() - d * d.transpose());
  }
  // a mass matrix has the inertia of its ends
  if (const auto end = std::ranges::find_if(
          points, [&](int i) { return bool{structure.resolved.has_rotary_mass[index(i)]}; });
      end != points.end()) {
    refuse_rod_at_end(scene, structure, points, *end, faults);
    return body;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(body.inertia);
  const Vector3d& moments = eigen.eigenvalues();
  if (body.mass > 0.0 && moments[0] > kThin * moments[2]) return body;
  if (const std::string cause = thin_refusal(scene, structure, body, moments); !cause.empty()) {
    add_error(
        faults, scene.points[index(points.front())].origin,
        join_text("the body at point ", quoted(scene.points[index(points.front())].name, points.front()),
                  " has no inertia about ",
                  moments[1] > kThin * moments[2] ? "one axis" : "its centre of mass", cause,
                  ", or set fidelity: coupled or a lower rung"));
    return body;
  }
  body.line = (structure.mass_properties.centres.col(points.back()) -
               structure.mass_properties.centres.col(points.front()))
                  .stableNormalized();
  const Matrix3d across = Matrix3d::Identity() - body.line * body.line.transpose();
  body.inertia = 0.5 * (moments[1] + moments[2]) * across;
  return body;
}

}  // namespace

int num_ball_joints(const Scene& scene, const Structure& structure) {
  Faults faults;
  const Sets sets(scene, structure.resolved, faults);
  int count = 0;
  for (int point = 0; point < static_cast<int>(scene.points.size()); ++point)
    count += std::max(0, sets.count(point) - 1);
  return count;
}

std::vector<RigidBody> rigid_bodies(const Scene& scene, const Structure& structure, Faults& faults) {
  std::vector<RigidBody> bodies;
  const Sets sets(scene, structure.resolved, faults);
  if (has_error(faults)) return bodies;
  for (const auto& [root, points] : sets.all())
    bodies.push_back(body_of(scene, structure, sets, points, faults));
  if (has_error(faults)) return bodies;
  // a beam or plate at a ball joint is turned by a body, but it would be open by which
  const Freedoms freedoms(scene);
  for (const RigidBody& body : bodies)
    for (const int point : body.points)
      if (sets.count(point) > 1 && freedoms.has_joint(point) && body.line.isZero(0.0)) {
        add_error(
            faults, scene.points[index(point)].origin,
            join_text("point ", quoted(scene.points[index(point)].name, point),
                      " is a ball joint of rigid links and turns a beam or plate, which this fidelity does "
                      "not support; join the beam or plate to another point of the link that shall turn "
                      "it, give the point inertia, which joins the links to one body, or set fidelity: "
                      "coupled or a lower rung"));
        return bodies;
      }
  return bodies;
}

MatrixXd motions_of(const Scene& scene, const Structure& structure, const Freedoms& freedoms,
                    const RigidBody& body) {
  MatrixXd motions(6, structure.shapes.cols());
  motions.bottomRows<3>() = rotation_of(scene, structure, freedoms, body.points);
  motions.bottomRows<3>() -= body.line * (body.line.transpose() * motions.bottomRows<3>()).eval();
  const int first = body.points.front();
  const Vector3d arm = body.centre - structure.mass_properties.r.col(first);
  motions.topRows<3>() = structure.shapes.middleRows<3>(3 * Eigen::Index{first});
  for (Eigen::Index l = 0; l < motions.cols(); ++l)
    motions.col(l).head<3>() += Vector3d(motions.col(l).tail<3>()).cross(arm);
  return motions;
}

}  // namespace freeflex
