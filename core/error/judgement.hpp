// The verdict on a motion: the distance from the shadow, and what this distance does not show.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "core/error/growth.hpp"
#include "core/error/shadow.hpp"
#include "core/error/verdict.hpp"

namespace freeflex {

/// Judges one motion from its first tick on. Allocates nothing after construction.
class Judgement {
 public:
  /// \pre !plan.verdict.is_off
  explicit Judgement(const Plan& plan);

  /// Notes the commands of a tick. Call this function before take() of the next tick.
  void command(std::int64_t tick, std::span<const ForceCommand> commands) noexcept;
  /// Takes the state. Call this function at the start of an epoch and after every tick. Returns true if the
  /// verdict is new.
  bool take(const MotionState& state) noexcept;
  /// Returns whether take() reads more than the numbers of tick and epoch.
  bool needs(const MotionState& state) const noexcept;
  const Verdict& now() const noexcept { return now_; }
  /// Returns the worst verdict since the epoch began, or the first of several equally bad ones. If every
  /// verdict was `good`, the tick of the returned verdict is -1.
  const Verdict& worst() const noexcept { return worst_; }

 private:
  void begin(const MotionState& state) noexcept;
  void judge(const MotionState& state) noexcept;
  bool may_inside_matter(const MotionState& state, double span) noexcept;
  double vibration(const MotionState& state) const noexcept;
  bool may_ringing_matter(double span) noexcept;
  bool may_error_grow(const MotionState& state, double ratio) noexcept;
  void take_attractor(const MotionState& state, double span) noexcept;

  const Plan& plan_;
  std::optional<Shadow> shadow_;
  std::int64_t epoch_ = -1, last_tick_ = 0;
  double size_ = 0.0;            // [m] largest distance of a point, or radius of uneven_inertia_ if larger
  double uneven_inertia_ = 0.0;  // [kg m^2] largest minus smallest principal moment
  bool is_field_exact_ = false;  // the attractor acts on each point mass of the shadow   (THEORY 8.21)
  Vec3 start_W_{};               // [m] centre of mass at the start of the epoch
  double slowest_ = 0.0;         // [1/s] slowest decay of a mode
  double fade_ = 0.0;            // [1/s] decay of peak_
  double peak_ = 0.0;            // [m] peak of the displacement, decaying
  // [m/s], [m] errors of velocity and position due to the first neglected term of the attractor's field, and
  // [-] largest size of the body over its distance from the attractor
  double velocity_error_ = 0.0, position_error_ = 0.0, attractor_ratio_ = 0.0;
  // [rad] phase by which what is not known of the inside of links may have shifted the lowest mode, decaying
  double hidden_phase_ = 0.0;
  // [-] share by which the ringing of modes that the steps of the shadow do not resolve may have changed the
  // stiffness of the lowest mode, decaying
  double ringing_ = 0.0;
  Growth growth_;
  Verdict now_, worst_;
};

}  // namespace freeflex
