// This queue passes values in order from one writer thread to one reader thread. The places of the queue are
// allocated once. The queue uses no lock and never waits.
#pragma once

#include <atomic>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace freeflex::service {

/// A queue whose values are filled in place, for values that are too large to copy. (A Ring copies its
/// values.) A Queue must not be placed in shared memory.
template <class Value>
class Queue {
 public:
  /// \param num_places  > 0; each place is a copy of the prototype
  Queue(const Value& prototype, std::size_t num_places) : places_(num_places, prototype) {}
  Queue(const Queue&) = delete;
  Queue& operator=(const Queue&) = delete;

  std::size_t num_places() const noexcept { return places_.size(); }

  /// Only the writer calls this function. Returns the place to fill before offer(). The place contains an old
  /// value. Returns nullptr if the queue is full.
  Value* draft() noexcept {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    return head - tail_.load(std::memory_order_acquire) < places_.size() ? &at(head) : nullptr;
  }
  /// Writer only. Adds the draft to the queue.  \pre draft() was not null
  void offer() noexcept {
    assert(draft() != nullptr);
    head_.store(head_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

  /// Only the reader calls this function. Returns the oldest value, or nullptr if the queue is empty. The
  /// value does not change until drop().
  const Value* front() noexcept {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    return head_.load(std::memory_order_acquire) != tail ? &at(tail) : nullptr;
  }
  /// Reader only. Removes the oldest value.  \pre front() was not null
  void drop() noexcept {
    assert(front() != nullptr);
    tail_.store(tail_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

 private:
  Value& at(std::uint64_t number) noexcept {
    return places_[static_cast<std::size_t>(number % places_.size())];
  }

  std::vector<Value> places_;
  alignas(64) std::atomic<std::uint64_t> head_{0};  // number of values offered
  alignas(64) std::atomic<std::uint64_t> tail_{0};  // number of values dropped
};

}  // namespace freeflex::service
