// Makes the links of a scene at true geometry, and the Cartesian system that contains them. THEORY 10.12 to
// 10.25, of which 10.22 gives the stiffness of matrix links and 10.25 the damping matrix
#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "core/faults.hpp"
#include "core/scene/bodies.hpp"
#include "core/scene/link_kinds.hpp"
#include "tools/verification/reference/cartesian.hpp"
#include "tools/verification/reference/rotations.hpp"
#include "tools/verification/reference/steady_motion.hpp"

namespace freeflex {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

bool contains(const std::vector<int>& points, int point) {
  return std::find(points.begin(), points.end(), point) != points.end();
}

FittedFrame fitted(const std::vector<int>& points, const Matrix3Xd& rest) {
  return {points, VectorXd::Ones(static_cast<Eigen::Index>(points.size())), rest};
}

/// Returns orthonormal columns, orthogonal to the rigid motions of points at r (3 x n).
MatrixXd across_rigid_motions(const Matrix3Xd& r) {
  constexpr double kRank = 1e-10;
  MatrixXd motions(3 * r.cols(), 6);
  const double size = r.colwise().norm().maxCoeff();
  for (Eigen::Index k = 0; k < r.cols(); ++k)
    motions.middleRows<3>(3 * k) << Matrix3d::Identity(), -cross_matrix(r.col(k) / size);
  Eigen::ColPivHouseholderQR<MatrixXd> qr(motions);
  qr.setThreshold(kRank);
  const MatrixXd all = qr.householderQ() * MatrixXd::Identity(motions.rows(), motions.rows());
  return all.rightCols(motions.rows() - qr.rank());
}

}  // namespace

