#include "service/verifier.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>
#include <utility>

#include "freeflex_msgs/control_t.hpp"
#include "freeflex_msgs/force_t.hpp"
#include "messages/channels.hpp"
#include "service/clock.hpp"
#include "service/io/wire/codec_wire.hpp"
#include "service/io/wire/wire_walk.hpp"

namespace freeflex::service {

using freeflex_msgs::control_t;
using freeflex_msgs::force_t;
using io::Admission;
using io::Reason;

namespace {

constexpr std::chrono::microseconds kPause{100};  // time between checks of an empty ring
constexpr int kMostALook = 64;                    // messages between two readings of the clock
constexpr double kPlainAnswers = 10.0;            // [1/s] answers to commands without a key
constexpr std::int64_t kMostLost = 1024;  // largest number of lost messages that is counted at one check

std::int64_t realtime_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// Returns true if the length exceeds the limit.  \param limit  0: no limit
bool is_over(const Vec3& v, double limit) {
  // allows for rounding errors, so that a vector whose length equals the limit is accepted
  constexpr double kRounding = 1.0 + 8.0 * 2.220446049250313e-16;
  return limit > 0.0 && std::hypot(v[0], v[1], v[2]) > limit * kRounding;
}

bool may_use(const std::vector<bool>& allowed, std::int32_t index) {
  return allowed.empty() ||
         (static_cast<std::size_t>(index) < allowed.size() && allowed[static_cast<std::size_t>(index)]);
}

Reason refuse_force(std::span<char> text, const char* list, int i, const char* kind, int number,
                    const char* name, const Vec3& v, double limit, const char* unit, const Key& key) {
  io::print(text, "%s[%d]: %s %d has |%s| %.10g %s, but key %s may use at most %.10g %s", list, i, kind,
            number, name, std::hypot(v[0], v[1], v[2]), unit, key.sealing.id.c_str(), limit, unit);
  return Reason::kOverKeyLimit;
}

}  // namespace

Reason check_grants(const ForceCommand& command, const Key& key, std::span<char> text) noexcept {
  const Grants& grants = key.grants;
  const char* const id = key.sealing.id.c_str();
  if (command.slot >= grants.num_slots) {
    io::print(text, "slot is %d, but key %s may use only 0 to %d", command.slot, id, grants.num_slots - 1);
    return Reason::kNotGranted;
  }
  for (int i = 0; i < command.num_points; ++i) {
    const PointForce& entry = command.points[static_cast<std::size_t>(i)];
    if (!may_use(grants.points, entry.point)) {
      io::print(text,
                "forces[%d]: point %d is not among the points of key %s; add it there, or use another key", i,
                entry.point, id);
      return Reason::kNotGranted;
    }
    if (is_over(entry.force, grants.largest_force))
      return refuse_force(text, "forces", i, "point", entry.point, "force", entry.force, grants.largest_force,
                          "N", key);
  }
  for (int i = 0; i < command.num_wheels; ++i) {
    const WheelTorque& entry = command.wheels[static_cast<std::size_t>(i)];
    if (!may_use(grants.wheels, entry.wheel)) {
      io::print(text,
                "wheels[%d]: wheel %d is not in a point of key %s; add the point there, or use another key",
                i, entry.wheel, id);
      return Reason::kNotGranted;
    }
    const Vec3 torque{entry.torque, 0.0, 0.0};
    if (is_over(torque, grants.largest_torque))
      return refuse_force(text, "wheels", i, "wheel", entry.wheel, "torque", torque, grants.largest_torque,
                          "N m", key);
  }
  for (int i = 0; i < command.num_torques; ++i) {
    const PointTorque& entry = command.torques[static_cast<std::size_t>(i)];
    if (!may_use(grants.points, entry.point)) {
      io::print(text,
                "torques[%d]: point %d is not among the points of key %s; add it there, or use another key",
                i, entry.point, id);
      return Reason::kNotGranted;
    }
    if (is_over(entry.torque, grants.largest_torque))
      return refuse_force(text, "torques", i, "point", entry.point, "torque", entry.torque,
                          grants.largest_torque, "N m", key);
  }
  for (int i = 0; i < command.num_wrenches; ++i) {
    const Wrench& entry = command.wrenches[static_cast<std::size_t>(i)];
    if (!may_use(grants.groups, entry.group)) {
      io::print(text,
                "wrenches[%d]: group %d is not among the groups of key %s; add it there, or use another key",
                i, entry.group, id);
      return Reason::kNotGranted;
    }
    if (is_over(entry.force, grants.largest_force))
      return refuse_force(text, "wrenches", i, "group", entry.group, "force", entry.force,
                          grants.largest_force, "N", key);
    if (is_over(entry.torque, grants.largest_torque))
      return refuse_force(text, "wrenches", i, "group", entry.group, "torque", entry.torque,
                          grants.largest_torque, "N m", key);
  }
  return Reason::kAccepted;
}

Reason check_grants(const io::ControlCommand& command, const Key& key, std::span<char> text) noexcept {
  if ((key.grants.controls >> command.command & 1U) != 0) return Reason::kAccepted;
  io::print(text, "control command %d is not among the controls of key %s; add it there, or use another key",
            command.command, key.sealing.id.c_str());
  return Reason::kNotGranted;
}

TokenBucket::TokenBucket(double per_second) : per_second_(per_second), tokens_(std::max(1.0, per_second)) {}

bool TokenBucket::take(std::int64_t now_ns) noexcept {
  if (filled_ns_ != 0)
    tokens_ = std::min(std::max(1.0, per_second_),
                       tokens_ + per_second_ * static_cast<double>(now_ns - filled_ns_) / 1e9);
  filled_ns_ = now_ns;
  if (tokens_ < 1.0) return false;
  tokens_ -= 1.0;
  return true;
}

Verifier::Verifier(std::vector<Key> keys, const Options& options, const io::NameTable& names,
                   SharedBlock& ingress, LimitedLog::Write write)
    : session_(options.session),
      force_channel_(options.channel_prefix + channels::kForce),
      control_channel_(options.channel_prefix + channels::kControl),
      names_(names),
      ingress_(ingress),
      block_(std::make_unique<SharedBlock>()),
      log_(std::move(write)),
      plain_answers_(kPlainAnswers),
      taken_(std::make_unique<InboundEntry>()),
      verified_(std::make_unique<InboundEntry>()) {
  std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) { return a.sealing.id < b.sealing.id; });
  for (Key& key : keys) {
    const double per_second = key.grants.commands_per_second;
    holders_.push_back({std::move(key), 0, TokenBucket(per_second)});
  }
}

