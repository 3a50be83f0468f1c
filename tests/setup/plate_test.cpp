// These tests check plates at rest by patch tests, rigid motion, numbering and thin triangles.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/rounding.hpp"
#include "core/scene/link_kinds.hpp"
#include "core/structure/modes/dense/decompositions.hpp"
#include "tests/setup/plate_mesh.hpp"

namespace freeflex::testing {
namespace {

// Returns a rotation about a general axis. The columns of the matrix are the directions of a patch's x, y, z.
Eigen::Matrix3d skew_axes() {
  return Eigen::AngleAxisd(1.1, Eigen::Vector3d(0.3, -0.5, 0.7).normalized()).toRotationMatrix();
}

constexpr double kLength = 0.24, kWidth = 0.12;  // [m]

// Returns the patch of MacNeal and Harder (1985, Finite Elements in Analysis and Design 1, 3-20), in which
// each of the five quadrilaterals is halved. Points 0 to 3 are the corners of the rectangle, and points 4 to
// 7 lie inside.
Scene patch(const Plate& plate) {
  Scene scene;
  for (const auto& [x, y] : std::initializer_list<std::pair<double, double>>{{0.0, 0.0},
                                                                             {kLength, 0.0},
                                                                             {kLength, kWidth},
                                                                             {0.0, kWidth},
                                                                             {0.04, 0.02},
                                                                             {0.18, 0.03},
                                                                             {0.16, 0.08},
                                                                             {0.08, 0.08}})
    add_point(scene, 1.0, {x, y, 0.0});
  add_plate(scene, 0, 1, 5, plate);
  add_plate(scene, 0, 5, 4, plate);
  add_plate(scene, 1, 2, 5, plate);
  add_plate(scene, 2, 6, 5, plate);
  add_plate(scene, 6, 2, 3, plate);
  add_plate(scene, 3, 7, 6, plate);
  add_plate(scene, 3, 0, 7, plate);
  add_plate(scene, 7, 0, 4, plate);
  add_plate(scene, 4, 5, 6, plate);
  add_plate(scene, 7, 4, 6, plate);
  return scene;
}

const Plate kPlate{2e11, 0.3, 2e-3};

// Returns the coefficients of deformation rows, multiplied by the square roots of their stiffnesses unless
// `plain`.
Eigen::MatrixXd dense(const DeformationRows& rows, int num_freedoms, bool plain = false) {
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows.size()), num_freedoms);
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (const auto& [freedom, coefficient] : rows[i].coefficients)
      all(static_cast<Eigen::Index>(i), freedom) += coefficient * (plain ? 1.0 : rows[i].root_stiffness);
  return all;
}

using Field = std::function<Eigen::Vector3d(const Eigen::Vector3d&)>;

// Returns all freedoms of a scene whose points are displaced and whose joints are rotated by these fields.
Eigen::VectorXd freedoms_of(const Scene& scene, const Field& displacement, const Field& rotation) {
  const Freedoms freedoms(scene);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(freedoms.num_all());
  for (int i = 0; i < static_cast<int>(scene.points.size()); ++i) {
    const Eigen::Vector3d& p = scene.points[static_cast<std::size_t>(i)].position;
    u.segment<3>(Eigen::Index{3} * i) = displacement(p);
    u.segment<3>(freedoms.rotation(i)) = rotation(p);
  }
  return u;
}

// Returns the freedoms that minimise the strain energy for given freedoms of the first num_held points.
Eigen::VectorXd relax(const Scene& scene, int num_held, const Eigen::VectorXd& given) {
  const Freedoms freedoms(scene);
  DeformationRows rows;
  for (const Link& link : scene.links) {
    const DeformationRows own = plate_rows(scene, link, freedoms);
    rows.insert(rows.end(), own.begin(), own.end());
  }
  const Eigen::MatrixXd A = dense(rows, freedoms.num_all());
  Eigen::VectorXd u = Eigen::VectorXd::Zero(freedoms.num_all());
  std::vector<Eigen::Index> free;
  for (int i = 0; i < static_cast<int>(scene.points.size()); ++i)
    for (const int first : {3 * i, freedoms.rotation(i)})
      for (int axis = 0; axis < 3; ++axis)
        if (i < num_held)
          u[first + axis] = given[first + axis];
        else
          free.push_back(first + axis);
  const Eigen::MatrixXd A_free = A(Eigen::all, free);
  u(free) = A_free.colPivHouseholderQr().solve(-(A * u));
  return u;
}

