// This file defines a hostile ingress, which writes arbitrary bytes into all memory that the ingress can
// reach.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <random>
#include <span>
#include <vector>

#include "service/shared.hpp"

namespace freeflex::testing {

class HostileIngress {
 public:
  HostileIngress(service::SharedBlock& block, std::uint64_t seed) : block_(block), engine_(seed) {}

  /// Stores the bytes of a genuine message. push_bytes() may later send them again with changes.
  void overhear(std::span<const std::byte> bytes) { heard_.assign(bytes.begin(), bytes.end()); }

  /// Performs one hostile action, random or crafted.
  void act() {
    switch (engine_() % 8) {
      case 0:
        return scribble(engine_() % 4096);
      case 1:
        return scribble(8);
      case 2:
        return write_indices();
      case 3:
        return write_counters();
      case 4:
        return push_command();
      case 5:
        return push_bytes();
      case 6:
        return push_answer();
      default:
        // only one of 256 such actions fills the whole ring, because the ring has 10 MB
        if (engine_() % 256 != 0) return scribble(64);
        return fill(&block_.inbound, sizeof(block_.inbound), static_cast<int>(engine_() & 0xFFU));
    }
  }

 private:
  /// Returns the shared block, which is all memory of the daemon that the ingress can write.
  std::span<std::byte> reach() const { return {reinterpret_cast<std::byte*>(&block_), sizeof(block_)}; }
  void scribble(std::size_t size) {
    const std::span<std::byte> all = reach();
    const std::size_t at = engine_() % (all.size() - size);
    for (std::byte& byte : all.subspan(at, size)) byte = static_cast<std::byte>(engine_() & 0xFFU);
  }
  static void fill(void* to, std::size_t size, int value) { std::memset(to, value, size); }

  /// Overwrites head_ or tail_ of a ring, which are the first words of its first two cache lines.
  void write_indices() {
    constexpr std::size_t kLine = 64;
    auto* ring = reinterpret_cast<std::byte*>(engine_() % 2 == 0 ? static_cast<void*>(&block_.inbound)
                                                                 : static_cast<void*>(&block_.rejected));
    const std::uint64_t values[] = {0, 1, 1023, 1024, 1025, ~0ULL, ~0ULL - 1023, 1ULL << 63, engine_()};
    const std::uint64_t value = values[engine_() % std::size(values)];
    std::memcpy(ring + (engine_() % 2) * kLine, &value, sizeof(value));
  }
  void write_counters() {
    const auto any = static_cast<std::int64_t>(engine_());
    block_.received.store(any);
    block_.dropped_answers.store(any);
    block_.rejections[engine_() % io::kNumReasons].store(any);
    block_.senders.records[0].heard_ns.store(any);
    block_.seats[engine_() % 2].lacks.store(static_cast<std::uint32_t>(any));
    block_.other_session.store(any);
  }
  /// Pushes a decoded command with the id of a key as its sender. A daemon without keys would obey it.
  void push_command() {
    service::InboundEntry entry{};
    const char name[] = "test";
    if (engine_() % 2 == 0) {
      entry.kind = service::InboundKind::kForce;
      std::memcpy(entry.force.sender.data(), name, sizeof(name));
      entry.force.sequence = static_cast<std::int64_t>(engine_() >> 1);
      entry.force.start_tick = -1;
      entry.force.duration_ticks = 1000;
      entry.force.num_points = 1;
      entry.force.points[0] = {0, 0, {1.0, 2.0, 3.0}};
    } else {
      entry.kind = service::InboundKind::kControl;
      std::memcpy(entry.control.sender.data(), name, sizeof(name));
      entry.control.sequence = static_cast<std::int64_t>(engine_() >> 1);
      entry.control.command = 1 + static_cast<std::int32_t>(engine_() % 5);  // including STOP and RESET
    }
    block_.inbound.try_push(entry);
  }
  /// Pushes changed bytes of the overheard message under a false length.
  void push_bytes() {
    service::InboundEntry entry{};
    entry.received_ns = static_cast<std::int64_t>(engine_());
    entry.kind = static_cast<service::InboundKind>(3 + engine_() % 2);
    const std::int32_t sizes[] = {-1,
                                  0,
                                  7,
                                  8,
                                  service::kMaxRawBytes,
                                  service::kMaxRawBytes + 1,
                                  INT32_MAX,
                                  INT32_MIN,
                                  static_cast<std::int32_t>(heard_.size())};
    entry.num_raw_bytes = sizes[engine_() % std::size(sizes)];
    std::copy(heard_.begin(), heard_.end(), entry.raw.begin());
    if (!heard_.empty()) {
      for (std::uint64_t n = engine_() % 4; n > 0; --n)
        entry.raw[engine_() % heard_.size()] = static_cast<std::byte>(engine_() & 0xFFU);
    }
    block_.inbound.try_push(entry);
  }
  /// Pushes a false answer that rejects a controller's command.
  void push_answer() {
    service::RejectionEntry entry{};
    entry.admission.reason = static_cast<io::Reason>(engine_() % (io::kNumReasons + 3));
    const char name[] = "test";
    std::memcpy(entry.admission.sender.data(), name, sizeof(name));
    entry.admission.sequence = static_cast<std::int64_t>(engine_() % 1000);
    block_.rejected.try_push(entry);
  }

  service::SharedBlock& block_;
  std::mt19937_64 engine_;
  std::vector<std::byte> heard_;
};

}  // namespace freeflex::testing
