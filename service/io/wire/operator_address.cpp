#include "service/io/wire/operator_address.hpp"

#include <unistd.h>

#include <cstdlib>
#include <cstring>

namespace freeflex::service {

std::string operator_socket_path(const std::string& prefix) {
  const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
  if (runtime != nullptr && runtime[0] == '/') return std::string(runtime) + "/freeflexd-" + prefix + ".sock";
  return "/tmp/freeflexd-" + std::to_string(geteuid()) + "/" + prefix + ".sock";
}

std::optional<sockaddr_un> unix_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) return {};
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  return address;
}

}  // namespace freeflex::service
