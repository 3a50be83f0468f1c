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
  };
  Agent agent = Agent::kNone;
  std::int32_t item = -1;  // index of the load, link or wheel; -1: none, or not known which
  std::int32_t mode = 0;   // its number in the scene, from 1; 0: none
  double frequency = 0.0;  // [Hz] of that mode; 0: a mechanism
};

/// Finds what is responsible. Allocates nothing after construction.
class ResponsibleFinder {
 public:
  explicit ResponsibleFinder(const Plan& plan) : plan_(plan) {}

  /// Returns what changes the stiffness of a mode most. \param mode  of the active plan; -1: one that is left
  /// out
  Responsible of_stiffness(const ModalErrors& errors, std::int32_t mode, const State& state) const noexcept;
  /// Returns what takes the stiffness of the softest mode, be it left out of the plan.
  Responsible of_buckling(const ModalErrors& errors, const State& state) const noexcept;
  /// Returns the load that holds a mode displaced, or its vibration.
  Responsible of_displacement(std::int32_t mode, const State& state) const noexcept;
  Responsible of_vibration(std::int32_t mode, const State& state) const noexcept;
  /// Returns what could hide an error: a wheel, a link whose inside no table tells, or modes that are left
  /// out.
  Responsible of_hidden(const ModalLeaders& leaders, const State& state) const noexcept;

 private:
  void name_mode(std::int32_t mode, const State& state, Responsible& named) const noexcept;
  Responsible acting_load(const State& state) const noexcept;

  const Plan& plan_;
};

}  // namespace freeflex
