#include "service/io/wire/versions.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "freeflex_msgs/wire_layouts.hpp"
#include "service/io/wire/wire_walk.hpp"

namespace freeflex::io {
namespace {

constexpr std::int64_t signed_of(std::uint64_t fingerprint) { return static_cast<std::int64_t>(fingerprint); }

/// All message types of version 0.4, and those of version 0.3 whose fingerprints differ from version 0.4.
constexpr std::array<EarlierType, 17> kEarlier{{{"scene_t", signed_of(0xccd8d906fd8c6806), "0.3"},
                                                {"force_t", signed_of(0x5eb2bea23d54be04), "0.3"},
                                                {"applied_t", signed_of(0x5956be7a5b12adf3), "0.3"},
                                                {"state_t", signed_of(0x61063d95b061afa7), "0.3"},
                                                {"points_t", signed_of(0xc3196a3aa064d0fa), "0.3"},
                                                {"status_t", signed_of(0xa207cd30e391dc9c), "0.3"},
                                                {"ack_t", signed_of(0xe3a93249e57edfb6), "0.4"},
                                                {"applied_t", signed_of(0xf83622f2d1facb53), "0.4"},
                                                {"control_t", signed_of(0x51aca0044b8a4ed6), "0.4"},
                                                {"envelope_t", signed_of(0xee0a1048c367da2d), "0.4"},
                                                {"force_t", signed_of(0xae2270de78c8ccb4), "0.4"},
                                                {"loads_t", signed_of(0x3e5b94ade0df009c), "0.4"},
                                                {"points_t", signed_of(0xebfd77b26067da76), "0.4"},
                                                {"scene_t", signed_of(0xa557f686a425475a), "0.4"},
                                                {"shapes_t", signed_of(0x632f06b27f4209bb), "0.4"},
                                                {"state_t", signed_of(0x63044e976c7680aa), "0.4"},
                                                {"status_t", signed_of(0x4510492c6aeb2ba5), "0.4"}}};

template <class... Messages>
struct Fingerprints {
  /// Returns true if a message type of this version has the fingerprint, even if a type of an earlier version
  /// has it too.
  static bool contain(std::int64_t fingerprint) noexcept {
    return ((fingerprint == Messages::getHash()) || ...);
  }
};

}  // namespace

const char* const kMessagesVersion = FREEFLEX_MESSAGES_VERSION;

const EarlierType* find_earlier(std::span<const std::byte> bytes) noexcept {
  const std::optional<std::int64_t> fingerprint = integer_at<std::int64_t>(bytes, 0);
  const auto found = std::find_if(kEarlier.begin(), kEarlier.end(),
                                  [&](const EarlierType& type) { return type.fingerprint == fingerprint; });
  const bool is_earlier =
      found != kEarlier.end() && !wire::EachType<Fingerprints>::contain(found->fingerprint);
  return is_earlier ? &*found : nullptr;
}

std::string explain_unread(std::span<const std::byte> bytes) {
  const EarlierType* const earlier = find_earlier(bytes);
  if (earlier == nullptr) return "damaged, or of a version that is not known here";
  return std::string("of version ") + earlier->version + " of the messages, but this program reads version " +
         kMessagesVersion;
}

}  // namespace freeflex::io
