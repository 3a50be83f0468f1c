// Makes Cartesian systems from scenes, and refuses scenes that the reference cannot represent. THEORY 10.1,
// 10.5 to 10.7: the unknowns, the damping of axial links, loads and initial state, the attractor
#include <cmath>

#include "core/scene/bodies.hpp"
#include "core/scene/link_kinds.hpp"
#include "core/structure/modes/dense/decompositions.hpp"
#include "tools/verification/reference/cartesian.hpp"
#include "tools/verification/reference/rotations.hpp"

namespace freeflex {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

/// Pseudo-inverse [1/(kg m^2)] of the inertia of points about their centre of mass, and its rank.
struct Inertia {
  Matrix3d inverse = Matrix3d::Zero();
  int rank = 0;
};
Inertia inverse_inertia(const Eigen::VectorXd& mass, const Matrix3Xd& d) {
  Matrix3d inertia = Matrix3d::Zero();
  for (Eigen::Index i = 0; i < mass.size(); ++i) {
    inertia += mass[i] * (d.col(i).squaredNorm() * Matrix3d::Identity() - d.col(i) * d.col(i).transpose());
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(inertia);
  Inertia result;
  for (int k = 0; k < 3; ++k) {
    const double moment = solver.eigenvalues()[k];
    if (moment <= kNoMoment * solver.eigenvalues()[2]) continue;
    const Vector3d axis = solver.eigenvectors().col(k);
    result.inverse += axis * axis.transpose() / moment;
    ++result.rank;
  }
  return result;
}

std::string find_refusal(const Scene& scene) {
  if (!are_point_masses(scene)) return "the Cartesian reference supports point masses only";
  for (std::size_t k = 0; k < scene.links.size(); ++k) {
    const Link& link = scene.links[k];
    const std::string who = "link " + called(link, static_cast<int>(k));
    if (!traits_of(link).is_axial) {
      return who +
             " is not a spring, bar or dashpot, and the Cartesian reference supports no other links, because "
             "a beam or a matrix " +
             "is linear in the displacements and has no true length";
    }
    if (link.loss_factor != 0.0)
      return who + " has a loss factor, which acts on modes, but the Cartesian reference has no modes";
  }
  if (!scene.feedbacks.empty())
    return "feedback acts on elastic displacements, which the Cartesian reference does not have";
  for (const Load& load : scene.loads)
    if (load.axes == Axes::kLocal)
      return "load '" + load.name +
             "' has local axes, which follow an elastic rotation, but points have no rotation";
  if (scene.damping.modal_ratio != 0.0 || !scene.damping.mode_ratios.empty() || scene.damping.alpha != 0.0) {
    return "the Cartesian reference supports stiffness-proportional damping (beta) only; modal ratios and "
           "alpha act on elastic coordinates, which it does not have";
  }
  if (!scene.initial.modes.empty()) {
    return "the Cartesian reference has no modes; give the initial elastic state by points";
  }
  return {};
}

void add_wrench(const CartesianSystem& system, const Group& group, const WrenchLoad& wrench,
                CartesianLoad& load) {
  const auto count = static_cast<Eigen::Index>(group.points.size());
  Eigen::VectorXd mass(count);
  Matrix3Xd d(3, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const int point = group.points[index(k)];
    mass[k] = system.mass[point];
    d.col(k) = system.r.col(point);
  }
  const Vector3d centre = d * mass / mass.sum();
  d.colwise() -= centre;
  const Inertia inertia = inverse_inertia(mass, d);
  CartesianLoad::Torque torque;
  torque.torque = wrench.torque;
  torque.points = group.points;
  for (Eigen::Index k = 0; k < count; ++k) {
    load.forces.push_back({torque.points[index(k)], mass[k] / mass.sum() * wrench.force});
    torque.force_per_torque.emplace_back(-mass[k] * cross_matrix(d.col(k)) * inertia.inverse);
  }
  if (!wrench.torque.isZero(0.0)) load.torques.push_back(std::move(torque));
}

void add_loads(const Scene& scene, CartesianSystem& system) {
  for (const Load& given : scene.loads) {
    CartesianLoad load;
    load.axes = given.axes;
    load.forces = given.forces;
    load.history = given.history;
    for (const WrenchLoad& wrench : given.wrenches) {
      add_wrench(system, scene.groups[index(wrench.group)], wrench, load);
    }
    system.needs_body_axes = system.needs_body_axes || load.axes == Axes::kBody || !load.torques.empty();
    system.loads.push_back(std::move(load));
  }
}

/// Removes rigid motion from displacements or their rates, so that they meet Eckart's conditions
/// (THEORY 2.12):
///   sum m V = 0,   sum m r x V = 0
void remove_rigid_part(const CartesianSystem& system, const Matrix3d& inverse, Eigen::Ref<Matrix3Xd> V) {
  const Vector3d mean = V * system.mass / system.mass.sum();
  V.colwise() -= mean;
  Vector3d moment = Vector3d::Zero();
  for (Eigen::Index i = 0; i < V.cols(); ++i) {
    moment += system.mass[i] * Vector3d(system.r.col(i)).cross(Vector3d(V.col(i)));
  }
  const Vector3d angle = inverse * moment;
  for (Eigen::Index i = 0; i < V.cols(); ++i) V.col(i) -= angle.cross(Vector3d(system.r.col(i)));
}

void set_initial(const Scene& scene, const Vector3d& p_SB, const Matrix3d& inverse, CartesianSystem& system) {
  const Eigen::Index n = system.mass.size();
  const Initial& initial = scene.initial;
  system.q_WB =
      Eigen::Quaterniond(initial.attitude[0], initial.attitude[1], initial.attitude[2], initial.attitude[3]);
  system.q_WB.normalize();
  system.p_WB = initial.position + system.q_WB * p_SB;
  system.v_WB = initial.velocity;
  system.spin = initial.angular_velocity;
  system.initial = Eigen::VectorXd::Zero(6 * n);
  Eigen::Map<Matrix3Xd> V(system.initial.data(), 3, n), V_dot(system.initial.data() + 3 * n, 3, n);
  for (const Initial::PointElastic& item : initial.points) {
    V.col(item.point) += item.displacement;
    V_dot.col(item.point) += item.velocity;
  }
  if (initial.points.empty()) return;
  remove_rigid_part(system, inverse, V);
  remove_rigid_part(system, inverse, V_dot);
}

}  // namespace

CartesianSystem make_axial_system(const Scene& scene) {
  const auto n = static_cast<Eigen::Index>(scene.points.size());
  CartesianSystem system;
  system.mass.resize(n);
  system.r.resize(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    system.mass[i] = scene.points[index(i)].mass;
    system.r.col(i) = scene.points[index(i)].position;
  }
  const Vector3d p_SB = system.r * system.mass / system.mass.sum();
  system.r.colwise() -= p_SB;
  for (std::size_t k = 0; k < scene.links.size(); ++k) {
    const Link& given = scene.links[k];
    if (!traits_of(given).is_axial) continue;
    CartesianLink link;
    link.link = static_cast<int>(k);
    link.first = given.points[0];
    link.second = given.points[1];
    // the difference is taken between coordinates of the scene, because a shift to the centre of mass would
    // round them
    link.rest = scene.points[index(link.second)].position - scene.points[index(link.first)].position;
    link.length = link.rest.norm();
    // c = (beta_R + tau) D   (THEORY 10.5)
    const auto strain = [&](double stiffness) {
      link.stiffness = stiffness;
      link.damping = (scene.damping.beta + given.viscous) * stiffness;
    };
    std::visit(Cases{[&](const Bar& bar) { strain(bar.EA / link.length); },
                     [&](const Spring& spring) { strain(spring.stiffness); },
                     [&](const Dashpot& dashpot) { link.damping = dashpot.damping; }, [](const Beam&) {},
                     [](const Plate&) {}, [](const BendingSpring&) {}, [](const TorsionSpring&) {},
                     [](const MatrixLink&) {}, [](const Rigid&) {}},
               given.kind);
    system.links.push_back(link);
  }
  system.gravity_W = scene.gravity;
  add_loads(scene, system);
  set_initial(scene, p_SB, inverse_inertia(system.mass, system.r).inverse, system);
  system.attractor_mu = scene.attractor.mu;
  system.attractor_W = scene.attractor.position;
  if (system.attractor_mu > 0.0) {
    // the carrier falls with the acceleration g_W = g(p_WB(0))   (THEORY 10.7)
    const Vector3d rho = system.p_WB - system.attractor_W;
    system.gravity_W = -system.attractor_mu / std::pow(rho.norm(), 3) * rho;
  }
  return system;
}

std::optional<CartesianSystem> make_cartesian_system(const Scene& scene, std::string& error) {
  error = find_refusal(scene);
  if (!error.empty()) return std::nullopt;
  CartesianSystem system = make_axial_system(scene);
  if (system.needs_body_axes && inverse_inertia(system.mass, system.r).rank < 3) {
    error =
        "body-axis loads and torques on a collinear shape need its rotation about its own line, which the "
        "Cartesian points do not define";
    return std::nullopt;
  }
  return system;
}

}  // namespace freeflex
