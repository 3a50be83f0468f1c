// The tag of an envelope equals the HMAC that Python computes, and an envelope with any changed bit is
// refused.
#include "service/envelope.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/service/verifier_rig.hpp"

namespace freeflex::testing {
namespace {

using service::Envelope;
using service::has_right_tag;
using service::read_envelope;
using Bytes = std::vector<std::byte>;

/// Returns the key with id alice and the secret 00 01 02 ... 1f.
SealingKey counting_key() {
  SealingKey key{.id = "alice"};
  std::iota(key.secret.begin(), key.secret.end(), static_cast<unsigned char>(0));
  return key;
}

Bytes sealed_force(const std::string& channel = kForceChannel) {
  return seal(make_force(), channel, counting_key(), 5);
}

std::string hex(std::span<const std::byte> bytes) {
  std::string text;
  for (const std::byte byte : bytes) {
    constexpr const char* kDigits = "0123456789abcdef";
    text += kDigits[std::to_integer<unsigned>(byte) >> 4];
    text += kDigits[std::to_integer<unsigned>(byte) & 15];
  }
  return text;
}

// the expected bytes come from the lines in messages/README.md, section 12, run by Python 3.11 with its
// module hmac
TEST(Envelope, HasTheTagThatPythonsHmacGives) {
  freeflex_msgs::control_t hold = make_control();
  hold.utime = 1;
  hold.command = freeflex_msgs::control_t::HOLD;
  const Bytes sealed = seal(hold, "FREEFLEX_CONTROL", counting_key(), 1'700'000'000'000'000);
  EXPECT_EQ(sealed.size(), 137u);
  EXPECT_EQ(hex(std::span(sealed).last(32)),
            "e92af8c45009aeec864b5c663e34dcab588a2a1433c136b7e7c1689614977326");
}

TEST(Envelope, IsReadBackWithItsTag) {
  const Bytes sealed = sealed_force();
  const auto envelope = read_envelope(sealed);
  ASSERT_TRUE(envelope);
  EXPECT_EQ(envelope->key_id, "alice");
  EXPECT_EQ(envelope->session, kSession);
  EXPECT_EQ(envelope->sequence, 42);
  EXPECT_EQ(envelope->valid_until, 5);
  freeflex_msgs::force_t force = make_force();
  force.sender = "alice";
  const Bytes body = io::encode(force);
  EXPECT_TRUE(std::equal(body.begin(), body.end(), envelope->body.begin(), envelope->body.end()));
  EXPECT_TRUE(has_right_tag(*envelope, kForceChannel, counting_key()));
}

TEST(Envelope, IsRefusedIfAnyBitIsChanged) {
  const Bytes sealed = sealed_force();
  for (std::size_t i = 0; i < 8 * sealed.size(); ++i) {
    Bytes changed = sealed;
    changed[i / 8] ^= static_cast<std::byte>(1u << (i % 8));
    const auto envelope = read_envelope(changed);
    EXPECT_FALSE(envelope && has_right_tag(*envelope, kForceChannel, counting_key())) << i;
  }
}

TEST(Envelope, IsValidForOneChannelAndOneKey) {
  const Bytes sealed = sealed_force();
  const auto envelope = read_envelope(sealed);
  ASSERT_TRUE(envelope);
  for (const char* other : {"TEST_CONTROL", "TEST2_FORCE", "TEST_FORC", "TEST_FORCEE", ""})
    EXPECT_FALSE(has_right_tag(*envelope, other, counting_key())) << other;
  SealingKey other = counting_key();
  other.secret[31] ^= 1;
  EXPECT_FALSE(has_right_tag(*envelope, kForceChannel, other));
}

TEST(Envelope, IsRefusedIfItsLengthIsChanged) {
  Bytes sealed = sealed_force();
  for (std::size_t size = 0; size < sealed.size(); ++size) {
    // the copy has no spare capacity, so that a sanitizer reports any read beyond its end
    const Bytes cut(sealed.begin(), sealed.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_FALSE(read_envelope(cut)) << size;
  }
  sealed.push_back(std::byte{0});
  EXPECT_FALSE(read_envelope(sealed));
}

TEST(Envelope, TheEnvelopeOfTheLargestCommandFitsAnEntryOfTheRing) {
  freeflex_msgs::force_t force = make_force();
  force.forces.resize(256), force.num_forces = 256;
  force.wrenches.resize(16), force.num_wrenches = 16;
  force.torques.resize(16), force.num_torques = 16;
  force.wheels.resize(16), force.num_wheels = 16;
  SealingKey key = counting_key();
  key.id.assign(31, 'k');
  EXPECT_EQ(seal(force, kForceChannel, key, 5).size(), static_cast<std::size_t>(service::kMaxRawBytes));
}

}  // namespace
}  // namespace freeflex::testing
