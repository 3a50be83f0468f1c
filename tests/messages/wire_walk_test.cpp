// The generated layouts agree with the generated classes, and the walk over a layout accepts exactly the
// messages that the classes encode.
#include "service/io/wire/wire_walk.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>
#include <random>

#include "service/io/wire/codec.hpp"
#include "service/io/wire/decode.hpp"

namespace freeflex::testing {
namespace {

using Bytes = std::vector<std::byte>;
using io::WireWalk;

/// Computes LCM's fingerprint of a struct from names, types and dimensions (lcm-gen's lcm_struct_hash).
class Fingerprint {
 public:
  static std::int64_t of(const wire::Layout& layout) {
    Fingerprint own;
    std::uint64_t inside = 0;
    for (const wire::Field& field : layout.fields) {
      own.add(field.name);
      if (field.kind == wire::Kind::kStruct) {
        inside += static_cast<std::uint64_t>(of(*field.nested));
      } else {
        own.add(type_name(field.kind));
      }
      own.add(field.num_dimensions);
      for (int i = 0; i < field.num_dimensions; ++i) {
        const wire::Dimension& dimension = field.dimensions[static_cast<std::size_t>(i)];
        own.add(dimension.count < 0 ? 0 : 1);
        own.add(dimension.count < 0 ? std::to_string(dimension.size) : count_name(layout, dimension.count));
      }
    }
    const std::uint64_t sum = static_cast<std::uint64_t>(own.value_) + inside;
    return static_cast<std::int64_t>((sum << 1) + (sum >> 63));
  }

 private:
  void add(int number) {
    const std::uint64_t mixed =
        static_cast<std::uint64_t>(value_) << 8 ^ static_cast<std::uint64_t>(value_ >> 55);
    value_ = static_cast<std::int64_t>(mixed + static_cast<std::uint64_t>(number));
  }
  void add(std::string_view text) {
    add(static_cast<int>(text.size()));
    for (const char c : text) add(c);
  }
  static std::string_view type_name(wire::Kind kind) {
    constexpr std::string_view kNames[] = {"boolean", "byte",  "int8_t", "int16_t", "int32_t",
                                           "int64_t", "float", "double", "string"};
    return kNames[static_cast<std::size_t>(kind)];
  }
  static std::string count_name(const wire::Layout& layout, int count) {
    for (const wire::Field& field : layout.fields)
      if (field.is_count && count-- == 0) return std::string(field.name);
    return "no such count";
  }

  std::int64_t value_ = 0x12345678;
};

/// Writes a message with random contents. Only the layout determines the form of the message.
class RandomMessage {
 public:
  RandomMessage(const wire::Layout& layout, std::int64_t fingerprint, std::mt19937_64& engine)
      : engine_(engine) {
    put(static_cast<std::uint64_t>(fingerprint), 8);
    put_struct(layout);
  }
  const Bytes& bytes() const { return bytes_; }

 private:
  void put(std::uint64_t value, std::int64_t size) {
    for (std::int64_t i = size - 1; i >= 0; --i)
      bytes_.push_back(static_cast<std::byte>(value >> (8 * i) & 0xFFu));
  }
  void put_struct(const wire::Layout& layout) {
    std::vector<std::int64_t> counts;
    for (const wire::Field& field : layout.fields) {
      if (field.is_count) {
        counts.push_back(static_cast<std::int64_t>(engine_() % 4));
        put(static_cast<std::uint64_t>(counts.back()), 4);
        continue;
      }
      std::int64_t num = 1;
      for (int i = 0; i < field.num_dimensions; ++i) {
        const wire::Dimension& dimension = field.dimensions[static_cast<std::size_t>(i)];
        num *= dimension.count < 0 ? dimension.size : counts.at(static_cast<std::size_t>(dimension.count));
      }
      for (std::int64_t i = 0; i < num; ++i) put_element(field);
    }
  }
  void put_element(const wire::Field& field) {
    if (field.kind == wire::Kind::kStruct) return put_struct(*field.nested);
    if (field.kind != wire::Kind::kString) return put(engine_(), wire::size_of(field));
    const std::uint64_t length = engine_() % 8;
    put(length + 1, 4);
    for (std::uint64_t i = 0; i < length; ++i) put(1 + engine_() % 255, 1);
    put(0, 1);
  }

