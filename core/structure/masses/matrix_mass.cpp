#include "core/structure/masses/matrix_mass.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/scene/bodies.hpp"
#include "core/structure/links/superelement.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kNone = 1e-12;  // [-] smaller shares are rounding errors
// [-] a moment of inertia of a smaller share of the largest does not turn the mass of a matrix
constexpr double kIdle = 1e-6;

Matrix3d cross_matrix(const Vector3d& v) {
  return (Matrix3d() << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0).finished();
}

// Returns the inverse of a symmetric matrix on the eigenvectors whose eigenvalue exceeds `least` times the
// largest, and zero on the others.
MatrixXd inverse_above(const MatrixXd& symmetric, double least) {
  if (symmetric.rows() == 0) return symmetric;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(0.5 * (symmetric + symmetric.transpose()));
  const double threshold = least * std::max(0.0, eigen.eigenvalues().maxCoeff());
  const VectorXd inverse =
      eigen.eigenvalues().unaryExpr([&](double s) { return s > threshold ? 1.0 / s : 0.0; });
  return eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
}

// A superelement with its rows: of the displacements of its points, and of its other coordinates.
struct Piece {
  const Link& link;
  MatrixXd mass;       // m_s, symmetric
  MatrixXd y;          // (num rows x num modes)
  Eigen::Matrix3Xd r;  // [m] (3 x points) from the centre of mass of the structure
  std::vector<Index> displacements, others;
  Index per_point;

  Piece(const Scene& scene, const Structure& structure, const Freedoms& freedoms, int number)
      : link(scene.links[index(number)]) {
    const auto& matrix = std::get<MatrixLink>(link.kind);
    mass = matrix.mass;
    mass = (0.5 * (mass + mass.transpose())).eval();
    y = superelement_motions(scene, number, freedoms, structure);
    per_point = matrix.has_rotations ? 6 : 3;
    r.resize(3, num_points());
    for (Index k = 0; k < num_points(); ++k)
      r.col(k) = structure.mass_properties.r.col(link.points[index(k)]);
    for (Index row = 0; row < mass.rows(); ++row)
      (row < per_point * num_points() && row % per_point < 3 ? displacements : others).push_back(row);
  }
  Index num_points() const { return static_cast<Index>(link.points.size()); }

  // Returns the rigid motions about a centre: translations, then rotations.
  MatrixXd rigid(const Vector3d& centre) const {
    MatrixXd T = MatrixXd::Zero(mass.rows(), 6);
    for (Index k = 0; k < num_points(); ++k) {
      T.block<3, 3>(per_point * k, 0).setIdentity();
      T.block<3, 3>(per_point * k, 3) = -cross_matrix(r.col(k) - centre);
      if (per_point == 6) T.block<3, 3>(per_point * k + 3, 3).setIdentity();
    }
    return T;
  }
};

LinearParticles none(const Piece& piece) {
  return {VectorXd(0), Eigen::Matrix3Xd(3, 0), MatrixXd(0, piece.y.cols())};
}

// Appends particles at positions that move like a rigid body.
void append_rigid(double mass, const Vector3d& position, const Vector3d& centre, const MatrixXd& motion,
                  LinearParticles& all) {
  const Index count = all.mass.size();
  all.mass.conservativeResize(count + 1);
  all.r.conservativeResize(3, count + 1);
  all.b.conservativeResize(3 * count + 3, motion.cols());
  all.mass[count] = mass;
  all.r.col(count) = position;
  all.b.bottomRows<3>() = motion.topRows<3>() - cross_matrix(position - centre) * motion.bottomRows<3>();
}

