// Messages as monitor prints them.
#include "tools/bus/message_json.hpp"

#include <gtest/gtest.h>

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

// on the wire they are signed; everywhere else they are sixteen hexadecimal digits
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

}  // namespace
}  // namespace freeflex::testing
