// Latest value from one writer thread to one reader thread: three preallocated copies, no lock, no wait.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace freeflex::service {

template <class Value>
class Box {
 public:
  explicit Box(const Value& prototype) : copies_{prototype, prototype, prototype} {}
  Box(const Box&) = delete;
  Box& operator=(const Box&) = delete;

  /// Writer only. The copy to fill before offer(); it holds an old value.
  Value& draft() noexcept { return copies_[writing_]; }
  /// Writer only. The draft becomes the latest value; an older one that nobody took is lost.
  void offer() noexcept {
    writing_ =
        latest_.exchange(static_cast<std::uint8_t>(writing_ | kUnread), std::memory_order_acq_rel) & kIndex;
  }
  /// Reader only. The latest value, or null when there is none since the last take. Stays as it is until the
  /// next take.
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
