// Values from one writer thread to one reader thread, each in order: places that are allocated once, no lock,
// no wait.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace freeflex::service {

/// Where a value is filled in place and is too large for a Ring, which copies; no shared memory.
template <class Value>
class Queue {
 public:
  /// \param num_places  > 0, each a copy of the prototype
  Queue(const Value& prototype, std::size_t num_places) : places_(num_places, prototype) {}
  Queue(const Queue&) = delete;
  Queue& operator=(const Queue&) = delete;

  std::size_t num_places() const noexcept { return places_.size(); }

  /// Writer only. The place to fill before offer(), which holds an old value; null when all wait for the
  /// reader.
  Value* draft() noexcept {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    return head - tail_.load(std::memory_order_acquire) < places_.size() ? &at(head) : nullptr;
  }
  /// Writer only. \pre draft() was not null
  void offer() noexcept { head_.store(head_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }

  /// Reader only. The oldest value, null when there is none. Stays as it is until drop().
  const Value* front() noexcept {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    return head_.load(std::memory_order_acquire) != tail ? &at(tail) : nullptr;
  }
  /// Reader only. \pre front() was not null
  void drop() noexcept { tail_.store(tail_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }

 private:
  Value& at(std::uint64_t number) noexcept {
    return places_[static_cast<std::size_t>(number % places_.size())];
  }

  std::vector<Value> places_;
  alignas(64) std::atomic<std::uint64_t> head_{0};  // values offered
  alignas(64) std::atomic<std::uint64_t> tail_{0};  // values dropped
};

}  // namespace freeflex::service
