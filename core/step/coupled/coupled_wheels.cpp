// Wheels on the coupled rungs, where the axes of wheels rotate with the bodies that carry the wheels
// (THEORY 16.27 to 16.32).
#include "core/step/coupled/stage.hpp"
#include "core/step/linear/kernels.hpp"

namespace freeflex {
namespace {

/// Returns the rotation theta of the body of a wheel from q, or the rate of theta from q'.
Vec3 rotation_of_body(const StepPlan& plan, const PlanWheel& wheel, const double* q) noexcept {
  return contract_rows(rotation_rows(plan, wheel.attitude_index), q, index(plan.num_padded));
}

/// Returns the axis of a wheel, rotated with its body, to second order: a + theta x a + theta x (theta x a) /
/// 2 (THEORY 16.27).
Vec3 rotated_axis(const Vec3& axis, const Vec3& theta) noexcept {
  const Vec3 first = cross(theta, axis);
  return add_scaled(add(axis, first), 0.5, cross(theta, first));
}

void add_to_modes(const StepPlan& plan, const PlanWheel& wheel, const Vec3& by_rotation, double* y) noexcept {
  combine_rows(rotation_rows(plan, wheel.attitude_index), by_rotation, true, index(plan.num_padded), y);
}

}  // namespace

// sum_w h_w a_theta   (THEORY 16.29)
Vec3 rotated_wheel_momentum(const StepPlan& plan, std::span<const double> momentum,
                            const double* q) noexcept {
  Vec3 sum{};
  for (std::size_t k = 0; k < plan.wheels.size(); ++k) {
    const PlanWheel& wheel = plan.wheels[k];
    sum = add_scaled(sum, momentum[k], rotated_axis(wheel.axis, rotation_of_body(plan, wheel, q)));
  }
  return sum;
}

// 1/2 sum_w h_w theta' . (a_w x theta). The kinetic energy also has a term in w, which the caller computes as
// w . H_B without the momenta of wheels   (THEORY 16.32).
double wheel_energy(const StepPlan& plan, std::span<const double> momentum, const double* q,
                    const double* q_dot) noexcept {
  double sum = 0.0;
  for (std::size_t k = 0; k < plan.wheels.size(); ++k) {
    const PlanWheel& wheel = plan.wheels[k];
    sum += 0.5 * momentum[k] *
           dot(rotation_of_body(plan, wheel, q_dot), cross(wheel.axis, rotation_of_body(plan, wheel, q)));
  }
  return sum;
}

// p_l += sign h_w theta_l . (a_w x theta) / (2 M), from the Lagrangian   (THEORY 16.28, 16.30)
void add_wheel_momenta(const StepPlan& plan, std::span<const double> momentum, const double* q, double sign,
                       double* p) noexcept {
  for (std::size_t k = 0; k < plan.wheels.size(); ++k) {
    const PlanWheel& wheel = plan.wheels[k];
    const Vec3 side = cross(wheel.axis, rotation_of_body(plan, wheel, q));
    add_to_modes(plan, wheel, scale(0.5 * sign * momentum[k] / plan.mass, side), p);
  }
}

// Q_l += theta_l . (h_w (a x w + ((theta x a) x w + a x (w x theta) - theta' x a) / 2) - tau_w a)
// (THEORY 16.31)
void add_wheel_forces(const StepLoads& step_loads, const StageState& stage, const Vec3& w,
                      const double* q_dot, double* Q) noexcept {
  const StepPlan& plan = step_loads.plan;
  for (std::size_t k = 0; k < plan.wheels.size(); ++k) {
    const PlanWheel& wheel = plan.wheels[k];
    const Vec3& a = wheel.axis;
    const Vec3 theta = rotation_of_body(plan, wheel, stage.q),
               theta_dot = rotation_of_body(plan, wheel, q_dot);
    const Vec3 twice = sub(add(cross(cross(theta, a), w), cross(a, cross(w, theta))), cross(theta_dot, a));
    const Vec3 by_momentum = scale(stage.wheels[k], add_scaled(cross(a, w), 0.5, twice));
    add_to_modes(plan, wheel, add_scaled(by_momentum, -step_loads.wheel_torque(k, stage.stage_time), a), Q);
  }
}

// Returns sum_w (tau_w a_theta + h_w a_theta'), with a_theta' = theta' x a + (theta' x (theta x a) + theta x
// (theta' x a)) / 2, the rate of a_theta in (THEORY 16.29).
// Adds Q_l += theta_l . (tau_w a x theta + h_w a x theta') / 2, which is M times the rate of p_l in
// (THEORY 16.30).
Vec3 add_wheel_rates(const StepLoads& step_loads, const StageState& stage, const double* q_dot,
                     double* Q) noexcept {
  const StepPlan& plan = step_loads.plan;
  Vec3 sum{};
  for (std::size_t k = 0; k < plan.wheels.size(); ++k) {
    const PlanWheel& wheel = plan.wheels[k];
    const Vec3& a = wheel.axis;
    const double h = stage.wheels[k], torque = step_loads.wheel_torque(k, stage.stage_time);
    const Vec3 theta = rotation_of_body(plan, wheel, stage.q),
               theta_dot = rotation_of_body(plan, wheel, q_dot);
    const Vec3 second = add(cross(theta_dot, cross(theta, a)), cross(theta, cross(theta_dot, a)));
    sum = add_scaled(sum, torque, rotated_axis(a, theta));
    sum = add_scaled(sum, h, add_scaled(cross(theta_dot, a), 0.5, second));
    const Vec3 side = add(scale(torque, cross(a, theta)), scale(h, cross(a, theta_dot)));
    add_to_modes(plan, wheel, scale(0.5, side), Q);
  }
  return sum;
}

}  // namespace freeflex
