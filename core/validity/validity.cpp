#include "core/validity/validity.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace freeflex {

double norm(const Vec3& v) noexcept { return std::hypot(v[0], v[1], v[2]); }

double bounded_ratio(double numerator, double denominator) noexcept {
  constexpr double kLargest = 1e9;  // what an unbounded ratio is published as
  return numerator == 0.0 ? 0.0 : std::min(numerator / denominator, kLargest);
}

namespace {

// two digits, as a person reads them
std::string number(double value) {
  std::ostringstream text;
  text.precision(2);
  text << value;
  return text.str();
}

Verdict::Word worse(Verdict::Word a, Verdict::Word b) { return std::max(a, b); }

Verdict::Word grade(double value, double good, double most) {
  if (value <= good) return Verdict::Word::kGood;
  return value <= most ? Verdict::Word::kWatch : Verdict::Word::kOutside;
}

constexpr double kGoodShare = 0.1;  // of a limit

/// Lowest frequency that is not zero [rad/s]; 0: none.
double lowest_omega(const Plan& plan) {
  double lowest = 0.0;
  for (const double omega : plan.omega)
    if (omega > 0.0 && (lowest == 0.0 || omega < lowest)) lowest = omega;
  return lowest;
}

/// True when some link has no second order on any rung: all but springs, bars and dashpots   (X98).
bool has_unseen_links(const Plan& plan) {
  if (plan.budget.shadows.empty()) return false;
  const Plan& best = plan.budget.shadows.front().plan;
  return best.coupled.bars.size() < best.links.size();
}

}  // namespace

Verdict judge_ratios(const Plan& plan, double displacement_ratio, double spin_ratio) {
  const RungTraits& rung = traits_of(plan.fidelity);
  const double d = displacement_ratio / (rung.displacement_room * kMaxDisplacementRatio),
               s = spin_ratio / (rung.spin_room * kMaxSpinRatio);
  Verdict verdict{worse(grade(d, kGoodShare, 1.0), grade(s, kGoodShare, 1.0)), {}};
  if (verdict.word != Verdict::Word::kGood)
    verdict.cause = d > s ? "deformation: displacement ratio " + number(displacement_ratio)
                          : "spin: spin ratio " + number(spin_ratio);
  return verdict;
}

namespace {

/// Of the distances alone.
Verdict judge_distances(const Plan& plan, const BudgetReading& reading, double size,
                        double displacement_ratio, double spin_ratio) {
  if (reading.is_lost)
    return {Verdict::Word::kOutside,
            "the full equations beside it left the numbers; raise the rate, or load less"};
  const ErrorSize& total = reading.total;
  const double position = size > 0.0 ? total.position / size : 0.0;
  Verdict verdict{
      worse(grade(total.elastic, kGoodElastic, kMostElastic), grade(position, kGoodPosition, kMostPosition)),
      {}};
  if (verdict.word == Verdict::Word::kGood) return verdict;
  const bool by_elastic = total.elastic / kGoodElastic > position / kGoodPosition;
  const auto part = [&](const ErrorSize& error) { return by_elastic ? error.elastic : error.position; };
  const double model = part(reading.model), integration = part(reading.integration),
               truncation = part(reading.truncation);
  if (integration > std::max(model, truncation))
    verdict.cause = "integration: raise the rate";
  else if (truncation > model)
    verdict.cause = "truncation: modes left out; lower leave_out: tolerance";
  else if (!traits_of(plan.fidelity).has_modes)
    verdict.cause = "model: the rung is rigid, and all that deforms is missing";
  else if (displacement_ratio / kMaxDisplacementRatio > spin_ratio / kMaxSpinRatio)
    verdict.cause = "model, by deformation: displacement ratio " + number(displacement_ratio);
  else
    verdict.cause = "model, by spin: spin ratio " + number(spin_ratio);
  verdict.cause += by_elastic ? "; elastic error " + number(total.elastic)
                              : "; position error " + number(total.position) + " m";
  return verdict;
}

}  // namespace

Verdict judge_budget(const Plan& plan, const BudgetReading& reading, double size, double displacement_ratio,
                     double spin_ratio) {
  Verdict verdict = judge_distances(plan, reading, size, displacement_ratio, spin_ratio);
  if (verdict.word == Verdict::Word::kGood && reading.unresolved > kGoodElastic)
    verdict = {Verdict::Word::kWatch,
               "integration: the rung beside the state does not resolve what vibrates, and "
               "may not see an elastic error of " +
                   number(reading.unresolved) + " by spin; raise the rate"};
  if (!has_unseen_links(plan)) return verdict;
  const double limit = traits_of(Fidelity::kCoupled).displacement_room * kMaxDisplacementRatio;
  const Verdict::Word by_ratio = grade(displacement_ratio / limit, kGoodShare, 1.0);
  if (by_ratio <= verdict.word) return verdict;
  return {
      by_ratio,
      "deformation: displacement ratio " + number(displacement_ratio) +
          ", and the estimate sees the second order of springs, bars and dashpots alone, not of other links"};
}

Validity::Validity(const Plan& plan) : plan_(plan) {
  omega_1_ = lowest_omega(plan);
  for (const Plan& wide : plan.wide)
    if (const double lowest = lowest_omega(wide); omega_1_ == 0.0 || (lowest > 0.0 && lowest < omega_1_))
      omega_1_ = lowest;
  for (const PlanPoint& point : plan.points) size_ = std::max(size_, norm(point.r));
}

double Validity::max_displacement(const MotionState& state) const noexcept {
  double largest = 0.0;
  for (const std::int32_t point : plan_.published_points)
    largest = std::max(largest, norm(read_point(plan_, state, point).V_B));
  return largest;
}

double Validity::displacement_ratio(double max_displacement) const noexcept {
  return size_ > 0.0 ? max_displacement / size_ : 0.0;
}

double Validity::spin_ratio(double spin, double max_displacement) const noexcept {
  if (omega_1_ == 0.0) return 0.0;
  return bounded_ratio(spin * spin / (omega_1_ * omega_1_) * size_, max_displacement);
}

}  // namespace freeflex
