#include "tools/cli/branches.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tools/plot/chart.hpp"

namespace freeflex::tools {
namespace {

constexpr std::complex<double> kMissing{std::numeric_limits<double>::quiet_NaN(),
                                        std::numeric_limits<double>::quiet_NaN()};

/// Names the motions at the first spin by the modes of nearest frequency, each mode once.
class ModeNames {
 public:
  explicit ModeNames(const StepPlan& plan) : plan_(plan), is_taken_(index(plan.num_elastic)) {}
  int next(const SmallMotion& small) {
    std::size_t nearest = 0;
    double distance = HUGE_VAL;
    for (std::size_t mode = 0; mode < is_taken_.size(); ++mode)
      if (const double d = std::abs(plan_.omega[mode] - std::abs(small.rate));
          !is_taken_[mode] && d < distance)
        nearest = mode, distance = d;
    is_taken_[nearest] = true;
    return number_of(plan_, static_cast<int>(nearest));
  }

 private:
  const StepPlan& plan_;
  std::vector<bool> is_taken_;
};

}  // namespace

std::vector<Branch> branches_of(const StepPlan& plan, const std::vector<RelativeEquilibrium>& all) {
  std::vector<Branch> branches;
  ModeNames names(plan);
  for (std::size_t k = 0; k < all.size(); ++k) {
    const std::vector<SmallMotion>& motions = all[k].motions;
    struct Pair {
      double distance;
      std::size_t branch, motion;
    };
    std::vector<Pair> pairs;
    for (std::size_t b = 0; b < branches.size(); ++b) {
      const auto& rates = branches[b].rates;
      if (std::isnan(rates[k - 1].real())) continue;
      const bool has_two = k > 1 && !std::isnan(rates[k - 2].real());
      const std::complex<double> next = has_two ? 2.0 * rates[k - 1] - rates[k - 2] : rates[k - 1];
      for (std::size_t m = 0; m < motions.size(); ++m)
        pairs.push_back({std::abs(motions[m].rate - next), b, m});
    }
    std::sort(pairs.begin(), pairs.end(),
              [](const Pair& a, const Pair& b) { return a.distance < b.distance; });
    std::vector<bool> is_taken(motions.size());
    for (Branch& branch : branches) branch.rates.push_back(kMissing);
    for (const Pair& pair : pairs) {
      if (is_taken[pair.motion] || !std::isnan(branches[pair.branch].rates[k].real())) continue;
      is_taken[pair.motion] = true;
      branches[pair.branch].rates[k] = motions[pair.motion].rate;
    }
    for (std::size_t m = 0; m < motions.size(); ++m) {
      if (is_taken[m]) continue;
      Branch& fresh = branches.emplace_back();
      fresh.name = motions[m].mode < 0 ? "body"
                   : k == 0            ? "mode " + std::to_string(names.next(motions[m]))
                                       : "-";
      fresh.rates.assign(k, kMissing);
      fresh.rates.push_back(motions[m].rate);
    }
  }
  // those that grow first, then the lowest, by the first frequency that is not zero
  const auto rank = [](const Branch& branch) {
    double frequency = HUGE_VAL;
    for (const auto rate : branch.rates) {
      if (grows(rate)) return -1.0;
      if (rate.imag() > 0.0 && frequency == HUGE_VAL) frequency = rate.imag();
    }
    return frequency;
  };
  std::stable_sort(branches.begin(), branches.end(),
                   [&](const Branch& a, const Branch& b) { return rank(a) < rank(b); });
  return branches;
}

std::string draw_branches(const std::string& title, const std::string& path, const std::vector<double>& spins,
                          const std::vector<Branch>& branches) {
  Panel frequency{"frequency [Hz]", spins, {}, {}},
      damping{"damping ratio [-], negative where a motion grows", spins, {}, {0.0}};
  for (const Branch& branch : branches) {
    Series of_frequency{branch.name, {}}, of_damping{branch.name, {}};
    for (const std::complex<double> rate : branch.rates) {
      of_frequency.y.push_back(rate.imag() / (2.0 * std::numbers::pi));
      const double size = std::abs(rate);
      of_damping.y.push_back(std::isnan(size) ? size : -growth_of(rate) / size);
    }
    frequency.series.push_back(std::move(of_frequency));
    damping.series.push_back(std::move(of_damping));
  }
  Series once{"once a turn", {}};
  for (const double spin : spins) once.y.push_back(spin / (2.0 * std::numbers::pi));
  frequency.series.push_back(std::move(once));
  return plot_panels(path, title, "spin [rad/s]", {frequency, damping});
}

}  // namespace freeflex::tools
