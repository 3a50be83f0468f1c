// The rig is a packet handler and a verifier without a network. The input is messages as bytes, and the
// output is commands.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "service/packet_handler.hpp"
#include "service/verifier.hpp"
#include "tests/messages/commands.hpp"

namespace freeflex::testing {

inline const std::string kForceChannel = "TEST_FORCE", kControlChannel = "TEST_CONTROL";

/// Returns a key without limits. The secret of the key is derived from the id of the key.
service::Key make_key(const std::string& id);

/// Return make_force() and make_control() with a sequence number, as the holder of a key sends them.
freeflex_msgs::force_t force_of(std::int64_t sequence);
freeflex_msgs::control_t control_of(std::int64_t sequence);

struct VerifierRig {
  /// The verifier uses the names of make_names(), kSession and the prefix TEST.
  explicit VerifierRig(std::vector<service::Key> keys);

  /// Passes a message on FORCE or CONTROL to the packet handler and then to the verifier.
  void deliver(std::span<const std::byte> bytes, bool is_force = true);
  void seal_and_deliver(const freeflex_msgs::force_t& force, const service::Key& key);
  void seal_and_deliver(const freeflex_msgs::control_t& control, const service::Key& key);
  /// Returns the time [us] that is one second after the time of the rig.
  std::int64_t valid_until() const { return time.wall_us + 1'000'000; }

  /// Returns the next command that was accepted, or nullopt.
  std::optional<service::InboundEntry> next_command();
  /// Returns the next answer to a rejection. The reason in the answer is kAccepted if there is no answer.
  io::Admission next_answer();
  std::int64_t count(io::Reason reason) const;

  service::Verifier::Time time{1'700'000'000'000'000, 5'000'000'000};
  std::unique_ptr<service::SharedBlock> ingress = std::make_unique<service::SharedBlock>();
  std::unique_ptr<service::IngressSettings> settings = std::make_unique<service::IngressSettings>();
  service::PacketHandler packet_handler{*ingress, *settings};
  std::vector<std::string> log;
  std::unique_ptr<service::Verifier> verifier;
};

}  // namespace freeflex::testing
