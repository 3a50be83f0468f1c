#include "tests/support/transform.hpp"

#include <vector>

namespace freeflex::testing {
namespace {

Eigen::Quaterniond attitude_of(const Scene& scene) {
  const Eigen::Vector4d& q = scene.initial.attitude;
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
}

void set_attitude(Scene& scene, const Eigen::Quaterniond& q) {
  scene.initial.attitude = {q.w(), q.x(), q.y(), q.z()};
}

}  // namespace

Scene in_other_axes(const Scene& scene, const Eigen::Quaterniond& Q, const Eigen::Vector3d& t) {
  Scene result = scene;
  for (PointMass& point : result.points) point.position = Q * point.position + t;
  for (Link& link : result.links) {
    if (auto* beam = std::get_if<Beam>(&link.kind)) beam->y_axis = Q * beam->y_axis;
  }
  for (Load& load : result.loads) {
    if (load.axes == Axes::kWorld) continue;
    for (PointLoad& item : load.forces) item.force = Q * item.force;
    for (WrenchLoad& item : load.wrenches) item.force = Q * item.force, item.torque = Q * item.torque;
  }
  const Eigen::Quaterniond attitude = attitude_of(scene) * Q.conjugate();
  set_attitude(result, attitude);
  result.initial.position = scene.initial.position - attitude * t;
  result.initial.angular_velocity = Q * scene.initial.angular_velocity;
  for (Feedback& feedback : result.feedbacks)
    for (Eigen::Matrix3d* gain :
         {&feedback.displacement_gain, &feedback.velocity_gain, &feedback.acceleration_gain})
      *gain = Q * *gain * Q.conjugate().toRotationMatrix();
  for (Initial::PointElastic& item : result.initial.points) {
    item.displacement = Q * item.displacement;
    item.velocity = Q * item.velocity;
  }
  return result;
}

Scene in_rotated_world(const Scene& scene, const Eigen::Quaterniond& Q) {
  Scene result = scene;
  for (Load& load : result.loads) {
    if (load.axes != Axes::kWorld) continue;
    for (PointLoad& item : load.forces) item.force = Q * item.force;
    for (WrenchLoad& item : load.wrenches) item.force = Q * item.force, item.torque = Q * item.torque;
  }
  result.gravity = Q * scene.gravity;
  result.initial.position = Q * scene.initial.position;
  result.initial.velocity = Q * scene.initial.velocity;
  set_attitude(result, Q * attitude_of(scene));
  return result;
}

Scene renumbered(const Scene& scene, std::span<const int> points, std::span<const int> links) {
  Scene result = scene;
  std::vector<int> number(points.size());  // new number of each old point
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto old = static_cast<std::size_t>(points[i]);
    result.points[i] = scene.points[old];
    number[old] = static_cast<int>(i);
  }
  const auto renumber = [&number](int& point) {
    if (point >= 0) point = number[static_cast<std::size_t>(point)];
  };
  for (std::size_t i = 0; i < links.size(); ++i) {
    result.links[i] = scene.links[static_cast<std::size_t>(links[i])];
    for (int& point : result.links[i].points) renumber(point);
  }
  for (Group& group : result.groups) {
    for (int& point : group.points) renumber(point);
  }
  for (Load& load : result.loads) {
    for (PointLoad& item : load.forces) renumber(item.point);
  }
  for (Feedback& feedback : result.feedbacks) {
    renumber(feedback.point);
    renumber(feedback.sensor);
  }
  for (Initial::PointElastic& item : result.initial.points) renumber(item.point);
  return result;
}

}  // namespace freeflex::testing
