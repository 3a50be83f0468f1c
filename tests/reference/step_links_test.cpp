// The links at true geometry of core/step against those of the Cartesian reference, which shares no code with
// them.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "core/plan/make_plan.hpp"
#include "core/step/links/matrix_link.hpp"
#include "core/step/links/rotations.hpp"
#include "core/step/links/true_links.hpp"
#include "core/structure/structure.hpp"
#include "tests/reference/random.hpp"
#include "tools/verification/reference/rotations.hpp"
#include "tools/verification/reference/true_geometry.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

Vec3 array_of(const Vector3d& v) { return {v[0], v[1], v[2]}; }
Vector3d vector_of(const Vec3& v) { return {v[0], v[1], v[2]}; }
Mat3 array_of(const Matrix3d& m) {
  Mat3 result;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) result[static_cast<std::size_t>(3 * i + j)] = m(i, j);
  return result;
}

TEST(StepRotations, AgreeWithLibmToSomeUnitsInTheLastPlace) {
  Random random(1);
  for (int k = 0; k < 20000; ++k) {
    const double angle = 3.0 * std::exp(10.0 * (random.one() - 1.0));
    const double sine = std::sin(angle), cosine = std::cos(angle);
    EXPECT_NEAR(angle_per_sine(sine, cosine) * sine, angle, 4e-16 + 3e-15 * angle);
    const Vector3d v = 2.0 * angle * random.vector().normalized();
    const Quat q = rotation_of(array_of(v)).q;
    const Eigen::Quaterniond exact = quaternion_of(v);
    EXPECT_LT((Eigen::Vector4d(q[0], q[1], q[2], q[3]) -
               Eigen::Vector4d(exact.w(), exact.x(), exact.y(), exact.z()))
                  .norm(),
              3e-15);
    const TangentCoefficients tangent = tangent_of(array_of(v), rotation_of(array_of(v)));
    const Vector3d m = random.vector();
    EXPECT_LT(
        (vector_of(transposed_tangent(array_of(v), tangent, array_of(m))) - spin_per_rate(v).transpose() * m)
            .norm(),
        1e-11);  // spin_per_rate loses digits at 1e-2 rad
  }
}

TEST(StepLinks, TheGradientOfABeamIsThatOfTheReferenceAtAnyRotation) {
  Random random(2);
  for (const double size : {1e-3, 0.1, 0.7})
    for (int k = 0; k < 500; ++k) {
      Beam beam;
      beam.EA = 1e5 * (1.1 + random.one()), beam.GJ = 300.0 * (1.1 + random.one());
      beam.EI_y = 500.0 * (1.1 + random.one()), beam.EI_z = 200.0 * (1.1 + random.one());
      if (k % 2 == 0) beam.GA_y = 1e4;
      if (k % 3 == 0) beam.GA_z = 2e4;
      const Vector3d span = Vector3d(1.0, 0.0, 0.5) + 0.7 * random.vector();
      const TrueBeam exact(beam, span);
      const Matrix3d turn = quaternion_of(2.0 * random.vector()).toRotationMatrix();
      const Vector3d d = turn * (span + size * 0.5 * random.vector()) - span;
      std::array<Matrix3d, 2> ends;
      for (Matrix3d& end : ends)
        end = turn * quaternion_of(size * random.vector()).toRotationMatrix() * exact.rest;
      LinkGradient expected;
      exact.evaluate(d, ends, false, expected);
      BeamConstants constants{exact.length,
                              beam.EA / exact.length,
                              exact.torsion,
                              {exact.symmetric[0], exact.symmetric[1]},
                              {exact.antisymmetric[0], exact.antisymmetric[1]}};
      for (std::size_t plane = 0; plane < 2; ++plane) {
        const double phi = exact.phi[plane], bending = 1.0 / (1.0 + phi);
        constants.shear[plane] = phi * bending;
        constants.skew_bow[plane] = bending * bending * (1.0 / 40.0 - phi * phi / 8.0);
      }
      const auto end_of = [](const Matrix3d& end) {
        return BeamEnd{array_of(Vector3d(end.col(0))), array_of(Vector3d(end.col(1)))};
      };
      const BeamGradient found =
          gradient_of(constants, array_of(span), array_of(d), end_of(ends[0]), end_of(ends[1]));
      EXPECT_LT((vector_of(found.force) - expected.force[1]).norm(),
                1e-11 * (expected.force[1].norm() + beam.EA));
      for (std::size_t end = 0; end < 2; ++end)
        EXPECT_LT((vector_of(found.moment[end]) - expected.moment[end]).norm(),
                  1e-11 * (expected.moment[0].norm() + expected.moment[1].norm() + beam.EI_y));
      EXPECT_NEAR(found.energy, expected.energy, 1e-11 * expected.energy);
    }
}