// Returns the plate_resultants of every plate for given freedoms, one column each.
Eigen::MatrixXd resultants(const Scene& scene, const Eigen::VectorXd& u) {
  const Freedoms freedoms(scene);
  Eigen::MatrixXd all(6, static_cast<Eigen::Index>(scene.links.size()));
  for (std::size_t i = 0; i < scene.links.size(); ++i) {
    const DeformationRows rows = plate_rows(scene, scene.links[i], freedoms);
    Eigen::VectorXd forces = dense(rows, freedoms.num_all(), true) * u;
    for (std::size_t k = 0; k < rows.size(); ++k)
      forces[static_cast<Eigen::Index>(k)] *= rows[k].root_stiffness * rows[k].root_stiffness;
    all.col(static_cast<Eigen::Index>(i)) = plate_resultants(scene, scene.links[i]) * forces;
  }
  return all;
}

// Returns the components xx, yy, xy of a symmetric tensor in the local axes of a plate with normal z. The
// tensor is given in scene axes.
Eigen::Vector3d in_local_axes(const Scene& scene, const Link& link, const Eigen::Vector3d& z,
                              const Eigen::Matrix3d& tensor) {
  const Eigen::Vector3d x = span_of(scene, link).normalized(), y = z.cross(x);
  return {x.dot(tensor * x), y.dot(tensor * y), x.dot(tensor * y)};
}

// Returns the stress by Hooke's law in plane stress, divided by E h / (1 - nu^2), for a strain tensor within
// the plane with normal z.
Eigen::Matrix3d plane_stress(const Eigen::Matrix3d& strain, const Eigen::Vector3d& z, double nu) {
  return (1.0 - nu) * strain + nu * strain.trace() * (Eigen::Matrix3d::Identity() - z * z.transpose());
}

// membrane rows are l / t = 1e2 times as stiff as bending rows, and QR loses no more than these two digits
constexpr double kPatchTolerance = 1e3 * kEpsilon * 1e2;

TEST(Plates, ConstantStrainOnTheEdgeOfAnIrregularPatchIsConstantInside) {
  const Eigen::Matrix3d axes = skew_axes();
  const Eigen::Vector3d z = axes.col(2);
  const Scene scene =
      moved(patch(kPlate), [&](const Eigen::Vector3d& p) { return Eigen::Vector3d(axes * p); });
  Eigen::Matrix3d strain = Eigen::Matrix3d::Zero();
  strain.topLeftCorner<2, 2>() << 1.0e-3, 0.7e-3, 0.7e-3, -0.4e-3;
  strain = axes * strain * axes.transpose();
  Eigen::Vector3d rotation = 2e-3 * z;  // the field includes a rotation in the plane
  const Eigen::VectorXd u = freedoms_of(
      scene, [&](const Eigen::Vector3d& p) { return Eigen::Vector3d(strain * p + rotation.cross(p)); },
      [&](const Eigen::Vector3d&) -> Eigen::Vector3d { return rotation; });
  const Eigen::MatrixXd found = resultants(scene, relax(scene, 4, u));
  const double Et = kPlate.E * kPlate.thickness / (1.0 - kPlate.nu * kPlate.nu);
  const Eigen::Matrix3d N = Et * plane_stress(strain, z, kPlate.nu);
  for (Eigen::Index i = 0; i < found.cols(); ++i) {
    const Link& link = scene.links[static_cast<std::size_t>(i)];
    EXPECT_LT((found.col(i).head<3>() - in_local_axes(scene, link, z, N)).norm(), kPatchTolerance * N.norm());
    EXPECT_LT(found.col(i).tail<3>().norm(), kPatchTolerance * N.norm() * kPlate.thickness);
  }
}

