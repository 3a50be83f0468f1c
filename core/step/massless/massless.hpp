// Points without mass that links hold. Their displacements are unknowns of least energy beside the rotations
// of joints   (THEORY 12.115 to 12.117).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/index.hpp"
#include "core/step/plan/coupled.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

struct StepPlan;

/// Holds a point without mass.
struct MasslessPoint {
  std::int32_t point = -1;  // index into StepPlan::points
  double length = 0.0;      // [m] least rest distance to another point of its links, the unit of its unknowns
  bool operator==(const MasslessPoint&) const = default;
};
/// Holds the motion of a massless point in a state.
struct MasslessMotion : MasslessPoint {
  Vec3 V{};       // [m] displacement from its rest position, body axes
  Vec3 v{}, a{};  // [m/s], [m/s^2] relative to the centre of mass of the structure, axes of the frame
  bool operator==(const MasslessMotion&) const = default;
};
/// Returns the motion of a point if it is massless, otherwise nullptr.
inline const MasslessMotion* find_massless(std::span<const MasslessMotion> all, std::int32_t point) noexcept {
  for (const MasslessMotion& each : all)
    if (each.point == point) return &each;
  return nullptr;
}
/// Returns whether a point of a plan has no mass, belongs to no body, and has a displacement of least energy.
bool is_massless(const StepPlan& plan, std::size_t point) noexcept;
/// Returns the massless points of a plan at true geometry, in the order of the points.
std::vector<MasslessPoint> find_massless_points(const StepPlan& plan);

struct MasslessPoints;
/// Returns the massless points of a plan with their work arrays.
MasslessPoints make_massless_points(const StepPlan& plan);

/// Holds what the equilibrium of massless points needs.
struct MasslessPoints {
  std::vector<MasslessPoint> points;
  std::vector<std::int32_t> of_points;  // (num_points) index into `points`, -1: has mass; empty without any
  std::vector<Vec3> load;               // [N] (points) loads, body axes
  std::vector<Vec3> force;              // [N] (num_points) of links, in a sweep; empty without any
  std::vector<Vec3> probed;             // [m] (num_points) displacements for differences of forces
  bool empty() const noexcept { return points.empty(); }
  /// Returns the number of a massless point, or -1.
  std::int32_t number(std::int32_t point) const noexcept { return empty() ? -1 : of_points[index(point)]; }
  /// Returns whether a bar ends at a massless point.
  bool holds(const PlanBar& bar) const noexcept { return number(bar.first) >= 0 || number(bar.second) >= 0; }
};

}  // namespace freeflex
