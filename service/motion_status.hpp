// The part of FREEFLEX_STATUS that describes a motion and its verdict, for the daemon and for freeflex run.
#pragma once

#include "core/error/validity.hpp"
#include "core/error/verdict.hpp"
#include "core/motion.hpp"
#include "core/step/readout.hpp"
#include "freeflex_msgs/status_t.hpp"

namespace freeflex::service {

/// The energy and the angular momentum at the time since which no load has acted: the end of the last load,
/// or the start of the epoch. The drifts in STATUS are the relative changes since then.
struct FreeMotion {
  std::int64_t epoch = -1;
  bool is_free = false;
  double energy = 0.0;  // [J] kinetic, elastic and gravitational
  Vec3 H_W{};           // [kg m^2/s]
  /// Updates these values. Must be called at the start of an epoch and after every tick. Allocates nothing.
  void take(const Motion& motion) noexcept;
};

/// A motion with its verdicts and the values from which its drifts are measured.
struct JudgedMotion {
  const MotionState& motion;
  const Verdict &now, &worst;
  const FreeMotion& free;
};

class MotionStatus {
 public:
  explicit MotionStatus(const Plan& plan);

  /// Fills plan, epoch, tick, replan, energies, drifts, displacements and verdict.
  void fill(const JudgedMotion& judged, freeflex_msgs::status_t& status) const;

 private:
  void fill_drift(const JudgedMotion& judged, const Invariants& invariants,
                  freeflex_msgs::status_t& status) const;
  void fill_sizes(const MotionState& motion, const Invariants& invariants,
                  freeflex_msgs::status_t& status) const;
  void fill_verdict(const JudgedMotion& judged, freeflex_msgs::status_t& status) const;

  const Plan& plan_;
  Validity validity_;
  std::int32_t num_modes_ = 0;  // elastic modes of the scene, including omitted modes
  bool is_damped_ = false;
};

/// Returns the feature for which a command switched to the fallback plan, "rotation" or "out_of_plane", or an
/// empty text if the plan has not been switched.
std::string replan_name(const MotionState& motion);

}  // namespace freeflex::service
