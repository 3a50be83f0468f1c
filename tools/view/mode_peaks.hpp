// The modes that move: those with the largest peak energy.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "freeflex_msgs/state_t.hpp"
#include "tools/view/body.hpp"

namespace freeflex::tools {

/// Keeps the peak energy of each mode of a body: M/2 (qdot^2 + omega^2 q^2).  [J]
class ModePeaks {
 public:
  /// \pre the body outlives it
  explicit ModePeaks(const Body& body) : body_(&body) {}
  /// A state of another session or epoch begins anew.
  void take(const freeflex_msgs::state_t& state);
  /// Returns pairs of mode, counted from 0, and peak energy [J], the largest first, at most kMostRanked of
  /// them. Modes that move by rounding alone are left out.
  Json largest() const;

  static constexpr std::size_t kMostRanked = 6;

 private:
  const Body* body_;
  std::int64_t session_ = 0, epoch_ = -1;
  std::vector<double> peaks_;  // [J] (modes of the body)
};

}  // namespace freeflex::tools