TEST(Plates, ConstantCurvatureOnTheEdgeOfAnIrregularPatchIsConstantInside) {
  const Eigen::Matrix3d axes = skew_axes();
  const Eigen::Vector3d z = axes.col(2);
  const Scene scene =
      moved(patch(kPlate), [&](const Eigen::Vector3d& p) { return Eigen::Vector3d(axes * p); });
  // w = p . H p / 2 + slope . p along the normal
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  H.topLeftCorner<2, 2>() << 0.9, -0.5, -0.5, 0.3;
  H = axes * H * axes.transpose();
  const Eigen::Vector3d slope = axes * Eigen::Vector3d(0.02, -0.05, 0.0);
  const Eigen::VectorXd u = freedoms_of(
      scene,
      [&](const Eigen::Vector3d& p) { return Eigen::Vector3d((0.5 * p.dot(H * p) + slope.dot(p)) * z); },
      [&](const Eigen::Vector3d& p) { return Eigen::Vector3d((H * p + slope).cross(z)); });
  const Eigen::MatrixXd found = resultants(scene, relax(scene, 4, u));
  // a deflection with upward curvature compresses the upper face
  const double D = kPlate.E * std::pow(kPlate.thickness, 3) / (12.0 * (1.0 - kPlate.nu * kPlate.nu));
  const Eigen::Matrix3d M = -D * plane_stress(H, z, kPlate.nu);
  for (Eigen::Index i = 0; i < found.cols(); ++i) {
    const Link& link = scene.links[static_cast<std::size_t>(i)];
    EXPECT_LT((found.col(i).tail<3>() - in_local_axes(scene, link, z, M)).norm(), kPatchTolerance * M.norm());
    EXPECT_LT(found.col(i).head<3>().norm(), kPatchTolerance * M.norm() / kPlate.thickness);
  }
}

// Returns the displacements of a free structure under balanced loads, from the condensed factor.
Eigen::VectorXd free_response(const Scene& scene, const LinkFactor& factor, const Eigen::VectorXd& force) {
  std::vector<int> points(scene.points.size());
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = static_cast<int>(i);
  // V = A^+ (A^+)' F, where A contains the rows of the links and the rigid motions
  const Eigen::MatrixXd rigid = rigid_basis(scene, points);
  Eigen::MatrixXd held(factor.rows.rows() + rigid.cols(), factor.rows.cols());
  held << factor.rows, factor.rows.norm() * rigid.transpose();
  const Eigen::MatrixXd R =
      held.householderQr().matrixQR().topRows(held.cols()).triangularView<Eigen::Upper>();
  const Eigen::VectorXd half = R.transpose().triangularView<Eigen::Lower>().solve(force);
  return R.triangularView<Eigen::Upper>().solve(half);
}

TEST(Plates, CornerForcesTwistAFreePlateUniformly) {
  // Timoshenko and Woinowsky-Krieger 1959, section 11: forces +-P at the corners give a uniform twisting
  // moment P / 2
  const Scene scene = patch(kPlate);
  Faults faults;
  const LinkFactor factor = factor_links(scene, true, faults);
  const double P = 3.0;
  Eigen::VectorXd force = Eigen::VectorXd::Zero(factor.rows.cols());
  for (const int corner : {0, 1, 2, 3}) force[3 * corner + 2] = corner % 2 == 0 ? P : -P;
  const Eigen::VectorXd V = free_response(scene, factor, force);
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  M(0, 1) = M(1, 0) = -0.5 * P;
  for (int i = 0; i < static_cast<int>(scene.links.size()); ++i) {
    const Link& link = scene.links[static_cast<std::size_t>(i)];
    const Eigen::VectorXd found = plate_resultants(scene, link) * (natural_forces(factor, i) * V);
    EXPECT_LT((found.tail<3>() - in_local_axes(scene, link, Eigen::Vector3d::UnitZ(), M)).norm(),
              kPatchTolerance * M.norm());
  }
  // w = c x y, P = 2 (1 - nu) D c
  const double D = kPlate.E * std::pow(kPlate.thickness, 3) / (12.0 * (1.0 - kPlate.nu * kPlate.nu));
  const double warp = V[2] - V[5] + V[8] - V[11];
  EXPECT_NEAR(warp, kLength * kWidth * P / (2.0 * (1.0 - kPlate.nu) * D), kPatchTolerance * warp);
}

