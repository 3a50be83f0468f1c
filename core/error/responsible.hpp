// Finds the load, link, wheel or mode that contributes most to the cause of a verdict.
#pragma once

#include <cstdint>
#include <vector>

#include "core/error/modal_errors.hpp"
#include "core/error/verdict.hpp"
#include "core/step/state.hpp"

namespace freeflex {

/// Returns true for a link whose internal forces are not given. Such a link is a matrix, a rigid link or a
/// plate.
bool hides_forces(const PlanLink& link);

/// Finds the responsible item of each cause. Allocates nothing after construction.
class ResponsibleFinder {
 public:
  explicit ResponsibleFinder(const Plan& plan);

  /// Returns the item that changes the stiffness of a mode the most.  \param mode  index in the active plan
  Responsible of_stiffness(const ModalErrors& errors, std::int32_t mode, const State& state) noexcept;
  /// Returns the item that reduces the stiffness of the softest mode the most. The softest mode may be an
  /// omitted mode.
  Responsible of_buckling(const ModalErrors& errors, const State& state) noexcept;
  /// Returns the commanded load or the spin, whichever changes the stiffness of a mode more in a quasi-static
  /// response.
  Responsible of_steady(const ModalErrors& errors, const JudgedMode& mode, const State& state) noexcept;
  /// Returns the load that displaces a mode the most quasi-statically, or the vibration if it displaces the
  /// mode more than all loads together do.
  Responsible of_displacement(std::int32_t mode, const State& state) noexcept;
  /// Returns the largest of the loads that change faster than the ticks resolve.
  Responsible of_fast_load(const State& state) noexcept;
  Responsible of_vibration(std::int32_t mode, const State& state) const noexcept;
  /// Returns the item with the largest unquantified error. The item is a wheel, a link whose internal forces
  /// are in no table, omitted modes, or a mode whose stiffness pulsates faster than the ticks resolve.
  Responsible of_unquantified(const ModalLeaders& leaders, const State& state) const noexcept;

 private:
  void name_mode(std::int32_t mode, const State& state, Responsible& named) const noexcept;
  void name_mode(const JudgedMode& mode, const State& state, Responsible& named) const noexcept;
  template <typename Visit>
  void for_each_load(const State& state, const Visit& visit) noexcept;
  void project_load(const StepPlan& plan, const LoadPattern& pattern, const Mat3& R_WB) noexcept;
  Responsible most_of_stiffness(const ModalErrors& errors, const JudgedMode& mode, bool is_softened,
                                const State& state) noexcept;

  const Plan& plan_;
  // [N] The generalized forces of one load at amplitude 1, and the generalized forces that no load causes.
  Array Q_, rest_;
  std::vector<Vec3> forces_;  // [N] force on each point, used on the coupled rungs
};

}  // namespace freeflex
