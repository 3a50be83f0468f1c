#include "tools/cli/points_batch.hpp"

#include <algorithm>
#include <array>
#include <cassert>

namespace freeflex::tools {
namespace {

constexpr double kMostBytes = 64e6;  // [B] of the points of a batch

std::size_t most_states(const Plan& plan) {
  if (integrates_points(plan)) return 1;  // their read-out has no products with mode shapes
  const double bytes =
      static_cast<double>(sizeof(PointState) * std::max<std::size_t>(1, plan.published_points.size()));
  return static_cast<std::size_t>(
      std::clamp(kMostBytes / bytes, 1.0, static_cast<double>(PointsReader::kMostStates)));
}

}  // namespace

PointsBatch::PointsBatch(const Plan& plan) : plan_(plan), reader_(plan), most_(most_states(plan)) {
  by_point_.resize(most_ * plan.published_points.size());
  by_state_.resize(by_point_.size());
}

bool PointsBatch::has_room_for(const MotionState& state) const {
  return num_ < most_ && (num_ == 0 || states_.front().uses_fallback == state.uses_fallback);
}

std::size_t PointsBatch::add(const MotionState& state) {
  assert(has_room_for(state));
  if (num_ < states_.size())
    states_[num_] = state;
  else
    states_.push_back(state);
  return num_++;
}

void PointsBatch::read() {
  if (num_ == 0) return;
  std::array<const MotionState*, PointsReader::kMostStates> all{};
  for (std::size_t k = 0; k < num_; ++k) all[k] = &states_[k];
  reader_.read(std::span(all).first(num_), plan_.published_points, by_point_.data());
  const std::size_t num_points = plan_.published_points.size();
  for (std::size_t i = 0; i < num_points; ++i)
    for (std::size_t k = 0; k < num_; ++k) by_state_[k * num_points + i] = by_point_[i * num_ + k];
}

std::span<const PointState> PointsBatch::points(std::size_t number) const {
  const std::size_t num_points = plan_.published_points.size();
  return std::span(by_state_).subspan(number * num_points, num_points);
}

}  // namespace freeflex::tools
