#include "service/io/wire/wire_walk.hpp"

#include <limits>

namespace freeflex::io {
namespace {

using Stop = WireWalk::Stop;

constexpr std::int64_t kLengthBytes = 4;  // [bytes] of the integer before a string, and of a count

/// The counts of one struct, in the order of its fields.
struct Counts {
  std::array<std::int32_t, wire::kMaxCounts> values{};
  std::size_t num = 0;
  bool is_missing = false;
  bool is_negative = false;
};

class Walker {
 public:
  explicit Walker(std::span<const std::byte> bytes) : bytes_(bytes) {}

  /// Walks over the fields of one struct. The recursion ends, because each nested struct precedes its owner
  /// in the tables, so no struct contains itself.
  Stop take_struct(const wire::Layout& layout, Counts& counts) {
    for (const wire::Field& field : layout.fields) {
      if (field.is_count) {
        take_count(counts);
        continue;
      }
      const Stop stop = take_field(field, counts);
      if (stop != Stop::kEnd) return stop;
    }
    return Stop::kEnd;
  }

  std::int64_t at() const { return at_; }

 private:
  void take_count(Counts& counts) {
    const std::optional<std::int32_t> count = integer_at<std::int32_t>(bytes_, at_);
    at_ += kLengthBytes;
    counts.values[counts.num++] = count.value_or(0);
    if (!count) counts.is_missing = true;
    if (count && *count < 0) counts.is_negative = true;
  }

  Stop take_field(const wire::Field& field, const Counts& counts) {
    std::int64_t num = 1;
    for (int i = 0; i < field.num_dimensions; ++i) {
      const wire::Dimension& dimension = field.dimensions[index(i)];
      if (dimension.count < 0) {
        num *= dimension.size;
        continue;
      }
      if (counts.is_missing) return Stop::kMissingCount;
      if (counts.is_negative) return Stop::kNegativeCount;
      num *= counts.values[index(dimension.count)];
    }
    // the product fits 64 bits, because at most one dimension is a 32-bit count, and all other factors
    // multiply to at most kMaxStride bytes
    if (const std::int64_t size = wire::size_of(field); size >= 0) {
      at_ += num * size;
      return Stop::kEnd;
    }
    // every element contains a string or a count, so the walk over an impossible number of elements stops at
    // the end of the bytes
    for (std::int64_t i = 0; i < num; ++i) {
      const Stop stop = take_element(field);
      if (stop != Stop::kEnd) return stop;
    }
    return Stop::kEnd;
  }

  Stop take_element(const wire::Field& field) {
    if (field.kind == wire::Kind::kStruct) {
      Counts counts;
      return take_struct(*field.nested, counts);
    }
    const std::optional<std::string_view> text = string_at(bytes_, at_);
    if (!text) return Stop::kBadString;
    at_ += kLengthBytes + static_cast<std::int64_t>(text->size()) + 1;
    return Stop::kEnd;
  }

  std::span<const std::byte> bytes_;
  std::int64_t at_ = wire::kFingerprintBytes;
};

}  // namespace

std::optional<std::string_view> string_at(std::span<const std::byte> bytes, std::int64_t at) noexcept {
  const std::optional<std::int32_t> length = integer_at<std::int32_t>(bytes, at);
  if (!length || *length < 1) return std::nullopt;
  const std::span<const std::byte> rest = bytes.subspan(index(at + kLengthBytes));
  const auto size = index(*length);
  if (rest.size() < size || rest[size - 1] != std::byte{0}) return std::nullopt;
  return std::string_view(reinterpret_cast<const char*>(rest.data()), size - 1);
}

WireWalk walk_message(std::span<const std::byte> bytes, const wire::Layout& layout) noexcept {
  Walker walker(bytes);
  Counts counts;
  WireWalk walk;
  walk.stop = walker.take_struct(layout, counts);
  walk.size = walker.at();
  walk.counts = counts.values;
  return walk;
}

bool fits_layout(std::span<const std::byte> bytes, const wire::Layout& layout) noexcept {
  const WireWalk walk = walk_message(bytes, layout);
  return walk.stop == Stop::kEnd && walk.size == static_cast<std::int64_t>(bytes.size());
}

}  // namespace freeflex::io
