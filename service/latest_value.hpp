// Latest-value buffer between one writer thread and one reader thread. The buffer has three preallocated
// copies, uses no lock and never waits.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace freeflex::service {

/// Passes the latest value to the reader. A value that is overwritten before the reader takes it is lost.
template <class Value>
class LatestValue {
 public:
  explicit LatestValue(const Value& prototype) : copies_{prototype, prototype, prototype} {}
  LatestValue(const LatestValue&) = delete;
  LatestValue& operator=(const LatestValue&) = delete;

  /// Writer only. Returns the copy to fill before offer(). The copy contains an old value.
  Value& draft() noexcept { return copies_[writing_]; }
  /// Only the writer calls this function. Makes the draft the latest value. An older value that was not taken
  /// is lost.
  void offer() noexcept {
    writing_ =
        latest_.exchange(static_cast<std::uint8_t>(writing_ | kUnread), std::memory_order_acq_rel) & kIndex;
  }
  /// Reader only. Returns the latest value, or null if none was offered since the last take(). The value
  /// does not change until the next take().
  const Value* take() noexcept {
    if ((latest_.load(std::memory_order_acquire) & kUnread) == 0) return nullptr;
    reading_ = latest_.exchange(reading_, std::memory_order_acq_rel) & kIndex;
    return &copies_[reading_];
  }

 private:
  static constexpr std::uint8_t kIndex = 3, kUnread = 4;
  std::array<Value, 3> copies_;
  alignas(64) std::uint8_t writing_ = 0;
  alignas(64) std::atomic<std::uint8_t> latest_{1};
  alignas(64) std::uint8_t reading_ = 2;
};

}  // namespace freeflex::service
