// Random structures of every kind of link.
#pragma once

#include <tuple>
#include <utility>
#include <vector>

#include "tests/reference/random.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {

inline const Beam kBeam{.EA = 2e5, .GJ = 300.0, .EI_y = 200.0, .EI_z = 400.0, .y_axis = {0.1, 0.9, -0.2}};

inline Scene chain(Random& random) {
  Scene scene;
  for (int i = 0; i < 7; ++i)
    add_point(scene, 1.0 + 0.3 * random.one(), Eigen::Vector3d(i, 0.0, 0.0) + 0.3 * random.vector());
  for (int i = 0; i < 6; ++i) add_link(scene, i, i + 1, kBeam);
  return scene;
}

inline Scene hinged(Random& random) {
  Scene scene = chain(random);
  std::get<Beam>(scene.links[3].kind).released[0] = {false, true, true};
  return scene;
}

inline Scene sheet(Random& random) {
  Scene scene;
  for (int i = 0; i < 9; ++i) add_point(scene, 1.0, Eigen::Vector3d(i % 3, i / 3, 0.1 * random.one()));
  for (const int corner : {0, 1, 3, 4}) {
    const Plate plate{1e6, 0.3, 0.05};
    add_link(scene, {corner, corner + 1, corner + 4}, plate);
    add_link(scene, {corner, corner + 4, corner + 3}, plate);
  }
  return scene;
}

inline Scene angles(Random& random) {
  Scene scene;
  for (int i = 0; i < 7; ++i) add_point(scene, 1.0, Eigen::Vector3d(i, 0.0, 0.0) + 0.4 * random.vector());
  for (int i = 0; i < 6; ++i) add_link(scene, i, i + 1, Spring{2e4});
  for (int i = 0; i < 5; ++i) add_link(scene, {i, i + 1, i + 2}, BendingSpring{300.0});
  for (int i = 0; i < 4; ++i) add_link(scene, {i, i + 1, i + 2, i + 3}, TorsionSpring{200.0});
  return scene;
}

// Three rigid bodies of four points each, joined by beams and a spring.
inline Scene bodies(Random& random) {
  Scene scene;
  for (int b = 0; b < 3; ++b) {
    const Eigen::Vector3d at(2.5 * b, 0.3 * b, 0.0);
    std::vector<int> points;
    for (const Eigen::Vector3d& corner : {Eigen::Vector3d(0.0, 0.0, 0.0), Eigen::Vector3d(0.6, 0.0, 0.1),
                                          Eigen::Vector3d(0.1, 0.5, 0.0), Eigen::Vector3d(0.0, 0.1, 0.4)})
      points.push_back(add_point(scene, 1.0 + 0.4 * random.one(), at + corner));
    add_link(scene, points, Rigid{});
  }
  const int middle = add_point(scene, 0.8, {1.5, 0.2, 0.1});
  add_link(scene, 1, middle, kBeam);
  add_link(scene, middle, 4, kBeam);
  add_link(scene, 5, 8, kBeam);
  add_link(scene, 2, 10, Spring{3e3});
  return scene;
}

// Two rigid bodies joined by springs alone.
inline Scene sprung(Random& random) {
  Scene scene;
  std::vector<int> points[2];
  for (int b = 0; b < 2; ++b) {
    for (const Eigen::Vector3d& corner : {Eigen::Vector3d(0.0, 0.0, 0.0), Eigen::Vector3d(0.6, 0.0, 0.1),
                                          Eigen::Vector3d(0.1, 0.5, 0.0), Eigen::Vector3d(0.0, 0.1, 0.4)})
      points[b].push_back(
          add_point(scene, 1.0 + 0.4 * random.one(), Eigen::Vector3d(1.5 * b, 0.3 * b, 0.0) + corner));
    add_link(scene, points[b], Rigid{});
  }
  for (int i = 0; i < 4; ++i)
    for (int j = 4; j < 8; ++j) add_link(scene, i, j, Spring{3e2});
  return scene;
}

// Three blocks of four points, each with a stiffness matrix, joined by springs.
inline Scene matrices(Random& random) {
  Scene scene;
  for (int b = 0; b < 3; ++b) {
    std::vector<int> points;
    for (const Eigen::Vector3d& corner : {Eigen::Vector3d(0.0, 0.0, 0.0), Eigen::Vector3d(0.6, 0.0, 0.1),
                                          Eigen::Vector3d(0.1, 0.5, 0.0), Eigen::Vector3d(0.0, 0.1, 0.4)})
      points.push_back(
          add_point(scene, 1.0 + 0.4 * random.one(), Eigen::Vector3d(1.2 * b, 0.3 * b, 0.0) + corner));
    Eigen::MatrixXd K = Eigen::MatrixXd::Zero(12, 12);
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const auto at = [&](std::size_t k) -> const Eigen::Vector3d& {
          return scene.points[index(points[k])].position;
        };
        Eigen::VectorXd row = Eigen::VectorXd::Zero(12);
        row.segment<3>(3 * static_cast<Eigen::Index>(i)) = (at(i) - at(j)).normalized();
        row.segment<3>(3 * static_cast<Eigen::Index>(j)) = (at(j) - at(i)).normalized();
        K += 2e3 * (1.2 + random.one()) * row * row.transpose();
      }
    MatrixLink link;
    link.matrix = K.sparseView();
    add_link(scene, points, link);
  }
  for (const auto& [i, j] : {std::pair{1, 4},
                             {1, 6},
                             {1, 7},
                             {2, 4},
                             {2, 6},
                             {3, 7},
                             {5, 8},
                             {5, 10},
                             {5, 11},
                             {6, 8},
                             {6, 10},
                             {7, 11}})
    add_link(scene, i, j, Spring{3e2});
  return scene;
}

