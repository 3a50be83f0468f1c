#include "service/io/wire/versions.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "service/io/wire/wire_walk.hpp"

namespace freeflex::io {
namespace {

/// Types that have changed since; the others (ack_t, control_t, loads_t, shapes_t) are as they were.
constexpr std::array<EarlierType, 6> kEarlier{{{"scene_t", std::int64_t(0xccd8d906fd8c6806), "0.3"},
                                               {"force_t", 0x5eb2bea23d54be04, "0.3"},
                                               {"applied_t", 0x5956be7a5b12adf3, "0.3"},
                                               {"state_t", 0x61063d95b061afa7, "0.3"},
                                               {"points_t", std::int64_t(0xc3196a3aa064d0fa), "0.3"},
                                               {"status_t", std::int64_t(0xa207cd30e391dc9c), "0.3"}}};

}  // namespace

const EarlierType* find_earlier(std::span<const std::byte> bytes) noexcept {
  const std::optional<std::int64_t> fingerprint = integer_at<std::int64_t>(bytes, 0);
  const auto found = std::find_if(kEarlier.begin(), kEarlier.end(),
                                  [&](const EarlierType& type) { return type.fingerprint == fingerprint; });
  return found == kEarlier.end() ? nullptr : &*found;
}

std::string explain_unread(std::span<const std::byte> bytes) {
  const EarlierType* const earlier = find_earlier(bytes);
  if (earlier == nullptr) return "damaged, or of a version that is not known here";
  return std::string("sent by version ") + earlier->version + " of the messages, this is " + kMessagesVersion;
}

}  // namespace freeflex::io
