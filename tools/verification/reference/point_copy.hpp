// Replaces bodies with inertia by point masses on rigid links, so that a system of points has their motion
// (THEORY 10.29).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/faults.hpp"
#include "core/scene/scene.hpp"

namespace freeflex {

/// A point mass that the copy adds to a scene, at a constant arm from the point of its body.
struct CarriedPoint {
  int point = -1;                                 // point of the body
  Eigen::Vector3d arm = Eigen::Vector3d::Zero();  // [m] from this point, scene axes
};

struct PointCopy {
  Scene scene;  // without inertia, wheels and torques; its first points are those of the scene
  std::vector<CarriedPoint> carried;  // the other points, in their order
};

/// Returns whether a scene has bodies with inertia or wheels.
bool has_bodies(const Scene& scene);

/// Makes the copy of a scene. Each body with inertia, and each massless point on a rigid link with it, gets a
/// small part of the mass of the body. Four point masses on the same rigid link have the rest, so that mass,
/// centre of mass and inertia are those of the body   (THEORY 10.29). Returns nullopt and sets `why` for
/// bodies whose inertia is that of a line or a point, bodies on two rigid links, wrenches on groups with such
/// bodies, and initial displacements.
std::optional<PointCopy> copy_bodies(const Scene& scene, Fault& why);

}  // namespace freeflex
