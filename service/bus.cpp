#include "service/bus.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string_view>

namespace freeflex::service {

namespace {

constexpr std::string_view kScheme = "udpm://";

/// Address of udpm://ADDRESS:PORT?options; LCM's default when left out.
std::string group_address(std::string_view url) {
  url.remove_prefix(kScheme.size());
  url = url.substr(0, url.find_first_of(":?"));
  return url.empty() ? "239.255.76.67" : std::string(url);
}

}  // namespace

std::string choose_url(const std::string& given) {
  if (!given.empty()) return given;
  const char* const environment = std::getenv("LCM_DEFAULT_URL");
  return environment != nullptr && *environment != '\0' ? environment : kDefaultUrl;
}

std::string find_route_fault(const std::string& url) {
  const std::string group = group_address(url);
  sockaddr_in destination{};
  destination.sin_family = AF_INET;
  destination.sin_port = htons(7);  // any: a route leads to an address
  if (inet_pton(AF_INET, group.c_str(), &destination.sin_addr) != 1 ||
      !IN_MULTICAST(ntohl(destination.sin_addr.s_addr))) {
    return fmt::format("LCM url '{}': '{}' is no multicast address, 224.0.0.0 to 239.255.255.255", url,
                       group);
  }
  const int socket_fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket_fd < 0) return fmt::format("no UDP socket: {}", std::strerror(errno));
  // connecting a datagram socket sends nothing: it only asks the routing table
  const int result = connect(socket_fd, reinterpret_cast<const sockaddr*>(&destination), sizeof destination);
  const int error = errno;
  close(socket_fd);
  if (result == 0) return {};
  return fmt::format(
      "no route for multicast to {}: {}. To use LCM on this machine alone, run\n"
      "  sudo ip link set lo up multicast on\n"
      "  sudo ip route add 239.0.0.0/8 dev lo",
      group, std::strerror(error));
}

Bus::Bus(const std::string& url, std::string prefix)
    : lcm_(lcm_create(url.c_str())), prefix_(std::move(prefix)) {
  if (!lcm_) throw std::runtime_error(fmt::format("LCM does not start on '{}'", url));
}

void Bus::send(const char* suffix, std::span<const std::byte> bytes) {
  channel_ = prefix_;
  channel_ += suffix;
  if (lcm_publish(lcm_.get(), channel_.c_str(), bytes.data(), static_cast<unsigned>(bytes.size())) != 0)
    ++num_failed_;
}

}  // namespace freeflex::service
