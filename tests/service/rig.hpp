// A simulation loop without a bus: commands go into its ring, what comes out is collected. One thread.
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

/// Time that passes only by sleeping, or when a test says so.
class FakeClock final : public service::Clock {
 public:
  std::int64_t now_ns() noexcept override { return now_ns_; }
  std::int64_t boot_ns() noexcept override { return now_ns_ + suspended_ns_; }
  void sleep_until(std::int64_t deadline_ns) noexcept override {
    now_ns_ = std::max(now_ns_, deadline_ns);
    if (on_sleep) on_sleep();
  }
  void pass(std::int64_t ns) { now_ns_ += ns; }
  /// The machine is suspended: only the boot time goes on.
  void suspend(std::int64_t ns) { suspended_ns_ += ns; }

  std::function<void()> on_sleep;  // after each sleep

 private:
  std::int64_t now_ns_ = 1'000'000'000;
  std::int64_t suspended_ns_ = 0;
};

inline constexpr service::Timing kRealtime{};
inline constexpr service::Timing kLockstep{service::Timing::Kind::kLockstep, 1.0};
inline constexpr service::Timing kAsap{service::Timing::Kind::kAsap, 1.0};

/// The octahedron, everything pushable and published, at 1 kHz.
Plan octahedron_plan();

/// [N] along (1, 2, 3) on a point, by sender "test", for a minute at 1 kHz, the longest that the bus may.
ForceCommand make_push(std::int64_t sequence, int slot = 0, std::int64_t start_tick = -1, int point = 0,
                       double size = 1.0);

struct Rig {
  /// \param most_waiting  snapshots of a channel; with one a loop without a pace waits for each to be taken
  Rig(const Plan& plan, const service::LoopSettings& settings, service::Clock& clock_of_loop,
      std::size_t most_waiting = 1);
  Rig(const Plan& plan, const service::LoopSettings& settings, std::size_t most_waiting = 1)
      : Rig(plan, settings, clock, most_waiting) {}

  /// False when the ring is full.
  bool push(const ForceCommand& command);
  bool control(std::int32_t command, std::int64_t count = 0, const std::string& target = "");
  /// What the rings hold by now, appended to acks and applied.
  void collect();
  /// The oldest STATE that nobody took, or null; the oldest of each channel beside it is taken too.
  const service::Snapshot* take_motion();
  /// Runs to the end and collects.
  void run();
  /// Next tick to be executed, as the loop last published it.
  std::int64_t tick() const { return output->tick.load(); }

  FakeClock clock;
  service::Clock& loop_clock;  // that one unless another was given
  std::unique_ptr<service::InboundRing> inbound = std::make_unique<service::InboundRing>();
  std::unique_ptr<service::Output> output;
  service::Simulation simulation;
  std::vector<service::AckEntry> acks;
  std::vector<service::AppliedEntry> applied;
  std::int64_t next_sequence = 1'000'000;  // of controls
  service::Snapshot taken;                 // by take_motion
};

/// Every number of the motion, bit for bit.
std::vector<std::uint64_t> motion_bits(const MotionState& motion);

}  // namespace freeflex::testing
