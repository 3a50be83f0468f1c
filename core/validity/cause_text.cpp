// A verdict in plain English, with the names of what is responsible. Texts stay below 256 characters, the
// room that the interface for C has.
#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "core/validity/judgement.hpp"
#include "core/validity/validity.hpp"

namespace freeflex {
namespace {

using Agent = Responsible::Agent;
using Cause = Verdict::Cause;

// [bytes] of a name: longer ones are cut in the middle, since names that begin alike differ at the end
constexpr std::size_t kMostOfName = 32;

std::string number(double value, int digits = 2) {
  std::ostringstream text;
  text.precision(digits);
  text << value;
  return text.str();
}

std::string quoted(const std::string& name) {
  if (name.size() <= kMostOfName) return "'" + name + "'";
  const auto is_within = [&](std::size_t at) {  // a character
    return (static_cast<unsigned char>(name[at]) & 0xC0) == 0x80;
  };
  std::size_t end = (kMostOfName - 3) / 2, begin = name.size() - (kMostOfName - 3 - end);
  while (end > 0 && is_within(end)) --end;
  while (begin < name.size() && is_within(begin)) ++begin;
  return "'" + name.substr(0, end) + "..." + name.substr(begin) + "'";
}

// "load 'thrust'", "load 2" of one without a name
template <typename Items>
std::string called(const char* noun, const Items& items, std::int32_t item) {
  if (item < 0 || static_cast<std::size_t>(item) >= items.size()) return {};
  const std::string& name = items[static_cast<std::size_t>(item)].name;
  return std::string(noun) + " " + (name.empty() ? std::to_string(item + 1) : quoted(name));
}

std::string mode_text(const Plan& plan, const Responsible& named) {
  if (named.mode == 0) return plan.neglect.named.left_out.empty() ? "a mode" : "a mode that is left out";
  return "mode " + std::to_string(named.mode) +
         (named.frequency > 0.0 ? " (" + number(named.frequency, 4) + " Hz)" : " (a mechanism)");
}

// the subject of a sentence: what acts
std::string agent_text(const Plan& plan, const Responsible& named) {
  switch (named.agent) {
    case Agent::kLoad:
      return called("load", plan.histories, named.item);
    case Agent::kCommands:
      return "the commanded load";
    case Agent::kWheel:
      return called("wheel", plan.wheels.all, named.item);
    case Agent::kSpin:
      return "the spin of the body";
    case Agent::kOrbit:
      return "the gravity gradient";
    default:
      return "the vibration itself";
  }
}

const char* noun_of(const std::string& kind) {
  if (kind == "rigid") return "rigid link";
  return kind.c_str();
}

// "tolerance, 1e-05 m": what errors are held against
std::string scale_text(const Plan& plan, const Verdict& verdict) {
  const bool is_tolerance = plan.neglect.tolerance > 0.0 && verdict.scale == plan.neglect.tolerance;
  return std::string(is_tolerance                                ? "tolerance"
                     : verdict.scale == verdict.displacement_now ? "displacement"
                                                                 : "recent peak displacement") +
         ", " + number(verdict.scale) + " m";
}

std::string unseen_text(const Plan& plan, const Responsible& named) {
  if (named.agent == Agent::kWheel)
    return "not modelled: how the deformation turns the axis of " +
           called("wheel", plan.wheels.all, named.item);
  if (named.agent == Agent::kRate)
    return "integration: " + mode_text(plan, named) +
           " swings too fast for the tick, and its stiffness changes meanwhile; raise the rate";
  if (named.agent == Agent::kModes) return "not modelled: forces that the modes left out carry";
  if (named.item < 0 || static_cast<std::size_t>(named.item) >= plan.links.size())
    return "not modelled: what a link with hidden or distributed mass does inside";
  const PlanLink& link = plan.links[static_cast<std::size_t>(named.item)];
  return std::string("not modelled: ") +
         (hides_forces(link) ? "how forces run inside " : "how spin and loads act on the mass within ") +
         called(noun_of(link.kind), plan.links, named.item);
}

// how much it may be; where that is little the size of the displacement is what makes it watch
std::string hidden_text(const Plan& plan, const Verdict& verdict) {
  const double most = verdict.error + verdict.unseen;
  if (most <= kGoodElastic * verdict.scale)
    return "; that may count at the displacement of " + number(verdict.displacement_now) + " m";
  return "; with that the error may be up to " + share_text(most, verdict.scale) + " the " +
         scale_text(plan, verdict);
}

// "9 modes (7 out_of_plane, 2 small_modes)"
std::string left_out_text(const Plan& plan) {
  std::string parts;
  for (const PlanPart& part : plan.parts) {
    const bool is_of_modes = part.part == Part::kOutOfPlane || part.part == Part::kUnreachedModes ||
                             part.part == Part::kSmallModes;
    if (is_of_modes && part.is_left_out && part.count > 0)
      parts += (parts.empty() ? " (" : ", ") + std::to_string(part.count) + " " + name_of(part.part);
  }
  return "the modes that are left out" + (parts.empty() ? parts : parts + ")");
}

std::string step_text(const Plan& plan, const Verdict& verdict) {
  const Responsible& named = verdict.responsible;
  switch (named.agent) {
    case Agent::kSpin:
      return "integration: the body turns too far in one tick; raise the rate" +
             (verdict.rate > 0.0 ? " to " + number(verdict.rate, 3) + " Hz" : std::string());
    case Agent::kLoad:
      return "integration: what loads the modes turns too far in the body within a tick, over which they "
             "take "
             "it as straight; raise the rate";
    default:
      return "integration: " + mode_text(plan, named) +
             " vibrates too fast for the tick of a body that turns" +
             (plan.wheels.all.empty() ? "" : " or has wheels") + "; raise the rate";
  }
}

std::string stiffness_text(const Plan& plan, const Responsible& named) {
  if (named.agent == Agent::kWheel)
    return "model: " + agent_text(plan, named) + " adds gyroscopic forces to " + mode_text(plan, named) +
           ", which this rung neglects";
  const bool is_spin = named.agent == Agent::kSpin;
  return "model: " + agent_text(plan, named) +
         (is_spin && !is_coupled(plan) ? " adds Coriolis forces and stiffness to "
                                       : " changes the stiffness of ") +
         mode_text(plan, named) + ", which this rung neglects";
}

std::string buckling_text(const Plan& plan, const Responsible& named) {
  return "model: " + agent_text(plan, named) + " takes half or more of the stiffness of " +
         mode_text(plan, named) + ": it is near buckling; load less, or stiffen it";
}

}  // namespace

const char* name_of(Verdict::Word word) {
  static constexpr std::array kNames{"good", "watch", "outside"};
  return kNames[static_cast<std::size_t>(word)];
}

std::string share_text(double error, double scale) {
  if (error <= 0.0) return "0 % of";
  const double percent = 100.0 * error / scale;
  if (!(percent < 1000.0)) return "more than 10 times";
  // what is above a limit of the verdict does not read as the limit
  int digits = 2;
  for (const double limit : {100.0 * kGoodElastic, 100.0 * kMostElastic})
    while (percent > limit && digits < 6 && number(percent, digits) == number(limit)) ++digits;
  return (percent < 100.0 ? number(percent, digits) : std::to_string(10 * std::lround(0.1 * percent))) +
         " % of";
}

std::string error_text(const Plan& plan, const Verdict& verdict) {
  if (!plan.neglect.is_known || plan.neglect.is_rigid || verdict.cause == Cause::kLost) return "not known";
  return share_text(verdict.error, verdict.scale) + " the " + scale_text(plan, verdict);
}

std::string describe(const Plan& plan, const Verdict& verdict) {
  const std::string cause = text_of(plan, verdict);
  return name_of(verdict.word) + (cause.empty() ? "" : ": " + cause);
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
      return "model: the deformation by the centrifugal forces of the spin, which this rung neglects" + error;
    case Cause::kDeformation:
      return "model: second order of the displacements, most by " + mode_text(plan, named) + error;
    case Cause::kSize:
      return "model: the displacement of " + number(verdict.displacement_now) + " m, most by " +
             mode_text(plan, named) + ", is not small beside the size of the body";
    case Cause::kLost:
      return "integration: the reference solution of the error budget diverged; raise the rate, or load less";
    case Cause::kIntegration:
      return "integration: the tick is long for this motion; raise the rate" + error;
    case Cause::kStep:
      return step_text(plan, verdict);
    case Cause::kUnresolved:
      return "integration: the reference solution of the error budget does not resolve the fastest "
             "vibration, and may miss an error by spin; raise the rate";
    case Cause::kTruncation:
      return "truncation: " + left_out_text(plan) +
             (named.agent == Agent::kCommands ? " may move by the commanded load" : " would move") +
             "; lower leave_out: tolerance" + error;
    case Cause::kModel:
      return "model: the reference solution of the error budget differs from this rung; take a higher rung" +
             error;
    case Cause::kPosition:
      return "position: points are off by about " + number(verdict.position) +
             " m in space, added up over the horizons of the error budget";
    case Cause::kUnseen:
      return unseen_text(plan, named) + hidden_text(plan, verdict);
    case Cause::kNotKept:
      return "truncation: only the lowest modes are kept, and what loads do to the others is not known; "
             "ask for more with modes:, or compare with a plan that has more";
    case Cause::kFastLoad:
      return "integration: " + agent_text(plan, named) + " changes faster than ticks follow; raise the rate";
    case Cause::kAttractor:
      return "model: only the gradient of the field of the attractor is modelled; the body is so near "
             "that its position may be off by more than the estimate";
    case Cause::kRigid:
      return "model: the rung is rigid, and the deformation by loads and spin is missing; take a higher rung";
    case Cause::kUnknown:
      return "the plan file is of an older version, without the tables that judge the motion; compile the "
             "scene again";
  }
  return {};
}

}  // namespace freeflex