void Verifier::run() {
  while (!is_stopping_.load(std::memory_order_relaxed)) {
    const Time time{realtime_us(), boot_ns()};
    int num_taken = 0;
    while (num_taken < kMostALook && take(time)) ++num_taken;
    count_lost();
    log_.write_due(time.now_ns);
    if (num_taken < kMostALook) std::this_thread::sleep_for(kPause);
  }
  log_.end();
}

bool Verifier::take(const Time& time) {
  if (!ingress_.inbound.try_pop(*taken_)) return false;
  block_->received.fetch_add(1, std::memory_order_relaxed);
  const InboundKind kind = taken_->kind;
  const std::int32_t size = taken_->num_raw_bytes;
  const bool is_raw = kind == InboundKind::kRawForce || kind == InboundKind::kRawControl;
  if (!is_raw || size < 0 || size > kMaxRawBytes) {
    count(Reason::kMalformed);
    log_.write(
        LineKind::kRefused, time.now_ns,
        fmt::format(
            "a message on FORCE or CONTROL is invalid or longer than any sealed command ({} bytes), so its "
            "tag was not checked",
            kMaxRawBytes));
  } else {
    verified_->received_ns = std::clamp<std::int64_t>(taken_->received_ns, 0, time.now_ns);
    verify(std::span(taken_->raw).first(static_cast<std::size_t>(size)), kind == InboundKind::kRawForce,
           time);
  }
  return true;
}

