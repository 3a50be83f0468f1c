// Properties of loads that only the estimate of the error needs.
#pragma once

#include "core/error/tables.hpp"
#include "core/step/loads/loads.hpp"
#include "core/step/state.hpp"

namespace freeflex {

/// Returns the number of elastic coordinates for which a plan has arms of its loads.
std::size_t num_armed(const PlanUnmodelled& unmodelled) noexcept;

/// Sets arms to the torque about the centre of mass that each elastic coordinate adds by displacing the
/// loaded points, b_il x F_i [N m per m]   (THEORY X148). Every loaded point must have rows.
/// \param num_armed  number of elastic coordinates that get arms; these are the first of the plan
/// \param arms  [N m per m] (num_armed x kArmSize) torques per elastic coordinate
void set_arms(const StepPlan& plan, std::size_t num_armed, const SumsOnPoints& sums, Array& arms) noexcept;

/// Returns the sum of |x| + |y| + |z| over all forces [N]. Forces do not cancel in this sum   (THEORY X143).
double size_of_forces(const SumsOnPoints& sums) noexcept;

/// Holds arms and size of the commanded loads of a motion. Allocates nothing after construction.
class CommandLoads {
 public:
  CommandLoads(const StepPlan& plan, const PlanUnmodelled& unmodelled);

  /// Makes the next update compute the loads again. Call this function before an update with another motion.
  void clear() noexcept { changes_ = -1; }
  /// Computes arms and size of the active commands, if these commands have changed since the last update.
  void update(const State& state) noexcept;
  /// Returns the result of set_arms [N m per m] (num_armed x kArmSize).
  const Array& arms() const noexcept { return arms_; }
  /// Returns the sums of the active commands.
  const LoadSums& sums() const noexcept { return sums_; }
  /// Returns the result of size_of_forces [N].
  double size() const noexcept { return size_; }

 private:
  const StepPlan& plan_;
  std::size_t num_armed_;
  SumsOnPoints sums_;
  Array arms_;
  double size_ = 0.0;
  std::int64_t changes_ = -1;  // State::num_slot_changes at the last update
};

}  // namespace freeflex
