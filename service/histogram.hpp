// Counts durations in fixed logarithmic buckets. One thread records while another thread reads.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace freeflex::service {

/// Divides each octave from 64 ns to 137 s into 32 buckets of equal width. A reported value is the upper edge
/// of a bucket, so between these limits it is at most 1/32 (3.1 %) above the true value and never below the
/// true value.
class Histogram {
 public:
  static constexpr int kPerOctave = 32;
  static constexpr int kFirstOctave = 6;  // 2^6 ns
  static constexpr int kNumOctaves = 31;
  static constexpr int kNumBuckets = kPerOctave * kNumOctaves;
  using Counts = std::array<std::uint32_t, kNumBuckets>;

  /// Records a duration. Only one thread may call this function. Allocates nothing.
  void record(std::int64_t duration_ns) noexcept {
    std::atomic<std::uint32_t>& count = counts_[static_cast<std::size_t>(bucket(duration_ns))];
    count.store(count.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  /// Reads the counts since the start, modulo 2^32. Any thread may call this function.
  void read(Counts& counts) const noexcept {
    for (std::size_t i = 0; i < counts.size(); ++i) counts[i] = counts_[i].load(std::memory_order_relaxed);
  }

  static int bucket(std::int64_t duration_ns) noexcept;
  /// Returns the upper edge of a bucket [ns].
  static std::int64_t upper_edge(int bucket) noexcept;

 private:
  std::array<std::atomic<std::uint32_t>, kNumBuckets> counts_{};
};

/// Percentiles of a set of durations, as in status_t.
struct Percentiles {
  std::int64_t count = 0;
  std::array<double, 4> us{};  // [us] p50, p99, p99.9, max, or zeros if count is 0
};

/// Percentiles of the durations that were recorded since the kSpan-th last call of advance(), or since the
/// start if advance() was called less often. Publisher thread only.
class SlidingPercentiles {
 public:
  static constexpr int kSpan = 10;

  explicit SlidingPercentiles(const Histogram& histogram) : histogram_(histogram) {}
  /// Drops the oldest slice (the durations between two calls) and starts a new slice.
  void advance() noexcept;
  Percentiles read() const noexcept;

 private:
  const Histogram& histogram_;
  std::array<Histogram::Counts, kSpan> starts_{};  // counts at the beginning of each slice
  int oldest_ = 0;
};

}  // namespace freeflex::service
