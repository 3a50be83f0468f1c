#include "core/motion.hpp"

#include <algorithm>

#include "core/step/loads/history.hpp"
#include "core/step/turning/turning.hpp"

namespace freeflex {

Motion::Motion(const Plan& plan, Watch watch)
    : plan_(&plan), state_(make_state(plan)), workspace_(make_workspace(plan)) {
  if (watch == Watch::kMotionAlone || plan.verdict.is_off) return;
  judgement_.emplace(plan);
  judgement_->take(state_);
}

// A copied array has memory only for its contents, so the arrays are allocated first and then assigned.
Motion::Motion(const Motion& other) : Motion(*other.plan_, kMotionAlone) {
  state_ = other.state_;
  workspace_ = other.workspace_;
  report_ = other.report_;
  if (other.judgement_) judgement_.emplace(*other.judgement_);
}

const StepReport& Motion::advance(std::span<const ForceCommand> commands) noexcept {
  const std::int64_t tick = state_.tick;
  step_unread(*plan_, state_, Inputs{commands}, workspace_, report_);
  if (report_.status != StepStatus::kOk || !judgement_) return report_;
  judgement_->command(tick, commands);
  judgement_->take(judgement_->needs(state_) ? state() : state_);
  return report_;
}

void Motion::set_plan(const Plan& plan) noexcept {
  assert(!has_verdict());
  if (plan_ == &plan) return;
  state();
  state_.point_history.num_nodes = 0;  // the steps of the other plan have another length
  state_.points.is_set = false;
  plan_ = &plan;
}

bool Motion::is_pushed() const noexcept {
  if (state_.num_slots > 0) return true;
  if (integrates_points(*plan_))
    return state_.tick > state_.epoch_start_tick &&
           std::ranges::any_of(plan_->histories, [this](const PlanHistory& history) {
             return amplitude_left(history, plan_->period, state_.tick - state_.epoch_start_tick) != 0.0;
           });
  return !is_zero(state_.force_W) || !is_zero(state_.moment_B) ||
         (!plan_->histories.empty() && std::ranges::any_of(state_.Q, [](double Q) { return Q != 0.0; }));
}

void Motion::reset() noexcept {
  reset_state(*plan_, state_);
  if (judgement_) judgement_->take(state_);
}

std::string lost_shape_text(const Plan& plan, const StepReport& report, std::int64_t tick) {
  const std::string step = "in the step after tick " + std::to_string(tick);
  const std::string point =
      report.joint_point >= 0 ? " at point '" + plan.points[index(report.joint_point)].name + "'" : "";
  if (report.status == StepStatus::kNoFrame)
    return step +
           " the axes of the body are lost, because bodies have turned against each other so far (by some 90 "
           "degrees) that the deformation no longer defines these axes; use smaller loads, or add points "
           "with "
           "mass that are beside the line between the bodies and turn less";
  if (report.status == StepStatus::kOpenJoint)
    return step + " the ball joint" + point +
           ", or one that its bodies share with others, could not be closed, because the bodies have turned "
           "too far against the axes of the structure; a joint with little mass allows smaller angles; "
           "end the run earlier, give the joint more mass, or use stiff bars in its place";
  if (report.status == StepStatus::kTurnedTooFar)
    return step + " the body" + point +
           (has_spread_mass(plan) ? " has turned by more than 57 degrees against the axes of the structure, "
                                    "which this fidelity does not support for links with spread mass; write "
                                    "lumped: true for the links with mass"
                                  : " has turned by more than 315 degrees against the axes of the structure, "
                                    "which this fidelity does not support; end the run earlier, or give the "
                                    "body as points joined by springs");
  return step + " a joint" + point +
         " has no equilibrium: a massless point snaps to another shape or hardly resists its load, or a beam "
         "or plate there buckles or bends too far for one element; use smaller loads or more elements, or "
         "give mass to the point";
}

}  // namespace freeflex
