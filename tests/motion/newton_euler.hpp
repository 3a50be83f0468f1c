// The Newton-Euler equations of rigid bodies with rotors, joined by springs at true length and direction.
// These equations are the reference for bodies and wheels on the rung `coupled`. This file is header only.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <vector>

#include "core/step/readout.hpp"
#include "tests/motion/lagrange_equations.hpp"
#include "tests/motion/rotations.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/simulation.hpp"

namespace freeflex::testing {

/// The system consists of rigid bodies, and each body has its own attitude. Springs at true length and
/// direction join arms of the bodies.
struct NewtonEuler {
  struct Rotor {
    int body;
    Eigen::Vector3d axis;     // in the axes of the body
    double momentum, torque;  // [N m s] at the start, [N m] constant
  };
  struct Spring {
    int first, second;           // bodies
    Eigen::Vector3d arm, other;  // [m] from the centre of each body, in its axes
    double stiffness, length;    // [N/m], [m]
  };
  std::vector<double> mass;
  std::vector<Eigen::Matrix3d> J;
  std::vector<Spring> springs;
  std::vector<Rotor> rotors;

  /// Returns dy/dt for y = (position, velocity, attitude x y z w, angular velocity in the axes of the body)
  /// of each body.
  Eigen::VectorXd rates(double t, const Eigen::VectorXd& y) const {
    Eigen::VectorXd dot(y.size());
    std::vector<Eigen::Vector3d> force(mass.size(), Eigen::Vector3d::Zero()), torque = force;
    const auto attitude = [&](std::size_t k) {
      return Eigen::Quaterniond(Eigen::Vector4d(y.segment<4>(13 * static_cast<Eigen::Index>(k) + 6)))
          .normalized();
    };
    for (const Spring& spring : springs) {
      const auto i = static_cast<std::size_t>(spring.first), j = static_cast<std::size_t>(spring.second);
      const Eigen::Vector3d arm = attitude(i) * spring.arm, other = attitude(j) * spring.other;
      const Eigen::Vector3d span =
          y.segment<3>(13 * spring.second) + other - y.segment<3>(13 * spring.first) - arm;
      const Eigen::Vector3d pull = spring.stiffness * (span.norm() - spring.length) * span.normalized();
      force[i] += pull;
      force[j] -= pull;
      torque[i] += arm.cross(pull);
      torque[j] -= other.cross(pull);
    }
    for (std::size_t k = 0; k < mass.size(); ++k) {
      const Eigen::Index at = 13 * static_cast<Eigen::Index>(k);
      const Eigen::Vector3d w = y.segment<3>(at + 10), half = 0.5 * w;
      const Eigen::Quaterniond now(Eigen::Vector4d(y.segment<4>(at + 6)));
      dot.segment<3>(at) = y.segment<3>(at + 3);
      dot.segment<3>(at + 3) = force[k] / mass[k];
      dot.segment<4>(at + 6) = (now * Eigen::Quaterniond(0.0, half.x(), half.y(), half.z())).coeffs();
      Eigen::Vector3d momentum = J[k] * w, motors = Eigen::Vector3d::Zero();
      for (const Rotor& rotor : rotors) {
        if (rotor.body != static_cast<int>(k)) continue;
        momentum += (rotor.momentum + rotor.torque * t) * rotor.axis;
        motors += rotor.torque * rotor.axis;
      }
      dot.segment<3>(at + 10) =
          J[k].inverse() * (attitude(k).inverse() * torque[k] - motors - w.cross(momentum));
    }
    return dot;
  }
};

inline Eigen::Quaterniond exponential(const Eigen::Vector3d& theta) {
  const double angle = theta.norm();
  return angle == 0.0 ? Eigen::Quaterniond::Identity()
                      : Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d(theta / angle)));
}

