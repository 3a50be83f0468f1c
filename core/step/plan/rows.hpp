// The part of a plan that converts elastic coordinates to points, groups and links, and loads back.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/step/array.hpp"
#include "core/step/vector.hpp"
#include "core/words.hpp"

namespace freeflex {

struct PlanPoint {
  std::string name;
  double mass = 0.0;      // [kg] 0: a massless point; links hold it
  Vec3 r{};               // [m] rest position from the centre of mass, body axes
  std::int32_t row = -1;  // block of three rows in Plan::rows; -1: the point is neither read nor loaded
  bool pushable = false;
};

struct PlanLink {
  std::string name;
  LinkType type = LinkType::kSpring;
  std::vector<std::int32_t> points;  // empty for a matrix
};

/// Holds a named group and the data that distribute a wrench over its points. A force F_g and a torque T_g at
/// the centre of mass of the group are distributed as the forces
///   F_i = m_i (F_g / mass + (inverse_inertia T_g) x d_i),  d_i = r_i - centre   (THEORY 8.8)
struct PlanGroup {
  std::string name;
  std::vector<std::int32_t> points;
  double mass = 0.0;             // [kg]
  Vec3 centre{};                 // [m] centre of mass of the group from B, body axes
  Mat3 inverse_inertia{};        // [1/(kg m^2)] pseudo-inverse for collinear groups
  std::int32_t torque_rank = 3;  // number of independent torques that the group supports: 3, or 2 if it is
                                 // collinear, or 0 if it is at one position
  Vec3 line{};  // [-] direction of the line of a collinear group; the group supports no torque about this
                // line   (THEORY 8.9)
};

/// Holds the particles that stand for the mass of bodies (THEORY 16.4). The arrays are empty if all points
/// are point masses.
struct PlanParticles {
  std::vector<PlanPoint> all;  // particles of bodies, without names
  // (num_groups) the points and particles that carry the mass of each group, as indices for mass_point
  std::vector<std::vector<std::int32_t>> of_groups;
  std::vector<std::int32_t> attitude_points;  // points whose attitude is read or loaded, ascending
  Array rotation_rows;  // [1/m] (3 num_attitude_points x num_padded) three rows for each of attitude_points:
                        // elastic rotation theta = rows q
};

/// Holds a wheel in a body   (THEORY 16.21 to 16.23).
struct PlanWheel {
  std::string name;
  std::int32_t attitude_index = -1;  // index of the wheel's body in PlanParticles::attitude_points
  Vec3 axis{};                       // [-] unit vector, body axes
  double momentum = 0.0;             // [N m s] momentum at the start
};

/// Holds the output rows of one published link, in PlanRows::link_rows:
///   force = rows q + rate rows q' + load rows Q
struct PlanLinkOutput {
  std::int32_t link = -1;            // index into PlanRows::links
  std::int32_t num_rows = 1;         // number of values, see LinkForceRows
  std::int32_t first_row = 0;        // first row of q
  std::int32_t first_rate_row = -1;  // first row of q'; -1: no rate rows
  std::int32_t first_load_row = -1;  // first row of Q; -1: no load rows
};

/// Holds the items of the structure and their rows over the elastic coordinates.
struct PlanRows {
  std::vector<PlanPoint> points;
  std::vector<PlanLink> links;
  std::vector<PlanGroup> groups;
  PlanParticles particles;
  std::vector<PlanWheel> wheels;
  Array rows;  // [-] (3*num_row_blocks x num_padded) unit elastic displacements
  // (6 x num_padded) sum m b [kg], sum m r x b [kg m], zero except for rounding errors (THEORY 2.15)
  Array eckart_rows;
  Array link_rows;  // (num_link_rows x num_padded) forces of links per q, q' or Q
  std::vector<PlanLinkOutput> link_outputs;
};

/// Returns a carrier of mass. An index below the number of points means a point, and an index from there on
/// means a particle.
inline const PlanPoint& mass_point(const PlanRows& plan, std::int32_t carrier) noexcept {
  const auto i = index(carrier);
  return i < plan.points.size() ? plan.points[i] : plan.particles.all[i - plan.points.size()];
}

/// Returns the index of a point in PlanParticles::attitude_points; -1 if its attitude is neither read nor
/// loaded.
inline std::int32_t attitude_index_of(const PlanRows& plan, std::int32_t point) noexcept {
  const auto& points = plan.particles.attitude_points;
  const auto found = std::lower_bound(points.begin(), points.end(), point);
  return found != points.end() && *found == point ? static_cast<std::int32_t>(found - points.begin()) : -1;
}

/// Returns the carriers of mass of a group, as indices for mass_point.
inline std::span<const std::int32_t> carriers_of_group(const PlanRows& plan, std::size_t group) noexcept {
  return plan.particles.of_groups.empty() ? plan.groups[group].points : plan.particles.of_groups[group];
}

}  // namespace freeflex
