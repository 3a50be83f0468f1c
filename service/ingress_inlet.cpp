#include "service/ingress_inlet.hpp"

#include <time.h>

#include <algorithm>
#include <cstdio>

namespace freeflex::service {
namespace {

using io::Reason;

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1'000'000'000 + now.tv_nsec;
}

/// The command was ours and its sender known, so its sequence counts whether or not its contents are good.
bool uses_a_sequence(Reason reason) {
  return reason != Reason::kMalformed && reason != Reason::kWrongType && reason != Reason::kWrongSession &&
         reason != Reason::kBadSender && reason != Reason::kNoKeys;
}

}  // namespace

void Inlet::on_force(std::span<const std::byte> bytes) noexcept {
  entry_.received_ns = monotonic_ns();
  entry_.kind = InboundKind::kForce;
  io::Admission admission =
      io::decode_force(bytes, block_.settings.session, block_.settings.names, entry_.force);
  finish(admission);
}

void Inlet::on_control(std::span<const std::byte> bytes) noexcept {
  entry_.received_ns = monotonic_ns();
  entry_.kind = InboundKind::kControl;
  io::Admission admission = io::decode_control(bytes, block_.settings.session, entry_.control);
  finish(admission);
}

void Inlet::on_status(std::span<const std::byte> bytes) noexcept {
  const std::optional<std::int64_t> session = io::read_status_session(bytes);
  if (session && *session != block_.settings.session) block_.other_session.store(*session);
}

void Inlet::finish(io::Admission& admission) noexcept {
  block_.received.fetch_add(1, std::memory_order_relaxed);
  // the sequence is used up before the command goes on: killed between the two, we lose it but never take it
  // twice
  if (uses_a_sequence(admission.reason)) take_sequence(admission);
  if (admission.reason == Reason::kAccepted) {
    if (block_.inbound.try_push(entry_)) return;
    admission.reason = Reason::kQueueFull;
    std::snprintf(admission.text.data(), admission.text.size(),
                  "more commands than the daemon takes: all %d places are waiting; send slower",
                  decltype(block_.inbound)::kCapacity);
  }
  block_.rejections[static_cast<std::size_t>(admission.reason)].fetch_add(1, std::memory_order_relaxed);
  if (!block_.rejected.try_push({admission})) block_.dropped_answers.fetch_add(1, std::memory_order_relaxed);
}

void Inlet::take_sequence(io::Admission& admission) noexcept {
  SenderTable& table = block_.senders;
  const int num_senders = std::clamp(table.num_senders.load(), 0, SenderTable::kMaxSenders);
  const auto begin = table.records.begin();
  const auto end = begin + num_senders;
  auto record = std::find_if(begin, end, [&](const auto& known) { return known.sender == admission.sender; });
  if (record == end) {
    if (num_senders == SenderTable::kMaxSenders) {
      admission.reason = Reason::kTooManySenders;
      std::snprintf(admission.text.data(), admission.text.size(),
                    "sender %s is new and %d are known already, the most of one session",
                    admission.sender.data(), SenderTable::kMaxSenders);
      return;
    }
    record->sender = admission.sender;
    record->last_sequence.store(0);
    table.num_senders.store(num_senders + 1);
  }
  const std::int64_t last = record->last_sequence.load();
  if (admission.sequence > last) {
    record->last_sequence.store(admission.sequence);
    return;
  }
  admission.reason = Reason::kStaleSequence;
  std::snprintf(admission.text.data(), admission.text.size(),
                "sequence %lld of %s, must be greater than %lld", static_cast<long long>(admission.sequence),
                admission.sender.data(), static_cast<long long>(last));
}

}  // namespace freeflex::service
