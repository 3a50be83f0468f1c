#include "core/scene/bodies.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <span>

#include "core/faults.hpp"
#include "core/scene/link_kinds.hpp"

namespace freeflex {

bool has_attitude(const PointMass& point) { return !point.inertia.isZero(0.0) || !point.offset.isZero(0.0); }

bool are_point_masses(const Scene& scene) {
  return std::all_of(scene.points.begin(), scene.points.end(),
                     [](const PointMass& point) { return point.mass > 0.0 && !has_attitude(point); }) &&
         std::none_of(scene.links.begin(), scene.links.end(),
                      [](const Link& link) { return has_mass(link); });
}

namespace {

// How the mass of a link is spread.
enum class MassShape {
  kNone,
  kLine,       // linear deformation shapes between two points
  kCubicLine,  // cubic deformation shapes between two points
  kTriangle,   // cubic deformation shapes between three points
  kMatrix,     // a mass matrix gives it
};
struct LinkMass {
  MassShape shape = MassShape::kNone;
  double density = 0.0;  // [kg/m] of a line, [kg/m^2] of a triangle
  MassDistribution distribution = MassDistribution::kConsistent;
};

// The one place that says how a kind of link has mass. A new kind does not compile without a case here.
LinkMass mass_law_of(const Link& link) {
  return std::visit(
      Cases{
          [](const Spring&) { return LinkMass{}; },
          [](const Bar& bar) {
            return LinkMass{MassShape::kLine, bar.mass_per_length, bar.mass_distribution};
          },
          [](const Beam& beam) {
            return LinkMass{MassShape::kCubicLine, beam.mass_per_length, beam.mass_distribution};
          },
          [](const MatrixLink& matrix) {
            return LinkMass{matrix.mass.nonZeros() > 0 ? MassShape::kMatrix : MassShape::kNone};
          },
          [](const BendingSpring&) { return LinkMass{}; },
          [](const TorsionSpring&) { return LinkMass{}; },
          [](const Plate& plate) {
            return LinkMass{MassShape::kTriangle, plate.density * plate.thickness, plate.mass_distribution};
          },
          [](const Rigid&) { return LinkMass{}; },
          [](const Dashpot&) { return LinkMass{}; },
      },
      link.kind);
}

}  // namespace

bool has_mass(const Link& link) {
  const LinkMass law = mass_law_of(link);
  return law.density > 0.0 || law.shape == MassShape::kMatrix;
}

std::vector<bool> points_that_move_mass(const Scene& scene) {
  std::vector<bool> moves;
  for (const PointMass& point : scene.points) moves.push_back(point.mass > 0.0);
  for (const Link& link : scene.links)
    for (const int point : link.points)
      if (has_mass(link) || is_rigid(link)) moves[index(point)] = true;
  return moves;
}

double mass_of(const Scene& scene, const Link& link) {
  if (!has_mass(link)) return 0.0;
  const LinkMass law = mass_law_of(link);
  if (law.shape == MassShape::kMatrix) return rigid_body_of(scene, link).mass;
  if (law.shape != MassShape::kTriangle) return law.density * span_of(scene, link).stableNorm();
  const auto at = [&](std::size_t k) -> const Eigen::Vector3d& {
    return scene.points[index(link.points[k])].position;
  };
  return law.density * 0.5 * (at(1) - at(0)).cross(at(2) - at(0)).stableNorm();
}

namespace {

// Adds a point mass at a point. With the offset c of the body from the point, the new centre is at
// m c / (m + dm), and the inertia about it grows by m dm / (m + dm) ((c . c) 1 - c c^T).
void add_mass(PointMass& point, double mass) {
  const double all = point.mass + mass;
  const Eigen::Vector3d& c = point.offset;
  point.inertia +=
      point.mass * (mass / all) * (c.squaredNorm() * Eigen::Matrix3d::Identity() - c * c.transpose()).eval();
  point.offset *= point.mass / all;
  point.mass = all;
}

}  // namespace

void place_lumped_masses(Scene& scene) {
  for (Link& link : scene.links) {
    if (mass_distribution_of(link) != MassDistribution::kLumped || !has_mass(link)) continue;
    const double part = mass_of(scene, link) / static_cast<double>(link.points.size());
    for (const int point : link.points) add_mass(scene.points[index(point)], part);
    remove_mass(link);
  }
}

bool has_mass_matrix(const Link& link) { return mass_law_of(link).shape == MassShape::kMatrix; }

bool moves_with_its_point(const Link& link) {
  return has_mass_matrix(link) && link.points.size() == 1 && std::get<MatrixLink>(link.kind).has_rotations;
}

std::vector<bool> points_with_rotary_mass(const Scene& scene) {
  constexpr double kRounding = 1e-12;  // [-] of the largest moment of inertia in the matrix
  std::vector<bool> found(scene.points.size(), false);
  for (const Link& link : scene.links) {
    if (!has_mass_matrix(link)) continue;
    const auto& matrix = std::get<MatrixLink>(link.kind);
    if (!matrix.has_rotations) continue;
    const auto moment = [&](std::size_t k, int axis) {
      const Eigen::Index row = 6 * static_cast<Eigen::Index>(k) + 3 + axis;
      return matrix.mass.coeff(row, row);
    };
    double largest = 0.0;
    for (std::size_t k = 0; k < 3 * link.points.size(); ++k)
      largest = std::max(largest, moment(k / 3, static_cast<int>(k % 3)));
    for (std::size_t k = 0; k < 3 * link.points.size(); ++k)
      if (moment(k / 3, static_cast<int>(k % 3)) > kRounding * largest)
        found[index(link.points[k / 3])] = true;
  }
  return found;
}

MassDistribution mass_distribution_of(const Link& link) { return mass_law_of(link).distribution; }

namespace {

// Holds one point of Gauss's rule on 0 to 1. The rule has two points for linear shapes and four points for
// cubic shapes
struct GaussPoint {
  double position, weight;  // [-]
};
std::span<const GaussPoint> gauss_points(bool is_cubic) {
  static constexpr std::array<GaussPoint, 2> kTwo{{{0.21132486540518712, 0.5}, {0.78867513459481288, 0.5}}};
  static constexpr std::array<GaussPoint, 4> kFour{{{0.069431844202973712, 0.17392742256872693},
                                                    {0.33000947820757187, 0.32607257743127307},
                                                    {0.66999052179242813, 0.32607257743127307},
                                                    {0.93056815579702629, 0.17392742256872693}}};
  if (is_cubic) return kFour;
  return kTwo;
}

// Dunavant's rule of degree 6 on a triangle (1985, Int. J. Numer. Meth. Eng. 21, 1129-1148), exact for the
// square of a cubic. It has two classes of three points and one class of six points. The weight of the points
// of the last class is computed such that all weights add up to one.
struct TrianglePoint {
  std::array<double, 3> weights_of_corners;  // [-]
  double weight;                             // [-]
};
std::vector<TrianglePoint> triangle_points() {
  constexpr double kFirst = 0.116786275726379, kSecond = 0.050844906370207;
  std::vector<TrianglePoint> points;
  const auto add_three = [&](double away, double weight) {
    const double near = 1.0 - 2.0 * away;
    points.insert(points.end(),
                  {{{near, away, away}, weight}, {{away, near, away}, weight}, {{away, away, near}, weight}});
  };
  add_three(0.249286745170910, kFirst);
  add_three(0.063089014491502, kSecond);
  constexpr double a = 0.053145049844817, b = 0.310352451033784, c = 1.0 - a - b;
  for (const std::array<double, 3>& each :
       {std::array<double, 3>{a, b, c}, {a, c, b}, {b, a, c}, {b, c, a}, {c, a, b}, {c, b, a}})
    points.push_back({each, (1.0 - 3.0 * (kFirst + kSecond)) / 6.0});
  return points;
}

}  // namespace

namespace {

// Returns the rigid motions T_s of the coordinates of a superelement, as columns: three translations, then
// three rotations about its first point. Inner coordinates are zero in a rigid motion
Eigen::MatrixXd rigid_rows_of(const Scene& scene, const Link& link, const MatrixLink& matrix) {
  const Eigen::Index per_point = matrix.has_rotations ? 6 : 3;
  Eigen::MatrixXd motions = Eigen::MatrixXd::Zero(num_rows(matrix, link.points.size()), 6);
  const auto at = [&](std::size_t k) {
    return scene.points[static_cast<std::size_t>(link.points[k])].position;
  };
  for (std::size_t k = 0; k < link.points.size(); ++k) {
    const Eigen::Index row = per_point * static_cast<Eigen::Index>(k);
    motions.block<3, 3>(row, 0).setIdentity();
    for (int axis = 0; axis < 3; ++axis)
      motions.block<3, 1>(row, 3 + axis) = Eigen::Vector3d::Unit(axis).cross(Eigen::Vector3d(at(k) - at(0)));
    if (matrix.has_rotations) motions.block<3, 3>(row + 3, 3).setIdentity();
  }
  return motions;
}

// T_s^T m_s T_s   (THEORY 16.18)
Eigen::Matrix<double, 6, 6> rigid_mass_of(const Scene& scene, const Link& link) {
  const auto& matrix = std::get<MatrixLink>(link.kind);
  const Eigen::MatrixXd rigid = rigid_rows_of(scene, link, matrix);
  const Eigen::Matrix<double, 6, 6> mass = rigid.transpose() * (matrix.mass * rigid);
  return 0.5 * (mass + mass.transpose());
}

}  // namespace

// T_s^T m_s T_s = (m 1, -m [c]x; m [c]x, J + m ((c . c) 1 - c c^T))   (THEORY 16.18), so c follows from the
// antisymmetric part of the upper right block, divided by m
PointMass rigid_body_of(const Scene& scene, const Link& link) {
  assert(has_mass_matrix(link));
  const Eigen::Matrix<double, 6, 6> all = rigid_mass_of(scene, link);
  PointMass body;
  body.mass = all.topLeftCorner<3, 3>().trace() / 3.0;
  if (!(body.mass > 0.0)) return body;
  const Eigen::Matrix3d S = all.topRightCorner<3, 3>();
  body.offset = Eigen::Vector3d(S(1, 2) - S(2, 1), S(2, 0) - S(0, 2), S(0, 1) - S(1, 0)) / (2.0 * body.mass);
  const Eigen::Vector3d& c = body.offset;
  body.inertia = all.bottomRightCorner<3, 3>() -
                 body.mass * (c.squaredNorm() * Eigen::Matrix3d::Identity() - c * c.transpose());
  return body;
}

std::string mass_matrix_problem(const Scene& scene, const Link& link) {
  constexpr double kRounding = 1e-5;  // [-] uncertainty of printed tables
  const auto& matrix = std::get<MatrixLink>(link.kind);
  if (!Eigen::MatrixXd(matrix.mass).allFinite())
    return "the mass matrix has an entry that is not finite; give finite entries";
  const Eigen::MatrixXd M = matrix.mass;
  if ((M - M.transpose()).cwiseAbs().maxCoeff() > 1e-6 * M.cwiseAbs().maxCoeff())
    return "the mass matrix is not symmetric; give a symmetric one";
  // the matrix is scaled by rows and columns, because entries of rotations have other units
  const Eigen::VectorXd root = M.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd inverse = root.unaryExpr([](double x) { return x > 0.0 ? 1.0 / x : 0.0; });
  for (Eigen::Index k = 0; k < M.rows(); ++k)
    if (M(k, k) < 0.0 || (M(k, k) == 0.0 && !M.row(k).isZero(0.0)))
      return join_text("row ", k + 1, " of the mass matrix has ", M(k, k),
                       " on the diagonal, which must be positive unless the whole row is zero");
  const Eigen::MatrixXd scaled = inverse.asDiagonal() * M * inverse.asDiagonal();
  const double least =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scaled, Eigen::EigenvaluesOnly).eigenvalues().minCoeff();
  if (least < -kRounding)
    return join_text("the mass matrix is not positive semidefinite, because it has the eigenvalue ", least,
                     " after scaling to a diagonal of ones; no eigenvalue may be negative");
  const Eigen::Matrix<double, 6, 6> all = rigid_mass_of(scene, link);
  const PointMass body = rigid_body_of(scene, link);
  const Eigen::Matrix3d excess = all.topLeftCorner<3, 3>() - body.mass * Eigen::Matrix3d::Identity();
  if (!(body.mass > 0.0) || excess.cwiseAbs().maxCoeff() > kRounding * body.mass)
    return join_text(
        "the mass matrix has the masses ", all.diagonal().head<3>().transpose(),
        " kg in translation along x, y, z, which must be equal; check the order of rows, the axes of "
        "its points and units");
  const Eigen::Matrix3d S = all.topRightCorner<3, 3>();
  const double size = std::sqrt(std::max(0.0, all.diagonal().tail<3>().maxCoeff() * body.mass));
  if ((S + S.transpose()).cwiseAbs().maxCoeff() > 2.0 * kRounding * size)
    return "translation and rotation of the mass matrix are not those of one body; check the order of rows "
           "and the axes of its points";
  return inertia_problem(body.inertia);
}

