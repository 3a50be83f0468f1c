#include "tools/bus/operator_link.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "messages/channels.hpp"
#include "service/io/wire/operator_address.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {

OperatorLink::OperatorLink(const service::OperatorPlaces& places) : buffer_(channels::kMaxMessageBytes) {
  std::string faults;
  for (const std::string& path : places.paths) {
    const auto address = service::unix_address(path);
    fd_ = address ? socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0) : -1;
    if (fd_ >= 0 && connect(fd_, reinterpret_cast<const sockaddr*>(&*address), sizeof *address) == 0) {
      path_ = path;
      return;
    }
    faults += (faults.empty() ? "there is no daemon at " : ", nor at ") + path + ": " +
              (address ? std::strerror(errno) : "the path is longer than 107 characters");
    if (fd_ >= 0) close(fd_);
    fd_ = -1;
  }
  error_ = (faults.empty() ? "there is no folder in which a daemon of this user could listen" : faults) +
           (places.faults.empty() ? "" : "\nUnsuitable folders: " + places.faults) +
           "\nIs freeflexd running as this user, with the same --prefix or --socket?";
}

OperatorLink::~OperatorLink() {
  if (fd_ >= 0) close(fd_);
}

bool OperatorLink::send(std::span<const std::byte> bytes) {
  return ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
}

bool OperatorLink::wait(std::chrono::milliseconds time, const std::function<bool()>& done,
                        const Handler& handler) {
  const auto end = std::chrono::steady_clock::now() + time;
  while (!done()) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    if (left.count() <= 0 || is_interrupted()) return false;
    // the waits are short, so that an interrupt is noticed
    pollfd readable{fd_, POLLIN, 0};
    if (poll(&readable, 1, static_cast<int>(std::min<std::int64_t>(left.count(), 100))) <= 0) continue;
    const ssize_t size = recv(fd_, buffer_.data(), buffer_.size(), MSG_DONTWAIT);
    if (size == 0 || (size < 0 && errno != EAGAIN && errno != EINTR)) return done();
    if (size > 0) handler(std::span(buffer_).first(index(size)));
  }
  return true;
}

}  // namespace freeflex::tools
