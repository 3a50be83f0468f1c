// Structures that several test areas share, as Scene values. Every point and spring is published.
#pragma once

#include <cstdint>

#include "core/scene/scene.hpp"

namespace freeflex::testing {

/// Returns a free truss of square cross-section, centred, with sections 1 m apart along x. Corner c = 0..3 of
/// section i is point 4 i + c of 1 kg at (y, z) = (-.5,-.5), (.5,-.5), (.5,.5), (-.5,.5). All springs have
/// 1e5 N/m and are at rest length. They join, in this order: in each section c to c+1 (cyclic), 0 to 2, 1 to
/// 3; then from each section to the next section, for each c, c to c, c to c+1, c+1 to c. \pre sections >= 2
Scene square_truss(int sections);

/// Adds a force in world axes of 1 N along (0.48, 0.6, 0.64) on point N-2 for 0 < t < 0.1 s.
void add_corner_pulse(Scene& scene);

/// Return the trusses S1 to S5 of the figures in tests and benchmarks.
Scene truss_s1();  // 5 sections (20 points, 78 springs) with the corner pulse
Scene truss_s2();  // 26 sections (104 points, 456 springs) with the corner pulse
Scene truss_s3();  // 250 sections (1000 points, 4488 springs) with the corner pulse
/// Returns S1 with springs of 1e9 N/m at the odd indices (counted from 0), and masses of 0.01 kg if i + c is
/// odd and 100 kg if i + c is even.
Scene truss_s4();
/// Returns S1 without initial strain, spinning at `spin` [rad/s] about the z axis through its centre of mass.
/// S5 itself has the spin 0.1 rad/s.
Scene truss_s5(double spin = 0.1);

/// Returns six points on the coordinate axes. A spring joins every pair. The principal moments about x, y and
/// z are exactly 2, 3 and 4 kg m^2, so y is the intermediate axis.
Scene octahedron(double stiffness = 1e6);

/// Returns two points `length` apart on the x axis, the first at -length m1 / (m0 + m1).
Scene spring_pair(double m0, double m1, double length, double stiffness);

/// Returns random points of 0.1 to 10 kg in a box, no two closer than 0.3 m. A spring of 1e4 to 1e6 N/m, or a
/// bar with EA of 1e4 to 1e6 N, joins every pair. The same seed gives the same scene.
/// \pre 4 <= num_points <= 20
Scene random_structure(std::uint64_t seed, int num_points);

/// Publishes every point and every spring, bar and beam, and makes every point pushable.
void publish_everything(Scene& scene);

}  // namespace freeflex::testing