// Points on a line or in space, and a random stiffness that rigid motions do not strain. On a line without
// rotations it is the same in all directions across the line.
MatrixConstants random_matrix(Random& random, Eigen::Index num_points, bool on_line, bool has_rotations) {
  MatrixConstants matrix;
  matrix.has_rotations = has_rotations;
  Matrix3Xd d(3, num_points);
  const Vector3d line = random.vector().normalized();
  for (Eigen::Index k = 0; k < num_points; ++k)
    d.col(k) = on_line ? Vector3d((static_cast<double>(k) + 0.3 * random.one()) * line) : random.vector();
  d.colwise() -= Vector3d(d.rowwise().mean());
  const Eigen::Index width = has_rotations ? 6 : 3, n = width * num_points;
  Eigen::MatrixXd rigid = Eigen::MatrixXd::Zero(n, 6), round;
  for (Eigen::Index k = 0; k < num_points; ++k) {
    matrix.arms.push_back(array_of(Vector3d(d.col(k))));
    rigid.block<3, 3>(width * k, 0).setIdentity();
    for (Eigen::Index a = 0; a < 3; ++a)
      rigid.block<3, 1>(width * k, 3 + a) = Vector3d::Unit(a).cross(Vector3d(d.col(k)));
    if (has_rotations) rigid.block<3, 3>(width * k + 3, 3).setIdentity();
  }
  const bool is_round = on_line && !has_rotations;  // the same across the line in all directions
  if (is_round) {
    Eigen::MatrixXd of_line(num_points, 2);
    of_line << Eigen::VectorXd::Ones(num_points), d.transpose() * line;
    const Eigen::MatrixXd Q = Eigen::HouseholderQR<Eigen::MatrixXd>(of_line).householderQ();
    const auto stiffness = [&](Eigen::Index num_rigid) {
      const Eigen::MatrixXd across = Q.rightCols(num_points - num_rigid);
      const Eigen::VectorXd values =
          Eigen::VectorXd::NullaryExpr(across.cols(), [&] { return 1.1 + random.one(); });
      return (1e3 * across * values.asDiagonal() * across.transpose()).eval();
    };
    const Eigen::MatrixXd along = stiffness(1), bending = stiffness(2);
    round = Eigen::MatrixXd::Zero(n, n);
    for (Eigen::Index i = 0; i < num_points; ++i)
      for (Eigen::Index j = 0; j < num_points; ++j)
        round.block<3, 3>(3 * i, 3 * j) = along(i, j) * line * line.transpose() +
                                          bending(i, j) * (Matrix3d::Identity() - line * line.transpose());
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(rigid);
  const Eigen::MatrixXd Q = qr.householderQ();
  const Eigen::MatrixXd across = Q.rightCols(n - qr.rank()),
                        root = Eigen::MatrixXd::NullaryExpr(across.cols(), across.cols(),
                                                            [&] { return random.one(); });
  const Eigen::MatrixXd K =
      is_round ? round : Eigen::MatrixXd(1e3 * across * (root.transpose() * root) * across.transpose());
  const auto padded = static_cast<Eigen::Index>(pad(static_cast<std::size_t>(n)));
  for (Eigen::Index row = 0; row < n; ++row)
    for (Eigen::Index column = 0; column < padded; ++column)
      matrix.stiffness.push_back(column < n ? K(row, column) : 0.0);
  const Matrix3d square = d * d.transpose();
  const Matrix3d inertia = square.trace() * Matrix3d::Identity() - square;
  if (has_rotations) {
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(square);
    const Vector3d widest = eigen.eigenvectors().col(2);
    matrix.line = array_of(widest);
    matrix.turn_weight = eigen.eigenvalues()[2] / static_cast<double>(num_points);
    matrix.inverse =
        array_of(Matrix3d((inertia + eigen.eigenvalues()[2] * widest * widest.transpose()).inverse()));
  } else if (on_line) {
    matrix.line = array_of(line);
    matrix.inverse = array_of(Matrix3d((Matrix3d::Identity() - line * line.transpose()) / square.trace()));
  } else {
    matrix.inverse = array_of(Matrix3d(inertia.inverse()));
  }
  return matrix;
}

// Forces and moments are the derivatives of the energy, by differences of order 4, and balance each other; a
// rotation of all turns them and keeps the energy. The rotations reach 2 rad, the deformations 0.3.
TEST(StepLinks, TheGradientOfAMatrixIsThatOfItsEnergyAtAnyRotation) {
  Random random(11);
  for (int k = 0; k < 400; ++k) {
    const Eigen::Index num_points = 2 + k % 4;
    const bool has_rotations = k % 3 == 0, on_line = num_points == 2 || k % 5 == 0;
    const MatrixConstants matrix = random_matrix(random, num_points, on_line, has_rotations);
    const double size = k % 2 == 0 ? 0.3 : 1e-3;
    std::vector<Vec3> x;
    std::vector<Mat3> R;
    const Matrix3d turn = quaternion_of(2.0 * random.vector()).toRotationMatrix();
    for (Eigen::Index i = 0; i < num_points; ++i) {
      x.push_back(array_of(Vector3d(
          turn * (vector_of(matrix.arms[static_cast<std::size_t>(i)]) + 0.3 * size * random.vector()))));
      if (has_rotations)
        R.push_back(array_of(Matrix3d(turn * quaternion_of(size * random.vector()).toRotationMatrix())));
    }
    MatrixGradient found, other;
    set_gradient(matrix, x, R, found);
    const auto energy_at = [&](const std::vector<Vec3>& at, const std::vector<Mat3>& ends) {
      set_gradient(matrix, at, ends, other);
      return other.energy;
    };
    double scale = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i)
      scale = std::max(
          {scale, vector_of(found.force[i]).norm(), has_rotations ? vector_of(found.moment[i]).norm() : 0.0});
    const double h = 1e-3 * size, bound = 1e-8 * scale;
    const auto slope = [&](const auto& energy_of) {
      return (8.0 * (energy_of(h) - energy_of(-h)) - (energy_of(2.0 * h) - energy_of(-2.0 * h))) / (12.0 * h);
    };
    Vector3d sum = Vector3d::Zero(), moment = Vector3d::Zero();
    for (std::size_t i = 0; i < x.size(); ++i) {
      sum += vector_of(found.force[i]);
      moment += vector_of(x[i]).cross(vector_of(found.force[i]));
      if (has_rotations) moment += vector_of(found.moment[i]);
      for (std::size_t a = 0; a < 3; ++a) {
        EXPECT_NEAR(found.force[i][a], slope([&](double by) {
                      std::vector<Vec3> moved = x;
                      moved[i][a] += by;
                      return energy_at(moved, R);
                    }),
                    bound)
            << k;
        if (!has_rotations) continue;
        EXPECT_NEAR(found.moment[i][a], slope([&](double by) {
                      std::vector<Mat3> turned = R;
                      Vec3 v{};
                      v[a] = by;
                      turned[i] = multiply(matrix_of(rotation_of(v).q), R[i]);
                      return energy_at(x, turned);
                    }),
                    bound)
            << k;
      }
    }
    EXPECT_LT(sum.norm(), 1e-12 * scale * static_cast<double>(num_points));
    EXPECT_LT(moment.norm(), 1e-11 * scale * static_cast<double>(num_points));
  }
}

