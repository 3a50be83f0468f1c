#include "service/status.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/step/scope.hpp"
#include "core/step/vector.hpp"

namespace freeflex::service {
namespace {

/// Elastic modes of the plan and those that it leaves out.
std::int32_t count_modes(const Plan& plan) {
  std::int32_t num_modes = plan.num_elastic;
  for (const PlanPart& part : plan.parts) {
    const bool is_of_modes = part.part == Part::kOutOfPlane || part.part == Part::kUnreachedModes ||
                             part.part == Part::kSmallModes;
    if (is_of_modes && part.is_left_out) num_modes += part.count;
  }
  return num_modes;
}

}  // namespace

StatusReporter::StatusReporter(const Plan& plan, const Identity& identity, const Output& output,
                               const SharedBlock& shared, const IngressCounts& ingress)
    : plan_(plan),
      identity_(identity),
      output_(output),
      shared_(shared),
      ingress_(ingress),
      validity_(plan),
      lateness_(output.lateness),
      compute_(output.compute),
      command_latency_(output.command_latency),
      num_modes_(count_modes(plan)) {
  const auto damps = [](const Plan& of) {
    return std::ranges::any_of(of.decay, [](double decay) { return decay > 0.0; });
  };
  is_damped_ = damps(plan) || std::ranges::any_of(plan.wide, damps);
}

freeflex_msgs::status_t StatusReporter::report(const Snapshot& snapshot, std::int64_t utime) {
  freeflex_msgs::status_t status{};
  status.utime = utime;
  status.session = identity_.session;
  status.plan_fingerprint = static_cast<std::int64_t>(identity_.plan_fingerprint);
  status.scene_hash = static_cast<std::int64_t>(plan_.scene_hash);
  status.mode = static_cast<std::int32_t>(snapshot.mode);
  status.fault = fault_text(snapshot);
  status.time_mode = timing_name(identity_.timing);
  status.rate = 1.0 / plan_.period;
  status.epoch = snapshot.motion.epoch;
  status.tick = snapshot.motion.tick;
  status.applied_count = snapshot.applied_count;
  status.num_slots = snapshot.num_slots;
  status.replan_tick = snapshot.motion.wide_tick;
  status.replan = replan_name(snapshot.motion);
  status.ingress_restarts = ingress_.restarts.load(std::memory_order_relaxed);
  status.ingress_hangs = ingress_.hangs.load(std::memory_order_relaxed);
  fill_counts(status);
  fill_timing(status);
  fill_physics(snapshot, status);
  return status;
}

void StatusReporter::turn() {
  lateness_.turn();
  compute_.turn();
  command_latency_.turn();
}

/// Rejections are counted by the ingress and by the loop; each reason is listed once.
void StatusReporter::fill_counts(freeflex_msgs::status_t& status) {
  status.commands_received = received_.take(shared_.received.load(std::memory_order_relaxed)) +
                             output_.num_operator_received.load(std::memory_order_relaxed);
  status.commands_accepted = output_.num_accepted.load(std::memory_order_relaxed);
  for (std::size_t reason = 1; reason < output_.num_rejected.size(); ++reason) {
    const std::int64_t count =
        rejected_[reason].take(shared_.rejections[reason].load(std::memory_order_relaxed)) +
        output_.operator_rejected[reason].load(std::memory_order_relaxed) +
        output_.num_rejected[reason].load(std::memory_order_relaxed);
    if (count == 0) continue;
    freeflex_msgs::rejection_count_t item{};
    item.reason = static_cast<std::int32_t>(reason);
    item.count = count;
    status.rejections.push_back(item);
  }
  status.num_rejections = static_cast<std::int32_t>(status.rejections.size());
  status.answers_dropped = dropped_answers_.take(shared_.dropped_answers.load(std::memory_order_relaxed));
  // in the order of io::kMotionChannels
  std::int64_t* const dropped[] = {&status.states_dropped, &status.points_dropped, &status.loads_dropped};
  static_assert(std::size(dropped) == io::kNumMotionChannels);
  for (std::size_t i = 0; i < io::kNumMotionChannels; ++i)
    *dropped[i] = output_.num_dropped[i].load(std::memory_order_relaxed);
}

void StatusReporter::fill_timing(freeflex_msgs::status_t& status) const {
  status.overruns = output_.num_overruns.load(std::memory_order_relaxed);
  status.slips = output_.num_slips.load(std::memory_order_relaxed);
  const Percentiles compute = compute_.read();
  status.window_ticks = static_cast<std::int32_t>(std::min<std::int64_t>(compute.count, INT32_MAX));
  std::ranges::copy(compute.us, status.compute_us);
  std::ranges::copy(lateness_.read().us, status.lateness_us);
  std::ranges::copy(command_latency_.read().us, status.command_latency_us);
}

void StatusReporter::fill_physics(const Snapshot& snapshot, freeflex_msgs::status_t& status) {
  const Invariants invariants = read_invariants(plan_, snapshot.motion);
  status.kinetic_rigid = invariants.kinetic_rigid;
  status.kinetic_elastic = invariants.kinetic_elastic;
  status.potential = invariants.potential;
  fill_drift(snapshot, invariants, status);
  fill_validity(snapshot, invariants, status);
}

void StatusReporter::fill_drift(const Snapshot& snapshot, const Invariants& invariants,
                                freeflex_msgs::status_t& status) {
  // gravity moves energy between the centre of mass and its height, and nothing else
  const double energy = invariants.kinetic_rigid + invariants.kinetic_elastic + invariants.potential -
                        plan_.mass * dot(plan_.gravity_W, snapshot.motion.p_WB);
  const Vec3& H_W = invariants.angular_momentum_W;
  if (baseline_.epoch != snapshot.motion.epoch || snapshot.last_load_tick >= baseline_.tick) {
    baseline_ = {snapshot.motion.epoch, snapshot.motion.tick, energy, H_W};
  }
  if (!is_damped_)
    status.energy_drift = bounded_ratio(std::abs(energy - baseline_.energy), std::abs(baseline_.energy));
  const Vec3 change{H_W[0] - baseline_.H_W[0], H_W[1] - baseline_.H_W[1], H_W[2] - baseline_.H_W[2]};
  status.momentum_drift = bounded_ratio(norm(change), norm(baseline_.H_W));
}

void StatusReporter::fill_validity(const Snapshot& snapshot, const Invariants& invariants,
                                   freeflex_msgs::status_t& status) {
  const double V = validity_.max_displacement(snapshot.motion);
  status.max_displacement = V;
  status.displacement_ratio = validity_.displacement_ratio(V);
  status.spin_ratio = validity_.spin_ratio(norm(angular_velocity(plan_, snapshot.motion)), V);
  fill_budget(snapshot, status);
  const Verdict &now = snapshot.verdict, &worst = snapshot.worst;
  status.validity = static_cast<std::int32_t>(now.word);
  status.validity_cause = text_of(plan_, now);
  status.model_error = now.error;
  status.displacement_now = now.displacement_now;
  status.error_scale = now.scale;
  status.worst_validity = static_cast<std::int32_t>(worst.word);
  status.worst_validity_tick = worst.tick;
  status.worst_validity_cause = text_of(plan_, worst);
  if (active_plan(plan_, snapshot.motion).num_elastic < num_modes_) status.truncation_bound = -1.0;
  if (V > 0.0) {
    const double translation = norm(invariants.eckart_translation) / (plan_.mass * V);
    const double rotation = norm(invariants.eckart_rotation) / (plan_.mass * validity_.size() * V);
    status.eckart_residual = std::max(translation, rotation);
  }
}

void StatusReporter::fill_budget(const Snapshot& snapshot, freeflex_msgs::status_t& status) const {
  const BudgetReading& reading = snapshot.budget;
  if (plan_.budget.shadows.empty()) return;
  status.budget_horizon = plan_.budget.horizon;
  status.budget_age = reading.age;
  const ErrorSize* const parts[] = {&reading.total, &reading.integration, &reading.truncation,
                                    &reading.model};
  for (std::size_t k = 0; k < std::size(parts); ++k) {
    status.error_position[k] = parts[k]->position;
    status.error_attitude[k] = parts[k]->attitude;
    status.error_elastic[k] = parts[k]->elastic;
  }
}

std::string replan_name(const MotionState& motion) {
  if (!motion.is_wide) return {};
  return name_of(static_cast<Need>(motion.wide_need) == Need::kRotation ? Part::kRotation
                                                                        : Part::kOutOfPlane);
}

std::string fault_text(const Snapshot& snapshot) {
  if (snapshot.mode != Mode::kFault) return {};
  const FaultNote& fault = snapshot.fault;
  std::string text =
      fmt::format("the state after tick {} is not finite; held at tick {}", fault.tick, fault.tick);
  if (fault.num_commands > 0) {
    text += fmt::format("; {} command(s) began there, the last {} sequence {}", fault.num_commands,
                        fault.sender.data(), fault.sequence);
  }
  return text + "; RESET recovers";
}

}  // namespace freeflex::service
