// Wheels on the coupled rungs, where their axes turn with the bodies that carry them (THEORY X168).
#include "core/step/kernels.hpp"
#include "core/step/stage.hpp"

namespace freeflex {
namespace {

Vec3 turn_at(const Plan& plan, const PlanWheel& wheel, const double* q) noexcept {
  return contract_rows(turn_rows(plan, wheel.turning), q, index(plan.num_padded));
}

/// a + theta x a + theta x (theta x a) / 2, of the order of the energy.
Vec3 turned_axis(const Vec3& axis, const Vec3& theta) noexcept {
  const Vec3 first = cross(theta, axis);
  return add_scaled(add(axis, first), 0.5, cross(theta, first));
}

void add_to_modes(const Plan& plan, const PlanWheel& wheel, const Vec3& by_turn, double* y) noexcept {
  combine_rows(turn_rows(plan, wheel.turning), by_turn, true, index(plan.num_padded), y);
}

}  // namespace

Vec3 turned_wheel_momentum(const Plan& plan, std::span<const double> momentum, const double* q) noexcept {
  Vec3 sum{};
  for (std::size_t k = 0; k < plan.wheels.all.size(); ++k) {
    const PlanWheel& wheel = plan.wheels.all[k];
    sum = add_scaled(sum, momentum[k], turned_axis(wheel.axis, turn_at(plan, wheel, q)));
  }
  return sum;
}

double wheel_energy(const Plan& plan, std::span<const double> momentum, const double* q,
                    const double* q_dot) noexcept {
  double sum = 0.0;
  for (std::size_t k = 0; k < plan.wheels.all.size(); ++k) {
    const PlanWheel& wheel = plan.wheels.all[k];
    sum += 0.5 * momentum[k] * dot(turn_at(plan, wheel, q_dot), cross(wheel.axis, turn_at(plan, wheel, q)));
  }
  return sum;
}

void add_wheel_momenta(const Plan& plan, std::span<const double> momentum, const double* q, double sign,
                       double* p) noexcept {
  for (std::size_t k = 0; k < plan.wheels.all.size(); ++k) {
    const PlanWheel& wheel = plan.wheels.all[k];
    const Vec3 side = cross(wheel.axis, turn_at(plan, wheel, q));
    add_to_modes(plan, wheel, scale(0.5 * sign * momentum[k] / plan.mass, side), p);
  }
}

void add_wheel_forces(const External& external, const Place& place, const Vec3& w, const double* q_dot,
                      double* Q) noexcept {
  const Plan& plan = external.plan;
  for (std::size_t k = 0; k < plan.wheels.all.size(); ++k) {
    const PlanWheel& wheel = plan.wheels.all[k];
    const Vec3& a = wheel.axis;
    const Vec3 theta = turn_at(plan, wheel, place.q), rate = turn_at(plan, wheel, q_dot);
    const Vec3 twice = sub(add(cross(cross(theta, a), w), cross(a, cross(w, theta))), cross(rate, a));
    const Vec3 by_momentum = scale(place.wheels[k], add_scaled(cross(a, w), 0.5, twice));
    add_to_modes(plan, wheel, add_scaled(by_momentum, -external.wheel_torque(k, place.instant), a), Q);
  }
}

Vec3 add_wheel_rates(const External& external, const Place& place, const double* q_dot, double* Q) noexcept {
  const Plan& plan = external.plan;
  Vec3 sum{};
  for (std::size_t k = 0; k < plan.wheels.all.size(); ++k) {
    const PlanWheel& wheel = plan.wheels.all[k];
    const Vec3& a = wheel.axis;
    const double h = place.wheels[k], torque = external.wheel_torque(k, place.instant);
    const Vec3 theta = turn_at(plan, wheel, place.q), rate = turn_at(plan, wheel, q_dot);
    const Vec3 second = add(cross(rate, cross(theta, a)), cross(theta, cross(rate, a)));
    sum = add_scaled(sum, torque, turned_axis(a, theta));
    sum = add_scaled(sum, h, add_scaled(cross(rate, a), 0.5, second));
    const Vec3 side = add(scale(torque, cross(a, theta)), scale(h, cross(a, rate)));
    add_to_modes(plan, wheel, scale(0.5, side), Q);
  }
  return sum;
}

}  // namespace freeflex
