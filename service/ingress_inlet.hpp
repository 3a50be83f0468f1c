// What the ingress does with the bytes of one message. No socket: LCM's callbacks and the tests call it
// alike.
#pragma once

#include <cstddef>
#include <span>

#include "service/shared.hpp"

namespace freeflex::service {

/// Producer side of the shared block. One thread.
class Inlet {
 public:
  explicit Inlet(SharedBlock& block) : block_(block) {}

  /// A message on FORCE or CONTROL: to the inbound ring, or rejected, counted and put up for an answer. Where
  /// keys are required it goes on as it is.
  void on_force(std::span<const std::byte> bytes) noexcept;
  void on_control(std::span<const std::byte> bytes) noexcept;
  /// A message on STATUS: notes a session that is not ours.
  void on_status(std::span<const std::byte> bytes) noexcept;

 private:
  void forward(InboundKind kind, std::span<const std::byte> bytes) noexcept;
  void finish(io::Admission& admission) noexcept;
  void take_sequence(io::Admission& admission) noexcept;

  SharedBlock& block_;
  InboundEntry entry_{};  // scratch
};

}  // namespace freeflex::service