// A matrix that is only turned has no forces, whatever the angle.
TEST(StepLinks, AMatrixThatTurnsAsAWholeHasNoForces) {
  Random random(12);
  for (int k = 0; k < 200; ++k) {
    const bool has_rotations = k % 2 == 0;
    const MatrixConstants matrix = random_matrix(random, 2 + k % 3, k % 3 == 0, has_rotations);
    const Matrix3d turn =
        quaternion_of((k % 4 == 0 ? 3.14 : 3.1 * random.one()) * random.vector().normalized())
            .toRotationMatrix();
    std::vector<Vec3> x;
    for (const Vec3& d : matrix.arms) x.push_back(array_of(Vector3d(turn * vector_of(d))));
    const std::vector<Mat3> R(has_rotations ? x.size() : 0, array_of(turn));
    MatrixGradient found;
    set_gradient(matrix, x, R, found);
    double largest = 0.0;
    for (const double each : matrix.stiffness) largest = std::max(largest, std::abs(each));
    for (std::size_t i = 0; i < x.size(); ++i) {
      EXPECT_LT(vector_of(found.force[i]).norm(), 1e-13 * largest) << k;
      if (has_rotations) {
        EXPECT_LT(vector_of(found.moment[i]).norm(), 1e-13 * largest) << k;
      }
    }
  }
}

