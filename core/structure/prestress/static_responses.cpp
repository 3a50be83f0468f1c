#include "core/structure/prestress/static_responses.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <set>

#include "core/scene/bodies.hpp"
#include "core/structure/masses/particles.hpp"
#include "core/structure/modes/sparse/sparse_system.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Kind = ReferenceLoad::Kind;

// [-] The response by the sparse factor has converged when its residual is below this share.
constexpr double kConverged = 1e-9;
constexpr int kMostSteps = 100;

// S r of a field whose components S_ab and S_ba are 1.
Vector3d field_at(const Vector3d& r, int component) {
  const auto [a, b] = kAxisPairs[index(component)];
  return a == b ? Vector3d(r[a] * Vector3d::Unit(a))
                : Vector3d(r[a] * Vector3d::Unit(b) + r[b] * Vector3d::Unit(a));
}

// Solves K v = f by conjugate gradients in the metric m for (1 - shift B) v = g, with B = (K + shift m)^-1 m
// and g = (K + shift m)^-1 f   (THEORY 8.51). On failure the result has no columns.
template <typename Inverse>
MatrixXd solve_unshifted(const SparseRows& mass, const Inverse& inverse, double shift, const MatrixXd& f) {
  const auto square = [](const MatrixXd& x, const MatrixXd& mass_y) {
    return x.cwiseProduct(mass_y).colwise().sum().transpose().eval();
  };
  MatrixXd g = inverse(f);
  if (g.cols() != f.cols()) return g;
  MatrixXd v = MatrixXd::Zero(f.rows(), f.cols()), r = g, p = r, mass_p = mass * p;
  VectorXd left = square(r, mass_p);
  const VectorXd whole = left;
  for (int step = 0; step < kMostSteps; ++step) {
    if ((left.array() <= kConverged * kConverged * whole.array()).all()) break;
    MatrixXd image = inverse(mass_p);
    if (image.cols() != f.cols()) return image;
    image = (p - shift * image).eval();
    const VectorXd curvature = square(image, mass_p);
    VectorXd length = (curvature.array() > 0.0).select(left.cwiseQuotient(curvature), 0.0);
    v += p * length.asDiagonal();
    r -= image * length.asDiagonal();
    const VectorXd next = square(r, mass * r);
    const VectorXd keep = (left.array() > 0.0).select(next.cwiseQuotient(left), 0.0);
    p = (r + p * keep.asDiagonal()).eval();
    mass_p = mass * p;
    left = next;
  }
  // v of freedoms without mass follows from that of the others
  const MatrixXd image = inverse(mass * v);
  return image.cols() == f.cols() ? MatrixXd(g + shift * image) : image;
}

}  // namespace

double softest_of_load(const Eigen::VectorXd& omega) {
  constexpr double kStiff = 5.0;
  double lowest = 0.0;
  for (Index l = 0; l < omega.size() && lowest == 0.0; ++l) lowest = omega[l];
  return kStiff * lowest;
}

std::vector<ReferenceLoad> command_components(const Scene& scene) {
  std::vector<ReferenceLoad> all;
  const auto add = [&](Kind kind, int item) {
    for (int axis = 0; axis < 3; ++axis) all.push_back({kind, item, axis});
  };
  const std::set<int> pushable(scene.pushable.begin(), scene.pushable.end());
  for (const int point : pushable) {
    add(Kind::kForce, point);
    if (has_attitude(scene.points[index(point)])) add(Kind::kTorque, point);
  }
  for (int group = 0; group < static_cast<int>(scene.groups.size()); ++group)
    add(Kind::kGroupForce, group), add(Kind::kGroupTorque, group);
  for (int wheel = 0; wheel < static_cast<int>(scene.wheels.size()); ++wheel)
    if (pushable.contains(scene.wheels[index(wheel)].point)) all.push_back({Kind::kMotor, wheel, 0});
  return all;
}

