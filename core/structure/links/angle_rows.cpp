// The natural deformations of bending and torsion springs are changes of angles (E. B. Wilson, J. C. Decius,
// P. C. Cross, Molecular Vibrations, 1955, section 4-1).
#include <Eigen/Geometry>
#include <cmath>

#include "core/rounding.hpp"
#include "core/structure/links/link_factor.hpp"

namespace freeflex {
namespace {

const Eigen::Vector3d& position(const Scene& scene, int point) { return scene.points[index(point)].position; }

}  // namespace

// The deformation is e = t_i . (V_i - V_j) / l_i + t_k . (V_k - V_j) / l_k   (THEORY 3.23), with
// t_i = u_ji x n, t_k = n x u_jk, where n is the unit vector along u_ji x u_jk   (THEORY 3.24). In the code
// u_ji and u_jk are a and c.
DeformationRows bending_rows(const Scene& scene, const Link& link) {
  const int i = link.points[0], j = link.points[1], k = link.points[2];
  const Eigen::Vector3d to_i = position(scene, i) - position(scene, j);
  const Eigen::Vector3d to_k = position(scene, k) - position(scene, j);
  const double length_i = to_i.stableNorm(), length_k = to_k.stableNorm();
  const Eigen::Vector3d a = to_i / length_i, c = to_k / length_k;
  const Eigen::Vector3d across = a.cross(c);
  DeformationRows rows;
  // the angle increases when point i moves along t_i, and also when point k moves along t_k
  const auto add = [&](const Eigen::Vector3d& t_i, const Eigen::Vector3d& t_k) {
    DeformationRow row;
    add_vector(row, 3 * i, 1.0 / length_i, t_i);
    add_vector(row, 3 * k, 1.0 / length_k, t_k);
    add_vector(row, 3 * j, -1.0, t_i / length_i + t_k / length_k);
    row.root_stiffness = std::sqrt(std::get<BendingSpring>(link.kind).stiffness);
    row.unit_scale = std::min(length_i, length_k);
    rows.push_back(std::move(row));
  };
  double largest = 0.0;
  for (const int point : link.points)
    largest = std::max(largest, position(scene, point).cwiseAbs().maxCoeff());
  const double rounding = kCollinearRoundings * kEpsilon * largest;
  if (across.norm() * std::min(length_i, length_k) <= rounding) {
    // For points on a line, t_k = t_i if j lies between i and k, else t_k = -t_i (THEORY 3.25)
    const double side = a.dot(c) < 0.0 ? 1.0 : -1.0;
    const Eigen::Vector3d first = a.unitOrthogonal(), second = a.cross(first);
    add(first, side * first);
    add(second, side * second);
  } else {
    const Eigen::Vector3d normal = across.normalized();
    add(a.cross(normal), normal.cross(c));
  }
  return rows;
}

// The deformation is e = B_i . V_i + B_j . V_j + B_k . V_k + B_l . V_l   (THEORY 3.26), with
// B_i = -|a_2| n_1 / |n_1|^2, B_l = |a_2| n_2 / |n_2|^2, B_j = -(1 + xi_1) B_i + xi_3 B_l,
// B_k = -(1 + xi_3) B_l + xi_1 B_i (THEORY 3.27). In the code a_1 to a_3 are b1 to b3, n_1 and n_2 are m and
// n, xi_1 and xi_3 are first and last.
DeformationRows torsion_rows(const Scene& scene, const Link& link) {
  const int i = link.points[0], j = link.points[1], k = link.points[2], l = link.points[3];
  const Eigen::Vector3d b1 = position(scene, j) - position(scene, i),
                        b2 = position(scene, k) - position(scene, j),
                        b3 = position(scene, l) - position(scene, k);
  const Eigen::Vector3d m = b1.cross(b2), n = b2.cross(b3);
  const double axis = b2.norm();
  const Eigen::Vector3d at_i = -axis / m.squaredNorm() * m, at_l = axis / n.squaredNorm() * n;
  const double first = b1.dot(b2) / b2.squaredNorm(), last = b3.dot(b2) / b2.squaredNorm();
  DeformationRow row;
  add_vector(row, 3 * i, 1.0, at_i);
  add_vector(row, 3 * j, 1.0, -(1.0 + first) * at_i + last * at_l);
  add_vector(row, 3 * k, 1.0, -(1.0 + last) * at_l + first * at_i);
  add_vector(row, 3 * l, 1.0, at_l);
  row.root_stiffness = std::sqrt(std::get<TorsionSpring>(link.kind).stiffness);
  row.unit_scale = std::min(1.0 / at_i.norm(), 1.0 / at_l.norm());
  return {row};
}

}  // namespace freeflex
