// Handles the bytes of packets in the ingress. The handler uses no socket, so tests can call it as the
// ingress does.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "service/shared.hpp"

namespace freeflex::service {

/// Decodes packets and fills the shared block as its producer. Used by one thread.
class PacketHandler {
 public:
  PacketHandler(SharedBlock& block, const IngressSettings& settings);

  /// Takes a packet from the bus. If the packet is on one of the daemon's channels, passes its message to one
  /// of the functions below.
  /// \param received_ns  [ns] CLOCK_BOOTTIME
  void on_packet(std::span<const std::byte> packet, std::int64_t received_ns) noexcept;

  /// These two functions take a message on FORCE or CONTROL. If keys are required, they put the message into
  /// the inbound ring without decoding it. Otherwise they put a valid command into the ring, and count an
  /// invalid command and queue the answer to it.
  void on_force(std::span<const std::byte> bytes, std::int64_t received_ns) noexcept;
  void on_control(std::span<const std::byte> bytes, std::int64_t received_ns) noexcept;
  /// Takes a message on STATUS and stores its session if another daemon sent it.
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
  std::string force_, control_, status_;  // channel names
  InboundEntry entry_{};                  // scratch
};

}  // namespace freeflex::service
