// Durations in fixed logarithmic buckets: one thread records, another reads while it does.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace freeflex::service {

/// Buckets of 1/32 of an octave from 64 ns to 137 s: a value is known to 3 %, and never reported as less than
/// it was.
class Histogram {
 public:
  static constexpr int kPerOctave = 32;
  static constexpr int kFirstOctave = 6;  // 2^6 ns
  static constexpr int kNumOctaves = 31;
  static constexpr int kNumBuckets = kPerOctave * kNumOctaves;
  using Counts = std::array<std::uint32_t, kNumBuckets>;

  /// One recording thread only. Allocates nothing.
  void record(std::int64_t duration_ns) noexcept {
    std::atomic<std::uint32_t>& count = counts_[static_cast<std::size_t>(bucket(duration_ns))];
    count.store(count.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  /// Any thread. Counts since the start, modulo 2^32.
  void read(Counts& counts) const noexcept {
    for (std::size_t i = 0; i < counts.size(); ++i) counts[i] = counts_[i].load(std::memory_order_relaxed);
  }

  static int bucket(std::int64_t duration_ns) noexcept;
  /// [ns] upper edge of a bucket.
  static std::int64_t upper_edge(int bucket) noexcept;

 private:
  std::array<std::atomic<std::uint32_t>, kNumBuckets> counts_{};
};

/// What status_t carries of a set of durations.
struct Percentiles {
  std::int64_t count = 0;
  std::array<double, 4> us{};  // [us] p50, p99, p99.9, max; zeros when count is 0
};

/// Percentiles of the recordings of the last kSpan to kSpan + 1 calls of turn(). Publisher thread.
class SlidingPercentiles {
 public:
  static constexpr int kSpan = 10;

  explicit SlidingPercentiles(const Histogram& histogram) : histogram_(histogram) {}
  /// Forgets the oldest slice and begins a new one.
  void turn() noexcept;
  Percentiles read() const noexcept;

 private:
  const Histogram& histogram_;
  std::array<Histogram::Counts, kSpan> starts_{};  // counts at the beginning of each slice
  int oldest_ = 0;
};

}  // namespace freeflex::service
