// Core values -> the messages that go out. Used by the daemon's publish side and by `freeflex run`.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/step/readout.hpp"
#include "core/step/step.hpp"
#include "freeflex_msgs/applied_t.hpp"
#include "freeflex_msgs/loads_t.hpp"
#include "freeflex_msgs/points_t.hpp"
#include "freeflex_msgs/scene_t.hpp"
#include "freeflex_msgs/shapes_t.hpp"
#include "freeflex_msgs/state_t.hpp"

namespace freeflex::io {

/// What every outgoing message of one moment has in common.
struct Stamp {
  std::int64_t utime = 0;  // [us] wall clock; simulated time when there is no clock (freeflex run)
  std::int64_t session = 0;
  std::uint64_t plan_fingerprint = 0;
  std::int64_t applied_count = 0;
};

/// At most channels::kMaxMessageBytes, which is where kMaxElastic comes from.
freeflex_msgs::state_t make_state_message(const Plan& plan, const MotionState& state, const Stamp& stamp);
/// Pages of at most channels::kMaxMessageBytes each; empty when the scene publishes none.
std::vector<freeflex_msgs::points_t> make_points_messages(const Plan& plan, const MotionState& state,
                                                          const Stamp& stamp);
std::vector<freeflex_msgs::loads_t> make_loads_messages(const Plan& plan, const MotionState& state,
                                                        const Stamp& stamp);
/// A channel on which the motion goes out at a rate of the plan, of simulated time.
struct MotionChannel {
  const char* suffix;  // of its name
  double Plan::*rate;  // [Hz] 0: off
  std::vector<std::vector<std::byte>> (*encode)(const Plan& plan, const MotionState& state,
                                                const Stamp& stamp);  // its messages
};
inline constexpr std::size_t kNumMotionChannels = 3;
/// STATE, POINTS, LOADS, in the order in which those of one tick leave. What is here, the daemon and
/// `freeflex run` publish.
extern const std::array<MotionChannel, kNumMotionChannels> kMotionChannels;
inline constexpr std::size_t kStateChannel = 0, kPointsChannel = 1, kLoadsChannel = 2;

/// [ticks] between two publications at a rate [Hz]; 0: off.
std::int64_t ticks_between(double rate, double period);

/// How many of its points and links a scene says what they are.
struct SceneListing {
  std::int32_t points = 0, links = 0;
};
/// All, but above kMostByDefault points those alone that are published, take commands, are loaded or in a
/// group, and the links that are published.
SceneListing scene_listing(const Plan& plan);

/// At least one page; every page has the front (name, rate, mass properties, totals). What scene_listing()
/// leaves out is on none, but for what stands in short gaps.
/// \pre no single name, and no group's points, near channels::kMaxMessageBytes
std::vector<freeflex_msgs::scene_t> make_scene_messages(const Plan& plan, const std::string& plan_file,
                                                        const Stamp& stamp);
/// \param mode elastic mode from 1 to plan.num_elastic
std::vector<freeflex_msgs::shapes_t> make_shapes_messages(const Plan& plan, int mode, const Stamp& stamp);
freeflex_msgs::applied_t make_applied_force(const ForceCommand& command, std::int64_t tick,
                                            std::int64_t applied_sequence, const Stamp& stamp);
/// \param kind  EXPIRED, LEASE_LOST or CLEARED
freeflex_msgs::applied_t make_applied_end(std::int32_t kind, const Expiry& end, std::int64_t tick,
                                          std::int64_t applied_sequence, const Stamp& stamp);
/// The same, EXPIRED or LEASE_LOST as the expiry says.
freeflex_msgs::applied_t make_applied_expiry(const Expiry& expiry, std::int64_t tick,
                                             std::int64_t applied_sequence, const Stamp& stamp);
freeflex_msgs::applied_t make_applied_reset(std::int64_t tick, std::int64_t applied_sequence,
                                            const Stamp& stamp);

}  // namespace freeflex::io
