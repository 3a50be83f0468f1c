// Output contains the data that the simulation thread passes to the publisher: rings and queues, whose items
// are passed in order, a latest-value buffer for the status, histograms and counters. It also contains the
// ring of the operator's commands, which this process receives itself. All memory is allocated on the heap in
// the constructor (about 20 MB, and at most kMotionBytes for each motion channel that is published).
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "core/error/verdict.hpp"
#include "service/histogram.hpp"
#include "service/io/wire/outbound.hpp"
#include "service/latest_value.hpp"
#include "service/motion_status.hpp"
#include "service/queue.hpp"
#include "service/shared.hpp"

namespace freeflex::service {

/// Values of status_t.mode.
enum class Mode : std::int32_t { kStarting = 0, kRunning = 1, kHolding = 2, kFault = 3, kStopped = 4 };

/// The answer to a command, before its text is made.
struct AckEntry {
  std::array<char, kSenderSize> sender{};
  std::int64_t sequence = 0;
  io::Reason reason = io::Reason::kAccepted;
  Mode mode = Mode::kRunning;  // mode at the time of the answer
  std::int64_t tick = 0;       // accepted: tick at which the command takes effect; rejected: present tick
  std::int32_t command = 0;    // control_t constant, 0 for a force
  // kTooOld: [ms] time that the command waited. kNoSlotFree and kQueueFull: number of slots or waiting
  // commands that the sender may have. Other reasons: start_tick of a force, or count of a control
  std::int64_t found = 0;
  std::int64_t most = 0;  // largest count of SHAPES or SCENE; force: [ticks] largest start_tick - tick
};

/// A change of the loads in force, or a reset (applied_t).
struct AppliedEntry {
  std::int64_t sequence = 0;  // 0, 1, 2, ... without gaps
  std::int64_t tick = 0;
  std::int32_t kind = 0;   // one of the constants in applied_t
  ForceCommand command{};  // FORCE
  Expiry expiry{};         // EXPIRED, LEASE_LOST, CLEARED
};

/// Circumstances of Mode::kFault.
struct FaultNote {
  std::int64_t tick = 0;                       // tick of the last finite state, which is kept
  std::int32_t num_commands = 0;               // commands due at that tick
  StepStatus status = StepStatus::kNotFinite;  // why the step failed
  std::int32_t joint_point = -1;               // point of such a joint or body, if it is known
  std::array<char, kSenderSize> sender{};      // sender of the last of these commands
  std::int64_t sequence = 0;
};

/// A request of SHAPES or SCENE for pages of the reduced or the fallback plan.
struct PageRequest {
  std::int32_t command = 0;  // control_t constant
  std::int32_t number = 0;   // SHAPES: elastic mode, from 1; SCENE: page, from 1, 0: all pages
  bool uses_fallback = false;
};

/// States why there is no verdict.
enum class NotJudged : std::int32_t {
  kJudged = 0,
  kNotYet,  // the result for the first tick is not due yet
  kOff,  // the scene has verdict: off, the plan has no shadow, or the daemon was started with --verdict off
  kProcessors,  // the machine has too few processors
  kBehind,      // the verdict thread fell so far behind that nothing is judged until the next reset
};

/// Data of one tick for publication.
struct Snapshot {
  MotionState motion;
  std::int64_t applied_count = 0;
  FreeMotion free;
  std::int32_t num_slots = 0;  // slots in force
  Mode mode = Mode::kStarting;
  FaultNote fault;
  Verdict verdict, worst;     // the verdict that is due, and the worst since the epoch began
  std::int64_t num_late = 0;  // number of comparisons that came too late
  NotJudged not_judged = NotJudged::kOff;
};
/// Returns a snapshot with memory for a motion in the reduced plan and in the fallback plan. Copies of the
/// snapshot have this memory too, so assigning a motion to them allocates nothing.
Snapshot make_snapshot(const Plan& plan);

/// Ring of the operator's commands to the simulation. The answers to these commands are sent over the socket,
/// not over the bus.
using OperatorRing = Ring<InboundEntry, 64>;

struct Output {
  static constexpr int kNumAcks = 2048;
  static constexpr int kNumOperatorAcks = 512;
  static constexpr int kNumApplied = 1024;
  static constexpr int kNumRequests = 64;
  /// Limits of the number of snapshots of one channel that can wait for a late publisher. kMostWaiting covers
  /// a quarter of a second at 1 kHz. If so many snapshots need more than kMotionBytes, as many as fit can
  /// wait, but at least kLeastWaiting.
  static constexpr std::size_t kMostWaiting = 256, kLeastWaiting = 4;
  static constexpr std::size_t kMotionBytes = 16'000'000;

  /// \param most_waiting  > 0, largest number of snapshots of one channel that can wait
  explicit Output(const Plan& plan, std::size_t most_waiting = kMostWaiting);

  // no entry is lost
  Ring<AckEntry, kNumAcks> acks;
  Ring<AckEntry, kNumOperatorAcks> operator_acks;
  Ring<AppliedEntry, kNumApplied> applied;
  Ring<PageRequest, kNumRequests> requests;
  // no snapshot is lost while there is room. There is one queue for each of kMotionChannels, filled at
  // the channel's rate.
  std::array<Queue<Snapshot>, kNumMotionChannels> motion;
  // number of snapshots of each channel that were lost because its queue was full
  std::array<std::atomic<std::int64_t>, kNumMotionChannels> num_dropped{};
  // number of pages of SCENE for the reduced and for the fallback plan; set before the simulation runs
  std::array<std::int32_t, 2> num_scene_pages{1, 1};
  // filled after the publisher has set is_status_wanted
  std::atomic<bool> is_status_wanted{false};
  LatestValue<Snapshot> status;
  // written by the simulation thread only
  Histogram lateness, compute, command_latency;
  std::atomic<std::int64_t> tick{0};  // next tick to be executed
  std::atomic<std::int64_t> num_overruns{0}, num_slips{0}, num_accepted{0};
  std::atomic<std::int64_t> slip_gap_ns{0};  // gap of the latest slip (Pacer::slip_gap_ns)
  std::array<std::atomic<std::int64_t>, io::kNumReasons> num_rejected{};
  std::atomic<bool> is_finished{false};  // true if the simulation thread has offered its last snapshot

  // written by the supervisor only: commands from the operator's socket
  OperatorRing operator_commands;
  std::atomic<std::int64_t> num_operator_received{0};
  // commands rejected before the loop, by reason
  std::array<std::atomic<std::int64_t>, io::kNumReasons> operator_rejected{};
};

}  // namespace freeflex::service
