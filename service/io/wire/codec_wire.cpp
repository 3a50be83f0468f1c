#include "service/io/wire/codec_wire.hpp"

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstring>

#include "core/step/command.hpp"
#include "freeflex_msgs/wire_layouts.hpp"
#include "messages/channels.hpp"
#include "service/io/wire/codec.hpp"
#include "service/io/wire/versions.hpp"
#include "service/io/wire/wire_walk.hpp"

namespace freeflex::io {
namespace {

using freeflex_msgs::control_t;
using freeflex_msgs::envelope_t;
using freeflex_msgs::force_t;
using freeflex_msgs::status_t;
using wire::layout_of;

/// Largest values of the counts of a command, in the order of the counts.
template <class Command>
constexpr std::array<std::int32_t, 0> kCountLimits{};
template <>
constexpr std::array<std::int32_t, 4> kCountLimits<force_t>{kMaxCommandPoints, kMaxCommandWrenches,
                                                            kMaxCommandTorques, kMaxWheels};

/// Returns true if the layout starts with fields of these names and kinds, each of which is a single value.
template <std::size_t kSize>
constexpr bool starts_with(const wire::Layout& layout, const wire::Field (&front)[kSize]) {
  return layout.fields.size() >= kSize &&
         std::equal(front, front + kSize, layout.fields.begin(), [](const auto& a, const auto& b) {
           return a.name == b.name && a.kind == b.kind && b.num_dimensions == 0;
         });
}
constexpr wire::Field kFront[] = {{"utime", wire::Kind::kInt64}, {"session", wire::Kind::kInt64}};
constexpr wire::Field kHead[] = {
    kFront[0], kFront[1], {"sender", wire::Kind::kString}, {"sequence", wire::Kind::kInt64}};
static_assert(starts_with(*layout_of<force_t>, kHead), "read_head");
static_assert(starts_with(*layout_of<control_t>, kHead), "read_head");
static_assert(starts_with(*layout_of<status_t>, kFront), "read_status_session");
constexpr std::int64_t kSessionAt = wire::kFingerprintBytes + 8;  // [bytes]
constexpr std::int64_t kSenderAt = kSessionAt + 8;
// the layout that find_body relies on
constexpr std::size_t kTagBytes = sizeof(envelope_t::tag);
constexpr wire::Field kEnvelope[] = {{"key_id", wire::Kind::kString},
                                     {"session", wire::Kind::kInt64},
                                     {"sequence", wire::Kind::kInt64},
                                     {"valid_until", wire::Kind::kInt64},
                                     {"num_bytes", wire::Kind::kInt32}};
static_assert(starts_with(*layout_of<envelope_t>, kEnvelope) && layout_of<envelope_t>->fields.size() == 7,
              "find_body");

/// Checks fingerprint and total size.
Reason check_front(std::span<const std::byte> bytes, std::int64_t fingerprint, std::span<char> text) {
  // the size is checked first: liblcm can report more bytes than there are, so no byte of an oversized
  // message may be read
  if (bytes.size() > index(channels::kMaxMessageBytes)) {
    print(text, "the message has more than %d bytes, the most allowed", channels::kMaxMessageBytes);
    return Reason::kMalformed;
  }
  const std::optional<std::int64_t> found = integer_at<std::int64_t>(bytes, 0);
  if (!found) {
    print(text, "the message of %zu bytes is too short for a fingerprint", bytes.size());
    return Reason::kMalformed;
  }
  if (*found == fingerprint) return Reason::kAccepted;
  if (const EarlierType* const earlier = find_earlier(bytes)) {
    print(text,
          "the message is of version %s of the messages, but must be of %s; generate your code from the "
          "daemon's .lcm files",
          earlier->version, kMessagesVersion);
  } else {
    print(text, "fingerprint %016llx is of another type or version of the protocol, but must be %016llx",
          static_cast<unsigned long long>(*found), static_cast<unsigned long long>(fingerprint));
  }
  return Reason::kWrongType;
}

using Phrase = std::array<char, 96>;

void append(Phrase& phrase, std::int32_t number, std::string_view name) {
  const std::size_t length = std::strlen(phrase.data());
  print(std::span(phrase).subspan(length), "%s%d%s%.*s", length == 0 ? "" : " and ", number,
        name.empty() ? "" : " ", static_cast<int>(name.size()), name.data());
}

/// Returns the name of the first array of which this count gives a dimension.
std::string_view counted_name(const wire::Layout& layout, int count) {
  const auto is_counted = [count](const wire::Field& field) {
    return std::any_of(field.dimensions.begin(), field.dimensions.end(),
                       [count](const wire::Dimension& dimension) { return dimension.count == count; });
  };
  return std::find_if(layout.fields.begin(), layout.fields.end(), is_counted)->name;
}

/// Returns each count with the name of its array, for example "3 forces and 2 wrenches".
Phrase describe(const wire::Layout& layout, std::span<const std::int32_t> counts) {
  Phrase phrase{};
  for (int i = 0; i < layout.num_counts; ++i) append(phrase, counts[index(i)], counted_name(layout, i));
  return phrase;
}

/// Rejects a message in which the walk stopped early, or whose fields need more or fewer bytes than it has.
Reason check_walk(std::span<const std::byte> bytes, const wire::Layout& layout, const WireWalk& walk,
                  std::span<char> text) {
  const auto size = static_cast<long long>(walk.size);
  switch (walk.stop) {
    case WireWalk::Stop::kBadString:
      print(text, "the message of %zu bytes has a string that is not terminated", bytes.size());
      return Reason::kMalformed;
    case WireWalk::Stop::kMissingCount:
      print(text, "the message ends at byte %zu, before its counts, which end at byte %lld", bytes.size(),
            size);
      return Reason::kMalformed;
    case WireWalk::Stop::kNegativeCount:
      print(text, "the message has %s, but no count may be negative", describe(layout, walk.counts).data());
      return Reason::kMalformed;
    case WireWalk::Stop::kEnd:
      break;
  }
  if (walk.size == static_cast<std::int64_t>(bytes.size())) return Reason::kAccepted;
  if (layout.num_counts == 0) {
    print(text, "the message has %zu bytes, but must have %lld", bytes.size(), size);
  } else {
    print(text, "the message has %zu bytes, but %s need %lld", bytes.size(),
          describe(layout, walk.counts).data(), size);
  }
  return Reason::kMalformed;
}

/// Checks the counts.  \param limits  the largest value of each count
Reason check_limits(const wire::Layout& layout, std::span<const std::int32_t> counts,
                    std::span<const std::int32_t> limits, std::span<char> text) {
  for (int i = 0; i < layout.num_counts; ++i) {
    const auto at = index(i);
    if (counts[at] <= limits[at]) continue;
    Phrase found{};
    append(found, counts[at], counted_name(layout, i));
    print(text, "the message has %s, but at most %d are allowed", found.data(), limits[at]);
    return Reason::kTooManyPoints;
  }
  return Reason::kAccepted;
}

}  // namespace

void print(std::span<char> text, const char* format, ...) noexcept {
  if (text.empty()) return;
  std::va_list arguments;
  va_start(arguments, format);
  // NOLINTNEXTLINE(clang-analyzer-valist.Uninitialized): clang-tidy 14 does not see va_start
  std::vsnprintf(text.data(), text.size(), format, arguments);
  va_end(arguments);
}

std::optional<Head> read_head(std::span<const std::byte> bytes) noexcept {
  const std::optional<std::int64_t> session = integer_at<std::int64_t>(bytes, kSessionAt);
  const std::optional<std::string_view> sender = string_at(bytes, kSenderAt);
  if (!session || !sender || sender->find('\0') != std::string_view::npos) return std::nullopt;
  const std::int64_t sequence_at = kSenderAt + 4 + static_cast<std::int64_t>(sender->size()) + 1;
  const std::optional<std::int64_t> sequence = integer_at<std::int64_t>(bytes, sequence_at);
  if (!sequence) return std::nullopt;
  return Head{*session, *sender, *sequence};
}

template <class Command>
Reason check_layout(std::span<const std::byte> bytes, std::span<char> text) noexcept {
  constexpr const wire::Layout& kLayout = *layout_of<Command>;
  static_assert(kCountLimits<Command>.size() == kLayout.num_counts, "one limit a count");
  const Reason front = check_front(bytes, Command::getHash(), text);
  if (front != Reason::kAccepted) return front;
  if (!read_head(bytes)) {
    print(text,
          "the %zu bytes end before the sequence number, or the sender is not a single terminated "
          "string",
          bytes.size());
    return Reason::kMalformed;
  }
  const WireWalk walk = walk_message(bytes, kLayout);
  const Reason fit = check_walk(bytes, kLayout, walk, text);
  return fit == Reason::kAccepted ? check_limits(kLayout, walk.counts, kCountLimits<Command>, text) : fit;
}
template Reason check_layout<force_t>(std::span<const std::byte> bytes, std::span<char> text) noexcept;
template Reason check_layout<control_t>(std::span<const std::byte> bytes, std::span<char> text) noexcept;

std::optional<std::int64_t> read_status_session(std::span<const std::byte> bytes) noexcept {
  const EarlierType* const earlier = find_earlier(bytes);
  const bool is_earlier = earlier != nullptr && earlier->name == layout_of<status_t>->name;
  if (!is_earlier && integer_at<std::int64_t>(bytes, 0) != status_t::getHash()) return std::nullopt;
  return integer_at<std::int64_t>(bytes, kSessionAt);
}

bool is_envelope(std::span<const std::byte> bytes) noexcept {
  return bytes.size() <= index(channels::kMaxMessageBytes) &&
         integer_at<std::int64_t>(bytes, 0) == envelope_t::getHash();
}

std::optional<std::span<const std::byte>> find_body(std::span<const std::byte> bytes) noexcept {
  if (!fits_layout(bytes, *layout_of<envelope_t>)) return std::nullopt;
  const std::size_t end = bytes.size() - kTagBytes;
  const std::optional<std::string_view> key_id = string_at(bytes, wire::kFingerprintBytes);
  const std::size_t begin = index(wire::kFingerprintBytes) + 4 + key_id->size() + 1 + std::size_t{3} * 8 + 4;
  return bytes.subspan(begin, end - begin);
}

}  // namespace freeflex::io
