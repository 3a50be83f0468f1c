#include "service/publisher.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "freeflex_msgs/control_t.hpp"
#include "messages/channels.hpp"
#include "service/clock.hpp"

namespace freeflex::service {

using freeflex_msgs::applied_t;
using io::Reason;

namespace {

// [ns] longest time from a standstill to the slip that it causes
constexpr std::int64_t kStandstillCounts = 3 * kSecond;
constexpr std::int64_t kStatusPatience = 30'000'000;  // [ns] longest wait for a fresh snapshot
// largest number of messages sent from one ring at one check, which allows 32,000 a second. The number is
// small because LCM's subscribers queue 30 messages and drop newer ones.
constexpr int kBurst = 8;
constexpr std::int64_t kIdle = 250'000;  // [ns] time between checks of the rings
constexpr std::chrono::microseconds kIdleUnpaced{50};

std::int64_t wall_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

std::string reason_text(const AckEntry& entry, const CommandLimits& limits) {
  switch (entry.reason) {
    case Reason::kLate:
      return fmt::format(
          "start_tick {} has passed, because the next tick is {}; give a later tick, -1, or "
          "late_policy 1",
          entry.found, entry.tick);
    case Reason::kTooFarAhead:
      return fmt::format(
          "start_tick {} is more than {} ticks ahead of tick {}; send it later{}", entry.found, entry.most,
          entry.tick,
          entry.most < io::kMaxAheadTicks ? " ('commands: max_hold' of the scene is the limit)" : "");
    case Reason::kNoSlotFree:
      return fmt::format(
          "all {} slots that are open to this sender, by itself or with others, are in use or reserved; "
          "end one first",
          entry.found);
    case Reason::kQueueFull:
      if (entry.command == 0 && entry.found > 0)
        return fmt::format(
            "this sender, by itself or with others, already has {} waiting commands, which is the limit; "
            "send again later",
            entry.found);
      return "the publisher is behind; send again later";
    case Reason::kEpochEnded:
      return fmt::format("a reset came before start_tick {}; send again in the new epoch", entry.found);
    case Reason::kCleared:
      return fmt::format(
          "the sender was cleared before start_tick {}; send the command again if it is still valid",
          entry.found);
    case Reason::kNotGranted:
      return "CLEAR is accepted only over the operator's socket, or with a key whose controls include clear";
    case Reason::kTooOld:
      return fmt::format(
          "the command waited {:.3g} s for its decision, but may wait at most {:g} s; send it again if it is "
          "still valid",
          1e-3 * static_cast<double>(entry.found), limits.max_age);
    case Reason::kBadControl:
      if (entry.command == freeflex_msgs::control_t::SCENE)
        return fmt::format("there is no page {}; SCENE takes a page from 1 to {}, or 0 for all", entry.found,
                           entry.most);
      return fmt::format("there is no mode {}; SHAPES takes an elastic mode from 1 to {}", entry.found,
                         entry.most);
    case Reason::kWrongMode:
      if (entry.mode == Mode::kFault) return "the simulation is faulted, so only RESET and STOP are accepted";
      return entry.command == freeflex_msgs::control_t::RUN ? "RUN does not apply in lockstep; send STEP"
                                                            : "STEP applies only while holding; send HOLD "
                                                              "first";
    default:
      return {};
  }
}

}  // namespace

freeflex_msgs::ack_t make_ack(const AckEntry& entry, const Identity& identity) {
  freeflex_msgs::ack_t ack{};
  ack.utime = wall_us();
  ack.session = identity.session;
  ack.sender = entry.sender.data();
  ack.sequence = entry.sequence;
  ack.reason = static_cast<std::int32_t>(entry.reason);
  ack.tick = entry.tick;
  ack.text = reason_text(entry, identity.limits);
  return ack;
}

freeflex_msgs::ack_t make_ack(const io::Admission& admission, std::int64_t tick, std::int64_t session) {
  freeflex_msgs::ack_t ack{};
  ack.utime = wall_us();
  ack.session = session;
  ack.sender = admission.sender.data();
  ack.sequence = admission.sequence;
  ack.reason = static_cast<std::int32_t>(admission.reason);
  ack.tick = tick;
  ack.text = admission.text.data();
  return ack;
}

Publisher::Publisher(const Plan& plan, const Identity& identity, Bus& bus, Output& output,
                     SharedBlock& shared, const IngressCounts& ingress)
    : plan_(plan),
      identity_(identity),
      bus_(bus),
      output_(output),
      shared_(shared),
      reporter_(plan, identity, output, shared, ingress),
      status_every_ns_(static_cast<std::int64_t>(kSecond / std::max(plan.status_rate, kMinStatusRate))),
      starting_(make_snapshot(plan)),
      status_(&starting_) {
  for (std::size_t i = 0; i <= plan.fallback.size(); ++i) {
    scene_pages_[i] = io::make_scene_messages(plan, i > 0, identity_.plan_file, stamp(*status_));
    output_.num_scene_pages[i] = static_cast<std::int32_t>(scene_pages_[i].size());
  }
}

void Publisher::run() {
  const bool is_paced = identity_.timing.is_paced();
  MonotonicClock clock;
  LookPace pace(kIdle);
  for (;;) {
    // is_finished is read before send_all(), so that no data that was offered before the end is missed
    const bool is_last =
        is_stopping_.load(std::memory_order_relaxed) || output_.is_finished.load(std::memory_order_acquire);
    const bool has_more = send_all();
    if (is_last && !has_more) break;
    if (is_paced)
      clock.sleep_until(pace.next(clock.now_ns(), has_more));
    else if (!has_more)
      std::this_thread::sleep_for(kIdleUnpaced);
  }
  log_.end();
  if (status_->mode != Mode::kStarting) send_report();
}

/// Checks every ring and buffer once. Returns true if there may be more to send.
bool Publisher::send_all() {
  const std::int64_t now_ns = MonotonicClock{}.now_ns();
  if (const Snapshot* const fresh = output_.status.take()) {
    status_ = fresh;
    has_fresh_ = true;
    note_mode(now_ns);
    note_replan(now_ns);
  }
  note_standstill(now_ns);
  log_.write_due(now_ns);
  bool has_more = send_applied();
  has_more |= send_answers();
  has_more |= send_rejections();
  has_more |= send_motion();
  has_more |= send_pages();
  send_status(now_ns);
  send_each_second(now_ns);
  return has_more;
}

/// Sends waiting snapshots, each after all APPLIED messages that its state includes. Returns true if any were
/// waiting.
bool Publisher::send_motion() {
  bool has_any = false;
  for (std::size_t i = 0; i < output_.motion.size(); ++i) {
    const io::ChannelEncoder& channel = io::kEncoders[i];
    const Snapshot* snapshot = output_.motion[i].front();
    has_any |= snapshot != nullptr;
    for (int n = 0; n < kBurst && snapshot != nullptr && snapshot->applied_count <= num_applied_; ++n) {
      for (const auto& message : channel.encode(plan_, snapshot->motion, stamp(*snapshot)))
        bus_.send(channel.suffix, message);
      output_.motion[i].drop();
      snapshot = output_.motion[i].front();
    }
  }
  return has_any;
}

bool Publisher::send_answers() {
  AckEntry entry;
  int num_sent = 0;
  for (; num_sent < kBurst && output_.acks.try_pop(entry); ++num_sent) {
    send(channels::kAck, make_ack(entry, identity_));
  }
  return num_sent == kBurst;
}

/// Answers commands that the ingress rejected. The ingress's memory is not trusted, so the number of
/// iterations is limited and each entry is checked.
bool Publisher::send_rejections() {
  int num_sent = 0;
  for (; num_sent < kBurst && shared_.rejected.try_pop(rejection_); ++num_sent) {
    if (!io::is_sane(rejection_.admission)) continue;
    send(channels::kAck,
         make_ack(rejection_.admission, output_.tick.load(std::memory_order_relaxed), identity_.session));
  }
  return num_sent == kBurst;
}

bool Publisher::send_applied() {
  int num_sent = 0;
  for (; num_sent < kBurst && output_.applied.try_pop(applied_); ++num_sent) {
    const io::Stamp stamp{
        .utime = wall_us(), .session = identity_.session, .plan_fingerprint = identity_.plan_fingerprint};
    applied_t message;
    if (applied_.kind == applied_t::FORCE) {
      message = io::make_applied_force(applied_.command, applied_.tick, applied_.sequence, stamp);
    } else if (applied_.kind == applied_t::RESET) {
      message = io::make_applied_reset(applied_.tick, applied_.sequence, stamp);
    } else {
      message = io::make_applied_end(applied_.kind, applied_.expiry, applied_.tick, applied_.sequence, stamp);
    }
    send(channels::kApplied, message);
    num_applied_ = applied_.sequence + 1;
  }
  return num_sent == kBurst;
}

bool Publisher::send_pages() {
  PageRequest request;
  int num_sent = 0;
  for (; num_sent < kBurst && output_.requests.try_pop(request); ++num_sent) {
    if (request.command == freeflex_msgs::control_t::SHAPES) {
      for (const auto& page : io::make_shapes_messages(request.uses_fallback ? plan_.fallback.front() : plan_,
                                                       request.number, stamp(*status_)))
        send(channels::kShapes, page);
      continue;
    }
    send_scene(request.uses_fallback, request.number);
  }
  return num_sent == kBurst;
}

void Publisher::send_scene(bool uses_fallback, std::int64_t number) {
  for (freeflex_msgs::scene_t& page : scene_pages_[uses_fallback ? 1 : 0]) {
    if (number != 0 && number != page.page + 1) continue;
    page.utime = wall_us();
    send(channels::kScene, page);
  }
}

/// When the status is due, asks the loop for a snapshot and sends the snapshot when it comes. If no snapshot
/// comes within kStatusPatience, sends the previous snapshot.
void Publisher::send_status(std::int64_t now_ns) {
  if (now_ns < status_due_ns_) return;
  if (!has_asked_) {
    has_asked_ = true;
    has_fresh_ = false;
    output_.is_status_wanted.store(true, std::memory_order_release);
  }
  const bool waits = status_->mode != Mode::kStarting && now_ns < status_due_ns_ + kStatusPatience;
  if (!has_fresh_ && waits) return;
  send_report();
  has_asked_ = false;
  status_due_ns_ = std::max(status_due_ns_ + status_every_ns_, now_ns);
}

void Publisher::send_report() {
  freeflex_msgs::status_t status = reporter_.report(*status_, wall_us());
  status.sends_failed = bus_.num_failed();
  send(channels::kStatus, status);
}

void Publisher::send_each_second(std::int64_t now_ns) {
  if (now_ns < second_due_ns_ || status_->mode == Mode::kStarting) return;
  second_due_ns_ = now_ns + kSecond;
  reporter_.advance_window();
  send_scene(status_->motion.uses_fallback, 0);
  if (bus_.num_failed() > noted_failures_) {
    log_.write(LineKind::kNotSent, now_ns,
               fmt::format("{} messages could not be sent; check that the network is up",
                           bus_.num_failed() - noted_failures_));
    noted_failures_ = bus_.num_failed();
  }
  const std::int64_t slips = output_.num_slips.load(std::memory_order_acquire);
  if (slips > noted_slips_) {
    // true if both the loop and this thread stood still, so the whole process did
    const bool stood = now_ns - stood_at_ns_ < kStandstillCounts &&
                       output_.slip_gap_ns.load(std::memory_order_relaxed) > Pacer::kCatchUp;
    log_.write(LineKind::kSlip, now_ns, slip_text(plan_.period, slips, stood ? stood_ns_ : 0));
    noted_slips_ = slips;
  }
}

/// Records a time during which this thread did not run, and logs it if the machine was suspended. During a
/// suspension the clock of the ticks stops too, so no tick is late afterwards.
void Publisher::note_standstill(std::int64_t now_ns) {
  const std::int64_t now_boot_ns = boot_ns();
  const std::int64_t stood_ns = now_boot_ns - looked_boot_ns_;
  const std::int64_t suspended_ns = stood_ns - (now_ns - looked_ns_);
  if (looked_ns_ != 0 && stood_ns > Pacer::kCatchUp) {
    stood_ns_ = stood_ns;
    stood_at_ns_ = now_ns;
  }
  if (looked_ns_ != 0 && suspended_ns > Pacer::kCatchUp)
    log_.write(LineKind::kSlip, now_ns,
               fmt::format("this machine was suspended for {:.1f} s; no tick was due in that time",
                           1e-9 * static_cast<double>(suspended_ns)));
  looked_boot_ns_ = now_boot_ns;
  looked_ns_ = now_ns;
}

/// Logs the begin and the end of a fault, because the simulation thread must not log.
void Publisher::note_mode(std::int64_t now_ns) {
  if (status_->mode == noted_mode_) return;
  if (status_->mode == Mode::kFault) log_.write(LineKind::kFault, now_ns, "fault: " + fault_text(*status_));
  if (noted_mode_ == Mode::kFault && status_->mode != Mode::kStopped)
    log_.write(LineKind::kRecovery, now_ns, "the simulation recovered by a reset");
  noted_mode_ = status_->mode;
}

void Publisher::note_replan(std::int64_t now_ns) {
  const MotionState& motion = status_->motion;
  if (motion.uses_fallback && motion.fallback_tick != noted_replan_tick_)
    log_.write(
        LineKind::kReplan, now_ns,
        fmt::format(
            "tick {}: the plan includes {} again because a command needs it, and has {} modes instead of "
            "{} from this tick on",
            motion.fallback_tick, replan_name(motion), plan_.fallback.front().num_elastic,
            plan_.num_elastic));
  noted_replan_tick_ = motion.fallback_tick;
}

io::Stamp Publisher::stamp(const Snapshot& snapshot) const {
  return {.utime = wall_us(),
          .session = identity_.session,
          .plan_fingerprint = identity_.plan_fingerprint,
          .applied_count = snapshot.applied_count};
}

template <class Message>
void Publisher::send(const char* suffix, const Message& message) {
  bus_.send(suffix, io::encode(message));
}

}  // namespace freeflex::service
