#include "service/histogram.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace freeflex::service {

int Histogram::bucket(std::int64_t duration_ns) noexcept {
  const auto ns = static_cast<std::uint64_t>(std::max<std::int64_t>(duration_ns, 0));
  if (ns < (1ULL << kFirstOctave)) return 0;
  // the highest bit that is set gives the octave, and the five bits below that bit give the bucket in the
  // octave
  const int octave = static_cast<int>(std::bit_width(ns)) - 1;
  const int place = static_cast<int>((ns >> (octave - 5)) & (kPerOctave - 1));
  return std::min((octave - kFirstOctave) * kPerOctave + place, kNumBuckets - 1);
}

std::int64_t Histogram::upper_edge(int bucket) noexcept {
  const int octave = bucket / kPerOctave + kFirstOctave;
  const std::int64_t place = bucket % kPerOctave + 1;
  return (1LL << octave) + (place << (octave - 5));
}

void SlidingPercentiles::advance() noexcept {
  histogram_.read(starts_[index(oldest_)]);
  oldest_ = (oldest_ + 1) % kSpan;
}

Percentiles SlidingPercentiles::read() const noexcept {
  static constexpr std::array<double, 4> kQuantiles{0.5, 0.99, 0.999, 1.0};
  Histogram::Counts counts;
  histogram_.read(counts);
  Percentiles result;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    counts[i] -= starts_[index(oldest_)][i];  // right even if a count has wrapped
    result.count += counts[i];
  }
  // finds the upper edge of the bucket that contains the quantile
  std::size_t quantile = 0;
  std::int64_t below = 0;
  for (int i = 0; i < Histogram::kNumBuckets && quantile < kQuantiles.size(); ++i) {
    below += counts[index(i)];
    while (quantile < kQuantiles.size() && below > 0 &&
           static_cast<double>(below) >=
               std::ceil(kQuantiles[quantile] * static_cast<double>(result.count))) {
      result.us[quantile++] = static_cast<double>(Histogram::upper_edge(i)) * 1e-3;
    }
  }
  return result;
}

}  // namespace freeflex::service