TEST(Plates, EdgeForcesStretchAFreePlateUniformly) {
  const Scene scene = patch(kPlate);
  Faults faults;
  const LinkFactor factor = factor_links(scene, true, faults);
  const double F = 500.0;  // [N] on each short side, half of F at each corner
  Eigen::VectorXd force = Eigen::VectorXd::Zero(factor.rows.cols());
  force[0] = force[9] = -0.5 * F;
  force[3] = force[6] = 0.5 * F;
  const Eigen::VectorXd V = free_response(scene, factor, force);
  Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
  N(0, 0) = F / kWidth;
  for (int i = 0; i < static_cast<int>(scene.links.size()); ++i) {
    const Link& link = scene.links[static_cast<std::size_t>(i)];
    const Eigen::VectorXd found = plate_resultants(scene, link) * (natural_forces(factor, i) * V);
    EXPECT_LT((found.head<3>() - in_local_axes(scene, link, Eigen::Vector3d::UnitZ(), N)).norm(),
              kPatchTolerance * N.norm());
  }
  const double elongation = F * kLength / (kPlate.E * kPlate.thickness * kWidth);
  EXPECT_NEAR(V[3] - V[0], elongation, kPatchTolerance * elongation);
  EXPECT_NEAR(V[10] - V[1], -kPlate.nu * elongation * kWidth / kLength, kPatchTolerance * elongation);
}

// Returns a patch flat in a skew plane, a patch bent into a quarter of a tube, a very flat triangle of height
// 1e-6 m, and a needle-shaped triangle.
std::vector<Scene> shapes() {
  const Eigen::Matrix3d axes = skew_axes();
  std::vector<Scene> all{moved(patch(kPlate),
                               [&](const Eigen::Vector3d& p) {
                                 return Eigen::Vector3d(axes * p + Eigen::Vector3d(5.0, -3.0, 7.0));
                               }),
                         moved(patch(kPlate), [&](const Eigen::Vector3d& p) {
                           return Eigen::Vector3d(0.15 * std::sin(p.x() / 0.15), p.y(),
                                                  0.15 * std::cos(p.x() / 0.15));
                         })};
  Scene cap;
  add_point(cap, 1.0, {0.0, 0.0, 0.0});
  add_point(cap, 1.0, {1.0, 0.3, 0.2});
  add_point(cap, 1.0, {0.4, 0.12 + 1e-6, 0.08});
  add_plate(cap, 0, 1, 2, kPlate);
  all.push_back(cap);
  cap.points[2].position = {1.0, 0.3 + 1e-6, 0.2};
  all.push_back(cap);
  return all;
}

TEST(Plates, RigidMotionsStrainNoPlate) {
  for (const Scene& scene : shapes()) {
    const Freedoms freedoms(scene);
    for (int motion = 0; motion < 6; ++motion) {
      const Eigen::Vector3d axis = Eigen::Vector3d::Unit(motion % 3);
      const bool rotates = motion >= 3;
      const Eigen::VectorXd u = freedoms_of(
          scene, [&](const Eigen::Vector3d& p) { return rotates ? Eigen::Vector3d(axis.cross(p)) : axis; },
          [&](const Eigen::Vector3d&) { return rotates ? axis : Eigen::Vector3d(0.0, 0.0, 0.0); });
      for (const Link& link : scene.links) {
        const Eigen::MatrixXd rows = dense(plate_rows(scene, link, freedoms), freedoms.num_all(), true);
        const Eigen::VectorXd strain = (rows * u).cwiseAbs(), size = rows.cwiseAbs() * u.cwiseAbs();
        // the bound allows some rounding errors of the terms, including positions up to 8 m away from the
        // triangle
        for (Eigen::Index row = 0; row < strain.size(); ++row)
          EXPECT_LE(strain[row], 16.0 * kEpsilon * size[row]);
      }
    }
  }
}

TEST(Plates, AFlatOrBentMeshHasSixRigidFreedomsAndNoMechanism) {
  for (const Scene& scene : shapes()) {
    if (scene.links.size() == 1) continue;
    const Structure structure = build(scene);
    EXPECT_EQ(structure.mass_properties.rigid_freedoms, 6);
    EXPECT_EQ(structure.omega.size(), 3 * static_cast<Eigen::Index>(scene.points.size()) - 6);
    EXPECT_TRUE(structure.mechanisms.empty());
    EXPECT_GT(structure.omega[0], 0.0);
  }
  // two plates have a common edge, and nothing else holds the two plates
  Scene hinge;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}})
    add_point(hinge, 1.0, {x, y, 0.0});
  add_plate(hinge, 0, 1, 2, kPlate);
  add_plate(hinge, 0, 2, 3, kPlate);
  const Structure structure = build(hinge);
  EXPECT_EQ(structure.omega.size(), 6);
  EXPECT_TRUE(structure.mechanisms.empty());
}

