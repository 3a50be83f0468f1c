// The scenes in these tests are refused for their section leave_out.
#include "tests/scene/bad_scene.hpp"

namespace freeflex::testing {
namespace {

// the text under test is on line 5
class LeaveOutKey : public ::testing::TestWithParam<BadScene> {};

TEST_P(LeaveOutKey, EachFaultIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

const std::string kParts =
    "damping, gravity, rotation, out_of_plane, unreached_modes, small_modes, point_rows or all";

INSTANTIATE_TEST_SUITE_P(
    BadScene, LeaveOutKey,
    ::testing::Values(
        bad_line("IsANumber", "leave_out: 1e-3",
                 {"scene.yaml:5:12: error: leave_out is the text '1e-3', but must be a mapping of tolerance, "
                  "horizon, on_need, keep: write leave_out: {tolerance: 1e-3}"}),
        bad_line("Unknown", "leave_out: {tolerence: 1e-3}",
                 {"scene.yaml:5:13: error: leave_out: the key 'tolerence' is unknown (did you mean "
                  "'tolerance'?); allowed are tolerance, horizon, on_need, keep"}),
        bad_line("OutOfRange", "leave_out: {tolerance: -1, horizon: 0}",
                 {"scene.yaml:5:24: error: leave_out: tolerance is -1, but must be >= 0",
                  "scene.yaml:5:37: error: leave_out: horizon is 0 s, but must be > 0"}),
        bad_line("ToleranceOfOne", "leave_out: {tolerance: 1}",
                 {"scene.yaml:5:24: error: leave_out: tolerance is 1, but must be a fraction below 1"}),
        bad_line("UnknownWord", "leave_out: {on_need: replann}",
                 {"scene.yaml:5:22: error: leave_out: on_need is the text 'replann', but must be keep, "
                  "refuse or replan (did you mean 'replan'?)"}),
        bad_line("UnknownFeature", "leave_out: {keep: [rotation, plane]}",
                 {"scene.yaml:5:30: error: leave_out: keep is the text 'plane', but must be " + kParts}),
        bad_line("MisspeltAll", "leave_out: {keep: alll}",
                 {"scene.yaml:5:19: error: leave_out: keep is the text 'alll', but must be " + kParts +
                  " (did you mean 'all'?)"}),
        bad_line("FeatureTwice", "leave_out: {keep: [rotation, rotation]}",
                 {"scene.yaml:5:30: error: leave_out: keep names rotation twice; name it once"})),
    bad_scene_name);

}  // namespace
}  // namespace freeflex::testing
