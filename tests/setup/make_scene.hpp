// One-line helpers that build scenes. Header only.
#pragma once

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/plan/make_plan.hpp"
#include "core/structure/structure.hpp"

namespace freeflex::testing {

inline int add_point(Scene& scene, double mass, const Eigen::Vector3d& position) {
  PointMass point;
  point.name = std::string("p") + std::to_string(scene.points.size());
  point.mass = mass;
  point.position = position;
  scene.points.push_back(point);
  return static_cast<int>(scene.points.size()) - 1;
}

inline int add_link(Scene& scene, std::vector<int> points, const LinkKind& kind) {
  Link link;
  link.name = std::string("l") + std::to_string(scene.links.size());
  link.points = std::move(points);
  link.kind = kind;
  scene.links.push_back(link);
  return static_cast<int>(scene.links.size()) - 1;
}
inline int add_link(Scene& scene, int first, int second, const LinkKind& kind) {
  return add_link(scene, {first, second}, kind);
}

inline void join_all(Scene& scene, double stiffness) {
  for (int i = 0; i < static_cast<int>(scene.points.size()); ++i)
    for (int j = 0; j < i; ++j) add_link(scene, i, j, Spring{stiffness});
}

/// Returns the structure of a scene. An error in the scene fails the test.
inline Structure build(const Scene& scene, Faults* warnings = nullptr) {
  Faults faults;
  const auto structure = build_structure(scene, faults);
  for (const Fault& fault : faults)
    if (fault.severity == Fault::Severity::kError) ADD_FAILURE() << fault.message;
  if (warnings != nullptr) *warnings = faults;
  return structure ? *structure : Structure{};
}

/// Returns the full plan of a scene. An error in the scene fails the test.
inline Plan compile(const Scene& scene, Faults* warnings = nullptr) {
  Faults faults;
  const Structure structure = build(scene);
  const auto plan = make_full_plan(scene, structure, scene.fidelity, faults);
  for (const Fault& fault : faults)
    if (fault.severity == Fault::Severity::kError) ADD_FAILURE() << fault.message;
  if (warnings != nullptr) *warnings = faults;
  return plan.value_or(Plan{});
}

inline Eigen::VectorXd masses(const Scene& scene) {
  Eigen::VectorXd mass(3 * static_cast<Eigen::Index>(scene.points.size()));
  for (Eigen::Index i = 0; i < mass.size(); ++i) mass[i] = scene.points[static_cast<std::size_t>(i / 3)].mass;
  return mass;
}

/// Returns a free beam of length 1 along x with EI = rho A = 1 and half masses at its ends. The axial and
/// torsional frequencies of the beam are far above the bending frequencies.
inline Scene lumped_beam(int num_points) {
  Scene scene;
  const int num_spans = num_points - 1;
  for (int i = 0; i < num_points; ++i) {
    const bool is_end = i == 0 || i == num_spans;
    add_point(scene, (is_end ? 0.5 : 1.0) / num_spans, {static_cast<double>(i) / num_spans, 0.0, 0.0});
  }
  for (int i = 0; i < num_spans; ++i) add_link(scene, i, i + 1, Beam{1e8, 1e8, 1.0, 1.0, {0.0, 1.0, 0.0}});
  return scene;
}

}  // namespace freeflex::testing
