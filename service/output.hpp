// What the simulation thread hands to the publish side: rings and queues for what is to arrive, a box for
// what is only wanted fresh, histograms and counters for status; and the operator's commands, which come from
// this process too. Preallocated; lives on the heap (about 20 MB, and at most kMotionBytes for each channel
// of the motion that is published).
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "core/step/budget.hpp"
#include "core/validity/judgement.hpp"
#include "service/box.hpp"
#include "service/histogram.hpp"
#include "service/io/wire/outbound.hpp"
#include "service/motion_status.hpp"
#include "service/queue.hpp"
#include "service/shared.hpp"

namespace freeflex::service {

/// status_t.mode.
enum class Mode : std::int32_t { kStarting = 0, kRunning = 1, kHolding = 2, kFault = 3, kStopped = 4 };

/// The answer to a command, before it is put in words.
struct AckEntry {
  std::array<char, kSenderSize> sender{};
  std::int64_t sequence = 0;
  io::Reason reason = io::Reason::kAccepted;
  Mode mode = Mode::kRunning;  // at the answer
  std::int64_t tick = 0;       // accepted: takes effect; rejected: at the rejection
  std::int32_t command = 0;    // control_t constant; 0: a force
  // start_tick of a force, count of a control command, or what the reason is about: [ms] that a command
  // waited, how many slots or waiting commands its sender may have
  std::int64_t found = 0;
  std::int64_t most = 0;  // that count may be, of SHAPES and SCENE; [ticks] that a start may be ahead
};

/// What changed the motion (applied_t).
struct AppliedEntry {
  std::int64_t sequence = 0;  // 0, 1, 2, ... without gaps
  std::int64_t tick = 0;
  std::int32_t kind = 0;   // applied_t constants
  ForceCommand command{};  // FORCE
  Expiry expiry{};         // EXPIRED, LEASE_LOST, CLEARED
};

/// Why the loop is in Mode::kFault.
struct FaultNote {
  std::int64_t tick = 0;                   // last good tick, held
  std::int32_t num_commands = 0;           // taken at that tick
  std::array<char, kSenderSize> sender{};  // of the last of them
  std::int64_t sequence = 0;
};

/// What SHAPES and SCENE ask for, of the plan or the wide one.
struct PageRequest {
  std::int32_t command = 0;  // control_t constant
  std::int32_t number = 0;   // elastic mode from 1; page from 1, 0: all
  bool is_wide = false;
};

/// What publication needs of one tick.
struct Snapshot {
  MotionState motion;
  std::int64_t applied_count = 0;
  FreeMotion free;
  std::int32_t num_slots = 0;  // in force
  Mode mode = Mode::kStarting;
  FaultNote fault;
  BudgetReading budget;    // status only
  Verdict verdict, worst;  // of now, and the worst since the epoch began
};
/// With room for the motion in either plan, also in copies: nothing allocates when a motion is assigned.
Snapshot make_snapshot(const Plan& plan);

/// The operator's commands -> simulation; answers go back the same way, not over the bus.
using OperatorRing = Ring<InboundEntry, 64>;

struct Output {
  static constexpr int kNumAcks = 2048;
  static constexpr int kNumOperatorAcks = 512;
  static constexpr int kNumApplied = 1024;
  static constexpr int kNumRequests = 64;
  /// Snapshots of one channel that wait for a publisher that is late: a quarter of a second at 1 kHz, less
  /// where kMotionBytes hold fewer, and never fewer than the least.
  static constexpr std::size_t kMostWaiting = 256, kLeastWaiting = 4;
  static constexpr std::size_t kMotionBytes = 16'000'000;

  /// \param most_waiting  > 0, snapshots of a channel
  explicit Output(const Plan& plan, std::size_t most_waiting = kMostWaiting);

  // every one arrives
  Ring<AckEntry, kNumAcks> acks;
  Ring<AckEntry, kNumOperatorAcks> operator_acks;
  Ring<AppliedEntry, kNumApplied> applied;
  Ring<PageRequest, kNumRequests> requests;
  // each arrives while there is room; filled at the tick multiples of each channel's rate, as
  // io::kMotionChannels
  std::array<Queue<Snapshot>, io::kNumMotionChannels> motion;
  std::array<std::atomic<std::int64_t>, io::kNumMotionChannels> num_dropped{};  // for want of room
  // of SCENE with the plan and with the wide one; set before the simulation runs
  std::array<std::int32_t, 2> num_scene_pages{1, 1};
  // filled when asked for
  std::atomic<bool> is_status_wanted{false};
  Box<Snapshot> status;
  // one writer, the simulation thread
  Histogram lateness, compute, command_latency;
  std::atomic<std::int64_t> tick{0};  // next to be executed
  std::atomic<std::int64_t> num_overruns{0}, num_slips{0}, num_accepted{0};
  std::atomic<std::int64_t> slip_gap_ns{0};  // of the latest slip (Pacer)
  std::array<std::atomic<std::int64_t>, io::kNumReasons> num_rejected{};
  std::atomic<bool> is_finished{false};  // the simulation thread has offered its last

  // one writer, the supervisor: what came over the operator's socket
  OperatorRing operator_commands;
  std::atomic<std::int64_t> num_operator_received{0};
  std::array<std::atomic<std::int64_t>, io::kNumReasons> operator_rejected{};  // before the loop saw it
};

}  // namespace freeflex::service