// Returns the masses on points [kg] (points x points), the same for each axis, that are subtracted from m_s.
// They are as large as possible while the rest of m_s has no negative eigenvalue. For this, the other
// coordinates move so that the kinetic energy is least   (THEORY 12.120).
MatrixXd masses_of_points(const Piece& piece) {
  const MatrixXd &M = piece.mass, cross = M(piece.others, piece.displacements);
  // the other coordinates have different units, so they are scaled to a diagonal of ones
  const VectorXd scale =
      M.diagonal()(piece.others).unaryExpr([](double x) { return x > 0.0 ? 1.0 / std::sqrt(x) : 0.0; });
  const MatrixXd own = scale.asDiagonal() * M(piece.others, piece.others) * scale.asDiagonal(),
                 scaled = scale.asDiagonal() * cross;
  const MatrixXd least =
      M(piece.displacements, piece.displacements) - scaled.transpose() * inverse_above(own, kNone) * scaled;
  const Index count = piece.num_points();
  MatrixXd mean(count, count);
  for (Index i = 0; i < count; ++i)
    for (Index j = 0; j < count; ++j) mean(i, j) = least.block<3, 3>(3 * i, 3 * j).trace() / 3.0;
  // least of v . S v over v . mean v, for v that move mass
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(0.5 * (mean + mean.transpose()));
  const VectorXd& value = eigen.eigenvalues();
  const Index rank = (value.array() > kIdle * M.diagonal()(piece.displacements).sum()).count();
  if (rank == 0) return MatrixXd::Zero(count, count);
  const MatrixXd root =
      eigen.eigenvectors().rightCols(rank) * value.tail(rank).cwiseSqrt().cwiseInverse().asDiagonal();
  MatrixXd wide = MatrixXd::Zero(3 * count, 3 * rank);
  for (Index i = 0; i < count; ++i)
    for (Index j = 0; j < rank; ++j) wide.block<3, 3>(3 * i, 3 * j).diagonal().setConstant(root(i, j));
  const MatrixXd shares = wide.transpose() * least * wide;
  const double share =
      Eigen::SelfAdjointEigenSolver<MatrixXd>(shares, Eigen::EigenvaluesOnly).eigenvalues().minCoeff();
  return std::clamp(share, 0.0, 1.0) * mean;
}

// Appends masses on points as particles, and takes them from the mass matrix of the piece.
void move_to_points(const MatrixXd& masses, Piece& piece, LinearParticles& all) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(masses);
  const MatrixXd root =
      eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() * eigen.eigenvectors().transpose();
  const Index count = piece.num_points(), before = all.mass.size(), n = piece.y.cols();
  all.mass.conservativeResize(before + count);
  all.r.conservativeResize(3, before + count);
  all.b.conservativeResize(3 * (before + count), n);
  all.mass.tail(count).setOnes();
  all.r.rightCols(count) = piece.r * root.transpose();
  all.b.bottomRows(3 * count).setZero();
  for (Index i = 0; i < count; ++i)
    for (Index j = 0; j < count; ++j) {
      all.b.middleRows<3>(3 * (before + i)) += root(i, j) * piece.y.middleRows<3>(piece.per_point * j);
      piece.mass.block<3, 3>(piece.per_point * i, piece.per_point * j).diagonal().array() -= masses(i, j);
    }
}

// Returns the body that moves like a rigid piece, with its offset from a centre   (THEORY 16.18).
PointMass body_of(const Piece& piece, const Vector3d& centre) {
  const MatrixXd T = piece.rigid(centre);
  const Eigen::Matrix<double, 6, 6> G = T.transpose() * piece.mass * T;
  PointMass body;
  body.mass = G.topLeftCorner<3, 3>().trace() / 3.0;
  if (!(body.mass > 0.0)) return body;
  const Matrix3d S = G.topRightCorner<3, 3>();
  body.offset = Vector3d(S(1, 2) - S(2, 1), S(2, 0) - S(0, 2), S(0, 1) - S(1, 0)) / (2.0 * body.mass);
  const Vector3d& c = body.offset;
  body.inertia =
      G.bottomRightCorner<3, 3>() - body.mass * (c.squaredNorm() * Matrix3d::Identity() - c * c.transpose());
  return body;
}

// Returns whether particles have the inertia of a body, or whether there is none. \param whole  [kg] of the
// matrix
bool is_body(const PointMass& body, double whole) {
  if (body.mass <= kNone * whole) return true;
  const VectorXd moments =
      Eigen::SelfAdjointEigenSolver<Matrix3d>(second_moment(body), Eigen::EigenvaluesOnly).eigenvalues();
  return moments[0] >= -kIdle * moments[2];
}

// Returns the symmetric part of a b^T as xx, yy, zz, xy, xz, yz.
Eigen::Matrix<double, 6, 1> products_of(const Vector3d& a, const Vector3d& b) {
  Eigen::Matrix<double, 6, 1> all;
  all << a.cwiseProduct(b), 0.5 * (a.x() * b.y() + a.y() * b.x()), 0.5 * (a.x() * b.z() + a.z() * b.x()),
      0.5 * (a.y() * b.z() + a.z() * b.y());
  return all;
}

// Y_l = sum r_j (m_s eta)_j, symmetric, of the motions eta without rigid motion   (THEORY 12.121)
MatrixXd moments_of(const Piece& piece, const MatrixXd& rigid, const MatrixXd& motion) {
  const MatrixXd p = piece.mass * (piece.y - rigid * motion);
  MatrixXd moments = MatrixXd::Zero(6, p.cols());
  for (Index k = 0; k < piece.num_points(); ++k)
    for (Index mode = 0; mode < p.cols(); ++mode)
      moments.col(mode) += products_of(piece.r.col(k), p.block<3, 1>(piece.per_point * k, mode));
  return moments;
}

