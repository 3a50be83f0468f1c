#include "service/bus.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace freeflex::service {

Bus::Bus(const std::string& url, std::string prefix)
    : lcm_(lcm_create(url.c_str())), prefix_(std::move(prefix)) {
  if (!lcm_)
    throw std::runtime_error(fmt::format("LCM does not start on '{}'; check the URL and the network", url));
}

void Bus::send(const char* suffix, std::span<const std::byte> bytes) {
  channel_ = prefix_;
  channel_ += suffix;
  if (lcm_publish(lcm_.get(), channel_.c_str(), bytes.data(), static_cast<unsigned>(bytes.size())) != 0)
    ++num_failed_;
}

}  // namespace freeflex::service
