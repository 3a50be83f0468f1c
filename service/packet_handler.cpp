#include "service/packet_handler.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>

#include "messages/channels.hpp"
#include "service/io/wire/lcm_packet.hpp"
#include "service/io/wire/operator_address.hpp"

namespace freeflex::service {
namespace {

using io::Reason;

/// Returns true if the command was for this session and its sender is valid. The sequence of such a command
/// is then used up, even if its contents are rejected.
bool uses_a_sequence(Reason reason) {
  return reason != Reason::kMalformed && reason != Reason::kWrongType && reason != Reason::kWrongSession &&
         reason != Reason::kBadSender && reason != Reason::kNoKeys;
}

}  // namespace

void release_places(SenderTable& senders, const std::array<char, kSenderSize>& target) noexcept {
  constexpr std::int64_t kLongAgo = std::numeric_limits<std::int64_t>::min() / 2;  // [ns]
  for (SenderTable::Record& record : senders.records)
    // the ingress may be writing the name at this moment, but at worst a place then becomes free a minute
    // early
    if (record.sender[0] != '\0' && is_target(target, record.sender)) record.heard_ns.store(kLongAgo);
}

PacketHandler::PacketHandler(SharedBlock& block, const IngressSettings& settings)
    : block_(block), settings_(settings) {
  const std::string prefix = settings.channel_prefix.data();
  force_ = prefix + channels::kForce;
  control_ = prefix + channels::kControl;
  status_ = prefix + channels::kStatus;
}

void PacketHandler::on_packet(std::span<const std::byte> packet, std::int64_t received_ns) noexcept {
  const std::optional<LcmPacket> message = read_lcm_packet(packet);
  if (!message) return;
  const bool is_force = message->channel == force_;
  const bool is_command = is_force || message->channel == control_;
  if (message->is_fragment) {
    if (is_command) on_fragment(is_force, received_ns);
  } else if (is_force) {
    on_force(message->payload, received_ns);
  } else if (is_command) {
    on_control(message->payload, received_ns);
  } else if (message->channel == status_) {
    on_status(message->payload);
  }
}

void PacketHandler::on_force(std::span<const std::byte> bytes, std::int64_t received_ns) noexcept {
  entry_.received_ns = received_ns;
  if (settings_.are_keys_required) return forward(InboundKind::kRawForce, bytes);
  entry_.kind = InboundKind::kForce;
  io::Admission admission = io::decode_force(bytes, settings_.session, settings_.names, entry_.force);
  finish(admission);
}

void PacketHandler::on_control(std::span<const std::byte> bytes, std::int64_t received_ns) noexcept {
  entry_.received_ns = received_ns;
  if (settings_.are_keys_required) return forward(InboundKind::kRawControl, bytes);
  entry_.kind = InboundKind::kControl;
  io::Admission admission = io::decode_control(bytes, settings_.session, entry_.control);
  finish(admission);
}

void PacketHandler::on_status(std::span<const std::byte> bytes) noexcept {
  const std::optional<std::int64_t> session = io::read_status_session(bytes);
  if (session && *session != settings_.session) block_.other_session.store(*session);
}

void PacketHandler::on_fragment(bool is_force, std::int64_t received_ns) noexcept {
  entry_.received_ns = received_ns;
  if (settings_.are_keys_required) {
    entry_.num_raw_bytes = kMaxRawBytes + 1;
    return hand_over(is_force ? InboundKind::kRawForce : InboundKind::kRawControl);
  }
  io::Admission admission;
  admission.reason = Reason::kMalformed;
  std::snprintf(admission.text.data(), admission.text.size(),
                "a message in fragments has more than 65499 bytes, but a command has at most %zu",
                kMaxCommandBytes);
  finish(admission);
}

/// Passes the bytes on without reading them, because the verifier checks sender and contents.
void PacketHandler::forward(InboundKind kind, std::span<const std::byte> bytes) noexcept {
  const bool has_room = bytes.size() <= kMaxRawBytes;
  entry_.num_raw_bytes = has_room ? static_cast<std::int32_t>(bytes.size()) : kMaxRawBytes + 1;
  if (has_room) std::copy(bytes.begin(), bytes.end(), entry_.raw.begin());
  hand_over(kind);
}

void PacketHandler::hand_over(InboundKind kind) noexcept {
  entry_.kind = kind;
  block_.received.fetch_add(1, std::memory_order_relaxed);
  if (block_.try_push(entry_)) return;
  block_.rejections[static_cast<std::size_t>(Reason::kQueueFull)].fetch_add(1, std::memory_order_relaxed);
}

void PacketHandler::finish(io::Admission& admission) noexcept {
  block_.received.fetch_add(1, std::memory_order_relaxed);
  if (uses_a_sequence(admission.reason) && is_operator(admission.sender)) {
    admission.reason = Reason::kBadSender;
    std::snprintf(
        admission.text.data(), admission.text.size(),
        "sender %s is refused, because names that begin with local. are reserved for the operator's socket",
        admission.sender.data());
  }
  // the sequence is used up before the command is passed on. If the process is killed in between, the command
  // is lost, but no command is ever taken twice
  if (uses_a_sequence(admission.reason)) take_sequence(admission);
  if (admission.reason == Reason::kAccepted) {
    if (block_.try_push(entry_)) return;
    admission.reason = Reason::kQueueFull;
    std::snprintf(admission.text.data(), admission.text.size(),
                  "commands arrive faster than the daemon processes them, so all %d places of its queue are "
                  "in use; send fewer a second",
                  SharedBlock::num_places(entry_.kind));
  }
  block_.rejections[static_cast<std::size_t>(admission.reason)].fetch_add(1, std::memory_order_relaxed);
  if (!block_.rejected.try_push({admission})) block_.dropped_answers.fetch_add(1, std::memory_order_relaxed);
}

/// Returns the sender's record, or a record that the sender may take over, or nullptr if there is neither.
SenderTable::Record* PacketHandler::find_record(const std::array<char, kSenderSize>& sender) noexcept {
  auto& records = block_.senders.records;
  const auto known = std::find_if(records.begin(), records.end(),
                                  [&](const auto& record) { return record.sender == sender; });
  if (known != records.end()) return &*known;
  const auto is_older = [](const auto& a, const auto& b) { return a.heard_ns.load() < b.heard_ns.load(); };
  const auto rest = records.begin() + SenderTable::kMaxSenders;
  // an empty place has the oldest time, so it is taken first
  auto place = std::min_element(records.begin(), rest, is_older);
  if (place->sender[0] != '\0' && entry_.received_ns - place->heard_ns.load() < SenderTable::kForget) {
    if (entry_.kind != InboundKind::kControl) return nullptr;
    place = std::min_element(rest, records.end(), is_older);
  }
  place->sender.fill('\0');
  place->last_sequence.store(0);
  place->sender = sender;
  return &*place;
}

void PacketHandler::take_sequence(io::Admission& admission) noexcept {
  SenderTable::Record* const record = find_record(admission.sender);
  if (record == nullptr) {
    admission.reason = Reason::kTooManySenders;
    std::snprintf(admission.text.data(), admission.text.size(),
                  "sender %s is new, but the daemon knows %d senders already, and all of them sent within "
                  "the last %lld s; send later",
                  admission.sender.data(), SenderTable::kMaxSenders,
                  static_cast<long long>(SenderTable::kForget / 1'000'000'000));
    return;
  }
  record->heard_ns.store(entry_.received_ns);
  const std::int64_t last = record->last_sequence.load();
  if (admission.sequence > last) {
    record->last_sequence.store(admission.sequence);
    return;
  }
  admission.reason = Reason::kStaleSequence;
  std::snprintf(admission.text.data(), admission.text.size(),
                "sequence number %lld of sender %s must be greater than %lld, its last one",
                static_cast<long long>(admission.sequence), admission.sender.data(),
                static_cast<long long>(last));
}

}  // namespace freeflex::service