TEST(StepLinks, SmallMotionsHaveTheForcesOfTheLinearLinks) {
  Random random(3);
  const BeamConstants beam{2.0, 5e4, 150.0, {250.0, 100.0}, {700.0, 300.0}};
  const Matrix3d axes = quaternion_of({0.3, -0.4, 1.1}).toRotationMatrix();
  const Vector3d span = 2.0 * axes.col(0), d = random.vector(), a = random.vector(), b = random.vector();
  // the difference from the linear force is of second order, so it falls tenfold with the size
  double before = 1.0;
  for (const double size : {1e-3, 1e-4, 1e-5}) {
    const auto end_of = [&](const Vector3d& v) {
      const Matrix3d end = quaternion_of(size * v).toRotationMatrix() * axes;
      return BeamEnd{array_of(Vector3d(end.col(0))), array_of(Vector3d(end.col(1)))};
    };
    const BeamGradient exact =
        gradient_of(beam, array_of(span), array_of(Vector3d(size * d)), end_of(a), end_of(b));
    const BeamGradient linear =
        linear_gradient_of(beam, array_of(axes), array_of(Vector3d(size * d)), array_of(Vector3d(size * a)),
                           array_of(Vector3d(size * b)));
    const double off =
        (vector_of(exact.force) - vector_of(linear.force)).norm() / vector_of(linear.force).norm();
    EXPECT_LT(off, 0.2 * before);
    before = off;
  }
}

// Scenes of points joined by links of one kind, not in a line but where the name says so.
Scene chain(bool is_straight, Random& random) {
  Scene scene;
  scene.fidelity = Fidelity::kCorotational;
  for (int i = 0; i < 9; ++i) {
    PointMass point;
    point.mass = 1.0 + 0.3 * random.one();
    point.position = Vector3d(i, 0.0, 0.0);
    if (!is_straight) point.position += 0.4 * random.vector();
    scene.points.push_back(point);
  }
  for (int i = 0; i < 8; ++i) {
    Beam beam;
    beam.EA = 1e7, beam.GJ = 2000.0, beam.EI_y = 2200.0, beam.EI_z = is_straight ? 2200.0 : 3300.0;
    Link link;
    link.kind = beam;
    link.points = {i, i + 1};
    scene.links.push_back(link);
  }
  return scene;
}