/// Checks which key sealed the message. Messages that fail this check are counted but not answered, because
/// anybody can send them.
void Verifier::verify(std::span<const std::byte> bytes, bool is_force, const Time& time) {
  const auto fingerprint = io::integer_at<std::int64_t>(bytes, 0);
  if (fingerprint == (is_force ? force_t::getHash() : control_t::getHash())) return refuse_plain(bytes, time);
  const std::optional<Envelope> envelope = read_envelope(bytes);
  if (!envelope) {
    const bool is_type = !fingerprint || *fingerprint == freeflex_msgs::envelope_t::getHash();
    return count(is_type ? Reason::kMalformed : Reason::kWrongType);
  }
  const std::string& channel = is_force ? force_channel_ : control_channel_;
  Holder* const holder = find(envelope->key_id);
  if (holder == nullptr) {
    count(Reason::kUnknownKey);
    log_.write(LineKind::kRefused, time.now_ns,
               fmt::format("a command on {} names key '{}', which is not among those of --keys", channel,
                           envelope->key_id));
  } else if (!has_right_tag(*envelope, channel, holder->key.sealing)) {
    count(Reason::kBadTag);
    log_.write(LineKind::kRefused, time.now_ns,
               fmt::format("a command on {} that names key '{}' was not sealed with it for this channel; "
                           "it is forged or damaged, or the sender has another secret",
                           channel, envelope->key_id));
  } else {
    verify_claim(*envelope, *holder, is_force, time);
  }
}

/// Handles an envelope with a valid tag. The envelope may be a copy of an earlier one.
/// \pre has_right_tag()
void Verifier::verify_claim(const Envelope& envelope, Holder& holder, bool is_force, const Time& time) {
  // a copy of an earlier command is not answered, because the sender would take the answer for the answer to
  // the original
  if (envelope.session != session_) return count(Reason::kWrongSession);
  if (envelope.sequence <= holder.last_sequence) {
    count(Reason::kStaleSequence);
    return log_.write(
        LineKind::kRefused, time.now_ns,
        fmt::format("a command with key '{}' has sequence number {}, which must be greater than {}; somebody "
                    "repeated a command, or its sender restarted its count",
                    envelope.key_id, envelope.sequence, holder.last_sequence));
  }
  // the sequence is used up before further checks, so that no command is accepted or answered twice
  holder.last_sequence = envelope.sequence;
  Admission admission = admit(envelope, holder, is_force, time);
  if (admission.reason == Reason::kAccepted) {
    verified_->kind = is_force ? InboundKind::kForce : InboundKind::kControl;
    if (block_->try_push(*verified_)) return;
    admission.reason = Reason::kQueueFull;
    io::print(admission.text,
              "commands arrive faster than the daemon processes them, so all %d places of its "
              "queue are in use; send fewer a second",
              SharedBlock::num_places(verified_->kind));
  }
  count(admission.reason);
  admission.sender.fill('\0');
  std::copy(envelope.key_id.begin(), envelope.key_id.end(), admission.sender.begin());
  admission.sequence = envelope.sequence;
  answer(admission);
}

