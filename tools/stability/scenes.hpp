// Scenes of the stability table. Every point is published and pushable; one tick is 1 ms unless told.
#pragma once

#include <array>

#include "core/scene/scene.hpp"

namespace freeflex::tools {

/// Free truss of three sections of four points whose corners are moved a little, so that no frequency
/// repeats: 30 springs of 1e3 N/m, every other one stiffer by `stiffness_ratio`; points of 1 kg and
/// `mass_ratio` kg by turns.
Scene stiff_truss(double stiffness_ratio, double mass_ratio);

/// Four points in a zigzag of `width` [m] about a line 3 m long, every pair joined.
/// \param is_tilted  the line stands along (0.36, 0.48, 0.8), not along x
Scene nearly_collinear(double width, bool is_tilted);

/// Five points of a plane, but for `height` [m], every pair joined.
Scene nearly_planar(double height, bool is_tilted);

/// Two points of 1 and 3 kg, 1 m apart along x, whose one mode has omega [rad/s]; it starts at its crest, a
/// stretch of 1e-3 m, at `rate` [Hz].
Scene oscillating_pair(double omega, double rate);

/// Six points of 1 kg on the axes, every pair joined by a spring: principal moments 2, 3 and 4 kg m^2.
Scene octahedron(double stiffness);

/// Truss of `sections` sections 1 m apart, 1 kg a point, springs of `stiffness` [N/m]: lengths times `size`.
Scene square_truss(int sections, double stiffness, double size = 1.0);

void add_point(Scene& scene, double mass, const Eigen::Vector3d& position);
void add_link(Scene& scene, std::vector<int> points, LinkKind kind);
/// A force in world axes that stays.
void add_force(Scene& scene, int point, const Eigen::Vector3d& force, History history = ConstantHistory{});

}  // namespace freeflex::tools
