#include "service/bus_connection.hpp"

#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>

#include "core/index.hpp"
#include "service/io/wire/lcm_packet.hpp"
#include "service/io/wire/lcm_url.hpp"

namespace freeflex::service {
namespace {

constexpr std::size_t kMaxDatagram = 65536;              // [B]
constexpr std::string_view kSelfTest = "LCM_SELF_TEST";  // liblcm and BusSocket test reception on this
                                                         // channel

std::int64_t wall_clock_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace

BusConnection::BusConnection() : buffer_(kMaxDatagram) {}

std::string BusConnection::open(const std::string& url, std::chrono::milliseconds timeout) {
  assert(check_lcm_url(url).empty());
  url_ = url;
  std::string fault = socket_.open(url, "", timeout);
  if (!fault.empty()) return fault;
  const auto ttl = static_cast<unsigned char>(read_lcm_url(url).ttl);
  setsockopt(socket_.fd(), IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
  return {};
}

std::optional<BusMessage> BusConnection::receive(std::chrono::milliseconds time) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + time;
  while (true) {
    const ReceivedPacket packet = receive_packet(socket_.fd(), buffer_, MSG_DONTWAIT);
    if (packet.size >= 0) {
      const std::span<const std::byte> bytes(buffer_.data(), index(packet.size));
      const std::optional<LcmPacket> message = read_lcm_packet(bytes);
      if (message && !message->is_fragment && message->channel != kSelfTest)
        return BusMessage{message->channel, message->payload,
                          packet.utime > 0 ? packet.utime : wall_clock_us()};
      if (!message || message->is_fragment) ++num_ignored_;
    }
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
    if (left.count() <= 0) return std::nullopt;
    if (packet.size >= 0) continue;
    pollfd readable{socket_.fd(), POLLIN, 0};
    // a signal ends the wait, so that the caller can check whether to stop
    if (poll(&readable, 1, static_cast<int>(left.count())) < 0) return std::nullopt;
  }
}

bool BusConnection::publish(std::string_view channel, std::span<const std::byte> bytes) {
  const std::vector<std::byte> packet = make_lcm_packet(channel, bytes, sequence_++);
  if (packet.empty()) return false;
  const LcmAddress address = read_lcm_url(url_);
  sockaddr_in group{};
  group.sin_family = AF_INET;
  group.sin_port = htons(address.port);
  group.sin_addr.s_addr = address.group;
  return sendto(socket_.fd(), packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&group),
                sizeof group) == static_cast<ssize_t>(packet.size());
}

}  // namespace freeflex::service