MatrixMass mass_of_matrix(const Scene& scene, const Structure& structure, const Freedoms& freedoms,
                          int number, bool turns) {
  Piece piece(scene, structure, freedoms, number);
  MatrixMass result;
  result.link = number;
  result.is_on_point = moves_with_its_point(piece.link);
  const Vector3d first = piece.r.col(0);
  const double whole = body_of(piece, first).mass;
  result.beyond = none(piece);
  PointMass body = body_of(piece, first);
  if (!result.is_on_point) {
    const MatrixXd given = piece.mass;
    move_to_points(masses_of_points(piece), piece, result.beyond);
    if (const PointMass rest = body_of(piece, first); is_body(rest, whole))
      body = rest;
    else
      piece.mass = given, result.beyond = none(piece);
  }
  result.mass = body.mass > kNone * whole ? body.mass : 0.0;
  result.centre = first + body.offset;
  result.inertia = body.inertia;
  result.motion = MatrixXd::Zero(6, piece.y.cols());
  result.moments = MatrixXd::Zero(6, piece.y.cols());
  if (result.mass == 0.0) return result;
  const MatrixXd T = piece.rigid(result.centre), momenta = T.transpose() * (piece.mass * piece.y);
  result.motion << momenta.topRows<3>() / body.mass,
      inverse_above(body.inertia, kIdle) * momenta.bottomRows<3>();
  result.moments = moments_of(piece, T, result.motion);
  if (turns && !result.is_on_point) return result;
  for (const Vector3d& corner : corners_of(body)) {
    append_rigid(0.25 * body.mass, first + corner, result.centre, result.motion, result.beyond);
    // the body at the point has the rest, but the rest moves by the inner coordinates as well
    if (turns) append_rigid(-0.25 * body.mass, first + corner, first, piece.y.topRows<6>(), result.beyond);
  }
  return result;
}

}  // namespace

std::vector<MatrixMass> matrix_masses(const Scene& scene, const Structure& structure, bool turns) {
  std::vector<MatrixMass> all;
  const Freedoms freedoms(scene);
  for (int k = 0; k < static_cast<int>(scene.links.size()); ++k)
    if (has_mass_matrix(scene.links[index(k)]))
      all.push_back(mass_of_matrix(scene, structure, freedoms, k, turns));
  return all;
}

// The sums are the momenta T_s^T m_s y about the centre of mass of the structure (THEORY 16.19) and the field
// moments of all parts (THEORY 16.20).
MatrixSums matrix_sums(const Scene& scene, const Freedoms& freedoms, const Structure& structure) {
  MatrixSums sums;
  const std::vector<MatrixMass> all = matrix_masses(scene, structure, false);
  if (all.empty()) return sums;
  sums.momenta = sums.field = MatrixXd::Zero(6, structure.shapes.cols());
  for (const MatrixMass& matrix : all) {
    const Piece piece(scene, structure, freedoms, matrix.link);
    sums.momenta += piece.rigid(Vector3d::Zero()).transpose() * (piece.mass * piece.y);
    sums.field += matrix.moments;
    const LinearParticles& particles = matrix.beyond;
    for (Index p = 0; p < particles.mass.size(); ++p)
      for (Index mode = 0; mode < sums.field.cols(); ++mode)
        sums.field.col(mode) +=
            products_of(particles.mass[p] * particles.r.col(p), particles.b.block<3, 1>(3 * p, mode));
  }
  return sums;
}

// sum m r d^T with d = c + d_c from the point or, with c = 0, from the centre: r_o m c^T + m c c^T + Pi,
// where Pi is the second moment about the centre
RotatingBody rotating_body(const Scene& scene, const Structure& structure, const MatrixMass& matrix) {
  PointMass rest;
  rest.mass = matrix.mass;
  rest.inertia = matrix.inertia;
  RotatingBody body{matrix.motion.bottomRows<3>(), second_moment(rest), Vector3d::Zero()};
  if (!matrix.is_on_point) return body;
  const int point = scene.links[index(matrix.link)].points.front();
  const Freedoms freedoms(scene);
  body.theta = structure.rotations.middleRows<3>(freedoms.rotation(point) - freedoms.num_displacements());
  body.arm = matrix.mass * (matrix.centre - structure.mass_properties.r.col(point));
  body.arms += matrix.centre * body.arm.transpose();
  return body;
}

}  // namespace freeflex
