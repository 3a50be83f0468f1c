#include "service/io/wire/codec_wire.hpp"

#include <cstdarg>
#include <cstdio>
#include <cstring>

#include "core/step/command.hpp"
#include "freeflex_msgs/control_t.hpp"
#include "freeflex_msgs/force_t.hpp"
#include "freeflex_msgs/status_t.hpp"
#include "messages/channels.hpp"
#include "service/io/wire/codec.hpp"

namespace freeflex::io {
namespace {

// encoded sizes [B], LCM being packed and big-endian
constexpr std::size_t kForceAfterHead = 4 + 4 + 8 + 4 + 8 + 8;  // slot to lease_ticks
constexpr std::size_t kCounts = 4 + 4;
constexpr std::size_t kControlAfterHead = 4 + 8;  // command, count
constexpr std::int64_t kPointForceSize = 4 + 3 * 8;
constexpr std::int64_t kWrenchSize = 4 + 6 * 8;

/// Reads forward through a span and never past its end.
class Walker {
 public:
  explicit Walker(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <class Integer>
  bool read(Integer& value) {
    if (bytes_.size() - at_ < sizeof(Integer)) return false;
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < sizeof(Integer); ++i) {
      bits = bits << 8 | std::to_integer<std::uint64_t>(bytes_[at_ + i]);
    }
    value = static_cast<Integer>(bits);
    at_ += sizeof(Integer);
    return true;
  }

  /// A length that counts the terminator, characters, the only NUL last.
  bool read(std::string_view& value) {
    std::int32_t length = 0;
    if (!read(length) || length < 1) return false;
    const auto size = static_cast<std::size_t>(length);
    if (bytes_.size() - at_ < size) return false;
    const char* first = reinterpret_cast<const char*>(bytes_.data()) + at_;
    if (std::memchr(first, '\0', size) != first + size - 1) return false;
    value = {first, size - 1};
    at_ += size;
    return true;
  }

  std::size_t at() const { return at_; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
};

/// Fingerprint and total size: what both commands share.
Reason check_envelope(std::span<const std::byte> bytes, std::int64_t fingerprint, std::span<char> text) {
  // first, because of an oversized message nothing may be read: its length may be untrue
  if (bytes.size() > static_cast<std::size_t>(channels::kMaxMessageBytes)) {
    print(text, "more than %d bytes", channels::kMaxMessageBytes);
    return Reason::kMalformed;
  }
  std::int64_t found = 0;
  if (!Walker(bytes).read(found)) {
    print(text, "%zu bytes: too short for the fingerprint of a message", bytes.size());
    return Reason::kMalformed;
  }
  if (found != fingerprint) {
    print(text, "fingerprint %016llx: another type or version of the protocol, must be %016llx",
          static_cast<unsigned long long>(found), static_cast<unsigned long long>(fingerprint));
    return Reason::kWrongType;
  }
  return Reason::kAccepted;
}

Reason report_bad_head(std::span<const std::byte> bytes, std::span<char> text) {
  print(text, "%zu bytes: ends before the sequence, or the sender is not one terminated string",
        bytes.size());
  return Reason::kMalformed;
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
  Walker walker(bytes);
  Head head;
  std::int64_t fingerprint = 0;
  std::int64_t utime = 0;
  if (!walker.read(fingerprint) || !walker.read(utime) || !walker.read(head.session) ||
      !walker.read(head.sender) || !walker.read(head.sequence)) {
    return std::nullopt;
  }
  head.size = walker.at();
  return head;
}

Reason check_force_layout(std::span<const std::byte> bytes, std::span<char> text) noexcept {
  const Reason envelope = check_envelope(bytes, freeflex_msgs::force_t::getHash(), text);
  if (envelope != Reason::kAccepted) return envelope;
  const std::optional<Head> head = read_head(bytes);
  if (!head) return report_bad_head(bytes, text);
  const std::size_t fixed = head->size + kForceAfterHead + kCounts;
  if (bytes.size() < fixed) {
    print(text, "%zu bytes: ends before the counts, which need %zu", bytes.size(), fixed);
    return Reason::kMalformed;
  }
  Walker counts(bytes.subspan(head->size + kForceAfterHead));
  std::int32_t num_forces = 0;
  std::int32_t num_wrenches = 0;
  counts.read(num_forces);
  counts.read(num_wrenches);
  if (num_forces < 0 || num_wrenches < 0) {
    print(text, "%d forces and %d wrenches: a count is negative", num_forces, num_wrenches);
    return Reason::kMalformed;
  }
  // in 64 bits no pair of 32-bit counts overflows
  const std::int64_t implied =
      static_cast<std::int64_t>(fixed) + num_forces * kPointForceSize + num_wrenches * kWrenchSize;
  if (static_cast<std::int64_t>(bytes.size()) != implied) {
    print(text, "%zu bytes, but %d forces and %d wrenches make %lld", bytes.size(), num_forces, num_wrenches,
          static_cast<long long>(implied));
    return Reason::kMalformed;
  }
  if (num_forces > kMaxCommandPoints || num_wrenches > kMaxCommandWrenches) {
    print(text, "%d forces and %d wrenches, must be at most %d and %d", num_forces, num_wrenches,
          kMaxCommandPoints, kMaxCommandWrenches);
    return Reason::kTooManyPoints;
  }
  return Reason::kAccepted;
}

Reason check_control_layout(std::span<const std::byte> bytes, std::span<char> text) noexcept {
  const Reason envelope = check_envelope(bytes, freeflex_msgs::control_t::getHash(), text);
  if (envelope != Reason::kAccepted) return envelope;
  const std::optional<Head> head = read_head(bytes);
  if (!head) return report_bad_head(bytes, text);
  if (bytes.size() != head->size + kControlAfterHead) {
    print(text, "%zu bytes, must be %zu", bytes.size(), head->size + kControlAfterHead);
    return Reason::kMalformed;
  }
  return Reason::kAccepted;
}

Reason wire_check_force(std::span<const std::byte> bytes) noexcept { return check_force_layout(bytes, {}); }

Reason wire_check_control(std::span<const std::byte> bytes) noexcept {
  return check_control_layout(bytes, {});
}

std::optional<std::int64_t> read_status_session(std::span<const std::byte> bytes) noexcept {
  Walker walker(bytes);
  std::int64_t fingerprint = 0;
  std::int64_t utime = 0;
  std::int64_t session = 0;
  if (!walker.read(fingerprint) || fingerprint != freeflex_msgs::status_t::getHash() || !walker.read(utime) ||
      !walker.read(session)) {
    return std::nullopt;
  }
  return session;
}

}  // namespace freeflex::io
