// The loads of one step of a shadow, which spans several ticks or a part of one.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/error/tables.hpp"
#include "core/step/step.hpp"

namespace freeflex {

/// Follows the commands of a motion, and turns the loads of a step into parabolas that have the same impulse
/// and the same first and second moment in time   (THEORY 15.2). The error of a mode that turns by 1 rad in
/// the step is then below 1e-3 of the part of the load that the parabola does not follow. Allocates nothing
/// after construction.
class ShadowLoads {
 public:
  /// \param plan  the plan that the shadow accompanies  \param shadow  must outlive this object
  ShadowLoads(const StepPlan& plan, const PlanShadow& shadow);

  /// Forgets all commands.
  void clear() noexcept;
  /// Applies the commands that take effect at a tick.  \pre they passed check_command and has_slot_for
  void command(std::int64_t tick, std::span<const ForceCommand> commands) noexcept;
  /// Removes the slots that end up to a tick, without adding their loads to a step.
  void skip_to(std::int64_t tick) noexcept;
  /// Begins a step at a tick.
  void begin_step(std::int64_t tick) noexcept;
  /// Ends the step at a tick and returns its loads.
  /// \param age  number of the first tick of the step since the epoch began
  const LoadsOverStep& end_step(std::int64_t tick, std::int64_t age) noexcept;
  /// Returns the loads of one substep of a tick. Commands are constant in a tick. Call skip_to() first.
  /// \param age  tick, counted from the start of the epoch  \param substep  index in the tick, from 0
  const LoadsOverStep& loads_of_substep(std::int64_t age, std::int32_t substep) noexcept;
  /// Returns the sum of the sizes of all forces of the last step, and of all torques over the size of the
  /// body [N]. Loads do not cancel in this sum.
  double size() const noexcept { return size_; }
  /// Returns the same of commands alone since begin_pause() [N].
  double command_size_in_pause() const noexcept { return pause_size_; }
  /// Begins to follow the sizes of commands while the shadow pauses.
  void begin_pause() noexcept;
  /// Returns the sum of the sizes of all histories where they are largest between two ticks [N].
  double largest_histories(std::int64_t from_age, std::int64_t to_age) const noexcept;
  /// Copies the active slots to the state of a shadow whose plan divides its steps.
  void copy_slots(std::int64_t age, State& state) noexcept;

 private:
  void move_to(std::int64_t tick) noexcept;
  void add_piece(std::int64_t from, std::int64_t to) noexcept;
  void copy_slots(State& state) noexcept;
  void sum_slots() noexcept;
  void sum_amplitudes(std::int64_t age, std::int32_t substep) noexcept;
  void sum_sizes(std::int64_t age) noexcept;

  const StepPlan& plan_;
  const PlanShadow& shadow_;
  std::vector<Slot> slots_;
  std::int32_t num_slots_ = 0;
  bool is_new_ = true;       // slots_ changed since `now_` was computed
  bool is_copied_ = false;   // slots_ did not change since copy_slots() or loads_of_substep()
  bool is_in_step_ = false;  // the loads of the present step are summed
  // a piece of the present step ended with other slots than those at its end
  bool has_pieces_ = false;
  std::int64_t start_ = 0;  // first tick of the present step
  std::int64_t from_ = 0;   // tick from which `slots_` act in the present step
  StepReport ends_;
  SumsOnPoints now_;  // loads of `slots_`, unless is_new_
  std::array<SumsOnPoints, 3> pieces_;
  double arm_ = 0.0;                   // [m] largest distance of a point from the centre of mass
  std::vector<double> history_sizes_;  // [N] of each history at amplitude 1
  double command_size_ = 0.0, size_ = 0.0, pause_size_ = 0.0;  // [N]
  bool is_pausing_ = false;
  Array group_rows_;
  LoadsOverStep over_;
};

/// Returns the values at the start, the middle and the end of a step of the parabola that has the moments of
/// order 0 to 2 of a load of size 1 between the shares u and v of the step, and 0 elsewhere   (THEORY 15.2).
std::array<double, 3> parabola_of_piece(double u, double v) noexcept;

}  // namespace freeflex