/// Holds three bodies on an axis, each with three arms. A spring joins every arm of a body to every arm of
/// the next body.
struct Stack {
  Scene scene;
  NewtonEuler truth;
  Stack() {
    constexpr std::array<double, 3> kAt{0.0, 0.7, 1.5};
    for (std::size_t k = 0; k < 3; ++k) {
      add_point(scene, 2.0 + static_cast<double>(k), {0.0, 0.0, kAt[k]});
      scene.points.back().inertia =
          Eigen::Vector3d(0.2 + 0.05 * static_cast<double>(k), 0.25, 0.36).asDiagonal();
      truth.mass.push_back(scene.points.back().mass);
      truth.J.push_back(scene.points.back().inertia);
    }
    std::vector<std::array<int, 3>> arms;
    for (int k = 0; k < 3; ++k) {
      std::array<int, 3> own{};
      for (int a = 0; a < 3; ++a)
        own[static_cast<std::size_t>(a)] =
            add_point(scene, 0.0, scene.points[static_cast<std::size_t>(k)].position + arm(k, a));
      arms.push_back(own);
    }
    for (int k = 0; k < 3; ++k) {
      const auto& own = arms[static_cast<std::size_t>(k)];
      add_link(scene, {k, own[0], own[1], own[2]}, Rigid{});
    }
    for (int k = 0; k < 2; ++k)
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) {
          const double stiffness = 800.0 + 100.0 * a;
          add_link(scene, arms[static_cast<std::size_t>(k)][static_cast<std::size_t>(a)],
                   arms[static_cast<std::size_t>(k) + 1][static_cast<std::size_t>(b)], Spring{stiffness});
          const Eigen::Vector3d span = scene.points[static_cast<std::size_t>(k) + 1].position +
                                       arm(k + 1, b) - scene.points[static_cast<std::size_t>(k)].position -
                                       arm(k, a);
          truth.springs.push_back({k, k + 1, arm(k, a), arm(k + 1, b), stiffness, span.norm()});
        }
    for (int k = 0; k < 3; ++k) scene.publication.points.push_back(k);
    scene.fidelity = Fidelity::kCoupled;
    scene.rate = 4000.0;
    scene.initial.angular_velocity = {0.0, 0.0, 6.0};
  }
  static Eigen::Vector3d arm(int body, int k) {
    const double angle = 2.0 * M_PI * k / 3.0 + 0.4 * body;
    return {0.3 * std::cos(angle), 0.3 * std::sin(angle), 0.05};
  }
};

/// Returns the positions, velocities, attitudes and angular velocities of the three bodies in the present
/// state of a simulation.
inline Eigen::VectorXd bodies_of(const Structure& structure, const Freedoms& freedoms,
                                 const Simulation& simulation) {
  Eigen::VectorXd y(39);
  const Quat& a = simulation.state.q_WB;
  const Eigen::Quaterniond R(a[0], a[1], a[2], a[3]);
  const Vec3& w = simulation.state.coupled.w_B;
  for (int k = 0; k < 3; ++k) {
    const PointState point = read_point(simulation.plan, simulation.state, k);
    const Eigen::Quaterniond rotation = exponential(joint_rotation(structure, freedoms, k, simulation.state));
    y.segment<3>(13 * k) = Eigen::Map<const Eigen::Vector3d>(point.p_W.data());
    y.segment<3>(13 * k + 3) = Eigen::Map<const Eigen::Vector3d>(point.v_W.data());
    y.segment<4>(13 * k + 6) = (R * rotation).coeffs();
    y.segment<3>(13 * k + 10) = rotation.inverse() * Eigen::Map<const Eigen::Vector3d>(w.data());  // q' = 0
  }
  return y;
}

/// Starts with amplitudes in all twelve modes and zero modal rates. Expects that after one second the error
/// is proportional to the square of the amplitude, because the rung omits the second-order terms of springs
/// and rigid links.
inline void expect_square_of_amplitude(const std::function<Stack(double)>& stack_of) {
  std::vector<double> errors;
  for (const double size : {4e-3, 2e-3, 1e-3, 5e-4}) {
    const Stack stack = stack_of(size);
    const Structure structure = build(stack.scene);
    const Freedoms freedoms(stack.scene);
    ASSERT_EQ(structure.omega.size(), 12);
    Plan plan = compile(stack.scene);
    for (std::size_t l = 0; l < 12; ++l) plan.initial.q[l] = size * std::cos(2.0 * static_cast<double>(l));
    Simulation simulation(std::move(plan));
    Eigen::VectorXd y = bodies_of(structure, freedoms, simulation);
    for (int k = 0; k < 250; ++k)
      y = extrapolated_step([&](double t, const Eigen::VectorXd& at) { return stack.truth.rates(t, at); },
                            4e-3 * k, y, 4e-3);
    simulation.run(4000);
    const Eigen::VectorXd found = bodies_of(structure, freedoms, simulation);
    double error = 0.0;
    for (int k = 0; k < 3; ++k) {
      error = std::max(error, (found - y).segment<3>(13 * k).norm());
      const Eigen::Quaterniond a(Eigen::Vector4d(found.segment<4>(13 * k + 6))),
          b(Eigen::Vector4d(y.segment<4>(13 * k + 6)));
      error = std::max(error, a.angularDistance(b));
    }
    errors.push_back(error);
  }
  std::printf(
      "three bodies on springs, 1 s at 6 rad/s: off by %.1e %.1e %.1e %.1e m or rad as the amplitude halves "
      "from 4 mm\n",
      errors[0], errors[1], errors[2], errors[3]);
  for (std::size_t k = 1; k < errors.size(); ++k)
    EXPECT_NEAR(std::log2(errors[k - 1] / errors[k]), 2.0, 0.25);
}

}  // namespace freeflex::testing