std::vector<ReferenceLoad> reference_loads(const Scene& scene, bool is_large) {
  std::vector<ReferenceLoad> all;
  const RungTraits& rung = traits_of(scene.fidelity);
  // `fidelity: auto` uses the rung `coupled` where others are not possible
  const bool may_couple = (rung.couples && !rung.has_true_geometry) || scene.automatic.has_value();
  const bool is_full = !is_large || may_couple;
  if (is_full)
    for (int component = 0; component < 6; ++component) all.push_back({Kind::kField, -1, component});
  for (int k = 0; k < static_cast<int>(scene.loads.size()); ++k) {
    const Load& load = scene.loads[index(k)];
    if (load.axes == Axes::kLocal || (is_full && load.axes == Axes::kBody))
      all.push_back({Kind::kBuiltIn, k, 0});
    if (!is_full || load.axes != Axes::kWorld) continue;
    for (int a = 0; a < 3; ++a) {
      double most = 0.0;
      for (const PointLoad& each : load.forces) most = std::max(most, std::abs(each.force[a]));
      for (const TorqueLoad& each : load.torques) most = std::max(most, std::abs(each.torque[a]));
      for (const WrenchLoad& each : load.wrenches)
        most = std::max({most, std::abs(each.force[a]), std::abs(each.torque[a])});
      for (int b = 0; b < 3 && most > 0.0; ++b) all.push_back({Kind::kBuiltIn, k, 3 * a + b});
    }
    if (!load.wheels.empty()) all.push_back({Kind::kBuiltIn, k, ReferenceLoad::kMotorsOnly});
  }
  if (!may_couple) return all;
  const std::vector<ReferenceLoad> commands = command_components(scene);
  if (commands.size() <= kMostCommandComponents) all.insert(all.end(), commands.begin(), commands.end());
  return all;
}

namespace {

// Returns a component of a command as a load in body axes.
Load command_load(const ReferenceLoad& reference) {
  Load load;
  load.axes = Axes::kBody;
  const Vector3d unit = Vector3d::Unit(reference.component), zero = Vector3d::Zero();
  switch (reference.kind) {
    case Kind::kForce:
      load.forces.push_back({reference.item, unit});
      break;
    case Kind::kTorque:
      load.torques.push_back({reference.item, unit});
      break;
    case Kind::kGroupForce:
      load.wrenches.push_back({reference.item, unit, zero});
      break;
    case Kind::kGroupTorque:
      load.wrenches.push_back({reference.item, zero, unit});
      break;
    case Kind::kMotor:
      load.wheels.push_back({reference.item, 1.0});
      break;
    case Kind::kField:
    case Kind::kBuiltIn:
      break;
  }
  return load;
}

}  // namespace

