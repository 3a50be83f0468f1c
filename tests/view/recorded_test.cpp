// These tests check the data that the page gets from a recording, and the ranking of the modes that the page
// shows.
#include <gtest/gtest.h>

#include <cmath>

#include "core/plan/file/plan_bytes.hpp"
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

/// Writes the scene and the first state of a plan in session 1, as `freeflex run` does.
void write_begin(const Body& body, io::LogWriter& log) {
  io::Stamp stamp;
  stamp.session = 1;
  stamp.plan_fingerprint = plan_fingerprint(body.plan);
  for (const auto& page : io::make_scene_messages(body.plan, false, body.plan_file, stamp))
    log.write(std::string(kPrefix) + channels::kScene, 0, io::encode(page));
  log.write(std::string(kPrefix) + channels::kState, 0,
            io::encode(io::make_state_message(body.plan, make_state(body.plan), stamp)));
}

TEST(ViewRecording, ARecordingOfTwoScenesIsRefused) {
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

// the energy M/2 (qdot^2 + omega^2 q^2) ranks the modes, so a mode of high frequency can rank above a mode of
// low frequency that has a larger amplitude
TEST(ModesThatMove, AreRankedByPeakEnergyUntilTheEpochEnds) {
  const Body body = body_of("boom.yaml");
  ASSERT_GT(body.num_modes, 3);
  const auto omega = [&](std::size_t mode) { return body.plan.omega[mode]; };
  freeflex_msgs::state_t state = io::make_state_message(body.plan, make_state(body.plan), io::Stamp{});
  std::fill(state.q.begin(), state.q.end(), 0.0);
  std::fill(state.q_dot.begin(), state.q_dot.end(), 0.0);
  tools::ModePeaks peaks(body);
  EXPECT_TRUE(peaks.largest().empty());
  state.q[0] = 1e-3;
  state.q[2] = 2e-3 * omega(0) / omega(2);
  state.q_dot[3] = 3e-3 * omega(0);
  peaks.take(state);
  // modes that have decayed stay in the ranking
  state.q[2] = state.q_dot[3] = 0.0;
  peaks.take(state);
  const tools::Json largest = peaks.largest();
  ASSERT_EQ(largest.size(), 3U);
  const double of_one = 0.5 * body.plan.mass * std::pow(1e-3 * omega(0), 2);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(largest[k][0], (std::vector<int>{3, 2, 0})[k]);
    EXPECT_DOUBLE_EQ(largest[k][1], of_one * std::pow(3.0 - static_cast<double>(k), 2));
  }
  ++state.epoch;
  peaks.take(state);
  EXPECT_EQ(peaks.largest().size(), 1U);
}

}  // namespace
}  // namespace freeflex::testing