TEST(Plates, TheStiffnessDoesNotDependOnTheNumberingOfThePoints) {
  for (Scene scene : shapes()) {
    scene.links.resize(1);
    Link& link = scene.links[0];
    const Freedoms freedoms(scene);
    const Eigen::MatrixXd A = dense(plate_rows(scene, link, freedoms), freedoms.num_all());
    const Eigen::MatrixXd K = A.transpose() * A;
    double longest = 0.0, twice_area = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto at = [&](std::size_t n) {
        return scene.points[static_cast<std::size_t>(link.points[n % 3])].position;
      };
      longest = std::max(longest, (at(k + 1) - at(k)).norm());
      twice_area = (at(k + 1) - at(k)).cross(at(k + 2) - at(k)).norm();
    }
    // a rounding error rotates the normal by eps l / height
    const double tolerance = 16.0 * kEpsilon * longest * longest / twice_area * K.norm();
    std::sort(link.points.begin(), link.points.end());
    do {
      const Eigen::MatrixXd other = dense(plate_rows(scene, link, freedoms), freedoms.num_all());
      EXPECT_LT((other.transpose() * other - K).norm(), tolerance);
    } while (std::next_permutation(link.points.begin(), link.points.end()));
  }
}

TEST(Plates, TheHeightOfANeedleTriangleKeepsItsDigits) {
  Scene scene;
  const Eigen::Vector3d near(0.4, 0.7, 0.2), far(-0.3, 1.1, 1.9);
  const Eigen::Vector3d tip = near + 1e-7 * Eigen::Vector3d(1.0, 2.0, -1.0);
  for (const Eigen::Vector3d& p : {near, far, tip}) add_point(scene, 1.0, p);
  add_plate(scene, 0, 1, 2, kPlate);
  const DeformationRows rows = plate_rows(scene, scene.links[0], Freedoms(scene));
  const Eigen::MatrixXd first = dense({rows[0]}, 9 + 9, true);
  // The first row contains the gradients of the barycentric coordinates, which are 1 / height over the
  // opposite side. Positions are exact data, so extended precision with 64 bits gives the height with an
  // error of 1e-19 l / height.
  using Vector = Eigen::Matrix<long double, 3, 1>;
  const Vector a = tip.cast<long double>() - near.cast<long double>();
  const Vector b = far.cast<long double>() - near.cast<long double>();
  const auto height = static_cast<double>(a.cross(b).norm() / b.norm());
  const double gradient = first.row(0).segment(6, 3).norm();
  EXPECT_NEAR(gradient * height, 1.0, 16.0 * kEpsilon);
}

TEST(Plates, RoundingOfPositionsDoesNotSoftenAFlatPlate) {
  const Scene flat = plate_mesh(1.0, 1.0, 3, 3, unit_plate(0.3, 0.01));
  const Structure structure = build(flat);
  const auto compare = [&](const Scene& other, double tolerance) {
    const Structure found = build(other);
    ASSERT_EQ(found.omega.size(), structure.omega.size());
    for (Eigen::Index l = 0; l < found.omega.size(); ++l)
      EXPECT_NEAR(found.omega[l], structure.omega[l], tolerance * structure.omega[l]);
  };
  // after a quarter turn, positions are off the plane by about 6e-17, because the computed cos(pi / 2) is not
  // exactly zero; after a rotation by another angle all digits are rounded
  const Eigen::AngleAxisd quarter(std::acos(0.0), Eigen::Vector3d::UnitX());
  compare(moved(flat, [&](const Eigen::Vector3d& p) { return Eigen::Vector3d(quarter * p); }), 1e-11);
  const Eigen::Matrix3d axes = skew_axes();
  compare(moved(flat, [&](const Eigen::Vector3d& p) { return Eigen::Vector3d(axes * p); }), 1e-11);
  std::mt19937_64 engine(5);
  std::normal_distribution<double> normal;
  // positions have seven digits, as in a table, so the membrane stiffness increases the bending stiffness by
  // a fraction of (1e-7 / t)^2
  compare(
      moved(flat,
            [&](const Eigen::Vector3d& p) { return Eigen::Vector3d(p.x(), p.y(), 1e-7 * normal(engine)); }),
      1e-7);
}

}  // namespace
}  // namespace freeflex::testing
