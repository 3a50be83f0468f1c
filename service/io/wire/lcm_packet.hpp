// A UDP packet of LCM 1.3, taken apart and put together without liblcm.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace freeflex::service {

/// What a packet says. Views of its bytes.
struct LcmPacket {
  std::string_view channel;            // 1 to 63 characters
  std::span<const std::byte> payload;  // empty for a fragment
  bool is_fragment = false;            // the first of a message of more than 65,499 bytes
};

/// On the wire, big-endian: a short message is "LC02", sequence u32, channel with its NUL, payload. A
/// fragment is "LC03", sequence u32, message size u32, offset u32, number u16, count u16, then in number 0
/// the channel with its NUL and bytes of the payload. Empty when the bytes are neither, and for fragments
/// after the first: no command is so long, so none is put together again. Looks at these bytes alone, keeps
/// nothing from one packet to the next, allocates nothing.
std::optional<LcmPacket> read_lcm_packet(std::span<const std::byte> packet) noexcept;

/// A short message as it goes out. Empty when it does not fit one datagram, or the channel is no name of 1 to
/// 63 characters.
std::vector<std::byte> make_lcm_packet(std::string_view channel, std::span<const std::byte> payload,
                                       std::uint32_t sequence);

/// Where the channel begins, of a short message and of a first fragment.
inline constexpr std::size_t kShortHeader = 8, kFragmentHeader = 20;  // [B]
inline constexpr std::string_view kShortMark = "LC02", kFragmentMark = "LC03";

}  // namespace freeflex::service
