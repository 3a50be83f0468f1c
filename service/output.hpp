// What the simulation thread hands to the publish side: rings for what must not be lost, boxes for what is
// only wanted fresh, histograms and counters for status; and the operator's commands, which come from this
// process too. Preallocated; lives on the heap (about 20 MB).
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "core/step/budget.hpp"
#include "service/box.hpp"
#include "service/histogram.hpp"
#include "service/io/wire/outbound.hpp"
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
  // start_tick of a force, the control command, the elastic mode asked for, or what the reason is about: [ms]
  // that a command waited, how many slots or waiting commands its sender may have
  std::int64_t found = 0;
};

/// What changed the motion (applied_t).
struct AppliedEntry {
  std::int64_t sequence = 0;  // 0, 1, 2, ... without gaps
  std::int64_t tick = 0;
  std::int32_t kind = 0;   // applied_t constants
  ForceCommand command{};  // FORCE
  Expiry expiry{};         // EXPIRED, LEASE_LOST
};

/// Why the loop is in Mode::kFault.
struct FaultNote {
  std::int64_t tick = 0;                   // last good tick, held
  std::int32_t num_commands = 0;           // taken at that tick
  std::array<char, kSenderSize> sender{};  // of the last of them
  std::int64_t sequence = 0;
};

/// A mode shape asked for: elastic mode from 1, of the plan or the wide one.
struct ShapeRequest {
  std::int32_t mode = 0;
  bool is_wide = false;
};

/// What publication needs of one tick.
struct Snapshot {
  MotionState motion;
  std::int64_t applied_count = 0;
  std::int64_t last_load_tick = 0;  // last tick with an external load, or of the last reset
  std::int32_t num_slots = 0;       // in force
  Mode mode = Mode::kStarting;
  FaultNote fault;
  BudgetReading budget;  // status only
};
/// With room for the motion in either plan, also in copies: nothing allocates when a motion is assigned.
Snapshot make_snapshot(const Plan& plan);

/// The operator's commands -> simulation; answers go back the same way, not over the bus.
using OperatorRing = Ring<InboundEntry, 64>;

struct Output {
  static constexpr int kNumAcks = 2048;
  static constexpr int kNumOperatorAcks = 512;
  static constexpr int kNumApplied = 1024;
  static constexpr int kNumShapes = 64;

  explicit Output(const Plan& plan);

  // every one arrives
  Ring<AckEntry, kNumAcks> acks;
  Ring<AckEntry, kNumOperatorAcks> operator_acks;
  Ring<AppliedEntry, kNumApplied> applied;
  Ring<ShapeRequest, kNumShapes> shapes;
  // the latest is enough; filled at the tick multiples of each channel's rate, as io::kMotionChannels
  std::array<Box<Snapshot>, io::kNumMotionChannels> motion;
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
