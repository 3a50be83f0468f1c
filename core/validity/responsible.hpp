// What a verdict names beside its cause: the load, link, wheel or mode that does most of it.
#pragma once

#include <cstdint>
#include <vector>

#include "core/step/state.hpp"
#include "core/validity/modal_errors.hpp"

namespace freeflex {

/// What is responsible for a cause. It is for messages alone: nothing of it goes into the verdict.
struct Responsible {
  enum class Agent : std::int32_t {
    kNone,
    kLoad,       // a load of the scene
    kCommands,   // commanded loads
    kSpin,       // the spin of the body
    kOrbit,      // the field of the attractor
    kVibration,  // the vibration itself
    kLink,
    kWheel,
    kModes,  // modes that are left out
    kRate,   // a mode that swings too fast for the rate
  };
  Agent agent = Agent::kNone;
  std::int32_t item = -1;  // index of the load, link or wheel; -1: none, or not known which
  std::int32_t mode = 0;   // its number in the scene, from 1; 0: none
  double frequency = 0.0;  // [Hz] of that mode; 0: a mechanism
};

/// Returns true for a link that is given without the forces inside it: a matrix, a rigid link or a plate.
bool hides_forces(const PlanLink& link);

/// Finds what is responsible. Allocates nothing after construction.
class ResponsibleFinder {
 public:
  explicit ResponsibleFinder(const Plan& plan);

  /// Returns what changes the stiffness of a mode most.  \param mode  of the active plan
  Responsible of_stiffness(const ModalErrors& errors, std::int32_t mode, const State& state) noexcept;
  /// Returns what takes the stiffness of the softest mode, be it left out of the plan.
  Responsible of_buckling(const ModalErrors& errors, const State& state) noexcept;
  /// Returns which of the commanded load and the spin changes the stiffness of a mode of a steady answer
  /// most.
  Responsible of_steady(const ModalErrors& errors, const JudgedMode& mode, const State& state) noexcept;
  /// Returns the load that holds a mode displaced, or its vibration.
  Responsible of_displacement(std::int32_t mode, const State& state) noexcept;
  /// Returns the largest of the loads that change faster than ticks follow.
  Responsible of_fast_load(const State& state) noexcept;
  Responsible of_vibration(std::int32_t mode, const State& state) const noexcept;
  /// Returns what could hide an error: a wheel, a link whose inside no table tells, modes that are left out,
  /// or a mode whose stiffness pulsates faster than ticks follow.
  Responsible of_hidden(const ModalLeaders& leaders, const State& state) const noexcept;

 private:
  void name_mode(std::int32_t mode, const State& state, Responsible& named) const noexcept;
  void name_mode(const JudgedMode& mode, const State& state, Responsible& named) const noexcept;
  template <typename Visit>
  void for_each_load(const State& state, const Visit& visit) noexcept;
  void project_load(const Plan& plan, const LoadPattern& pattern, const Mat3& R_WB) noexcept;
  Responsible most_of_stiffness(const ModalErrors& errors, const JudgedMode& mode, bool is_softened,
                                const State& state) noexcept;

  const Plan& plan_;
  Array Q_, rest_;            // [N] of one load at amplitude 1, and of what is no load
  std::vector<Vec3> forces_;  // [N] on each point, on rungs that couple
};

}  // namespace freeflex
