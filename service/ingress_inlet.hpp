// What the ingress does with the bytes of one packet. No socket: the ingress and the tests call it alike.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "service/shared.hpp"

namespace freeflex::service {

/// Producer side of the shared block. One thread.
class Inlet {
 public:
  Inlet(SharedBlock& block, const IngressSettings& settings);

  /// A packet off the bus: to one of the next three when it is on one of our channels.
  /// \param received_ns  [ns] CLOCK_BOOTTIME
  void on_packet(std::span<const std::byte> packet, std::int64_t received_ns) noexcept;

  /// A message on FORCE or CONTROL: to the inbound ring, or rejected, counted and put up for an answer. Where
  /// keys are required it goes on as it is.
  void on_force(std::span<const std::byte> bytes, std::int64_t received_ns) noexcept;
  void on_control(std::span<const std::byte> bytes, std::int64_t received_ns) noexcept;
  /// A message on STATUS: notes a session that is not ours.
  void on_status(std::span<const std::byte> bytes) noexcept;

 private:
  void on_fragment(bool is_force, std::int64_t received_ns) noexcept;
  void forward(InboundKind kind, std::span<const std::byte> bytes) noexcept;
  void hand_over(InboundKind kind) noexcept;
  void finish(io::Admission& admission) noexcept;
  void take_sequence(io::Admission& admission) noexcept;
  SenderTable::Record* find_record(const std::array<char, kSenderSize>& sender) noexcept;

  SharedBlock& block_;
  const IngressSettings& settings_;
  std::string force_, control_, status_;  // channels
  InboundEntry entry_{};                  // scratch
};

}  // namespace freeflex::service
