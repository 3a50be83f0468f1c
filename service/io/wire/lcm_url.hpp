// The bus's address: what a URL may say, and whether this machine can receive on it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace freeflex::service {

/// LCM's own default.
inline constexpr const char* kDefaultUrl = "udpm://239.255.76.67:7667?ttl=0";
inline constexpr std::size_t kMaxUrlSize = 220;  // [B]

/// True for what may be the first part of channel names.
bool is_channel_prefix(std::string_view prefix);
inline constexpr const char* kPrefixAllowed = "1 to 32 of A-Z a-z 0-9 _ -";

/// The given one, else that of LCM_DEFAULT_URL, else kDefaultUrl.
std::string choose_url(const std::string& given);

/// url, or kDefaultUrl for "".
std::string effective_url(const std::string& url);

/// Empty when url is udpm://ADDRESS:PORT with ttl and recv_buf_size as options, or "udpm://" alone or "" for
/// LCM's default; else what was found and what is allowed. Stricter than liblcm, which waits ten seconds for
/// an answer from port 0 and takes what it cannot read for its own default.
std::string check_lcm_url(const std::string& url);

/// What a URL says.
struct LcmAddress {
  std::uint32_t group = 0;  // network byte order
  std::uint16_t port = 0;
  int receive_buffer = 0;  // [B] recv_buf_size; 0: not given
  int ttl = 0;             // networks that what is sent may cross; 0: it stays on this machine
};
/// \pre check_lcm_url(url) is empty
LcmAddress read_lcm_url(const std::string& url);

/// Empty when a packet for the url's group has a way out and its port can be shared; else what is missing and
/// what mends it. Asks the routing table, binds the port for a moment and sends nothing.
/// \pre check_lcm_url(url) is empty
std::string find_network_fault(const std::string& url);

}  // namespace freeflex::service
