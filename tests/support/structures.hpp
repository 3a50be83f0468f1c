// Structures that several test areas share, as Scene values. Every point and spring link is published.
#pragma once

#include <cstdint>

#include "core/scene/scene.hpp"

namespace freeflex::testing {

/// Free truss of square cross-section, sections 1 m apart along x and centred, corners c = 0..3 of section i
/// at (y, z) = (-.5,-.5), (.5,-.5), (.5,.5), (-.5,.5), point 4 i + c, 1 kg each. Springs of 1e5 N/m at rest
/// length, in this order: per section c to c+1 (cyclic), 0 to 2, 1 to 3; then to the next section, for each
/// c: c to c, c to c+1, c+1 to c. \pre sections >= 2
Scene square_truss(int sections);

/// World-axis force of 1 N along (0.48, 0.6, 0.64) on point N-2 for 0 < t < 0.1 s.
void add_corner_pulse(Scene& scene);

/// The trusses S1 to S5 that figures in tests and benchmarks refer to.
Scene truss_s1();  // 5 sections (20 points, 78 springs) with the corner pulse
Scene truss_s2();  // 26 sections (104 points, 456 springs) with the corner pulse
Scene truss_s3();  // 250 sections (1000 points, 4488 springs) with the corner pulse
/// S1 with every odd-numbered spring (from 0) at 1e9 N/m, and 0.01 kg where i + c is odd, 100 kg where even.
Scene truss_s4();
/// S1 spinning at `spin` [rad/s] about z through its centre of mass, not pre-strained. S5: 0.1 rad/s.
Scene truss_s5(double spin = 0.1);

/// Six points on the coordinate axes, every pair joined by a spring: principal moments exactly 2, 3 and
/// 4 kg m^2 about x, y and z, so y is the middle axis.
Scene octahedron(double stiffness = 1e6);

/// Two points `length` apart on the x axis, the first at -length m1 / (m0 + m1).
Scene spring_pair(double m0, double m1, double length, double stiffness);

/// Random points in a box, no two closer than 0.3 m, masses 0.1 to 10 kg, every pair joined by a spring or
/// a bar of 1e4 to 1e6 N/m. The same seed gives the same scene. \pre 4 <= num_points <= 20
Scene random_structure(std::uint64_t seed, int num_points);

/// Publishes every point and every spring, bar and beam; makes every point pushable.
void publish_everything(Scene& scene);

}  // namespace freeflex::testing
