// The rig runs a simulation loop in one thread without a bus. Commands go into the ring of the loop, and the
// outputs of the loop are collected.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "freeflex_msgs/applied_t.hpp"
#include "freeflex_msgs/control_t.hpp"
#include "service/loop.hpp"
#include "tests/support/simulation.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {

/// Simulates a clock that advances only by sleep and by pass().
class FakeClock final : public service::Clock {
 public:
  std::int64_t now_ns() noexcept override { return now_ns_; }
  std::int64_t boot_ns() noexcept override { return now_ns_ + suspended_ns_; }
  void sleep_until(std::int64_t deadline_ns) noexcept override {
    now_ns_ = std::max(now_ns_, deadline_ns);
    if (on_sleep) on_sleep();
  }
  void pass(std::int64_t ns) { now_ns_ += ns; }
  /// Simulates that the machine is suspended, so only the boot time advances.
  void suspend(std::int64_t ns) { suspended_ns_ += ns; }

  std::function<void()> on_sleep;  // called after each sleep

 private:
  std::int64_t now_ns_ = 1'000'000'000;
  std::int64_t suspended_ns_ = 0;
};

inline constexpr service::Timing kRealtime{};
inline constexpr service::Timing kLockstep{service::Timing::Kind::kLockstep, 1.0};
inline constexpr service::Timing kAsap{service::Timing::Kind::kAsap, 1.0};

/// Returns a plan of the octahedron at 1 kHz in which everything is pushable and published.
Plan octahedron_plan();

/// Returns a command of sender "test": a force of `size` [N] times (1, 2, 3) on a point, for a minute at 1
/// kHz, which is the longest duration allowed on the bus.
ForceCommand make_push(std::int64_t sequence, int slot = 0, std::int64_t start_tick = -1, int point = 0,
                       double size = 1.0);

struct Rig {
  /// \param most_waiting  number of snapshots of one channel that can wait. If it is 1, a loop without a pace
  ///   waits for the reader  \param verdicts  judges the motion; nullptr: nothing is judged
  Rig(const Plan& plan, const service::LoopSettings& settings, service::Clock& clock_of_loop,
      std::size_t most_waiting = 1, service::VerdictThread* verdicts = nullptr);
  Rig(const Plan& plan, const service::LoopSettings& settings, std::size_t most_waiting = 1)
      : Rig(plan, settings, clock, most_waiting) {}

  /// These functions put a command into the ring, or return false if the ring is full.
  bool push(const ForceCommand& command);
  bool control(std::int32_t command, std::int64_t count = 0, const std::string& target = "");
  /// Moves all entries of the rings to acks and applied.
  void collect();
  /// Returns the oldest STATE that has not been taken, or null. Takes the oldest snapshot of each other
  /// channel too.
  const service::Snapshot* take_motion();
  /// Runs to the end and collects the outputs.
  void run();
  /// Returns the next tick to execute, as the loop last published it.
  std::int64_t tick() const { return output->tick.load(); }

  FakeClock clock;
  service::Clock& loop_clock;  // `clock`, unless the constructor got another clock
  std::unique_ptr<service::InboundRing> inbound = std::make_unique<service::InboundRing>();
  std::unique_ptr<service::Output> output;
  service::Simulation simulation;
  std::vector<service::AckEntry> acks;
  std::vector<service::AppliedEntry> applied;
  std::int64_t next_sequence = 1'000'000;  // next sequence of a control
  service::Snapshot taken;                 // the snapshot that take_motion() returned
};

/// Returns the bits of every number of the motion.
std::vector<std::uint64_t> motion_bits(const MotionState& motion);

}  // namespace freeflex::testing
