// Converts core values into messages. The daemon's publisher and `freeflex run` use these functions.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/plan.hpp"
#include "core/step/readout.hpp"
#include "core/step/step.hpp"
#include "freeflex_msgs/applied_t.hpp"
#include "freeflex_msgs/loads_t.hpp"
#include "freeflex_msgs/points_t.hpp"
#include "freeflex_msgs/scene_t.hpp"
#include "freeflex_msgs/shapes_t.hpp"
#include "freeflex_msgs/state_t.hpp"
#include "freeflex_msgs/status_t.hpp"

namespace freeflex::io {

/// Values that are the same in all outgoing messages of one moment.
struct Stamp {
  std::int64_t utime = 0;  // [us] wall clock, or simulated time if there is no clock (freeflex run)
  std::int64_t session = 0;
  std::uint64_t plan_fingerprint = 0;
  std::int64_t applied_count = 0;
};

/// Makes a state message. kMaxElastic follows from the largest size of a state message,
/// channels::kMaxMessageBytes.
freeflex_msgs::state_t make_state_message(const Plan& plan, const MotionState& state, const Stamp& stamp);
/// Make pages of at most channels::kMaxMessageBytes with the published points, groups and bodies, or with the
/// loads of the published links. If none of these is published, there is no page.
std::vector<freeflex_msgs::points_t> make_points_messages(const Plan& plan, const MotionState& state,
                                                          const Stamp& stamp);
/// \param points  motions of plan.published_points that were read before
std::vector<freeflex_msgs::points_t> make_pages_of_points(const Plan& plan, const MotionState& state,
                                                          std::span<const PointState> points,
                                                          const Stamp& stamp);
std::vector<freeflex_msgs::loads_t> make_loads_messages(const Plan& plan, const MotionState& state,
                                                        const Stamp& stamp);
/// Says how a channel publishes the motion.
struct ChannelEncoder {
  const char* suffix;  // last part of the channel name
  std::vector<std::vector<std::byte>> (*encode)(const Plan& plan, const MotionState& state,
                                                const Stamp& stamp);  // returns the channel's messages
  // number of messages of the channel that were dropped because the publisher was late
  std::int64_t freeflex_msgs::status_t::*dropped;
};
/// One encoder for each of kMotionChannels, in the order in which messages of one tick are sent. The daemon
/// and `freeflex run` publish these channels at the rates of the plan.
extern const std::array<ChannelEncoder, kNumMotionChannels> kEncoders;

/// Returns the number of ticks between two publications at a rate [Hz], or 0 if the channel is off.
std::int64_t ticks_between(double rate, double period);

/// Holds the number of points and links that the scene messages list.
struct SceneListing {
  std::int32_t points = 0, links = 0;
};
/// Counts all points and links. If there are more than kMostByDefault points, counts only the published
/// links, and the points with inertia or stored mode shapes: these points are published, pushable, loaded or
/// in a group.
SceneListing scene_listing(const Plan& plan);

/// Makes the pages of a scene, at least one page. Every page has the first fields (name, rate, mass
/// properties, totals). If `uses_fallback` is true, the modes are those of the fallback plan. The pages list
/// only the items that scene_listing() counts, and items in short gaps between these. \pre each name, and the
/// points of each group, need much less than channels::kMaxMessageBytes
std::vector<freeflex_msgs::scene_t> make_scene_messages(const Plan& plan, bool uses_fallback,
                                                        const std::string& plan_file, const Stamp& stamp);
/// Makes the pages of a mode shape.  \param mode elastic mode from 1 to plan.num_elastic
std::vector<freeflex_msgs::shapes_t> make_shapes_messages(const StepPlan& plan, int mode, const Stamp& stamp);
freeflex_msgs::applied_t make_applied_force(const ForceCommand& command, std::int64_t tick,
                                            std::int64_t applied_sequence, const Stamp& stamp);
/// \param kind  EXPIRED, LEASE_LOST or CLEARED
freeflex_msgs::applied_t make_applied_end(std::int32_t kind, const Expiry& end, std::int64_t tick,
                                          std::int64_t applied_sequence, const Stamp& stamp);
/// Makes an EXPIRED or LEASE_LOST message, depending on the expiry.
freeflex_msgs::applied_t make_applied_expiry(const Expiry& expiry, std::int64_t tick,
                                             std::int64_t applied_sequence, const Stamp& stamp);
freeflex_msgs::applied_t make_applied_reset(std::int64_t tick, std::int64_t applied_sequence,
                                            const Stamp& stamp);

}  // namespace freeflex::io
