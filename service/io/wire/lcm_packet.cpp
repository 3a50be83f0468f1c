#include "service/io/wire/lcm_packet.hpp"

namespace freeflex::service {

namespace {
constexpr std::size_t kMaxChannel = 63;      // LCM_MAX_CHANNEL_NAME_LENGTH
constexpr std::size_t kFragmentNumber = 16;  // [B] offset of the fragment's number
constexpr std::size_t kMaxShort = 65499;     // [B] channel, NUL and payload: LCM_SHORT_MESSAGE_MAX_SIZE
}  // namespace

std::optional<LcmPacket> read_lcm_packet(std::span<const std::byte> packet) noexcept {
  const std::string_view text(reinterpret_cast<const char*>(packet.data()), packet.size());
  const bool is_fragment = text.starts_with(kFragmentMark);
  if (!is_fragment && !text.starts_with(kShortMark)) return {};
  const std::size_t begin = is_fragment ? kFragmentHeader : kShortHeader;
  if (text.size() <= begin) return {};
  if (is_fragment && (text[kFragmentNumber] != 0 || text[kFragmentNumber + 1] != 0)) return {};
  // the name must end inside the packet
  const std::string_view rest = text.substr(begin, kMaxChannel + 1);
  const std::size_t length = rest.find('\0');
  if (length == rest.npos || length == 0) return {};
  LcmPacket found{rest.substr(0, length), {}, is_fragment};
  if (!is_fragment) found.payload = packet.subspan(begin + length + 1);
  return found;
}

std::vector<std::byte> make_lcm_packet(std::string_view channel, std::span<const std::byte> payload,
                                       std::uint32_t sequence) {
  std::vector<std::byte> packet;
  if (channel.empty() || channel.size() > kMaxChannel || channel.find('\0') != channel.npos) return packet;
  if (channel.size() + 1 + payload.size() > kMaxShort) return packet;
  packet.reserve(kShortHeader + channel.size() + 1 + payload.size());
  for (const char c : kShortMark) packet.push_back(static_cast<std::byte>(c));
  for (int shift = 24; shift >= 0; shift -= 8) packet.push_back(static_cast<std::byte>(sequence >> shift));
  for (const char c : channel) packet.push_back(static_cast<std::byte>(c));
  packet.push_back(std::byte{0});
  packet.insert(packet.end(), payload.begin(), payload.end());
  return packet;
}

}  // namespace freeflex::service