// corners d +- a_1 +- a_2 +- a_3 with an even number of minus signs, |a_k|^2 = Pi_k / m along the principal
// axes of Pi   (THEORY 16.4)
std::array<Eigen::Vector3d, 4> corners_of(const PointMass& body) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(second_moment(body));
  // Principal values of Pi as small as rounding errors are set to zero, because they mean that the body has
  // no extent along these axes
  constexpr double kRounding = 1e-13;
  const double least =
      kRounding * (eigen.eigenvalues().cwiseMax(0.0).sum() + body.mass * body.offset.squaredNorm());
  const Eigen::Vector3d S = eigen.eigenvalues().unaryExpr([&](double s) { return s > least ? s : 0.0; });
  const Eigen::Matrix3d arms = eigen.eigenvectors() * (S / body.mass).cwiseSqrt().asDiagonal();
  static const std::array<Eigen::Vector3d, 4> kSigns{
      Eigen::Vector3d{1.0, 1.0, 1.0}, {1.0, -1.0, -1.0}, {-1.0, 1.0, -1.0}, {-1.0, -1.0, 1.0}};
  std::array<Eigen::Vector3d, 4> corners;
  for (std::size_t k = 0; k < corners.size(); ++k) corners[k] = body.offset + arms * kSigns[k];
  return corners;
}

