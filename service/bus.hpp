// Publishes messages over LCM. A Bus never subscribes, because only the ingress process parses packets from
// the network.
#pragma once

#include <lcm/lcm.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace freeflex::service {

/// One connection that publishes. Used by one thread.
class Bus {
 public:
  /// Throws std::runtime_error if liblcm refuses the url.
  Bus(const std::string& url, std::string prefix);

  /// Sends the bytes on the channel whose name is prefix + suffix. Counts a failed send and does not throw,
  /// because the network may recover.
  void send(const char* suffix, std::span<const std::byte> bytes);
  std::int64_t num_failed() const { return num_failed_; }

 private:
  struct Destroy {
    void operator()(lcm_t* lcm) const { lcm_destroy(lcm); }
  };
  std::unique_ptr<lcm_t, Destroy> lcm_;
  std::string prefix_;
  std::string channel_;
  std::int64_t num_failed_ = 0;
};

}  // namespace freeflex::service
