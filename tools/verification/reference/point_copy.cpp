#include "tools/verification/reference/point_copy.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "core/scene/bodies.hpp"
#include "core/scene/link_kinds.hpp"

namespace freeflex {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Solver = Eigen::SelfAdjointEigenSolver<Matrix3d>;

/// Returns the body that remains if each of some points takes `part` [kg] of its mass. Positions are relative
/// to the point of the body   (THEORY 10.29):
///   m' = m - sum part,   m' c' = m c - sum part x,   Pi' = Pi + m c c^T - sum part x x^T - m' c' c'^T
PointMass without_parts(const PointMass& body, const std::vector<Vector3d>& points, double part) {
  PointMass rest = body;
  rest.mass -= part * static_cast<double>(points.size());
  Vector3d first = body.mass * body.offset;
  Matrix3d second = second_moment(body) + body.mass * body.offset * body.offset.transpose();
  for (const Vector3d& x : points) {
    first -= part * x;
    second -= part * x * x.transpose();
  }
  rest.offset = first / rest.mass;
  second -= rest.mass * rest.offset * rest.offset.transpose();
  rest.inertia = second.trace() * Matrix3d::Identity() - second;
  return rest;
}

class Copier {
 public:
  explicit Copier(const Scene& scene) : given_(scene) {
    copy_.scene = scene;
    copy_.scene.wheels.clear();
    for (Load& load : copy_.scene.loads) load.torques.clear(), load.wheels.clear();
  }

  std::optional<PointCopy> make(Fault& why) {
    for (int i = 0; i < static_cast<int>(given_.points.size()) && !fault_; ++i)
      if (has_attitude(given_.points[index(i)])) add(i);
    if (!fault_) check_loads();
    if (!fault_) return std::move(copy_);
    why = *fault_;
    return std::nullopt;
  }

 private:
  std::string called_point(int point) const {
    return "point " + quoted(given_.points[index(point)].name, point);
  }
  void refuse(const Origin& origin, std::string message) {
    fault_ = Fault{Fault::Severity::kError, origin, std::move(message)};
  }
  void refuse(int point, const char* cause) {
    refuse(given_.points[index(point)].origin, called_point(point) + cause);
  }

  /// Returns the rigid link of a body, to which the copy adds one if there is none. Returns nullptr and sets
  /// the fault if there are two.
  Link* rigid_link_of(int point) {
    Link* found = nullptr;
    for (Link& link : copy_.scene.links) {
      if (!is_rigid(link) || !std::ranges::count(link.points, point)) continue;
      if (found != nullptr) {
        refuse(point,
               " has inertia and is on two rigid links, but the reference takes one; join them in one link");
        return nullptr;
      }
      found = &link;
    }
    if (found != nullptr) return found;
    Link link;
    link.kind = Rigid{};
    link.points = {point};
    copy_.scene.links.push_back(link);
    return &copy_.scene.links.back();
  }

  void add(int point) {
    constexpr double kThin = 1e-9;  // [-] second moment across a thin body, over the largest
    const PointMass& body = given_.points[index(point)];
    const Vector3d moments = Solver(second_moment(body)).eigenvalues();
    if (moments[1] <= kThin * moments[2] || moments[2] <= 0.0) {
      refuse(point,
             " has inertia about two axes only or none with an offset, but the reference needs inertia about "
             "three; give it inertia about three axes, where 1e-3 of the largest is enough for the third");
      return;
    }
    Link* link = rigid_link_of(point);
    if (link == nullptr) return;
    std::vector<int> members{point};
    for (const int other : link->points)
      if (other != point && copy_.scene.points[index(other)].mass == 0.0 &&
          !has_attitude(given_.points[index(other)]))
        members.push_back(other);
    std::vector<Vector3d> at;
    at.reserve(members.size());
    for (const int member : members) at.push_back(given_.points[index(member)].position - body.position);
    split(point, members, at, *link);
  }

  /// Finds the largest parts of the mass for which the rest is a body, and adds the rest as four points.
  void split(int point, const std::vector<int>& members, const std::vector<Vector3d>& at, Link& link) {
    constexpr double kFlat = 1e-12, kLeft = 0.3;  // [-]
    constexpr int kMost = 40;                     // halvings
    const PointMass& body = given_.points[index(point)];
    const Vector3d whole = Solver(second_moment(body)).eigenvalues();
    double part = 0.1 * body.mass / static_cast<double>(members.size());
    for (int k = 0; k < kMost; ++k, part *= 0.5) {
      const PointMass rest = without_parts(body, at, part);
      const double least = Solver(second_moment(rest)).eigenvalues()[0];
      if (least < kLeft * whole[0] - kFlat * whole[2]) continue;
      for (const int member : members) {
        PointMass& to = copy_.scene.points[index(member)];
        to.mass = part;
        to.offset.setZero();
        to.inertia.setZero();
      }
      for (const Vector3d& arm : corners_of(rest)) {
        PointMass particle;
        particle.mass = 0.25 * rest.mass;
        particle.position = body.position + arm;
        link.points.push_back(static_cast<int>(copy_.scene.points.size()));
        copy_.scene.points.push_back(particle);
        copy_.carried.push_back({point, arm});
      }
      return;
    }
    refuse(point,
           " has the inertia of a flat body, but a point on the body lies outside of its plane; give the "
           "body inertia across the plane");
  }

  void check_loads() {
    if (!given_.initial.points.empty())
      refuse(
          Origin{},
          "initial.points gives displacements, which the reference takes for point masses only; start from "
          "rest and push");
    for (const Load& load : given_.loads)
      for (const WrenchLoad& wrench : load.wrenches)
        for (const int point : given_.groups[index(wrench.group)].points)
          if (has_attitude(given_.points[index(point)]) || given_.points[index(point)].mass == 0.0)
            refuse(load.origin, "load " + quoted(load.name, 0) + " is a wrench on a group with " +
                                    called_point(point) +
                                    ", which the reference takes for point masses only; use a force and a "
                                    "torque on the body");
  }

  const Scene& given_;
  PointCopy copy_;
  std::optional<Fault> fault_;
};

}  // namespace

bool has_bodies(const Scene& scene) {
  return !scene.wheels.empty() || std::ranges::any_of(scene.points, has_attitude);
}

std::optional<PointCopy> copy_bodies(const Scene& scene, Fault& why) { return Copier(scene).make(why); }

}  // namespace freeflex
