// These tests check the JSON of the messages that `freeflex monitor` prints.
#include "tools/bus/message_json.hpp"

#include <gtest/gtest.h>

#include "freeflex_msgs/control_t.hpp"
#include "freeflex_msgs/envelope_t.hpp"
#include "freeflex_msgs/scene_t.hpp"
#include "freeflex_msgs/shapes_t.hpp"
#include "freeflex_msgs/status_t.hpp"
#include "messages/channels.hpp"
#include "service/io/wire/codec.hpp"
#include "tools/terminal/json.hpp"

namespace freeflex::testing {
namespace {

template <class Message>
tools::Json fields_of(const char* suffix, const Message& message) {
  return tools::decode_by_suffix(suffix, io::encode(message)).fields;
}

// fingerprints and hashes are signed integers on the wire, but sixteen hexadecimal digits everywhere else
TEST(MessageJson, FingerprintsAndHashesAreHexadecimal) {
  freeflex_msgs::scene_t scene{};
  scene.plan_fingerprint = -2;
  scene.scene_hash = 0xabc;
  freeflex_msgs::status_t status{};
  status.plan_fingerprint = -2;
  status.scene_hash = 0xabc;
  for (const tools::Json& fields :
       {fields_of(channels::kScene, scene), fields_of(channels::kStatus, status)}) {
    EXPECT_EQ(fields["plan_fingerprint"], "fffffffffffffffe") << fields;
    EXPECT_EQ(fields["scene_hash"], "0000000000000abc") << fields;
  }
  freeflex_msgs::applied_t applied{};
  applied.plan_fingerprint = 0x123456789abcdef0;
  EXPECT_EQ(fields_of(channels::kApplied, applied)["plan_fingerprint"], "123456789abcdef0");
  freeflex_msgs::shapes_t shapes{};
  shapes.plan_fingerprint = 1;
  EXPECT_EQ(fields_of(channels::kShapes, shapes)["plan_fingerprint"], "0000000000000001");
}

TEST(MessageJson, AnEnvelopeIsShownWithItsContents) {
  freeflex_msgs::control_t control{};
  control.sender = "desk";
  control.command = freeflex_msgs::control_t::SCENE;
  freeflex_msgs::envelope_t envelope{};
  envelope.key_id = "pilot-1";
  for (const std::byte byte : io::encode(control))
    envelope.body.push_back(std::to_integer<std::uint8_t>(byte));
  envelope.num_bytes = static_cast<std::int32_t>(envelope.body.size());
  envelope.tag[31] = 0xab;
  const tools::DecodedMessage shown = tools::decode_by_suffix(channels::kControl, io::encode(envelope));
  EXPECT_EQ(shown.summary, "sealed with key pilot-1: desk: scene");
  EXPECT_EQ(shown.fields["body"]["command"], "scene");
  EXPECT_EQ(shown.fields["tag"], std::string(62, '0') + "ab");
}

TEST(MessageJson, AMessageOfAnOlderVersionIsReportedWithItsVersion) {
  const std::vector<std::byte> bytes = [] {
    std::vector<std::byte> state(200);
    const std::uint64_t fingerprint = 0x61063d95b061afa7;
    for (std::size_t i = 0; i < 8; ++i)
      state[i] = static_cast<std::byte>(fingerprint >> (56 - 8 * i) & 0xFFu);
    return state;
  }();
  EXPECT_EQ(tools::decode_by_suffix(channels::kState, bytes).summary,
            "of version 0.3 of the messages, but this program reads version 0.5");
}

}  // namespace
}  // namespace freeflex::testing
