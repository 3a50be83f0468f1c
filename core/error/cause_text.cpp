// Texts of the causes of a verdict. A text has fewer than 256 characters, because its field in the C
// interface has 256 bytes.
#include <array>
#include <cmath>
#include <sstream>

#include "core/error/verdict.hpp"

namespace freeflex {
namespace {

using Cause = Verdict::Cause;

std::string number(double value, int digits = 2) {
  std::ostringstream text;
  text.precision(digits);
  text << value;
  return text.str();
}

// Returns the value with which errors are compared, for example "1e-05 m (tolerance)".
std::string scale_text(const Plan& plan, const Verdict& verdict) {
  const bool is_tolerance = plan.verdict.tolerance > 0.0 && verdict.scale == plan.verdict.tolerance;
  return number(verdict.scale) + " m (" +
         (is_tolerance                                ? "tolerance"
          : verdict.scale == verdict.displacement_now ? "displacement"
                                                      : "recent peak displacement") +
         ")";
}

// Returns for example "the rung corotational at 250 Hz".
std::string shadow_text(const Plan& plan) {
  const StepPlan& shadow = plan.verdict.shadows.front().plan;
  return std::string("the same motion on the rung ") + name_of(shadow.fidelity) + " at " +
         number(1.0 / shadow.period, 4) + " Hz";
}

// Returns what to do if the state is far from the shadow.
std::string remedy(const Plan& plan) {
  const StepPlan& shadow = plan.verdict.shadows.front().plan;
  // without elastic modes all rungs are the same
  if (plan.fidelity != shadow.fidelity && shadow.num_elastic > 0)
    return std::string("; set fidelity: ") + name_of(shadow.fidelity) +
           " or raise the rate; freeflex run --explain says which effect is missing";
  if (integrates_points(plan))
    return "; set a smaller accuracy under integration, or, if that changes nothing, set verdict: "
           "{step: S} to a shorter step";
  return "; raise the rate";
}

std::string stopped_text(StepStatus status) {
  switch (status) {
    case StepStatus::kNoEquilibrium:
      return "a joint found no equilibrium";
    case StepStatus::kNoFrame:
    case StepStatus::kTurnedTooFar:
      return "bodies turned too far against each other";
    case StepStatus::kOpenJoint:
      return "a ball joint could not be closed";
    case StepStatus::kOk:
    case StepStatus::kNotFinite:
      break;
  }
  return "it became infinite";
}

}  // namespace

const char* name_of(Verdict::Level level) {
  static constexpr std::array kNames{"good", "watch", "outside"};
  return kNames[static_cast<std::size_t>(level)];
}

std::string share_text(double error, double scale) {
  if (error <= 0.0) return "0 % of";
  const double percent = 100.0 * error / scale;
  if (!(percent < 1000.0)) return "more than 10 times";
  // if a value is above a limit of the verdict, it is never rounded to the limit
  int digits = 2;
  for (const double limit : {100.0 * kGoodElastic, 100.0 * kMostElastic})
    while (percent > limit && digits < 6 && number(percent, digits) == number(limit)) ++digits;
  // three digits from 99.5 % on, because two would be 1e+02
  return (percent < 99.5 ? number(percent, digits) : std::to_string(10 * std::lround(0.1 * percent))) +
         " % of";
}

std::string error_text(const Plan& plan, const Verdict& verdict) {
  if (verdict.tick < 0 || verdict.cause == Cause::kLost) return "not known";
  return share_text(verdict.error.deformation, verdict.scale) + " " + scale_text(plan, verdict);
}

std::string not_judged_text(const Plan& plan) {
  if (plan.verdict.is_off) return "the scene has verdict: off";
  return plan.verdict.shadows.empty() ? plan.verdict.shared_text : "no tick is judged yet";
}

std::string describe(const Plan& plan, const Verdict& verdict) {
  if (verdict.tick < 0 && verdict.level == Verdict::Level::kGood)
    return "not judged (" + not_judged_text(plan) + ")";
  const std::string cause = text_of(plan, verdict);
  return name_of(verdict.level) + (cause.empty() ? "" : " (" + cause + ")");
}

std::string text_of(const Plan& plan, const Verdict& verdict) {
  const std::string error = "; estimated error " + error_text(plan, verdict);
  switch (verdict.cause) {
    case Cause::kNone:
      return {};
    case Cause::kDeformation:
      return "deformation differs from " + shadow_text(plan) + remedy(plan) + error;
    case Cause::kPosition:
      return "the centre of mass is " + number(verdict.error.position) + " m from its position in " +
             shadow_text(plan) + remedy(plan);
    case Cause::kAttitude:
      return "the attitude is " + number(verdict.error.attitude) + " rad from that of " + shadow_text(plan) +
             remedy(plan);
    case Cause::kLost:
      return shadow_text(plan) + " stopped, because " + stopped_text(verdict.stopped) +
             "; reduce the loads, raise the rate, or see the scene on that rung";
    case Cause::kCoarse:
      return shadow_text(plan) + " may itself be wrong by " + share_text(verdict.own_error, verdict.scale) +
             " " + scale_text(plan, verdict) + "; set verdict: {step: S} to a shorter step";
    case Cause::kRigid:
      return "the motion has no elastic modes, and the structure deforms by " +
             number(verdict.error.deformation) +
             " m; set a higher rung, lower leave_out: tolerance, or set tolerance: {displacement: M}";
    case Cause::kFastLoad: {
      const std::int32_t load = plan.verdict.fast_loads.front();
      const std::string& name = plan.histories[index(load)].name;
      return "load " + (name.empty() ? std::to_string(load + 1) : "'" + name + "'") +
             " changes faster than the ticks resolve; raise the rate";
    }
    case Cause::kAttractor:
      return "the attractor is so near that the position error may exceed the estimate; check the position "
             "with another program";
    case Cause::kRinging:
      return "fast modes ring, and " + shadow_text(plan) +
             " does not resolve their forces on the slow ones; raise the rate, give damping, or set verdict: "
             "{step: S} to a shorter step";
    case Cause::kMissedLoad:
      return "one horizon in " + std::to_string(plan.verdict.shadows.front().every) +
             " is judged, and larger loads act in the others; raise verdict: {share: S}, up to 1";
    case Cause::kGrowth:
      return "the error grows fast, and only one horizon in " +
             std::to_string(plan.verdict.shadows.front().every) +
             " is judged; raise verdict: {share: S}, up to 1";
    case Cause::kShared:
      return plan.verdict.shared_text + error;
  }
  return {};
}

}  // namespace freeflex