// The parts g have the kinetic energy of the link: int mu |V'|^2 / 2 dx = sum_g m_g |V_g'|^2 / 2, where mu is
// the mass per length   (THEORY 16.10)
std::vector<DistributedMass> distributed_masses(const Scene& scene, int index) {
  const Link& link = scene.links[static_cast<std::size_t>(index)];
  if (!has_mass(link)) return {};
  assert(std::ranges::all_of(
      link.points, [&](int point) { return point >= 0 && freeflex::index(point) < scene.points.size(); }));
  assert(mass_distribution_of(link) != MassDistribution::kLumped);
  const double mass = mass_of(scene, link);
  std::vector<DistributedMass> all;
  const MassShape shape = mass_law_of(link).shape;
  if (shape == MassShape::kMatrix) {
    for (const Eigen::Vector3d& arm : corners_of(rigid_body_of(scene, link)))
      all.push_back({index, 0.25 * mass, {{link.points[0], 1.0}}, arm});
  } else if (shape == MassShape::kTriangle) {
    static const std::vector<TrianglePoint> kPoints = triangle_points();
    for (const TrianglePoint& each : kPoints)
      all.push_back({index,
                     mass * each.weight,
                     {{link.points[0], each.weights_of_corners[0]},
                      {link.points[1], each.weights_of_corners[1]},
                      {link.points[2], each.weights_of_corners[2]}}});
  } else {
    for (const GaussPoint& each : gauss_points(shape == MassShape::kCubicLine))
      all.push_back({index,
                     mass * each.weight,
                     {{link.points[0], 1.0 - each.position}, {link.points[1], each.position}}});
  }
  return all;
}