VectorXd forces_of(const Scene& scene, const Freedoms& freedoms, const Eigen::Matrix3Xd& r,
                   const ReferenceLoad& reference) {
  const Load load = reference.is_command() ? command_load(reference) : scene.loads[index(reference.item)];
  const bool is_world = load.axes == Axes::kWorld,
             has_motors = !is_world || reference.component == ReferenceLoad::kMotorsOnly;
  VectorXd f = VectorXd::Zero(freedoms.num_all());
  const auto acting = [&](const Vector3d& v) {
    return is_world ? Vector3d(v[reference.component / 3] * Vector3d::Unit(reference.component % 3)) : v;
  };
  for (const WheelLoad& each : load.wheels) {
    if (!has_motors) break;
    const Wheel& wheel = scene.wheels[index(each.wheel)];
    f.segment<3>(freedoms.rotation(wheel.point)) -= each.torque * wheel.axis;
  }
  if (is_world && has_motors) return f;
  for (const PointLoad& each : load.forces) f.segment<3>(3 * Index{each.point}) += acting(each.force);
  for (const TorqueLoad& each : load.torques)
    f.segment<3>(freedoms.rotation(each.point)) += acting(each.torque);
  for (const WrenchLoad& each : load.wrenches) {  // F_i = (m_i / m_g) F + m_i (J_g^-1 T) x d_i   (THEORY 8.8)
    const std::vector<int>& points = scene.groups[index(each.group)].points;
    double mass = 0.0;
    Vector3d centre = Vector3d::Zero();
    for (const int point : points) {
      mass += scene.points[index(point)].mass;
      centre += scene.points[index(point)].mass * r.col(point);
    }
    if (mass == 0.0) continue;
    centre /= mass;
    Eigen::Matrix3d J = Eigen::Matrix3d::Zero();
    for (const int point : points) {
      const Vector3d d = r.col(point) - centre;
      J += scene.points[index(point)].mass *
           (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
    }
    const Vector3d turn = J.completeOrthogonalDecomposition().solve(acting(each.torque));
    for (const int point : points)
      f.segment<3>(3 * Index{point}) +=
          scene.points[index(point)].mass * (acting(each.force) / mass + turn.cross(r.col(point) - centre));
  }
  return f;
}

StaticResponses static_responses(const Scene& scene, const Structure& structure) {
  StaticResponses responses{reference_loads(scene, false), {}, {}};
  const Freedoms freedoms(scene);
  const Index n = structure.omega.size();
  MatrixXd q = MatrixXd::Zero(n, static_cast<Index>(responses.loads.size()));
  for (std::size_t k = 0; k < responses.loads.size(); ++k) {
    const ReferenceLoad& reference = responses.loads[k];
    auto Q = q.col(static_cast<Index>(k));
    if (reference.is_field()) {
      const auto [a, b] = kAxisPairs[index(reference.component)];
      for (Index l = 0; l < n; ++l) Q[l] = (a == b ? 1.0 : 2.0) * field_moments(structure, l)(a, b);
    } else {
      const VectorXd f = forces_of(scene, freedoms, structure.mass_properties.r, reference);
      Q = structure.shapes.transpose() * f.head(structure.shapes.rows());
      if (structure.rotations.rows() > 0)
        Q += structure.rotations.transpose() * f.tail(structure.rotations.rows());
    }
    const double soft = softest_of_load(structure.omega);
    for (Index l = 0; l < n; ++l) {
      const double stiffness = structure.mass_properties.mass * structure.omega[l] * structure.omega[l];
      Q[l] = structure.omega[l] > soft ? Q[l] / stiffness : 0.0;
    }
  }
  responses.shapes = structure.shapes * q;
  if (structure.rotations.rows() > 0) responses.rotations = structure.rotations * q;
  return responses;
}

// u = x omega^-2 x^T f + v. f acts on v without the share of rigid motions and known modes   (THEORY 8.51).
StaticResponses static_responses(const Scene& scene, const Freedoms& freedoms, const SparseSystem& system,
                                 const Eigen::Matrix3Xd& r, const MatrixXd& x, const VectorXd& omega,
                                 ShiftedInverse& inverse) {
  StaticResponses responses{reference_loads(scene, true), {}, {}};
  const auto count = static_cast<Index>(responses.loads.size());
  MatrixXd f(system.num_all(), count);
  for (Index k = 0; k < count; ++k) {
    const ReferenceLoad& reference = responses.loads[index(k)];
    if (!reference.is_field()) {
      f.col(k) = forces_of(scene, freedoms, r, reference);
      f.col(k).tail(freedoms.num_rotations()) /= system.length;  // per y = length theta
      continue;
    }
    VectorXd field = VectorXd::Zero(system.num_all());
    for (Index i = 0; i < r.cols() && 3 * i < system.num_displacements; ++i)
      field.segment<3>(3 * i) = field_at(r.col(i), reference.component);
    f.col(k) = system.mass * field;
  }
  MatrixXd known(x.rows(), system.rigid.cols() + x.cols());
  known << system.rigid, x;
  const MatrixXd mass_known = system.mass * known;
  const auto deflate = [&](MatrixXd& v) {
    subtract(known, known.cols(), products(mass_known, known.cols(), v), v);
  };
  const MatrixXd share = products(known, known.cols(), f);
  subtract(mass_known, known.cols(), share, f);
  const auto shifted = [&](const MatrixXd& forces) {
    MatrixXd out = inverse.apply(forces);
    if (out.cols() == count) deflate(out);
    return out;
  };
  MatrixXd v = solve_unshifted(system.mass, shifted, inverse.shift(), f);
  if (v.cols() != count) return {};
  MatrixXd q = share.bottomRows(x.cols());
  for (Index k = 0; k < count; ++k) {
    const double soft = softest_of_load(omega);
    for (Index l = 0; l < x.cols(); ++l) q(l, k) = omega[l] > soft ? q(l, k) / (omega[l] * omega[l]) : 0.0;
  }
  v += x * q;
  responses.shapes = v.topRows(system.num_displacements);
  responses.rotations =
      scaled_rotations(v, freedoms.num_rotations(), VectorXd::Constant(count, 1.0 / system.length));
  rotate_with_bodies(scene, freedoms, responses.shapes, responses.rotations);
  return responses;
}

}  // namespace freeflex
