// The part of FREEFLEX_STATUS that tells of a motion and its verdict: of the daemon's and of a run without
// one.
#pragma once

#include "core/step/readout.hpp"
#include "core/validity/judgement.hpp"
#include "core/validity/validity.hpp"
#include "freeflex_msgs/status_t.hpp"

namespace freeflex::service {

/// A motion, how it is judged, and since when nothing pushes it.
struct JudgedMotion {
  const MotionState& motion;
  const Verdict &now, &worst;
  const BudgetReading& budget;
  std::int64_t last_load_tick;  // last tick with an external load, or of the last reset
};

class MotionStatus {
 public:
  explicit MotionStatus(const Plan& plan);

  /// Fills plan, epoch, tick, replan, energies, drifts, displacements, error budget and verdict. Drifts count
  /// from the first call after the last load.
  void fill(const JudgedMotion& judged, freeflex_msgs::status_t& status);

 private:
  /// Conserved while nothing pushes.
  struct Baseline {
    std::int64_t epoch = -1;
    std::int64_t tick = -1;
    double energy = 0.0;  // [J] kinetic, elastic and gravity
    Vec3 H_W{};           // [kg m^2/s]
  };
  void fill_drift(const JudgedMotion& judged, const Invariants& invariants, freeflex_msgs::status_t& status);
  void fill_sizes(const MotionState& motion, const Invariants& invariants,
                  freeflex_msgs::status_t& status) const;
  void fill_verdict(const JudgedMotion& judged, freeflex_msgs::status_t& status) const;
  void fill_budget(const BudgetReading& reading, freeflex_msgs::status_t& status) const;

  const Plan& plan_;
  Validity validity_;
  Baseline baseline_;
  std::int32_t num_modes_ = 0;  // elastic modes of the scene, left out or not
  bool is_damped_ = false;
};

/// True where a command or a load of the scene pushes in the state.
bool is_pushed(const Plan& plan, const State& state) noexcept;

/// Part that a command brought back, "rotation" or "out_of_plane"; empty when the plan is as it started.
std::string replan_name(const MotionState& motion);

}  // namespace freeflex::service