Scene with_release(Random& random) {
  Scene scene = chain(false, random);
  std::get<Beam>(scene.links[4].kind).released[0] = {false, true, true};
  return scene;
}

Scene sheet(Random& random) {
  Scene scene;
  scene.fidelity = Fidelity::kCorotational;
  for (int i = 0; i < 9; ++i) {
    PointMass point;
    point.mass = 1.0;
    point.position = Vector3d(i % 3, i / 3, 0.1 * random.one());
    scene.points.push_back(point);
  }
  for (const int corner : {0, 1, 3, 4})
    for (const std::vector<int>& points : {std::vector<int>{corner, corner + 1, corner + 4},
                                           std::vector<int>{corner, corner + 4, corner + 3}}) {
      Plate plate;
      plate.E = 1e7, plate.nu = 0.3, plate.thickness = 0.05;
      Link link;
      link.kind = plate;
      link.points = points;
      scene.links.push_back(link);
    }
  return scene;
}

Scene with_angles(Random& random) {
  Scene scene = chain(false, random);
  const auto add = [&](LinkKind kind, std::vector<int> points) {
    Link link;
    link.kind = kind;
    link.points = std::move(points);
    scene.links.push_back(link);
  };
  for (int i = 0; i < 6; i += 2) add(BendingSpring{300.0}, {i, i + 1, i + 2});
  for (int i = 0; i < 5; i += 2) add(TorsionSpring{200.0}, {i, i + 1, i + 2, i + 3});
  return scene;
}

// Holds the generalized forces of all links of a scene at coordinates q, by the reference and by the step.
struct Forces {
  VectorXd expected, found, linear;
};

Forces forces_at(const Scene& scene, double size, Random& random) {
  Faults faults;
  const std::optional<Structure> structure = build_structure(scene, faults);
  const std::optional<Plan> plan = make_full_plan(scene, *structure, scene.fidelity, faults);
  EXPECT_TRUE(plan) << (faults.empty() ? "" : faults.back().message);
  const auto n = static_cast<Eigen::Index>(scene.points.size()), modes = structure->omega.size();
  Array q(index(plan->num_padded), 0.0);
  // the size of a mode falls with its frequency, so that no link is stretched beyond all reason
  const double lowest =
      *std::find_if(structure->omega.begin(), structure->omega.end(), [](double w) { return w > 0.0; });
  for (Eigen::Index l = 0; l < modes; ++l)
    q[index(l)] = structure->omega[l] > 0.0 ? size * random.one() * lowest / structure->omega[l] : 0.0;
  const Map<const VectorXd> coordinates(q.data(), modes);
  const VectorXd displacements = structure->shapes * coordinates;
  const Matrix3Xd V = Map<const Matrix3Xd>(displacements.data(), 3, n);
  VectorXd mass(n);
  for (Eigen::Index i = 0; i < n; ++i) mass[i] = scene.points[index(i)].mass;
  const TrueGeometry reference(scene, mass, structure->mass_properties.r);
  Matrix3Xd force = Matrix3Xd::Zero(3, n);
  reference.add_forces(V, force);

  std::vector<Vec3> displaced(index(n)), rest(index(n)), excess(index(n));
  for (Eigen::Index i = 0; i < n; ++i) {
    displaced[index(i)] = array_of(Vector3d(V.col(i)));
    rest[index(i)] = plan->points[index(i)].r;
  }
  const PlanTrueLinks& links = plan->coupled.links;
  JointState joints = make_joint_state(links.joints);
  JointWorkspace workspace = make_joint_workspace(links, 0);
  Array Q(index(plan->num_padded), 0.0);
  const double last =
      relax_joints(links, {}, rest, index(plan->num_padded), q.data(), displaced, joints, workspace);
  EXPECT_LT(last, 1e-7);
  std::vector<Vec3> linear(index(n));
  add_true_links(links, index(plan->num_padded), displaced, displaced, rest, joints, workspace, excess,
                 linear, Q.data());
  for (std::size_t i = 0; i < index(n); ++i) excess[i] = sub(excess[i], linear[i]);
  Matrix3Xd on_points(3, n);
  for (Eigen::Index i = 0; i < n; ++i) on_points.col(i) = vector_of(excess[index(i)]);
  EXPECT_LT(on_points.rowwise().sum().norm(), 1e-12 * (1.0 + on_points.norm())) << "links act on each other";
  Forces result;
  result.expected = structure->shapes.transpose() * Map<const VectorXd>(force.data(), force.size());
  result.linear = -plan->mass * structure->omega.array().square().matrix().cwiseProduct(coordinates);
  result.found =
      result.linear + structure->shapes.transpose() * Map<const VectorXd>(on_points.data(), on_points.size());
  for (Eigen::Index l = 0; l < modes; ++l) result.found[l] += Q[index(l)];
  return result;
}

