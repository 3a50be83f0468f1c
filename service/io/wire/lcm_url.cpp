#include "service/io/wire/lcm_url.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>

namespace freeflex::service {

namespace {

constexpr std::string_view kScheme = "udpm://";
constexpr std::string_view kDefaultAddress = "239.255.76.67:7667";

/// Parses a text that is exactly one whole number from least to most.
std::optional<int> read_number(std::string_view text, int least, int most) {
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size() || number < least || number > most) return {};
  return number;
}

struct Parts {
  std::string_view address;  // ADDRESS:PORT
  std::string_view options;  // the text after the question mark
};
Parts split(std::string_view url) {
  url.remove_prefix(kScheme.size());
  const std::size_t mark = url.find('?');
  Parts parts{url.substr(0, mark), mark == url.npos ? std::string_view{} : url.substr(mark + 1)};
  if (parts.address.empty()) parts.address = kDefaultAddress;
  return parts;
}

/// Returns the group and the port of "GROUP:PORT", or nullopt if the text is not a multicast address and a
/// port.
std::optional<sockaddr_in> read_address(std::string_view address) {
  const std::size_t colon = address.rfind(':');
  if (colon == address.npos) return {};
  const std::optional<int> port = read_number(address.substr(colon + 1), 1, 65535);
  sockaddr_in group{};
  group.sin_family = AF_INET;
  const std::string host(address.substr(0, colon));
  if (!port || inet_pton(AF_INET, host.c_str(), &group.sin_addr) != 1) return {};
  if (!IN_MULTICAST(ntohl(group.sin_addr.s_addr))) return {};
  group.sin_port = htons(static_cast<std::uint16_t>(*port));
  return group;
}

/// Returns the first invalid option, or an empty text if all are valid.
std::string_view find_bad_option(std::string_view options) {
  while (!options.empty()) {
    const std::string_view option = options.substr(0, options.find('&'));
    options.remove_prefix(std::min(options.size(), option.size() + 1));
    const std::size_t equals = option.find('=');
    const std::string_view name = option.substr(0, equals);
    const std::string_view value = equals == option.npos ? std::string_view{} : option.substr(equals + 1);
    const bool is_right = (name == "ttl" && read_number(value, 0, 255)) ||
                          (name == "recv_buf_size" && read_number(value, 1, std::numeric_limits<int>::max()));
    if (!is_right) return option.empty() ? "&" : option;
  }
  return {};
}

std::string describe(const sockaddr_in& group) {
  char text[INET_ADDRSTRLEN];
  inet_ntop(AF_INET, &group.sin_addr, text, sizeof text);
  return text;
}

/// Makes a datagram socket that shares its port and calls connect or bind on it. Returns 0 or errno.
template <class Call>
int try_on_socket(Call call, const sockaddr_in& address) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return errno;
  const int on = 1;
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  setsockopt(fd, SOL_SOCKET, SO_REUSEPORT, &on, sizeof on);
  const int error = call(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ? 0 : errno;
  close(fd);
  return error;
}

}  // namespace

bool is_channel_prefix(std::string_view prefix) {
  const auto is_allowed = [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  return !prefix.empty() && prefix.size() <= 32 && std::all_of(prefix.begin(), prefix.end(), is_allowed);
}

std::string choose_url(const std::string& given) {
  if (!given.empty()) return given;
  const char* const environment = std::getenv("LCM_DEFAULT_URL");
  return environment != nullptr && *environment != '\0' ? environment : kDefaultUrl;
}

std::string effective_url(const std::string& url) { return url.empty() ? kDefaultUrl : url; }

std::string check_lcm_url(const std::string& url) {
  if (url.empty()) return {};
  const std::string found = "LCM URL '" + url + "' ";
  if (url.starts_with("memq://") || url.starts_with("file://"))
    return found + "stays inside one process, but the daemon receives in another process; use udpm://";
  if (!url.starts_with(kScheme))
    return found + "must be udpm://ADDRESS:PORT?ttl=N with a multicast address, 224.0.0.0 to 239.255.255.255";
  if (url.size() > kMaxUrlSize)
    return found + "is too long; it may have at most " + std::to_string(kMaxUrlSize) + " characters";
  const Parts parts = split(url);
  if (!read_address(parts.address)) {
    return found + "has the address '" + std::string(parts.address) +
           "', which must be ADDRESS:PORT with a multicast address, 224.0.0.0 to 239.255.255.255, and a "
           "port, 1 to 65535";
  }
  if (const std::string_view bad = find_bad_option(parts.options); !bad.empty()) {
    return found + "has the option '" + std::string(bad) +
           "', which must be ttl=0 to 255 or recv_buf_size=BYTES";
  }
  return {};
}

LcmAddress read_lcm_url(const std::string& url) {
  assert(check_lcm_url(url).empty());
  const std::string checked = effective_url(url);
  const Parts parts = split(checked);
  const sockaddr_in group = *read_address(parts.address);
  LcmAddress address{group.sin_addr.s_addr, ntohs(group.sin_port), 0, 0};
  constexpr std::string_view kSize = "recv_buf_size=", kTtl = "ttl=";
  for (std::size_t at = 0; at < parts.options.size();) {
    const std::string_view option = parts.options.substr(at, parts.options.find('&', at) - at);
    if (option.starts_with(kSize))
      address.receive_buffer =
          read_number(option.substr(kSize.size()), 1, std::numeric_limits<int>::max()).value_or(0);
    if (option.starts_with(kTtl)) address.ttl = read_number(option.substr(kTtl.size()), 0, 255).value_or(0);
    at += option.size() + 1;
  }
  return address;
}

std::string find_network_fault(const std::string& url) {
  assert(check_lcm_url(url).empty());
  const std::string checked = effective_url(url);
  const sockaddr_in group = *read_address(split(checked).address);
  // the call of connect sends no packet: for a datagram socket it only queries the routing table
  if (const int error = try_on_socket(connect, group); error != 0) {
    return "there is no route for multicast to " + describe(group) + ": " + std::strerror(error) +
           ". To use LCM on this machine alone, run\n"
           "  sudo ip link set lo up multicast on\n"
           "  sudo ip route add 239.0.0.0/8 dev lo";
  }
  sockaddr_in here = group;
  here.sin_addr.s_addr = htonl(INADDR_ANY);
  if (const int error = try_on_socket(bind, here); error != 0) {
    const std::string port = std::to_string(ntohs(group.sin_port));
    return "LCM cannot receive on UDP port " + port + ": " + std::strerror(error) +
           (error == EADDRINUSE ? ". A program that does not share the port uses it ('ss -ulpn sport = :" +
                                      port + "' names it); end it, or give another --lcm-url"
                                : "");
  }
  return {};
}

}  // namespace freeflex::service
