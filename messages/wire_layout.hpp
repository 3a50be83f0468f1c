// How the fields of a message lie on the wire: the words of the tables that wire_layouts.cmake makes from the
// .lcm files (freeflex_msgs/wire_layouts.hpp in the build tree). LCM puts eight bytes of fingerprint first,
// then the fields without gaps, big-endian: a string as its length with the terminator (int32), its
// characters and NUL; an array as its elements; a struct as its fields.
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
/// [bytes] Most that one step of a count may stand for, so that no sum of sizes leaves 64 bits: no message is
/// longer.
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

/// One dimension of an array: a constant, or as many as a count of the same struct says.
struct Dimension {
  std::int32_t size = 1;    // when constant
  std::int32_t count = -1;  // which of the struct's counts, from 0; -1: constant
};
constexpr Dimension constant(std::int32_t size) { return {size, -1}; }
constexpr Dimension counted_by(std::int32_t count) { return {1, count}; }

struct Layout;
struct Field {
  std::string_view name;
  Kind kind = Kind::kInt8;
  const Layout* nested = nullptr;  // of kStruct
  bool is_count = false;           // an int32 that is the dimension of an array after it
  int num_dimensions = 0;          // 0: one value
  std::array<Dimension, kMaxDimensions> dimensions{};
};

/// A message or a struct inside one.
struct Layout {
  std::string_view name;
  std::span<const Field> fields;  // in the order of the wire
  int num_counts = 0;
  std::int64_t fixed_size = -1;  // [bytes] without fingerprint; -1: depends on contents
};

/// [bytes] One value; -1: depends on contents.
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

/// Does not compile for a table that the walk over it could not bound.
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
      if (dimension.count >= layout.num_counts) throw std::logic_error("a count stands after its array");
    }
    if (stride == 0 || stride > kMaxStride) throw std::logic_error("an element of no bytes, or of too many");
    if (num_counted > 1) throw std::logic_error("an array with two counts");
    layout.fixed_size = is_fixed && layout.fixed_size >= 0 ? layout.fixed_size + stride : -1;
  }
  if (fields.empty() || layout.fixed_size > kMaxStride)
    throw std::logic_error("a struct of no bytes, or of too many");
  if (layout.num_counts > kMaxCounts) throw std::logic_error("more counts than kMaxCounts");
  return layout;
}

/// The layout of a generated message class: the generated tables give a `const Layout*` for each.
template <class Message>
inline constexpr std::nullptr_t layout_of = nullptr;

template <class Message>
concept HasLayout = !std::is_null_pointer_v<std::remove_const_t<decltype(layout_of<Message>)>>;

}  // namespace freeflex::wire
