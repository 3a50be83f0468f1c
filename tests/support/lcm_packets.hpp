// Sends UDP packets to an LCM group in forms that no LCM library sends. Header only.
//
// The wire format of LCM 1.3.1 has big-endian numbers. A short message is "LC02", sequence u32, channel with
// its NUL, payload. A fragment is "LC03", sequence u32, message size u32, offset of this fragment u32, number
// of this fragment u16, count of fragments u16, then, in fragment 0 only, the channel with its NUL, then
// bytes of the payload.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace freeflex::testing {

/// Sends from one UDP socket and so from one source address, by which LCM reassembles fragments. Use this
/// class only in a private network.
class PacketSender {
 public:
  explicit PacketSender(const char* group = "239.255.76.67", std::uint16_t port = 7667)
      : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    const unsigned char ttl = 0;
    setsockopt(fd_, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof(ttl));
    to_.sin_family = AF_INET;
    to_.sin_port = htons(port);
    inet_pton(AF_INET, group, &to_.sin_addr);
  }
  ~PacketSender() { close(fd_); }
  PacketSender(const PacketSender&) = delete;
  PacketSender& operator=(const PacketSender&) = delete;

  /// Sends a packet. Returns false if the kernel did not accept all bytes of the packet.
  bool send(std::span<const std::byte> packet) {
    return sendto(fd_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to_),
                  sizeof(to_)) == static_cast<ssize_t>(packet.size());
  }

  /// Sends a well-formed short message.
  bool publish(const std::string& channel, std::span<const std::byte> payload) {
    Packet packet;
    packet.u32(kShort).u32(sequence_++).text(channel).append(payload);
    return send(packet.bytes);
  }

  /// Kills the reader thread of liblcm. The sum of offset and size wraps around 32 bits to less than the
  /// message size, so liblcm accepts the fragment and copies its 32 bytes to 4 GiB past the buffer.
  bool send_wrapping_fragment(const std::string& channel) {
    constexpr std::uint32_t kSize = 32;
    Packet packet;
    packet.u32(kFragment).u32(sequence_++).u32(1000).u32(0xFFFFFFF0u).u16(0).u16(2).text(channel);
    packet.bytes.resize(packet.bytes.size() + kSize);
    return send(packet.bytes);
  }

  /// Kills the reader thread of liblcm. The second packet has 16 bytes, 4 fewer than a fragment header, so
  /// liblcm computes a fragment size of 2^32 - 4, which wraps to 0 when the offset 4 is added. A valid first
  /// fragment is sent before, so that the truncated fragment belongs to a message.
  bool send_fragment_runt(const std::string& channel) {
    Packet first;
    first.u32(kFragment).u32(sequence_).u32(1000).u32(0).u16(0).u16(2).text(channel);
    first.bytes.resize(first.bytes.size() + 100);
    Packet truncated;
    truncated.u32(kFragment).u32(sequence_++).u32(1000).u32(4);
    return send(first.bytes) && send(truncated.bytes);
  }

  /// Sends a short message that ends inside the channel name. Then liblcm reads the rest of the name from old
  /// contents of the buffer, and may report a payload of negative size.
  bool send_cut_channel(const std::string& channel) {
    Packet packet;
    packet.u32(kShort).u32(sequence_++).append(std::as_bytes(std::span(channel.data(), channel.size() / 2)));
    return send(packet.bytes);
  }
  /// Sends a first fragment of `part_size` bytes of a message of `message_size` bytes.
  bool send_first_fragment(const std::string& channel, std::uint32_t message_size, std::size_t part_size) {
    Packet packet;
    packet.u32(kFragment).u32(sequence_++).u32(message_size).u32(0).u16(0).u16(2).text(channel);
    packet.bytes.resize(packet.bytes.size() + part_size);
    return send(packet.bytes);
  }

 private:
  static constexpr std::uint32_t kShort = 0x4c433032;     // "LC02"
  static constexpr std::uint32_t kFragment = 0x4c433033;  // "LC03"

  struct Packet {
    std::vector<std::byte> bytes;
    Packet& u16(std::uint16_t value) {
      bytes.push_back(static_cast<std::byte>(value >> 8));
      bytes.push_back(static_cast<std::byte>(value & 0xFFu));
      return *this;
    }
    Packet& u32(std::uint32_t value) {
      return u16(static_cast<std::uint16_t>(value >> 16)).u16(static_cast<std::uint16_t>(value & 0xFFFFu));
    }
    Packet& text(const std::string& value) {
      append(std::as_bytes(std::span(value.c_str(), value.size() + 1)));
      return *this;
    }
    void append(std::span<const std::byte> more) { bytes.insert(bytes.end(), more.begin(), more.end()); }
  };

  int fd_;
  sockaddr_in to_{};
  std::uint32_t sequence_ = 0;
};

}  // namespace freeflex::testing