  std::mt19937_64& engine_;
  Bytes bytes_;
};

/// Checks a copy of the bytes on the heap without spare capacity, so that a sanitizer reports any read beyond
/// it.
template <class Message>
bool fits_exact(std::span<const std::byte> bytes) {
  const std::unique_ptr<std::byte[]> copy(new std::byte[bytes.size()]);
  if (!bytes.empty()) std::memcpy(copy.get(), bytes.data(), bytes.size());
  return io::fits_layout({copy.get(), bytes.size()}, *wire::layout_of<Message>);
}

template <class Message>
Bytes random_message(std::mt19937_64& engine) {
  return RandomMessage(*wire::layout_of<Message>, Message::getHash(), engine).bytes();
}

template <class Message>
class WireWalkOf : public ::testing::Test {};
TYPED_TEST_SUITE(WireWalkOf, wire::EachType<::testing::Types>);

TYPED_TEST(WireWalkOf, LayoutHasTheFingerprintOfTheGeneratedClass) {
  EXPECT_EQ(Fingerprint::of(*wire::layout_of<TypeParam>), TypeParam::getHash());
  EXPECT_EQ(wire::layout_of<TypeParam>->name, TypeParam::getTypeName());
}

TYPED_TEST(WireWalkOf, RandomMessagesAreDecodedByTheGeneratedClass) {
  std::mt19937_64 engine(11);
  for (int i = 0; i < 200; ++i) {
    const Bytes bytes = random_message<TypeParam>(engine);
    TypeParam message;
    ASSERT_TRUE(io::decode_message(bytes, message)) << i;
    EXPECT_EQ(io::encode(message), bytes) << i;
  }
}

TYPED_TEST(WireWalkOf, RefusesEveryTruncationAndATrailingByte) {
  std::mt19937_64 engine(12);
  for (int i = 0; i < 5; ++i) {
    Bytes bytes = random_message<TypeParam>(engine);
    EXPECT_TRUE(fits_exact<TypeParam>(bytes));
    for (std::size_t size = 0; size < bytes.size(); ++size)
      EXPECT_FALSE(fits_exact<TypeParam>(std::span(bytes).first(size))) << size;
    bytes.push_back(std::byte{0});
    EXPECT_FALSE(fits_exact<TypeParam>(bytes));
  }
}

TYPED_TEST(WireWalkOf, TheGeneratedClassDecodesEveryMessageThatFitsTheLayout) {
  std::mt19937_64 engine(13);
  for (int i = 0; i < 3000; ++i) {
    Bytes bytes = random_message<TypeParam>(engine);
    for (std::uint64_t n = engine() % 3; n < 3; ++n) {
      const std::size_t at = engine() % bytes.size();
      const std::size_t length = std::min<std::size_t>(engine() % 5, bytes.size() - at);
      constexpr int kExtreme[] = {0, 0x7F, 0x80, 0xFF};
      std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), length,
                  static_cast<std::byte>(kExtreme[engine() % 4]));
    }
    if (!fits_exact<TypeParam>(bytes)) continue;
    std::memcpy(bytes.data(), random_message<TypeParam>(engine).data(), 8);  // restores the fingerprint
    TypeParam message;
    ASSERT_TRUE(io::decode_walked(bytes, message)) << i;
  }
}

TYPED_TEST(WireWalkOf, AnotherFingerprintIsRefused) {
  std::mt19937_64 engine(14);
  Bytes bytes = random_message<TypeParam>(engine);
  for (std::size_t bit = 0; bit < 64; ++bit) {
    Bytes other = bytes;
    other[bit / 8] ^= static_cast<std::byte>(1u << bit % 8);
    TypeParam message;
    EXPECT_FALSE(io::decode_message(other, message)) << bit;
  }
}

/// Hold the fields of a layout in which a walk can stop for every cause.
constexpr wire::Field kInnerFields[] = {
    {"n", wire::Kind::kInt32, nullptr, true, 0, {}},
    {"texts", wire::Kind::kString, nullptr, false, 1, {{wire::counted_by(0)}}}};
