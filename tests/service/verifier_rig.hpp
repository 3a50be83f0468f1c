// A verifier behind an ingress's part, without a network: messages go in as bytes, commands come out.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "service/ingress_inlet.hpp"
#include "service/verifier.hpp"
#include "tests/messages/commands.hpp"

namespace freeflex::testing {

inline const std::string kForceChannel = "TEST_FORCE", kControlChannel = "TEST_CONTROL";

/// A key that may do everything; its secret follows from its id.
service::Key make_key(const std::string& id);

/// make_force() and make_control() with a sequence, as a key's holder sends them.
freeflex_msgs::force_t force_of(std::int64_t sequence);
freeflex_msgs::control_t control_of(std::int64_t sequence);

struct VerifierRig {
  /// On the scene of make_names(), in kSession, prefix TEST.
  explicit VerifierRig(std::vector<service::Key> keys);

  /// A message on FORCE or CONTROL, taken by the ingress's part and then by the verifier.
  void deliver(std::span<const std::byte> bytes, bool is_force = true);
  void seal_and_deliver(const freeflex_msgs::force_t& force, const service::Key& key);
  void seal_and_deliver(const freeflex_msgs::control_t& control, const service::Key& key);
  /// [us] a second after the time of the rig
  std::int64_t valid_until() const { return time.wall_us + 1'000'000; }

  /// The next command that was let through.
  std::optional<service::InboundEntry> next_command();
  /// The next answer to a rejection; reason kAccepted when there is none.
  io::Admission next_answer();
  std::int64_t count(io::Reason reason) const;

  service::Verifier::Time time{1'700'000'000'000'000, 5'000'000'000};
  std::unique_ptr<service::SharedBlock> ingress = std::make_unique<service::SharedBlock>();
  std::unique_ptr<service::IngressSettings> settings = std::make_unique<service::IngressSettings>();
  service::Inlet inlet{*ingress, *settings};
  std::vector<std::string> log;
  std::unique_ptr<service::Verifier> verifier;
};

}  // namespace freeflex::testing
