// The publisher thread: takes what the simulation hands out, encodes and sends it.
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

/// An answer in words, stamped now: of the loop, and to what never reached it.
freeflex_msgs::ack_t make_ack(const AckEntry& entry, const Identity& identity);
freeflex_msgs::ack_t make_ack(const io::Admission& admission, std::int64_t tick, std::int64_t session);

/// When the publisher looks at its rings again. While there is more, looks begin one idle time apart, however
/// long each took: what the pace lets through does not fall with the cost of sending.
class LookPace {
 public:
  explicit LookPace(std::int64_t idle_ns) : idle_ns_(idle_ns) {}
  /// [ns] Begin of the next look. Time that was lost is not caught up by a burst.
  /// \param has_more  the last look left something
  std::int64_t next(std::int64_t now_ns, bool has_more) {
    begin_ns_ = has_more ? std::max(begin_ns_ + idle_ns_, now_ns) : now_ns + idle_ns_;
    return begin_ns_;
  }

 private:
  std::int64_t idle_ns_;
  std::int64_t begin_ns_ = 0;  // of the latest look, as planned
};

/// Channels of the motion leave as the simulation offers them; ACK and APPLIED in order, before any state
/// that contains them; STATUS by the wall clock at the scene's rate and at least kMinStatusRate, also while
/// the loop starts or stands, so that a second daemon hears this one; SCENE once a second and when asked for.
class Publisher {
 public:
  static constexpr double kMinStatusRate = 10.0;  // [Hz]

  Publisher(const Plan& plan, const Identity& identity, Bus& bus, Output& output, SharedBlock& shared,
            const IngressCounts& ingress);

  /// Body of the thread; returns when everything of a finished simulation, or of none, has been sent.
  void run();
  /// Any thread: ends run() although the simulation never ran.
  void request_stop() { is_stopping_.store(true, std::memory_order_relaxed); }

 private:
  bool send_all();
  bool send_answers();  // true: there may be more
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
  void send_scene(bool is_wide, std::int64_t number);  // a page from 1; 0: all
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
  Snapshot starting_;                                               // what status says before the loop runs
  const Snapshot* status_;                                          // latest taken
  std::array<std::vector<freeflex_msgs::scene_t>, 2> scene_pages_;  // of the plan and of the wide one
  std::int64_t num_applied_ = 0;                                    // sent
  std::int64_t status_due_ns_ = 0;
  std::int64_t second_due_ns_ = 0;
  bool has_asked_ = false;  // for the status that is due
  bool has_fresh_ = false;  // and the loop has answered
  Mode noted_mode_ = Mode::kStarting;
  std::int64_t noted_replan_tick_ = -1;
  std::int64_t noted_failures_ = 0;
  std::int64_t noted_slips_ = 0;
  std::int64_t looked_ns_ = 0, looked_boot_ns_ = 0;            // last look at the clocks; 0: none
  std::int64_t stood_ns_ = 0, stood_at_ns_ = -10'000'000'000;  // [ns] the latest standstill, and its end
  std::atomic<bool> is_stopping_{false};
  AppliedEntry applied_;
  RejectionEntry rejection_{};
};

}  // namespace freeflex::service
