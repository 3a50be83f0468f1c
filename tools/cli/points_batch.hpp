// Motions of published points, read for several ticks at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/plan.hpp"
#include "core/step/readout.hpp"

namespace freeflex::tools {

/// Collects states of a motion and then reads the published points of all of them at once. With hundreds of
/// modes, this takes a fraction of the time of reading them tick by tick, because the mode shapes are read
/// from memory once.
class PointsBatch {
 public:
  explicit PointsBatch(const Plan& plan);

  bool is_empty() const { return num_ == 0; }
  std::size_t size() const { return num_; }
  /// Returns whether a state can be added. If not, the batch must be read and cleared first.
  bool has_room_for(const MotionState& state) const;
  /// Adds a copy of a state, and returns its number.  \pre has_room_for(state)
  std::size_t add(const MotionState& state);
  void clear() { num_ = 0; }

  /// Reads the points of all states.
  void read();
  const MotionState& state(std::size_t number) const { return states_[number]; }
  /// Returns the motions of plan.published_points in a state.  \pre read() was called after the last add()
  std::span<const PointState> points(std::size_t number) const;

 private:
  const Plan& plan_;
  PointsReader reader_;
  std::size_t most_, num_ = 0;
  std::vector<MotionState> states_;
  std::vector<PointState> by_point_, by_state_;  // (points x states), (states x points)
};

}  // namespace freeflex::tools
