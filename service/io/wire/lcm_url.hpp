// Checks the URL of the bus, and whether this machine can receive on that address.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace freeflex::service {

/// LCM's default URL.
inline constexpr const char* kDefaultUrl = "udpm://239.255.76.67:7667?ttl=0";
inline constexpr std::size_t kMaxUrlSize = 220;  // [B]

/// Returns true if the text may be the first part of channel names.
bool is_channel_prefix(std::string_view prefix);
inline constexpr const char* kPrefixAllowed = "1 to 32 of A-Z a-z 0-9 _ -";

/// Returns the given URL if it is not empty, else LCM_DEFAULT_URL, else kDefaultUrl.
std::string choose_url(const std::string& given);

/// Returns url, or kDefaultUrl if url is empty.
std::string effective_url(const std::string& url);

/// Returns an empty string if url is udpm://ADDRESS:PORT, optionally with ttl and recv_buf_size, or if url is
/// "udpm://" or "", which mean LCM's default. Else returns what was found and what is allowed. The check is
/// stricter than liblcm's, which waits ten seconds for an answer from port 0 and replaces unreadable parts by
/// defaults.
std::string check_lcm_url(const std::string& url);

/// Contents of a URL.
struct LcmAddress {
  std::uint32_t group = 0;  // network byte order
  std::uint16_t port = 0;
  int receive_buffer = 0;  // [B] recv_buf_size, 0 if not given
  int ttl = 0;             // number of networks that packets may cross; 0: they stay on this machine
};
/// Reads a URL.  \pre check_lcm_url(url) is empty
LcmAddress read_lcm_url(const std::string& url);

/// Returns an empty string if there is a route to the url's group and the port can be shared. Otherwise
/// returns the fault and its remedy. Queries the routing table, binds the port for a moment and sends
/// nothing.
/// \pre check_lcm_url(url) is empty
std::string find_network_fault(const std::string& url);

}  // namespace freeflex::service
