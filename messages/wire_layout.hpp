// Describes how the fields of a message follow each other on the wire. wire_layouts.cmake generates tables of
// these types from the .lcm files (freeflex_msgs/wire_layouts.hpp in the build tree). An LCM message begins
// with eight bytes of fingerprint. The fields follow without gaps, big-endian. A string is an int32, which
// counts its characters and the NUL, then the characters and the NUL. An array is the sequence of its
// elements, and a struct the sequence of its fields.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string_view>
#include <type_traits>

namespace freeflex::wire {

inline constexpr std::int64_t kFingerprintBytes = 8;  // [bytes]
inline constexpr int kMaxCounts = 8;                  // counts in one struct
inline constexpr int kMaxDimensions = 2;              // of one array
/// [bytes] Largest size by which a count may be multiplied. With this limit no sum of sizes overflows 64
/// bits. No message is longer than kMaxStride.
inline constexpr std::int64_t kMaxStride = 1 << 16;

enum class Kind : std::uint8_t {
  kBoolean,
  kByte,
  kInt8,
  kInt16,
  kInt32,
  kInt64,
  kFloat,
  kDouble,
  kString,
  kStruct
};

/// One dimension of an array: a constant, or the value of a count in the same struct.
struct Dimension {
  std::int32_t size = 1;    // the constant; not used if the dimension is a count
  std::int32_t count = -1;  // index of the count among the counts of the struct, from 0; -1: constant
};
constexpr Dimension constant(std::int32_t size) { return {size, -1}; }
constexpr Dimension counted_by(std::int32_t count) { return {1, count}; }

struct Layout;
struct Field {
  std::string_view name;
  Kind kind = Kind::kInt8;
  const Layout* nested = nullptr;  // kStruct only
  bool is_count = false;           // true: an int32 that gives a dimension of a later array
  int num_dimensions = 0;          // 0: one value
  std::array<Dimension, kMaxDimensions> dimensions{};
};

/// Layout of a message, or of a struct inside a message.
struct Layout {
  std::string_view name;
  std::span<const Field> fields;  // in wire order
  int num_counts = 0;
  std::int64_t fixed_size = -1;  // [bytes] without fingerprint; -1: the size depends on the contents
};

/// Returns the size of one value [bytes], or -1 if the size depends on the contents.
constexpr std::int64_t size_of(const Field& field) {
  switch (field.kind) {
    case Kind::kBoolean:
    case Kind::kByte:
    case Kind::kInt8:
      return 1;
    case Kind::kInt16:
      return 2;
    case Kind::kInt32:
    case Kind::kFloat:
      return 4;
    case Kind::kInt64:
    case Kind::kDouble:
      return 8;
    case Kind::kStruct:
      return field.nested->fixed_size;
    case Kind::kString:
      break;
  }
  return -1;
}

/// Returns the layout of the fields. Fails to compile if a walk could not check such a message: a count is
/// declared after its array, an array has two counts, a size is 0 or above kMaxStride, or there are more than
/// kMaxCounts counts.
constexpr Layout make_layout(std::string_view name, std::span<const Field> fields) {
  Layout layout{name, fields, 0, 0};
  for (const Field& field : fields) {
    if (field.is_count) ++layout.num_counts;
    std::int64_t stride = size_of(field);
    bool is_fixed = stride >= 0;
    int num_counted = 0;
    for (int i = 0; i < field.num_dimensions; ++i) {
      const Dimension& dimension = field.dimensions[static_cast<std::size_t>(i)];
      stride *= dimension.size;
      if (dimension.count < 0) continue;
      is_fixed = false;
      ++num_counted;
      if (dimension.count >= layout.num_counts) throw std::logic_error("a count is declared after its array");
    }
    if (stride == 0 || stride > kMaxStride)
      throw std::logic_error("an element is empty or larger than kMaxStride");
    if (num_counted > 1) throw std::logic_error("an array has two counts");
    layout.fixed_size = is_fixed && layout.fixed_size >= 0 ? layout.fixed_size + stride : -1;
  }
  if (fields.empty() || layout.fixed_size > kMaxStride)
    throw std::logic_error("a struct is empty or larger than kMaxStride");
  if (layout.num_counts > kMaxCounts) throw std::logic_error("more counts than kMaxCounts");
  return layout;
}

/// The layout of a message class, or nullptr for any other type. The generated tables define this variable as
/// a `const Layout*` for each generated class.
template <class Message>
inline constexpr std::nullptr_t layout_of = nullptr;

template <class Message>
concept HasLayout = !std::is_null_pointer_v<std::remove_const_t<decltype(layout_of<Message>)>>;

}  // namespace freeflex::wire
