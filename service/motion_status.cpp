#include "service/motion_status.hpp"

#include <algorithm>
#include <cmath>

#include "core/step/readout.hpp"
#include "core/step/scope.hpp"
#include "core/step/vector.hpp"

namespace freeflex::service {
namespace {

/// Returns the number of elastic modes, including the modes that the plan omits.
std::int32_t count_modes(const Plan& plan) {
  std::int32_t num_modes = plan.num_elastic;
  for (const PlanFeature& part : plan.features) {
    const bool is_of_modes = part.feature == Feature::kOutOfPlane ||
                             part.feature == Feature::kUnreachedModes || part.feature == Feature::kSmallModes;
    if (is_of_modes && part.is_left_out) num_modes += part.count;
  }
  return num_modes;
}

/// Returns kinetic, elastic and gravitational energy [J]. The gravitational energy is that of the total mass
/// at the centre of mass.
double total_energy(const Plan& plan, const MotionState& motion, const Invariants& invariants) noexcept {
  double energy = invariants.kinetic_rigid + invariants.kinetic_elastic + invariants.potential -
                  plan.mass * dot(plan.gravity_W, motion.p_WB);
  if (plan.attractor_mu > 0.0)
    energy -= plan.mass * plan.attractor_mu / norm(sub(motion.p_WB, plan.attractor_W));
  return energy;
}

}  // namespace

void FreeMotion::take(const Motion& motion) noexcept {
  const bool was_free = is_free && epoch == motion.epoch();
  is_free = !motion.is_pushed();
  epoch = motion.epoch();
  if (!is_free || was_free) return;
  const Invariants invariants = read_invariants(motion.plan(), motion.state());
  energy = total_energy(motion.plan(), motion.state(), invariants);
  H_W = invariants.angular_momentum_W;
}

MotionStatus::MotionStatus(const Plan& plan) : plan_(plan), validity_(plan), num_modes_(count_modes(plan)) {
  const auto damps = [](const StepPlan& of) {
    return std::ranges::any_of(of.decay, [](double decay) { return decay > 0.0; });
  };
  is_damped_ = damps(plan) || std::ranges::any_of(plan.fallback, damps);
}

void MotionStatus::fill(const JudgedMotion& judged, freeflex_msgs::status_t& status) const {
  const MotionState& motion = judged.motion;
  status.scene_hash = static_cast<std::int64_t>(plan_.scene_hash);
  status.rate = 1.0 / plan_.period;
  status.epoch = motion.epoch;
  status.tick = motion.tick;
  status.replan_tick = motion.fallback_tick;
  status.replan = replan_name(motion);
  const Invariants invariants = read_invariants(plan_, motion);
  status.kinetic_rigid = invariants.kinetic_rigid;
  status.kinetic_elastic = invariants.kinetic_elastic;
  status.potential = invariants.potential;
  fill_drift(judged, invariants, status);
  fill_sizes(motion, invariants, status);
  fill_verdict(judged, status);
}

void MotionStatus::fill_drift(const JudgedMotion& judged, const Invariants& invariants,
                              freeflex_msgs::status_t& status) const {
  const FreeMotion& free = judged.free;
  if (!free.is_free || free.epoch != judged.motion.epoch) return;
  const double energy = total_energy(plan_, judged.motion, invariants);
  if (!is_damped_) status.energy_drift = bounded_ratio(std::abs(energy - free.energy), std::abs(free.energy));
  status.momentum_drift = bounded_ratio(norm(sub(invariants.angular_momentum_W, free.H_W)), norm(free.H_W));
}

void MotionStatus::fill_sizes(const MotionState& motion, const Invariants& invariants,
                              freeflex_msgs::status_t& status) const {
  const double V = validity_.max_displacement(motion);
  status.max_displacement = V;
  status.displacement_ratio = validity_.displacement_ratio(V);
  status.spin_ratio = validity_.spin_ratio(norm(angular_velocity(plan_, motion)), V);
  if (active_plan(plan_, motion).num_elastic < num_modes_) status.truncation_bound = -1.0;
  if (V > 0.0) {
    const double translation = norm(invariants.eckart_translation) / (plan_.mass * V);
    const double rotation = norm(invariants.eckart_rotation) / (plan_.mass * validity_.size() * V);
    status.eckart_residual = std::max(translation, rotation);
  }
}

void MotionStatus::fill_verdict(const JudgedMotion& judged, freeflex_msgs::status_t& status) const {
  using freeflex_msgs::status_t;
  const auto level = [](const Verdict& verdict) { return static_cast<std::int32_t>(verdict.level); };
  const bool is_judged = !plan_.verdict.shadows.empty() && judged.now.tick >= 0;
  status.validity = is_judged ? level(judged.now) : status_t::NOT_JUDGED;
  status.worst_validity = is_judged ? level(judged.worst) : status_t::NOT_JUDGED;
  status.validity_cause = is_judged ? text_of(plan_, judged.now) : not_judged_text(plan_);
  status.worst_validity_tick = judged.worst.tick;
  status.worst_validity_cause = text_of(plan_, judged.worst);
  status.judged_tick = judged.now.tick;
  if (!plan_.verdict.shadows.empty())
    status.judged_every = static_cast<std::int32_t>(plan_.verdict.shadows.front().every);
  status.position_error = judged.now.error.position;
  status.attitude_error = judged.now.error.attitude;
  status.deformation_error = judged.now.error.deformation;
  status.shadow_error = judged.now.own_error;
  status.displacement_now = judged.now.displacement_now;
  status.error_scale = judged.now.scale;
}

std::string replan_name(const MotionState& motion) {
  if (!motion.uses_fallback) return {};
  return name_of(static_cast<Need>(motion.fallback_need) == Need::kRotation ? Feature::kRotation
                                                                            : Feature::kOutOfPlane);
}

}  // namespace freeflex::service
