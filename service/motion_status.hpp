// The part of FREEFLEX_STATUS that tells of a motion and its verdict: of the daemon's and of a run without
// one.
#pragma once

#include "core/step/readout.hpp"
#include "core/validity/judgement.hpp"
#include "core/validity/validity.hpp"
#include "freeflex_msgs/status_t.hpp"

namespace freeflex::service {

/// What stays the same from the moment on at which nothing pushes, and what drifts are counted from.
struct FreeMotion {
  std::int64_t epoch = -1;
  bool is_free = false;
  double energy = 0.0;  // [J] kinetic, elastic and of gravity
  Vec3 H_W{};           // [kg m^2/s]
  /// At the start of an epoch and after every tick. Allocates nothing.
  void take(const Plan& plan, const State& state) noexcept;
};

/// A motion, how it is judged, and what it would keep.
struct JudgedMotion {
  const MotionState& motion;
  const Verdict &now, &worst;
  const BudgetReading& budget;
  const FreeMotion& free;
};

class MotionStatus {
 public:
  explicit MotionStatus(const Plan& plan);

  /// Fills plan, epoch, tick, replan, energies, drifts, displacements, error budget and verdict.
  void fill(const JudgedMotion& judged, freeflex_msgs::status_t& status) const;

 private:
  void fill_drift(const JudgedMotion& judged, const Invariants& invariants,
                  freeflex_msgs::status_t& status) const;
  void fill_sizes(const MotionState& motion, const Invariants& invariants,
                  freeflex_msgs::status_t& status) const;
  void fill_verdict(const JudgedMotion& judged, freeflex_msgs::status_t& status) const;
  void fill_budget(const BudgetReading& reading, freeflex_msgs::status_t& status) const;

  const Plan& plan_;
  Validity validity_;
  std::int32_t num_modes_ = 0;  // elastic modes of the scene, left out or not
  bool is_damped_ = false;
};

/// True where a command or a load of the scene pushes in the state.
bool is_pushed(const Plan& plan, const State& state) noexcept;

/// Part that a command brought back, "rotation" or "out_of_plane"; empty when the plan is as it started.
std::string replan_name(const MotionState& motion);

}  // namespace freeflex::service
