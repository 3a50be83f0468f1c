#include "service/status.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace freeflex::service {
StatusReporter::StatusReporter(const Plan& plan, const Identity& identity, const Output& output,
                               const SharedBlock& shared, const IngressCounts& ingress)
    : plan_(plan),
      identity_(identity),
      output_(output),
      shared_(shared),
      ingress_(ingress),
      motion_(plan),
      lateness_(output.lateness),
      compute_(output.compute),
      command_latency_(output.command_latency) {}

freeflex_msgs::status_t StatusReporter::report(const Snapshot& snapshot, std::int64_t utime) {
  freeflex_msgs::status_t status{};
  status.utime = utime;
  status.session = identity_.session;
  status.plan_fingerprint = static_cast<std::int64_t>(identity_.plan_fingerprint);
  status.mode = static_cast<std::int32_t>(snapshot.mode);
  status.fault = fault_text(snapshot);
  status.time_mode = timing_name(identity_.timing);
  status.applied_count = snapshot.applied_count;
  status.num_slots = snapshot.num_slots;
  status.ingress_restarts = ingress_.restarts.load(std::memory_order_relaxed);
  status.ingress_hangs = ingress_.hangs.load(std::memory_order_relaxed);
  fill_counts(status);
  fill_timing(status);
  motion_.fill(
      {.motion = snapshot.motion, .now = snapshot.verdict, .worst = snapshot.worst, .free = snapshot.free},
      status);
  status.judgements_late = snapshot.num_late;
  if (snapshot.not_judged == NotJudged::kJudged) return status;
  if (snapshot.not_judged == NotJudged::kOff || snapshot.not_judged == NotJudged::kProcessors)
    status.judged_every = 0;
  status.validity = freeflex_msgs::status_t::NOT_JUDGED;
  if (snapshot.not_judged == NotJudged::kProcessors)
    status.validity_cause =
        "the verdict takes a processor, and this machine has fewer than 3; start the daemon with --verdict "
        "on";
  if (snapshot.not_judged == NotJudged::kBehind) {
    status.validity_cause = "the verdict fell too far behind the simulation; RESET judges again";
    if (snapshot.verdict.tick >= 0) return status;  // the worst verdict so far stays
  }
  status.worst_validity = freeflex_msgs::status_t::NOT_JUDGED;
  status.worst_validity_cause.clear();
  if (snapshot.not_judged == NotJudged::kOff && !plan_.verdict.shadows.empty())
    status.validity_cause = "the daemon was started with --verdict off";
  return status;
}

void StatusReporter::advance_window() {
  lateness_.advance();
  compute_.advance();
  command_latency_.advance();
}

/// Adds the rejections that the ingress, the operator's socket and the loop counted, and lists each reason
/// once.
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
  for (std::size_t i = 0; i < kNumMotionChannels; ++i)
    status.*io::kEncoders[i].dropped = output_.num_dropped[i].load(std::memory_order_relaxed);
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

std::string fault_text(const Snapshot& snapshot) {
  if (snapshot.mode != Mode::kFault) return {};
  const FaultNote& fault = snapshot.fault;
  std::string text = fmt::format("the state after tick {} is not finite, so the simulation holds at tick {}",
                                 fault.tick, fault.tick);
  if (fault.status == StepStatus::kNoEquilibrium)
    text = fmt::format(
        "in the step after tick {} the joint at point {} has no equilibrium, so the simulation holds at tick "
        "{}; a massless point snaps to another shape or hardly resists its load, or a beam or plate there "
        "buckles or bends too far for one element: use smaller loads or more elements, or give mass to the "
        "point",
        fault.tick, fault.joint_point + 1, fault.tick);
  if (fault.status == StepStatus::kNoFrame)
    text = fmt::format(
        "in the step after tick {} the axes of the body are lost, so the simulation holds at tick {}; bodies "
        "have turned against each other by some 90 degrees: use smaller loads, or add points with mass that "
        "are beside the line between the bodies and turn less",
        fault.tick, fault.tick);
  if (fault.status == StepStatus::kOpenJoint)
    text = fmt::format(
        "in the step after tick {} the ball joint at point {} could not be closed, so the simulation holds "
        "at tick {}; its bodies have turned too far against the axes of the structure, and a joint with "
        "little mass allows smaller angles: give the joint more mass, or use stiff bars in its place",
        fault.tick, fault.joint_point + 1, fault.tick);
  if (fault.status == StepStatus::kTurnedTooFar)
    text = fmt::format(
        "in the step after tick {} the body at point {} has turned too far against the axes of the "
        "structure, which this fidelity does not support, so the simulation holds at tick {}: write lumped: "
        "true for links with spread mass, or give the body as points joined by springs",
        fault.tick, fault.joint_point + 1, fault.tick);
  if (fault.num_commands > 0) {
    text += fmt::format("; {} command(s) began there, the last from {} with sequence number {}",
                        fault.num_commands, fault.sender.data(), fault.sequence);
  }
  return text + "; RESET recovers";
}

}  // namespace freeflex::service
