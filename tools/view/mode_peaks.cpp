#include "tools/view/mode_peaks.hpp"

#include <algorithm>
#include <numeric>

#include "tools/view/live.hpp"

namespace freeflex::tools {

void ModePeaks::take(const freeflex_msgs::state_t& state) {
  const auto num_modes = index(body_->num_modes);
  if (state.session != session_ || state.epoch != epoch_ || peaks_.size() != num_modes)
    peaks_.assign(num_modes, 0.0);
  session_ = state.session;
  epoch_ = state.epoch;
  for (std::size_t l = 0; l < num_modes; ++l) {
    const std::size_t at = coordinate_of_mode(*body_, state, l);
    if (at >= state.q.size() || at >= state.q_dot.size()) continue;
    const double rate = state.q_dot[at], spring = body_->plan.omega[l] * state.q[at];
    peaks_[l] = std::max(peaks_[l], 0.5 * body_->plan.mass * (rate * rate + spring * spring));
  }
}

Json ModePeaks::largest() const {
  // [-] relative to the largest energy, because smaller energies are rounding errors
  constexpr double kLeast = 1e-12;
  std::vector<std::size_t> ranked(peaks_.size());
  std::iota(ranked.begin(), ranked.end(), std::size_t{0});
  std::stable_sort(ranked.begin(), ranked.end(),
                   [this](std::size_t a, std::size_t b) { return peaks_[a] > peaks_[b]; });
  Json pairs = Json::array();
  for (const std::size_t mode : ranked) {
    if (pairs.size() == kMostRanked || !(peaks_[mode] > kLeast * peaks_[ranked.front()])) break;
    pairs.push_back(Json::array({mode, peaks_[mode]}));
  }
  return pairs;
}

}  // namespace freeflex::tools