/// Checks the rights of the key, decodes the command into verified_ and returns the admission.
Admission Verifier::admit(const Envelope& envelope, Holder& holder, bool is_force, const Time& time) {
  const Key& key = holder.key;
  const auto refuse = [](Reason reason, const char* format, const auto&... values) {
    Admission admission;
    admission.reason = reason;
    const auto end =
        fmt::format_to_n(admission.text.data(), admission.text.size() - 1, fmt::runtime(format), values...);
    *end.out = '\0';
    return admission;
  };
  if (envelope.valid_until < time.wall_us)
    return refuse(Reason::kExpired,
                  "valid_until is {} us, but the daemon's clock is at {} us; send the command sooner after "
                  "sealing it, or correct the clocks",
                  envelope.valid_until, time.wall_us);
  if (envelope.valid_until > time.wall_us + io::kMaxValidity)
    return refuse(Reason::kValidTooLong,
                  "valid_until is {} us, more than {} s ahead of the daemon's clock ({} us); use a shorter "
                  "validity, or correct the clocks",
                  envelope.valid_until, io::kMaxValidity / 1'000'000, time.wall_us);
  if (key.grants.commands_per_second > 0.0 && !holder.bucket.take(time.now_ns))
    return refuse(Reason::kTooFast, "commands come too fast, because key {} may send only {} a second",
                  key.sealing.id, key.grants.commands_per_second);
  if (is_force ? !key.grants.has_force : !key.grants.has_control)
    return refuse(Reason::kNotGranted,
                  "{} is not among the channels of key {}; add it there, or use another key",
                  is_force ? "FORCE" : "CONTROL", key.sealing.id);
  Admission admission = is_force ? io::decode_force(envelope.body, session_, names_, verified_->force)
                                 : io::decode_control(envelope.body, session_, verified_->control);
  if (admission.reason == Reason::kNoKeys)
    return refuse(Reason::kWrongType, "the body is an envelope, but must be the command itself");
  if (admission.reason != Reason::kAccepted) return admission;
  if (admission.sender.data() != envelope.key_id || admission.sequence != envelope.sequence)
    return refuse(
        Reason::kKeyMismatch,
        "the command has sender {} and sequence number {}, but must have {} and {} as on its envelope",
        admission.sender.data(), admission.sequence, envelope.key_id, envelope.sequence);
  admission.reason = is_force ? check_grants(verified_->force, key, admission.text)
                              : check_grants(verified_->control, key, admission.text);
  return admission;
}

/// Answers a command without an envelope, unless its sender's name is the id of a key. The holder of that key
/// could mistake an answer to a stranger for the answer to a command of its own.
void Verifier::refuse_plain(std::span<const std::byte> bytes, const Time& time) {
  count(Reason::kKeyRequired);
  const std::optional<io::Head> head = io::read_head(bytes);
  if (!head || head->session != session_ || !io::is_valid_sender(head->sender)) return;
  if (find(head->sender) != nullptr || !plain_answers_.take(time.now_ns)) return;
  Admission admission;
  admission.reason = Reason::kKeyRequired;
  std::copy(head->sender.begin(), head->sender.end(), admission.sender.begin());
  admission.sequence = head->sequence;
  io::print(admission.text, "this daemon accepts only commands with a key; seal it in an envelope_t");
  answer(admission);
}

Verifier::Holder* Verifier::find(std::string_view key_id) noexcept {
  const auto found =
      std::lower_bound(holders_.begin(), holders_.end(), key_id,
                       [](const Holder& holder, std::string_view id) { return holder.key.sealing.id < id; });
  return found != holders_.end() && found->key.sealing.id == key_id ? &*found : nullptr;
}

void Verifier::count(Reason reason) noexcept {
  block_->rejections[static_cast<std::size_t>(reason)].fetch_add(1, std::memory_order_relaxed);
}

void Verifier::answer(const Admission& admission) noexcept {
  if (!block_->rejected.try_push({admission}))
    block_->dropped_answers.fetch_add(1, std::memory_order_relaxed);
}

/// Counts the messages that the ingress reports as lost because the ring was full.
void Verifier::count_lost() noexcept {
  const std::int64_t lost =
      ingress_.rejections[static_cast<std::size_t>(Reason::kQueueFull)].load(std::memory_order_relaxed);
  if (lost <= num_lost_) return;
  const std::int64_t more = std::min(lost - num_lost_, kMostLost);
  num_lost_ += more;
  block_->received.fetch_add(more, std::memory_order_relaxed);
  block_->rejections[static_cast<std::size_t>(Reason::kQueueFull)].fetch_add(more, std::memory_order_relaxed);
}

}  // namespace freeflex::service