std::vector<DistributedMass> distributed_masses(const Scene& scene) {
  std::vector<DistributedMass> all;
  for (int i = 0; i < static_cast<int>(scene.links.size()); ++i)
    for (DistributedMass& each : distributed_masses(scene, i)) all.push_back(std::move(each));
  return all;
}

// Pi = (tr J) / 2 1 - J   (THEORY 16.3)
Eigen::Matrix3d second_moment(const PointMass& point) {
  return 0.5 * point.inertia.trace() * Eigen::Matrix3d::Identity() - point.inertia;
}

std::string inertia_problem(const Eigen::Matrix3d& inertia) {
  // [-] uncertainty of printed tables with seven digits, as a fraction of the largest moment
  constexpr double kRounding = 1e-6;
  if (!inertia.allFinite()) return "inertia has an entry that is not finite; give finite entries";
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(inertia, Eigen::EigenvaluesOnly);
  const Eigen::Vector3d& moments = eigen.eigenvalues();  // ascending
  const double least = -kRounding * moments[2];
  if (moments[0] < least)
    return join_text(
        "inertia has the principal moment ", moments[0],
        " kg m^2, but it must be >= 0; give the entries of the inertia matrix, which off the diagonal are "
        "-sum m x y");
  if (moments[0] + moments[1] - moments[2] < least)
    return join_text(
        "inertia has the principal moments ", moments.transpose(),
        " kg m^2, but no moment may exceed the sum of the two others; check their order and that "
        "they are about the centre of mass");
  return {};
}

}  // namespace freeflex
