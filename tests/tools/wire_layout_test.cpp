// These tests are about the layout check, which every message must pass before it reaches a generated
// decoder.
#include <gtest/gtest.h>

#include <vector>

#include "service/io/wire/codec.hpp"
#include "service/io/wire/decode.hpp"

namespace freeflex::tools {
namespace {

using namespace freeflex_msgs;

force_t some_force() {
  force_t m{};
  m.sender = "pilot";
  m.num_forces = 3;
  m.forces.resize(3);
  m.num_wrenches = 2;
  m.wrenches.resize(2);
  m.num_torques = 1;
  m.torques.resize(1);
  m.num_wheels = 2;
  m.wheels.resize(2);
  return m;
}

template <class Message>
Message some() {
  return Message{};
}
template <>
force_t some() {
  return some_force();
}
template <>
applied_t some() {
  applied_t m{};
  m.command = some_force();
  return m;
}
template <>
ack_t some() {
  ack_t m{};
  m.sender = "pilot";
  m.text = "late";
  return m;
}
template <>
control_t some() {
  control_t m{};
  m.sender = "p";
  return m;
}
template <>
state_t some() {
  state_t m{};
  m.num_elastic = 5;
  m.q.resize(5);
  m.q_dot.resize(5);
  m.num_wheels = 2;
  m.wheel_momentum.resize(2);
  return m;
}
template <>
points_t some() {
  points_t m{};
  m.num_points = 2;
  m.points.resize(2);
  m.num_groups = 1;
  m.groups.resize(1);
  m.num_bodies = 1;
  m.bodies.resize(1);
  return m;
}
template <>
loads_t some() {
  loads_t m{};
  m.num_links = 2;
  m.links.resize(2);
  m.links[0].num_values = 12;
  m.links[0].values.resize(12);
  m.links[1].num_values = 1;
  m.links[1].values.resize(1);
  return m;
}
template <>
shapes_t some() {
  shapes_t m{};
  m.num_points = 2;
  m.point.resize(2);
  m.shape.assign(2, std::vector<double>(3, 0.5));
  return m;
}
template <>
scene_t some() {
  scene_t m{};
  m.name = "rotor";
  m.num_points = 2;
  m.points.resize(2);
  m.points[0].name = "a";
  m.num_links = 1;
  m.links.resize(1);
  m.links[0].kind = "beam";
  m.links[0].num_points = 2;
  m.links[0].points = {0, 1};
  m.num_groups = 1;
  m.groups.resize(1);
  m.groups[0].num_points = 2;
  m.groups[0].points.resize(2);
  m.num_frequencies = 3;
  m.frequencies.resize(3);
  return m;
}
template <>
status_t some() {
  status_t m{};
  m.time_mode = "realtime";
  m.num_rejections = 2;
  m.rejections.resize(2);
  return m;
}

template <>
envelope_t some() {
  envelope_t m{};
  m.key_id = "pilot";
  m.num_bytes = 3;
  m.body = {1, 2, 255};
  return m;
}

template <class Message>
class WireLayout : public ::testing::Test {};
using Messages = ::testing::Types<ack_t, applied_t, control_t, envelope_t, force_t, loads_t, points_t,
                                  scene_t, shapes_t, state_t, status_t>;
TYPED_TEST_SUITE(WireLayout, Messages);

TYPED_TEST(WireLayout, AcceptsEveryMessageThatTheGeneratedCodeEncodes) {
  const std::vector<std::byte> bytes = io::encode(some<TypeParam>());
  TypeParam decoded{};
  EXPECT_TRUE(io::decode_message(bytes, decoded));
  EXPECT_EQ(io::encode(decoded), bytes);
}

TYPED_TEST(WireLayout, RefusesEveryTruncatedMessageAndAnExtraByte) {
  std::vector<std::byte> bytes = io::encode(some<TypeParam>());
  TypeParam decoded{};
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_FALSE(io::decode_message(std::span(bytes).first(length), decoded)) << length;
  }
  bytes.push_back(std::byte{0});
  EXPECT_FALSE(io::decode_message(bytes, decoded));
}

TYPED_TEST(WireLayout, DoesNotThrowOnAnyWrongCount) {
  const std::vector<std::byte> whole = io::encode(some<TypeParam>());
  // the test sets every four successive bytes to -1 and to 2^30, as wrong counts, and nothing may throw, not
  // even std::bad_alloc
  for (const int top : {0xff, 0x40}) {
    for (std::size_t at = 8; at + 4 <= whole.size(); ++at) {
      std::vector<std::byte> bytes = whole;
      for (std::size_t k = 0; k < 4; ++k)
        bytes[at + k] = static_cast<std::byte>(k == 0 || top == 0xff ? top : 0);
      TypeParam decoded{};
      EXPECT_NO_THROW(io::decode_message(bytes, decoded)) << at;
    }
  }
}

TEST(WireFingerprint, AMessageOfAnotherTypeIsRefused) {
  ack_t ack{};
  EXPECT_FALSE(io::decode_message(io::encode(some<control_t>()), ack));
}

}  // namespace
}  // namespace freeflex::tools