TrueGeometry::TrueGeometry(const Scene& scene, const VectorXd& mass, const Matrix3Xd& rest)
    : mass_(mass), r_(rest), joint_of_(scene.points.size(), -1) {
  std::vector<int> all(scene.points.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<int>(i);
  body_ = FittedFrame(all, mass, rest);
  num_links_ = static_cast<int>(scene.links.size());
  // bodies first, because they rotate joints
  for (const Link& link : scene.links)
    if (is_rigid(link)) add_body(link.points);
  for (int k = 0; k < num_links_; ++k)
    std::visit(Cases{[&](const Beam& beam) { add_beam(scene, k, beam); },
                     [&](const Plate& plate) { add_plate(scene, k, plate); },
                     [&](const BendingSpring& spring) { add_bend(scene, k, spring.stiffness); },
                     [&](const TorsionSpring& spring) { add_twist(scene, k, spring.stiffness); },
                     [&](const MatrixLink& matrix) { add_matrix(scene, k, matrix); },
                     [](const Rigid&) {},   // added above
                     [](const Spring&) {},  // springs, bars and dashpots are links of the Cartesian system
                     [](const Bar&) {}, [](const Dashpot&) {}},
               scene.links[static_cast<std::size_t>(k)].kind);
  find_idle_rotations();
  find_surroundings(scene);
}

void TrueGeometry::add_body(const std::vector<int>& points) {
  TrueBody body{fitted(points, r_), {}};
  body.forbidden = across_rigid_motions(body.frame.rest());
  bodies_.push_back(std::move(body));
}

int TrueGeometry::add_joint(int point) {
  int& index = joint_of_[static_cast<std::size_t>(point)];
  if (index >= 0) return index;
  TrueJoint joint;
  for (std::size_t k = 0; k < bodies_.size() && joint.body < 0; ++k) {
    const FittedFrame& frame = bodies_[k].frame;
    // a rigid link of two points rotates no joint
    if (frame.points().size() < 3 || !contains(frame.points(), point)) continue;
    joint.body = static_cast<int>(k);
    joint.num = frame.is_line() ? 1 : 0;
    for (std::size_t other = 0; other < joints_.size(); ++other)
      if (joints_[other].body == joint.body) return index = static_cast<int>(other);
  }
  joint.first = num_rotations_;
  num_rotations_ += joint.num;
  joints_.push_back(joint);
  return index = static_cast<int>(joints_.size()) - 1;
}

LinkEnd TrueGeometry::make_end(int point, const Matrix3d& axes, const std::array<bool, 3>& released) {
  LinkEnd end;
  end.joint = add_joint(point);
  end.rest = axes;
  if (released[0] && released[1] && released[2]) {
    // The joint does not hold this end at all, so the end gets a separate joint
    end.joint = static_cast<int>(joints_.size());
    joints_.push_back({-1, num_rotations_, 3});
    num_rotations_ += 3;
    return end;
  }
  end.first = num_rotations_;
  for (int axis = 0; axis < 3; ++axis)
    if (released[static_cast<std::size_t>(axis)]) end.released.push_back(axis);
  num_rotations_ += static_cast<int>(end.released.size());
  return end;
}

void TrueGeometry::add_beam(const Scene& scene, int index, const Beam& beam) {
  const Link& link = scene.links[static_cast<std::size_t>(index)];
  RotatingLink<TrueBeam> one{index, TrueBeam(beam, span_of(scene, link)), link.points, {}};
  for (std::size_t k = 0; k < 2; ++k)
    one.ends.push_back(make_end(link.points[k], one.kind.rest, beam.released[k]));
  const double L = one.kind.length;
  stiffnesses_.push_back(beam.EA / L);
  stiffnesses_.push_back(3.0 * std::min(beam.EI_y, beam.EI_z) / (L * L * L));
  beams_.push_back(std::move(one));
}

void TrueGeometry::add_plate(const Scene& scene, int index, const Plate& plate) {
  const Link& link = scene.links[static_cast<std::size_t>(index)];
  const auto position = [&](std::size_t k) -> const Vector3d& {
    return scene.points[static_cast<std::size_t>(link.points[k])].position;
  };
  RotatingLink<TruePlate> one{
      index, TruePlate(plate, {position(0), position(1), position(2)}), link.points, {}};
  for (const int point : link.points) one.ends.push_back(make_end(point, one.kind.rest, {}));
  const double side = one.kind.edges.col(0).norm();
  stiffnesses_.push_back(plate.E * plate.thickness);
  stiffnesses_.push_back(plate.E * std::pow(plate.thickness, 3) / (12.0 * side * side));
  plates_.push_back(std::move(one));
}

void TrueGeometry::add_matrix(const Scene& scene, int index, const MatrixLink& given) {
  const Link& link = scene.links[static_cast<std::size_t>(index)];
  TrueMatrix matrix{index, fitted(link.points, r_), MatrixXd(given.matrix)};
  // (1 - T T^T) K (1 - T T^T), where the columns of T are the rigid motions. A flexibility is inverted in the
  // space orthogonal to T (THEORY 3.12, 3.38)
  const MatrixXd across = across_rigid_motions(matrix.frame.rest());
  MatrixXd inner = across.transpose() * matrix.K * across;
  inner = (0.5 * (inner + inner.transpose())).eval();
  if (given.is_flexibility) inner = inner.ldlt().solve(MatrixXd::Identity(inner.rows(), inner.rows())).eval();
  matrix.K = across * inner * across.transpose();
  stiffnesses_.push_back(matrix.K.diagonal().maxCoeff());
  stiffnesses_.push_back(std::max(matrix.K.diagonal().minCoeff(), 1e-6 * stiffnesses_.back()));
  matrices_.push_back(std::move(matrix));
}

void TrueGeometry::find_surroundings(const Scene& scene) {
  surroundings_.resize(scene.points.size());
  for (const Load& load : scene.loads) {
    if (load.axes != Axes::kLocal) continue;
    for (const PointLoad& item : load.forces) {
      std::set<int> star{item.point};
      for (const Link& link : scene.links) {
        if (!contains(link.points, item.point)) continue;
        const bool is_body = is_rigid(link) && link.points.size() > 2;
        if (is_body) star = {item.point};
        star.insert(link.points.begin(), link.points.end());
        if (is_body) break;
      }
      surroundings_[static_cast<std::size_t>(item.point)] = fitted({star.begin(), star.end()}, r_);
    }
  }
}

namespace {

/// Returns the scene with only those links that have damped strain. Each stiffness is multiplied by
/// Rayleigh's beta plus the relaxation time of the link. Rigid links stay, because they rotate the ends of
/// beams and plates at their points. Springs, bars and dashpots are omitted, because they are damped at their
/// true length.
Scene damped_links(const Scene& scene) {
  Scene damped = scene;
  damped.loads.clear();
  std::erase_if(damped.links, [&](const Link& link) {
    const LinkTraits traits = traits_of(link);
    if (is_rigid(link)) return false;
    return traits.is_axial || traits.effect != LinkEffect::kStrains ||
           scene.damping.beta + link.viscous == 0.0;
  });
  for (Link& link : damped.links) {
    const double factor = scene.damping.beta + link.viscous;
    std::visit(
        Cases{[&](Beam& beam) {
                for (double* value : {&beam.EA, &beam.GJ, &beam.EI_y, &beam.EI_z, &beam.GA_y, &beam.GA_z})
                  *value *= factor;
              },
              [&](Plate& plate) { plate.E *= factor; },
              [&](BendingSpring& spring) { spring.stiffness *= factor; },
              [&](TorsionSpring& spring) { spring.stiffness *= factor; },
              [&](MatrixLink& matrix) { matrix.matrix *= matrix.is_flexibility ? 1.0 / factor : factor; },
              // not in the list: these links are damped at their true length, or not at all
              [](Spring&) {}, [](Bar&) {}, [](Dashpot&) {}, [](Rigid&) {}},
        link.kind);
  }
  return damped;
}

/// Returns the damping matrix over V', from modal damping and from links that are not axial   (THEORY 10.25):
///   C_d = sum_links (beta_R + tau) K_rest + m (sum_l (2 zeta_l omega_l + alpha_R) psi_l psi_l^T) m
/// with K_rest [N/m] the stiffness of an undeformed link and psi_l [1/sqrt(kg)] the modes of the undeformed
/// structure.
MatrixXd damping_matrix(const Scene& scene, const CartesianSystem& system) {
  const Eigen::Index n = system.mass.size();
  MatrixXd C = MatrixXd::Zero(3 * n, 3 * n);
  const Scene links = damped_links(scene);
  if (!links.links.empty()) {
    const TrueGeometry damped(links, system.mass, system.r);
    C = stiffness_at_rest(damped, system);
  }
  const Damping& damping = scene.damping;
  const bool has_losses = std::any_of(scene.links.begin(), scene.links.end(),
                                      [](const Link& link) { return link.loss_factor != 0.0; });
  if (damping.modal_ratio == 0.0 && damping.mode_ratios.empty() && damping.alpha == 0.0 && !has_losses)
    return C;
  const RestModes modes = rest_modes(system);
  VectorXd ratio = VectorXd::Constant(modes.omega.size(), damping.modal_ratio);
  for (const auto& [mode, value] : damping.mode_ratios)
    if (mode >= 1 && mode <= ratio.size()) ratio[mode - 1] = value;
  if (has_losses) {
    VectorXd loss(static_cast<Eigen::Index>(scene.links.size()));
    for (Eigen::Index k = 0; k < loss.size(); ++k)
      loss[k] = scene.links[static_cast<std::size_t>(k)].loss_factor;
    for (Eigen::Index mode = 0; mode < ratio.size(); ++mode) {
      const VectorXd energy = energies_of_mode(system, modes.shapes.col(mode));
      if (energy.sum() > 0.0) ratio[mode] += 0.5 * loss.dot(energy) / energy.sum();
    }
  }
  const VectorXd rate =
      2.0 * ratio.cwiseProduct(modes.omega) + VectorXd::Constant(modes.omega.size(), damping.alpha);
  // shapes are orthonormal in the mass metric
  const VectorXd mass = system.mass.transpose().replicate<3, 1>().reshaped();
  const MatrixXd weighted = mass.asDiagonal() * modes.shapes;
  return C + weighted * rate.asDiagonal() * weighted.transpose();
}

/// Returns the first item of the scene that the reference does not have.
/// \param takes_massless  true: massless points are allowed where nothing damps them
std::optional<Fault> find_refusal(const Scene& scene, bool takes_massless) {
  const auto fault = [](const Origin& origin, const auto&... parts) {
    return Fault{Fault::Severity::kError, origin, join_text(parts...)};
  };
  for (std::size_t k = 0; k < scene.points.size(); ++k) {
    const PointMass& point = scene.points[k];
    const std::string who = "point " + quoted(point.name, static_cast<int>(k));
    const auto holds = [&](const Link& link) {
      return contains(link.points, static_cast<int>(k)) &&
             (link.viscous > 0.0 || traits_of(link).effect != LinkEffect::kStrains);
    };
    const bool is_damped = scene.damping.beta + scene.damping.alpha + scene.damping.modal_ratio > 0.0 ||
                           !scene.damping.mode_ratios.empty() || std::ranges::any_of(scene.links, holds);
    if (point.mass <= 0.0 && (!takes_massless || is_damped))
      return fault(point.origin, who, " has the mass ", point.mass,
                   " kg, but every point of the reference must have mass; give it mass");
  }
  for (std::size_t k = 0; k < scene.links.size(); ++k)
    if (has_mass(scene.links[k]))
      return fault(
          scene.links[k].origin, "link ", called(scene.links[k], static_cast<int>(k)),
          " has distributed mass, but the reference has mass at points only; give the mass to points, "
          "or set lumped: true for a beam, bar or plate");
  if (!scene.feedbacks.empty())
    return fault(scene.feedbacks[0].origin, "feedback ", quoted(scene.feedbacks[0].name, 0),
                 " acts on elastic displacements, which the reference does not have; remove it");
  if (!scene.initial.modes.empty())
    return fault({},
                 "initial.modes sets modes, which the reference does not have; give the initial elastic "
                 "state by points");
  return std::nullopt;
}

}  // namespace

namespace {

/// Adds the wheels and the torques on bodies of a scene to the system of its copy   (THEORY 10.29).
void add_moments(const Scene& scene, CartesianSystem& system) {
  const TrueGeometry& geometry = *system.true_geometry;
  const auto body_at = [&](int point) {
    int body = 0;
    while (!contains(geometry.body_frame(body).points(), point)) ++body;
    return body;
  };
  for (const Wheel& wheel : scene.wheels)
    system.wheels.push_back({body_at(wheel.point), wheel.axis, wheel.momentum});
  for (std::size_t k = 0; k < scene.loads.size(); ++k) {
    CartesianLoad& load = system.loads[k];
    for (const TorqueLoad& each : scene.loads[k].torques)
      load.body_torques.emplace_back(body_at(each.point), each.torque);
    for (const WheelLoad& each : scene.loads[k].wheels)
      load.wheel_torques.emplace_back(each.wheel, each.torque);
    if (load.axes == Axes::kBody && !load.body_torques.empty()) system.needs_body_axes = true;
  }
}

std::optional<CartesianSystem> make_of_points(const Scene& scene, std::string& error) {
  if (const auto fault = find_refusal(scene, true)) {
    error = fault->message;
    return std::nullopt;
  }
  CartesianSystem system = make_axial_system(scene);
  for (int i = 0; i < static_cast<int>(scene.points.size()); ++i)
    if (scene.points[static_cast<std::size_t>(i)].mass == 0.0) system.massless.points.push_back(i);
  system.true_geometry.emplace(scene, system.mass, system.r);
  TrueGeometry& geometry = *system.true_geometry;
  const MatrixXd C = damping_matrix(scene, system);
  if (!C.isZero(0.0)) geometry.set_damping(C);
  if (geometry.has_rigid_links()) {
    const Eigen::Index n = system.mass.size();
    Eigen::Map<Matrix3Xd> e(system.initial.data(), 3, n), e_dot(system.initial.data() + 3 * n, 3, n);
    geometry.project(e, e_dot);
    // the constraint errors decay at ten times the rate of the initial motion, and at no less than a tenth of
    // the highest frequency of a single link
    double rate = 10.0 * (system.spin.norm() + e_dot.cwiseAbs().maxCoeff() / system.r.cwiseAbs().maxCoeff());
    for (const CartesianLink& link : system.links)
      rate = std::max(rate, 0.1 * std::sqrt(link.stiffness / system.mass.maxCoeff()));
    for (const double stiffness : geometry.stiffnesses())
      rate = std::max(rate, 0.1 * std::sqrt(stiffness / system.mass.maxCoeff()));
    geometry.set_correction(rate);
  }
  return system;
}

}  // namespace

std::optional<CartesianSystem> make_true_geometry(const Scene& scene, std::string& error) {
  error.clear();
  if (!has_bodies(scene)) return make_of_points(scene, error);
  Fault why;
  const std::optional<PointCopy> copy = copy_bodies(scene, why);
  if (!copy) {
    error = why.message;
    return std::nullopt;
  }
  auto system = make_of_points(copy->scene, error);
  if (!system) return std::nullopt;
  system->carried = copy->carried;
  add_moments(scene, *system);
  return system;
}

namespace {

/// Returns the system of springs and bars without dissipation and attractor, or nullopt for other scenes.
std::optional<CartesianSystem> make_conservative_axial(const Scene& scene) {
  if (has_bodies(scene)) return std::nullopt;
  std::string error;
  std::optional<CartesianSystem> system = make_cartesian_system(scene, error);
  const auto is_damped = [](const CartesianLink& link) { return link.damping > 0.0; };
  const bool fits = system && system->attractor_mu == 0.0 &&
                    std::none_of(system->links.begin(), system->links.end(), is_damped);
  return fits ? std::move(system) : std::nullopt;
}

}  // namespace

std::optional<Fault> find_no_full_system(const Scene& scene) {
  if (make_conservative_axial(scene)) return std::nullopt;
  if (scene.points.size() > kMostTruePoints)
    return Fault{
        Fault::Severity::kError,
        {},
        join_text("the scene has ", scene.points.size(), " points, but at most ", kMostTruePoints,
                  " are allowed with damping, an attractor, or links other than springs and bars; use "
                  "a coarser mesh")};
  if (!has_bodies(scene)) return find_refusal(scene, false);
  Fault why;
  const std::optional<PointCopy> copy = copy_bodies(scene, why);
  if (!copy) return why;
  return find_refusal(copy->scene, false);
}

CartesianSystem make_full_system(const Scene& scene) {
  if (auto axial = make_conservative_axial(scene)) return std::move(*axial);
  std::string error;
  return make_true_geometry(scene, error).value();
}

}  // namespace freeflex
