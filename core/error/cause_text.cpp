// Texts of the causes of a verdict, with the names of the responsible items. A text has fewer than 256
// characters, because its field in the C interface has 256 bytes.
#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "core/error/judgement.hpp"
#include "core/error/validity.hpp"

namespace freeflex {
namespace {

using Agent = Responsible::Agent;
using Cause = Verdict::Cause;

// [bytes] longest name. Longer names are cut in the middle, because names that begin alike differ at the end.
constexpr std::size_t kMostOfName = 32;

std::string number(double value, int digits = 2) {
  std::ostringstream text;
  text.precision(digits);
  text << value;
  return text.str();
}

std::string quoted(const std::string& name) {
  if (name.size() <= kMostOfName) return "'" + name + "'";
  const auto is_within = [&](std::size_t at) {  // not the first byte of a character
    return (static_cast<unsigned char>(name[at]) & 0xC0) == 0x80;
  };
  std::size_t end = (kMostOfName - 3) / 2, begin = name.size() - (kMostOfName - 3 - end);
  while (end > 0 && is_within(end)) --end;
  while (begin < name.size() && is_within(begin)) ++begin;
  return "'" + name.substr(0, end) + "..." + name.substr(begin) + "'";
}

// Returns for example "load 'thrust'", or "load 2" for a load without a name.
template <typename Items>
std::string called(const char* noun, const Items& items, std::int32_t item) {
  if (item < 0 || index(item) >= items.size()) return {};
  const std::string& name = items[index(item)].name;
  return std::string(noun) + " " + (name.empty() ? std::to_string(item + 1) : quoted(name));
}

std::string mode_text(const Plan& plan, const Responsible& named) {
  if (named.mode == 0) return plan.unmodelled.named.left_out.empty() ? "a mode" : "an omitted mode";
  return "mode " + std::to_string(named.mode) +
         (named.frequency > 0.0 ? " (" + number(named.frequency, 4) + " Hz)" : " (a mechanism)");
}

// Returns the subject of the sentence, which is the item that acts.
std::string agent_text(const Plan& plan, const Responsible& named) {
  switch (named.agent) {
    case Agent::kLoad:
      return called("load", plan.histories, named.item);
    case Agent::kCommands:
      return "the commanded load";
    case Agent::kWheel:
      return called("wheel", plan.wheels, named.item);
    case Agent::kSpin:
      return "the spin of the body";
    case Agent::kOrbit:
      return "the gravity gradient";
    default:
      return "the vibration itself";
  }
}

// Returns the value with which errors are compared, for example "tolerance, 1e-05 m".
std::string scale_text(const Plan& plan, const Verdict& verdict) {
  const bool is_tolerance = plan.unmodelled.tolerance > 0.0 && verdict.scale == plan.unmodelled.tolerance;
  return std::string(is_tolerance                                ? "tolerance"
                     : verdict.scale == verdict.displacement_now ? "displacement"
                                                                 : "recent peak displacement") +
         ", " + number(verdict.scale) + " m";
}

std::string unquantified_text(const Plan& plan, const Responsible& named) {
  const std::string refine = "; compare with a finer model";
  if (named.agent == Agent::kWheel)
    return "model: this rung omits the effect of the deformation on the axis of " +
           called("wheel", plan.wheels, named.item) + (is_coupled(plan) ? refine : "; set fidelity: coupled");
  if (named.agent == Agent::kRate)
    return "integration: the stiffness of " + mode_text(plan, named) +
           " changes faster than the ticks resolve; raise the rate";
  if (named.agent == Agent::kModes)
    return "model: the internal forces that omitted modes carry are missing; keep more modes";
  if (named.item < 0 || index(named.item) >= plan.links.size())
    return "model: this rung omits internal forces of a link with hidden or distributed mass" + refine;
  const PlanLink& link = plan.links[index(named.item)];
  return std::string("model: this rung omits ") +
         (hides_forces(link) ? "the forces inside " : "the effect of spin and loads on the mass within ") +
         called(traits_of(link.type).noun, plan.links, named.item) + refine;
}

// Returns the error including its unquantified part. If that error is small, returns the displacement
// instead, because the displacement is then the reason for the verdict `watch`.
std::string bound_text(const Plan& plan, const Verdict& verdict) {
  const double most = verdict.error + verdict.unquantified;
  if (most <= kGoodElastic * verdict.scale)
    return "; this may matter at the displacement of " + number(verdict.displacement_now) + " m";
  const std::string share = share_text(most, verdict.scale);
  return std::string("; the error may be ") + (share.starts_with("more") ? "" : "as large as ") + share +
         " the " + scale_text(plan, verdict);
}

// Returns the remedy for terms of second order. The remedy is a rung that has these terms or, if there is no
// such rung, a reduction of their cause.
std::string second_order_remedy(const Plan& plan) {
  const bool has_only_axial_links =
      std::ranges::all_of(plan.links, [](const PlanLink& link) { return traits_of(link.type).is_axial; });
  const bool has_point_masses = plan.particles.all.empty() && plan.particles.attitude_points.empty();
  if (has_only_axial_links && has_point_masses && plan.wheels.empty() &&
      plan.unmodelled.lacks_modes != LacksModes::kNotKept && !traits_of(plan.fidelity).has_true_geometry)
    return "; set fidelity: corotational";
  return "; reduce the loads or the spin, or stiffen the structure";
}

// Returns for example "9 modes (7 out_of_plane, 2 small_modes)".
std::string left_out_text(const Plan& plan) {
  std::string counts;
  for (const PlanFeature& feature : plan.features) {
    const bool is_of_modes = feature.feature == Feature::kOutOfPlane ||
                             feature.feature == Feature::kUnreachedModes ||
                             feature.feature == Feature::kSmallModes;
    if (is_of_modes && feature.is_left_out && feature.count > 0)
      counts +=
          (counts.empty() ? " (" : ", ") + std::to_string(feature.count) + " " + name_of(feature.feature);
  }
  return "the omitted modes" + (counts.empty() ? counts : counts + ")");
}

std::string step_text(const Plan& plan, const Verdict& verdict) {
  const Responsible& named = verdict.responsible;
  switch (named.agent) {
    case Agent::kSpin:
      return "integration: the body rotates too far in one tick; raise the rate" +
             (verdict.rate > 0.0 ? " to " + number(verdict.rate, 3) + " Hz" : std::string());
    case Agent::kLoad:
      return "integration: the loads rotate too far relative to the body within a tick to be treated as "
             "linear; raise the rate";
    default:
      return "integration: the tick is too long to resolve " + mode_text(plan, named) +
             ", which matters because the body rotates" + (plan.wheels.empty() ? "" : " or has wheels") +
             "; raise the rate";
  }
}

std::string stiffness_text(const Plan& plan, const Responsible& named) {
  if (named.agent == Agent::kWheel)
    return "model: this rung neglects the gyroscopic forces that " + agent_text(plan, named) + " adds to " +
           mode_text(plan, named) + "; set fidelity: coupled";
  if (named.agent == Agent::kSpin && !is_coupled(plan))
    return "model: this rung neglects the Coriolis forces and the geometric stiffness that " +
           agent_text(plan, named) + " adds to " + mode_text(plan, named) + "; set fidelity: coupled";
  return "model: this rung neglects the change of geometric stiffness that " + agent_text(plan, named) +
         " causes in " + mode_text(plan, named) + second_order_remedy(plan);
}

std::string buckling_text(const Plan& plan, const Responsible& named) {
  return "model: " + agent_text(plan, named) + " reduces the stiffness of " + mode_text(plan, named) +
         " by half or more, so the structure is near buckling; reduce the loads, or stiffen it";
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
  return (percent < 100.0 ? number(percent, digits) : std::to_string(10 * std::lround(0.1 * percent))) +
         " % of";
}

std::string error_text(const Plan& plan, const Verdict& verdict) {
  if (!plan.unmodelled.is_known || plan.unmodelled.is_rigid || verdict.cause == Cause::kLost)
    return "not known";
  return share_text(verdict.error, verdict.scale) + " the " + scale_text(plan, verdict);
}

std::string describe(const Plan& plan, const Verdict& verdict) {
  const std::string cause = text_of(plan, verdict);
  return name_of(verdict.level) + (cause.empty() ? "" : " (" + cause + ")");
}

std::string text_of(const Plan& plan, const Verdict& verdict) {
  const Responsible& named = verdict.responsible;
  const std::string error = "; estimated error " + error_text(plan, verdict);
  switch (verdict.cause) {
    case Cause::kNone:
      return {};
    case Cause::kStiffness:
      return stiffness_text(plan, named) + error;
    case Cause::kBuckling:
      return buckling_text(plan, named);
    case Cause::kSpinLoad:
      return "model: this rung neglects the centrifugal load of the spin; set fidelity: spin-loaded or a "
             "higher rung" +
             error;
    case Cause::kDeformation:
      return "model: displacements are too large for linear geometry, mostly in " + mode_text(plan, named) +
             second_order_remedy(plan) + error;
    case Cause::kSize:
      return "model: the displacement of " + number(verdict.displacement_now) + " m, mostly in " +
             mode_text(plan, named) +
             ", is not small compared with the size of the body; reduce the loads or the spin, or stiffen "
             "the structure";
    case Cause::kLost:
      return "integration: the reference solution of the error budget diverged; raise the rate, or reduce "
             "the loads";
    case Cause::kIntegration:
      return "integration: the tick is too long for this motion; raise the rate" + error;
    case Cause::kStep:
      return step_text(plan, verdict);
    case Cause::kUnresolved:
      return "integration: the reference solution of the error budget does not resolve the fastest "
             "vibration, and may miss an error that the spin causes; raise the rate";
    case Cause::kTruncation:
      return "truncation: " + left_out_text(plan) +
             (named.agent == Agent::kCommands ? " may be excited by the commanded load" : " would move") +
             "; lower leave_out: tolerance" + error;
    case Cause::kModel:
      return "model: the reference solution of the error budget differs from this rung; set a higher rung" +
             error;
    case Cause::kPosition:
      return "position: the points are about " + number(verdict.position) +
             " m from their true positions (sum over the horizons of the error budget); raise the rate, "
             "or set a higher rung";
    case Cause::kUnquantified:
      return unquantified_text(plan, named) + bound_text(plan, verdict);
    case Cause::kNotKept:
      return "truncation: only the lowest modes are kept, and the response of the others is not known; keep "
             "more with modes:, or compare with a plan that has more";
    case Cause::kFastLoad:
      return "integration: " + agent_text(plan, named) +
             " changes faster than the ticks resolve; raise the rate";
    case Cause::kAttractor:
      return "model: the attractor is so near that the position error may exceed the estimate; check the "
             "position with another program";
    case Cause::kRigid:
      return "model: the rung is rigid and neglects the deformation due to loads and spin; set a higher rung";
    case Cause::kUnknown:
      return "the plan has no tables for the verdict; compile the scene again";
  }
  return {};
}

}  // namespace freeflex
