// Reads and makes UDP packets of LCM 1.3 without liblcm.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace freeflex::service {

/// Contents of a packet, as views into its bytes.
struct LcmPacket {
  std::string_view channel;            // 1 to 63 characters
  std::span<const std::byte> payload;  // empty for a fragment
  bool is_fragment = false;            // true: first fragment of a message that does not fit one packet
};

/// Reads a packet. All numbers are big-endian on the wire. A short message is "LC02", sequence u32, channel
/// with its NUL, payload. A fragment is "LC03", sequence u32, message size u32, offset u32, number u16, count
/// u16 and bytes of the payload. In fragment number 0 the channel with its NUL precedes the payload. Returns
/// nullopt if the bytes are neither a short message nor a first fragment. Fragments are not reassembled,
/// because no command is that long. Reads only these bytes, keeps no state between packets and allocates
/// nothing.
std::optional<LcmPacket> read_lcm_packet(std::span<const std::byte> packet) noexcept;

/// Returns the packet of a short message, or an empty list if channel, NUL and payload have more than 65,499
/// bytes together, or if the channel name does not have 1 to 63 characters other than NUL.
std::vector<std::byte> make_lcm_packet(std::string_view channel, std::span<const std::byte> payload,
                                       std::uint32_t sequence);

/// Offset at which the channel begins in a short message, and in a first fragment.
inline constexpr std::size_t kShortHeader = 8, kFragmentHeader = 20;  // [B]
inline constexpr std::string_view kShortMark = "LC02", kFragmentMark = "LC03";

}  // namespace freeflex::service
