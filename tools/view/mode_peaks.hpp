// Finds the modes with the largest peak energy.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "freeflex_msgs/state_t.hpp"
#include "tools/view/body.hpp"

namespace freeflex::tools {

/// Keeps the peak of the energy M/2 (qdot^2 + omega^2 q^2) [J] of each mode of a body, where M is the mass of
/// the body.
class ModePeaks {
 public:
  /// \pre the body outlives this object
  explicit ModePeaks(const Body& body) : body_(&body) {}
  /// Updates the peaks with a state. A state of another session or epoch first resets the peaks.
  void take(const freeflex_msgs::state_t& state);
  /// Returns at most kMostRanked pairs of mode (counted from 0) and peak energy [J], the largest first. Modes
  /// whose motion is only rounding error are omitted.
  Json largest() const;

  static constexpr std::size_t kMostRanked = 6;

 private:
  const Body* body_;
  std::int64_t session_ = 0, epoch_ = -1;
  std::vector<double> peaks_;  // [J] (modes of the body)
};

}  // namespace freeflex::tools