// Returns the stiffness (12 x 12) of a straight beam over displacements and rotations of its ends, from the
// closed forms of Przemieniecki (1968, section 5.6) without shear. The columns of `axes` are the axes of the
// beam.
inline Eigen::MatrixXd beam_stiffness(const Beam& beam, const Eigen::Matrix3d& axes, double L) {
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(12, 12);
  const auto pair = [&](Eigen::Index a, double k) {
    K(a, a) += k, K(a + 6, a + 6) += k, K(a, a + 6) -= k, K(a + 6, a) -= k;
  };
  pair(0, beam.EA / L);
  pair(3, beam.GJ / L);
  for (const auto& [v, r, EI, sign] : {std::tuple{1, 5, beam.EI_z, 1.0}, {2, 4, beam.EI_y, -1.0}}) {
    pair(v, 12.0 * EI / (L * L * L));
    for (const int end : {r, r + 6}) {
      K(v, end) += sign * 6.0 * EI / (L * L), K(end, v) += sign * 6.0 * EI / (L * L);
      K(v + 6, end) -= sign * 6.0 * EI / (L * L), K(end, v + 6) -= sign * 6.0 * EI / (L * L);
    }
    K(r, r) += 4.0 * EI / L, K(r + 6, r + 6) += 4.0 * EI / L;
    K(r, r + 6) += 2.0 * EI / L, K(r + 6, r) += 2.0 * EI / L;
  }
  Eigen::MatrixXd turn = Eigen::MatrixXd::Zero(12, 12);
  for (Eigen::Index k = 0; k < 4; ++k) turn.block<3, 3>(3 * k, 3 * k) = axes;
  return turn * K * turn.transpose();
}

// Beams, a plate and springs with massless points: two joints along a chain, and a node of springs alone.
inline Scene massless(Random& random) {
  Scene scene;
  for (int i = 0; i < 7; ++i)
    add_point(scene, i == 2 || i == 4 ? 0.0 : 1.0 + 0.3 * random.one(),
              Eigen::Vector3d(i, 0.0, 0.0) + 0.3 * random.vector());
  for (int i = 0; i < 6; ++i) add_link(scene, i, i + 1, kBeam);
  const int corner = add_point(scene, 0.7, {5.2, 1.1, 0.2}), node = add_point(scene, 0.0, {1.1, 1.0, 0.5});
  add_link(scene, {4, 5, corner}, Plate{1e6, 0.3, 0.05});
  for (const int other : {0, 1, 3, corner}) add_link(scene, node, other, Spring{2e3});
  return scene;
}

// Rods of two and three points, held by beams with free joints at the ends of one rod, by springs, and by a
// rigid body of four points.
inline Scene rods(Random& random) {
  Scene scene;
  const auto point = [&](double x, double y, double z) {
    return add_point(scene, 1.0 + 0.4 * random.one(), {x, y, z});
  };
  std::vector<int> body;
  for (const Eigen::Vector3d& corner : {Eigen::Vector3d(0.0, 0.0, 0.0), Eigen::Vector3d(0.6, 0.0, 0.1),
                                        Eigen::Vector3d(0.1, 0.5, 0.0), Eigen::Vector3d(0.0, 0.1, 0.4)})
    body.push_back(point(1.0 + corner.x(), 1.5 + corner.y(), 0.3 + corner.z()));
  const int a = point(0.0, 0.0, 0.0), b = point(0.9, 0.1, 0.2), c = point(1.8, -0.2, 0.1);
  const int d = point(2.6, 0.3, 0.4), e = point(2.9, 0.5, 0.55), f = point(3.2, 0.7, 0.7);
  add_link(scene, body, Rigid{});
  add_link(scene, {b, c}, Rigid{});
  add_link(scene, {d, e, f}, Rigid{});
  add_link(scene, a, b, kBeam);
  add_link(scene, c, body[1], kBeam);
  for (const int from : {a, c, body[1], body[3]})
    for (const int to : {d, e, f}) add_link(scene, from, to, Spring{4e2});
  for (const int from : {a, b, c})
    for (const int to : {body[0], body[2], body[3]}) add_link(scene, from, to, Spring{4e2});
  return scene;
}

// Two bodies of four points that share a point. A rod hangs on one of them by another joint, and springs hold
// a mass between them.
inline Scene tree(double mass_of_joint) {
  Scene scene;
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(0.0, 0.0, 0.0), Eigen::Vector3d(0.5, 0.4, 0.0), Eigen::Vector3d(0.5, 0.0, 0.3),
        Eigen::Vector3d(1.0, 0.0, 0.0), Eigen::Vector3d(1.5, 0.3, 0.0), Eigen::Vector3d(2.0, 0.0, 0.4),
        Eigen::Vector3d(2.6, 0.2, 0.9), Eigen::Vector3d(0.8, 0.9, 0.5), Eigen::Vector3d(1.6, -0.4, 0.1)})
    add_point(scene, 2.0, p);
  scene.points[3].mass = mass_of_joint;
  scene.points[7].mass = 0.5;
  add_link(scene, {0, 1, 2, 3}, Rigid{});
  add_link(scene, {3, 4, 5, 8}, Rigid{});
  add_link(scene, {5, 6}, Rigid{});
  for (const int i : {1, 3, 4, 6}) add_link(scene, i, 7, Spring{60.0});
  scene.fidelity = Fidelity::kCorotational;
  scene.rate = 1000.0;
  scene.initial.angular_velocity = {0.3, 1.0, 2.0};
  return scene;
}

}  // namespace freeflex::testing
