#include "service/campaign/measures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "service/io/scene/text.hpp"

namespace freeflex::campaign {

Tally::Tally(const Measure& measure, double period) : measure_(&measure), period_(period) {
  constexpr double kRounding = 1e-6;  // [ticks]
  constexpr double kMost = 9e18;
  first_tick_ = static_cast<std::int64_t>(std::min(std::ceil(measure.from / period - kRounding), kMost));
  last_tick_ = static_cast<std::int64_t>(std::min(std::floor(measure.to / period + kRounding), kMost));
}

void Tally::take(std::int64_t tick, double value) noexcept {
  if (tick < first_tick_ || tick > last_tick_) return;
  const double time = static_cast<double>(tick) * period_;
  if (count_++ == 0) first_ = max_ = min_ = value;
  last_ = value;
  // a value that is not a number stays in max and min
  max_ = value > max_ || std::isnan(value) ? value : max_;
  min_ = value < min_ || std::isnan(value) ? value : min_;
  // Neumaier's sum: sum_low_ holds what rounding has lost
  const double term = measure_->statistic == Statistic::kRms ? value * value : value;
  const double sum = sum_ + term;
  sum_low_ += std::abs(sum_) >= std::abs(term) ? (sum_ - sum) + term : (term - sum) + sum_;
  sum_ = sum;
  const bool is_inside = std::abs(value - measure_->target) <= measure_->band;
  if (is_inside && !is_settled_) settled_since_ = time;
  is_settled_ = is_inside;
}

double Tally::result() const noexcept {
  if (count_ == 0) return std::numeric_limits<double>::quiet_NaN();
  const double mean = (sum_ + sum_low_) / static_cast<double>(count_);
  switch (measure_->statistic) {
    case Statistic::kLargest:
      return std::isnan(max_) ? max_ : std::max(std::abs(max_), std::abs(min_));
    case Statistic::kMax:
      return max_;
    case Statistic::kMin:
      return min_;
    case Statistic::kMean:
      return mean;
    case Statistic::kRms:
      return std::sqrt(mean);
    case Statistic::kFinal:
      return last_;
    case Statistic::kSettlingTime:
      return is_settled_ ? settled_since_ - measure_->from : std::numeric_limits<double>::infinity();
    case Statistic::kOvershoot: {
      if (std::isnan(max_)) return max_;
      const double above = max_ - measure_->target, below = measure_->target - min_;
      const double beyond = first_ < measure_->target   ? above
                            : first_ > measure_->target ? below
                                                        : std::max(above, below);
      return std::max(beyond, 0.0);
    }
  }
  return 0.0;
}

Measuring::Measuring(const Plan& plan, const std::vector<Measure>& measures, std::int64_t num_ticks) {
  if (num_ticks < 1)
    error_ = "until is shorter than a tick of " + io::reader::format_number(plan.period) + " s";
  for (const Measure& measure : measures) {
    const Tally& tally = tallies_.emplace_back(measure, plan.period);
    const std::int64_t last = std::min(tally.last_tick(), num_ticks),
                       first = measure.statistic == Statistic::kFinal ? last : tally.first_tick();
    auto window = std::find_if(windows_.begin(), windows_.end(),
                               [&](const Window& w) { return w.first == first && w.last == last; });
    if (window == windows_.end())
      window = windows_.insert(windows_.end(), {first, last, Quantities(plan), {}});
    window->tallies.push_back({tallies_.size() - 1, needs_verdict(measure.quantity)});
    const std::string problem = window->quantities.add(measure.quantity, measure.reference);
    if (!error_.empty()) continue;
    if (!problem.empty())
      error_ = "measure " + io::reader::quote(measure.name) + ": of: " + io::reader::quote(measure.quantity) +
               ": " + problem;
    else if (tally.first_tick() > last)
      error_ = "measure " + io::reader::quote(measure.name) +
               ": no tick is between from and to; a tick takes " + io::reader::format_number(plan.period) +
               " s";
  }
}

void Measuring::take(const Motion& motion) noexcept {
  const std::int64_t tick = motion.tick();
  const bool is_judged = motion.verdict().tick >= 0;
  for (Window& window : windows_) {
    if (tick < window.first || tick > window.last) continue;
    window.quantities.read(motion);
    const double* value = window.quantities.values().data();
    for (const auto& [number, waits] : window.tallies) {
      if (is_judged || !waits) tallies_[number].take(tick, *value);
      ++value;
    }
  }
}

std::vector<double> Measuring::results() const {
  std::vector<double> results;
  for (const Tally& tally : tallies_) results.push_back(tally.result());
  return results;
}

bool need_verdict(const std::vector<Measure>& measures) {
  return std::any_of(measures.begin(), measures.end(),
                     [](const Measure& measure) { return needs_verdict(measure.quantity); });
}

std::string find_failure(const std::vector<Measure>& measures, const std::vector<double>& results) {
  for (std::size_t k = 0; k < measures.size(); ++k) {
    const Measure& measure = measures[k];
    const std::string found = measure.name + " is " + io::reader::format_number(results[k]);
    if (measure.fail_above && !(results[k] <= *measure.fail_above))
      return found + ", but may be at most " + io::reader::format_number(*measure.fail_above);
    if (measure.fail_below && !(results[k] >= *measure.fail_below))
      return found + ", but must be at least " + io::reader::format_number(*measure.fail_below);
  }
  return {};
}

}  // namespace freeflex::campaign
