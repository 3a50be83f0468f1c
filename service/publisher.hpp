// The publisher thread takes data from the simulation, encodes the data and sends it.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "freeflex_msgs/ack_t.hpp"
#include "service/bus.hpp"
#include "service/io/wire/outbound.hpp"
#include "service/limited_log.hpp"
#include "service/output.hpp"
#include "service/shared.hpp"
#include "service/status.hpp"

namespace freeflex::service {

/// Both functions return the ack_t of an answer, with the present time as utime. The first is for decisions
/// of the loop, the second for rejections before the loop.
freeflex_msgs::ack_t make_ack(const AckEntry& entry, const Identity& identity);
freeflex_msgs::ack_t make_ack(const io::Admission& admission, std::int64_t tick, std::int64_t session);

/// Schedules the publisher's checks of its rings. While messages wait, a check begins one idle time after the
/// begin of the previous check, if that check took less time. The throughput therefore does not depend on the
/// cost of sending.
class LookPace {
 public:
  explicit LookPace(std::int64_t idle_ns) : idle_ns_(idle_ns) {}
  /// Returns the time at which the next check begins [ns]. Checks that were missed because time
  /// was lost are not made up for.
  /// \param has_more  true: the last check left messages unsent
  std::int64_t next(std::int64_t now_ns, bool has_more) {
    begin_ns_ = has_more ? std::max(begin_ns_ + idle_ns_, now_ns) : now_ns + idle_ns_;
    return begin_ns_;
  }

 private:
  std::int64_t idle_ns_;
  std::int64_t begin_ns_ = 0;  // begin of the check that next() planned last
};

/// Sends the motion channels when the simulation offers snapshots. Sends ACK in order. Sends APPLIED in order
/// and before any state that includes its entries. Sends STATUS by the wall clock at the scene's rate and at
/// least at kMinStatusRate, even while the loop starts or holds, so that a second daemon detects this one.
/// Sends SCENE once a second and on request.
class Publisher {
 public:
  static constexpr double kMinStatusRate = 10.0;  // [Hz]

  Publisher(const Plan& plan, const Identity& identity, Bus& bus, Output& output, SharedBlock& shared,
            const IngressCounts& ingress);

  /// Body of the thread. Returns when all data of a finished simulation has been sent, or after
  /// request_stop().
  void run();
  /// Ends run() even if the simulation never ran. Any thread may call this function.
  void request_stop() { is_stopping_.store(true, std::memory_order_relaxed); }

 private:
  bool send_all();
  bool send_answers();  // returns true if there may be more
  bool send_rejections();
  bool send_applied();
  bool send_motion();
  bool send_pages();
  void send_status(std::int64_t now_ns);
  void send_report();
  void send_each_second(std::int64_t now_ns);
  void note_standstill(std::int64_t now_ns);
  void note_mode(std::int64_t now_ns);
  void note_replan(std::int64_t now_ns);
  void send_scene(bool uses_fallback, std::int64_t number);  // number: a page from 1, 0 for all
  io::Stamp stamp(const Snapshot& snapshot) const;
  template <class Message>
  void send(const char* suffix, const Message& message);

  const Plan& plan_;
  const Identity& identity_;
  Bus& bus_;
  Output& output_;
  SharedBlock& shared_;
  StatusReporter reporter_;
  LimitedLog log_;
  const std::int64_t status_every_ns_;
  Snapshot starting_;                                               // status before the loop runs
  const Snapshot* status_;                                          // latest snapshot
  std::array<std::vector<freeflex_msgs::scene_t>, 2> scene_pages_;  // pages for the reduced and the fallback
                                                                    // plan
  std::int64_t num_applied_ = 0;                                    // APPLIED messages sent
  std::int64_t status_due_ns_ = 0;
  std::int64_t second_due_ns_ = 0;
  bool has_asked_ = false;  // true: has asked the loop for the snapshot of the status that is due
  bool has_fresh_ = false;  // true: the loop has offered this snapshot
  Mode noted_mode_ = Mode::kStarting;
  std::int64_t noted_replan_tick_ = -1;
  std::int64_t noted_failures_ = 0;
  std::int64_t noted_slips_ = 0;
  std::int64_t looked_ns_ = 0, looked_boot_ns_ = 0;            // last reading of the clocks; 0: none
  std::int64_t stood_ns_ = 0, stood_at_ns_ = -10'000'000'000;  // [ns] latest standstill: duration, end
  std::atomic<bool> is_stopping_{false};
  AppliedEntry applied_;
  RejectionEntry rejection_{};
};

}  // namespace freeflex::service