constexpr wire::Layout kInner = wire::make_layout("inner", kInnerFields);
constexpr wire::Field kOuterFields[] = {
    {"num_inner", wire::Kind::kInt32, nullptr, true, 0, {}},
    {"num_pairs", wire::Kind::kInt32, nullptr, true, 0, {}},
    {"pairs", wire::Kind::kInt16, nullptr, false, 2, {{wire::counted_by(1), wire::constant(2)}}},
    {"inner", wire::Kind::kStruct, &kInner, false, 1, {{wire::counted_by(0)}}}};
constexpr wire::Layout kOuter = wire::make_layout("outer", kOuterFields);

Bytes words(std::initializer_list<std::uint32_t> values) {
  Bytes bytes(8);  // room for the fingerprint
  for (const std::uint32_t value : values)
    for (int shift = 24; shift >= 0; shift -= 8)
      bytes.push_back(static_cast<std::byte>(value >> shift & 0xFFu));
  return bytes;
}
WireWalk walk(const Bytes& bytes) { return io::walk_message(bytes, kOuter); }

TEST(WireWalk, ReportsWhyItStopsAndWhichSizeTheMessageNeeds) {
  using Stop = WireWalk::Stop;
  EXPECT_EQ(walk(words({1})).stop, Stop::kMissingCount);
  EXPECT_EQ(walk(words({1})).size, 16) << "the size that the counts need";
  EXPECT_EQ(walk(words({0, 0x80000000u})).stop, Stop::kNegativeCount);
  EXPECT_EQ(walk(words({0xFFFFFFFFu, 0})).stop, Stop::kNegativeCount)
      << "the negative count is found before the array before it is read";
  EXPECT_EQ(walk(words({0xFFFFFFFFu, 0})).counts[0], -1);
  const WireWalk far = walk(words({0, 0x7FFFFFFFu}));
  EXPECT_EQ(far.stop, Stop::kEnd);
  EXPECT_EQ(far.size, 16 + std::int64_t{4} * 0x7FFFFFFF) << "the size exceeds the bytes, and also 32 bits";
  EXPECT_EQ(walk(words({1, 1, 0})).stop, Stop::kMissingCount) << "the count of the nested struct";
  EXPECT_EQ(walk(words({1, 0, 0xFFFFFFFEu})).stop, Stop::kNegativeCount);
  EXPECT_EQ(walk(words({1, 0, 2, 1})).stop, Stop::kBadString) << "neither a character nor a terminator";
  EXPECT_EQ(walk(words({1, 0, 1, 4, 0x61626300})).stop, Stop::kEnd);
  EXPECT_EQ(walk(words({1, 0, 1, 4, 0x61626300})).size, 28);
  for (const std::uint32_t length : {0u, 5u, 0x7FFFFFFFu, 0x80000000u, 0xFFFFFFFFu})
    EXPECT_EQ(walk(words({1, 0, 1, length, 0})).stop, Stop::kBadString) << length;
}

TEST(WireWalk, StopsAtTheEndOfTheBytesDespiteImpossibleCounts) {
  // the counts say 2^31 - 1 structs of 2^31 - 1 strings each, so a walk that trusted either count would take
  // years
  EXPECT_EQ(walk(words({0x7FFFFFFFu, 0, 0x7FFFFFFFu})).stop, WireWalk::Stop::kBadString);
  Bytes bytes = words({0x7FFFFFFFu, 0});
  bytes.resize(60'000);  // filled with empty structs
  EXPECT_EQ(walk(bytes).stop, WireWalk::Stop::kMissingCount);
  EXPECT_EQ(walk(bytes).size, 60'004);
}

TEST(WireWalk, NothingOutsideTheBytesIsRead) {
  EXPECT_FALSE(io::fits_layout({}, kOuter));
  EXPECT_EQ(io::integer_at<std::int32_t>({}, 0), std::nullopt);
  const Bytes bytes = words({4, 0x61620000});
  EXPECT_EQ(io::string_at(bytes, 8), std::string_view("ab\0", 3));
  for (const std::int64_t at : {std::int64_t{-1}, std::int64_t{13}, std::numeric_limits<std::int64_t>::min(),
                                std::numeric_limits<std::int64_t>::max()}) {
    EXPECT_EQ(io::integer_at<std::int32_t>(bytes, at), std::nullopt) << at;
    EXPECT_EQ(io::string_at(bytes, at), std::nullopt) << at;
  }
}

}  // namespace
}  // namespace freeflex::testing
