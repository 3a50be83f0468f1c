// What the page gets of a recording.
#include <gtest/gtest.h>

#include "core/plan/plan_bytes.hpp"
#include "core/step/step.hpp"
#include "messages/channels.hpp"
#include "service/io/wire/codec.hpp"
#include "service/io/wire/log.hpp"
#include "service/io/wire/outbound.hpp"
#include "tests/tools/shell.hpp"
#include "tools/view/live.hpp"

namespace freeflex::testing {
namespace {

using tools::Body;

constexpr const char* kPrefix = "FREEFLEX";

Body body_of(const std::string& scene) {
  std::optional<Body> body = tools::make_body(kScenes + scene);
  if (!body) throw std::runtime_error(scene);
  return std::move(*body);
}

/// Writes the scene and the first state of a plan, as freeflex run does, in session 1.
void write_begin(const Body& body, io::LogWriter& log) {
  io::Stamp stamp;
  stamp.session = 1;
  stamp.plan_fingerprint = plan_fingerprint(body.plan);
  for (const auto& page : io::make_scene_messages(body.plan, body.plan_file, stamp))
    log.write(std::string(kPrefix) + channels::kScene, 0, io::encode(page));
  log.write(std::string(kPrefix) + channels::kState, 0,
            io::encode(io::make_state_message(body.plan, make_state(body.plan), stamp)));
}

TEST(ViewRecording, OfTwoScenesIsRefused) {
  TemporaryFolder folder;
  Body boom = body_of("boom.yaml");
  const Body rotor = body_of("rotor.yaml");
  for (const bool has_both : {false, true}) {
    io::LogWriter log(folder / "a.log");
    write_begin(boom, log);
    if (has_both) write_begin(rotor, log);
    ASSERT_EQ(log.close(), "");
    std::string error, damage;
    EXPECT_EQ(tools::recorded_plan(folder / "a.log", kPrefix, {}, error).empty(), has_both) << error;
    EXPECT_EQ(tools::recorded_motion(boom, folder / "a.log", kPrefix, {}, error, damage).empty(), has_both);
    EXPECT_EQ(error.find("contradicts itself") != std::string::npos, has_both) << error;
    EXPECT_EQ(error.find("rotor.yaml") != std::string::npos, has_both) << error;
  }
}

}  // namespace
}  // namespace freeflex::testing