TEST(StepLinks, ForcesOfFramesPlatesAndAnglesAreThoseOfTheReference) {
  Random random(4);
  const std::vector<std::pair<const char*, Scene>> scenes{
      {"straight chain of beams", chain(true, random)},
      {"bent chain of anisotropic beams", chain(false, random)},
      {"beam with a hinge", with_release(random)},
      {"sheet of plates", sheet(random)},
      {"angle springs", with_angles(random)}};
  for (const auto& [name, scene] : scenes)
    for (const double share : {0.05, 0.25, 1.0}) {
      // a sheet of two plates a side bends by more than a radian at 5 % of its size
      const double size = share * (name == std::string_view("sheet of plates") ? 0.01 : 0.2);
      const Forces forces = forces_at(scene, size, random);
      const double scale = forces.expected.norm(), nonlinear = (forces.expected - forces.linear).norm();
      EXPECT_GT(nonlinear, 1e-3 * scale) << name << ": the motion is too small to tell";
      EXPECT_LT((forces.found - forces.expected).norm(), 1e-7 * scale) << name << " at " << size;
    }
}

// The factor of an indefinite stiffness has bounded entries, l^2 d <= the largest diagonal entry, and its
// steps lead downhill. That of a definite stiffness is exact.
TEST(JointFactor, OfAnIndefiniteStiffnessIsBounded) {
  PlanTrueLinks links;
  PlanJoints& joints = links.joints;
  joints.num_joints = 1;
  joints.num_rotations = 3;
  joints.order = {0, 1, 2};
  joints.starts = {0, 2, 3, 3};
  joints.below = {1, 2, 2};
  joints.lower = {0.0, 0.0, 0.0};
  joints.inverse_pivots = {1.0, 1.0, 1.0};
  JointFactor factor = make_joint_factor(links);
  const auto solve = [&](double first, double coupling) {
    factor.diagonal = {first, 1.0, 1.0};
    factor.lower = {coupling, coupling, 0.0};
    factor_stiffness(joints, factor);
    std::array<double, 3> x{1.0, -2.0, 0.5};
    solve_stiffness(joints, factor, x.data());
    return x;
  };
  const std::array<double, 3> exact = solve(2.0, 0.1);
  EXPECT_NEAR(2.0 * exact[0] + 0.1 * exact[1] + 0.1 * exact[2], 1.0, 1e-15);
  EXPECT_NEAR(0.1 * exact[0] + exact[1], -2.0, 1e-15);
  for (const double first : {1e-8, -1e-8, -0.5}) {
    const std::array<double, 3> x = solve(first, 1.0);
    EXPECT_GT(x[0] - 2.0 * x[1] + 0.5 * x[2], 0.0) << first;
    for (std::size_t column = 0; column < 3; ++column)
      for (std::int32_t e = joints.starts[column]; e < joints.starts[column + 1]; ++e) {
        const double entry = factor.lower[static_cast<std::size_t>(e)];
        EXPECT_LE(entry * entry / factor.inverse_pivots[column], 1.0 + 1e-15) << first;
      }
  }
}

}  // namespace
}  // namespace freeflex::testing
