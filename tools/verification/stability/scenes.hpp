// Scenes of the stability table. Every point is published and pushable. A tick is 1 ms unless stated
// otherwise.
#pragma once

#include <array>

#include "core/scene/scene.hpp"

namespace freeflex::tools {

/// A rung, and what it integrates if links have their true geometry there.
struct Solver {
  Fidelity rung;
  IntegrateBy by;
  const char* name;
};
inline constexpr Solver kOnModes{Fidelity::kCorotational, IntegrateBy::kModes, "corotational"};
inline constexpr Solver kOnPoints{Fidelity::kCorotational, IntegrateBy::kPoints, "corotational, points"};
void use(const Solver& solver, Scene& scene);

/// Returns a free truss of three sections of four points, which are slightly displaced so that no two
/// frequencies are equal. Every second of its 30 springs has 1e3 N/m, and the others are stiffer by the
/// factor `stiffness_ratio`. Points of 1 kg and of `mass_ratio` kg alternate.
Scene stiff_truss(double stiffness_ratio, double mass_ratio);

/// Returns four points in a zigzag of `width` [m] about a line 3 m long, with every pair joined.
/// \param is_tilted  true: the line is along (0.36, 0.48, 0.8) instead of x
Scene nearly_collinear(double width, bool is_tilted);

/// Returns five points whose distance from a plane is at most `height` [m], with every pair joined.
Scene nearly_planar(double height, bool is_tilted);

/// Returns two points of 1 and 3 kg, 1 m apart along x. Their only mode has the frequency `omega` [rad/s] and
/// starts at its maximum, an elongation of 1e-3 m.
/// \param rate  [Hz] of the ticks
Scene oscillating_pair(double omega, double rate);

/// Returns six points of 1 kg on the axes, with every pair joined by a spring. The principal moments are 2, 3
/// and 4 kg m^2.
Scene octahedron(double stiffness);

/// Returns a truss of `sections` sections with 1 kg per point and springs of `stiffness` [N/m]. The sections
/// are 1 m apart. All lengths are multiplied by `size`.
Scene square_truss(int sections, double stiffness, double size = 1.0);

void add_point(Scene& scene, double mass, const Eigen::Vector3d& position);
void add_link(Scene& scene, std::vector<int> points, LinkKind kind);
/// Adds a force in world axes, which is constant unless another history is given.
void add_force(Scene& scene, int point, const Eigen::Vector3d& force, History history = ConstantHistory{});

}  // namespace freeflex::tools
