// The scenes in these tests are refused for their fidelity, attractor, feedback and follower forces.
#include "tests/scene/bad_scene.hpp"

namespace freeflex::testing {
namespace {

// the text under test is on line 5
class Surroundings : public ::testing::TestWithParam<BadScene> {};

TEST_P(Surroundings, EachFaultIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    BadScene, Surroundings,
    ::testing::Values(
        bad_line(
            "UnknownFidelity", "fidelity: spinloaded",
            {"scene.yaml:5:11: error: scene: fidelity is the text 'spinloaded', but must be rigid, "
             "separated, spin-loaded, coupled, corotational, full or auto (did you mean 'spin-loaded'?)"}),
        bad_line("FidelityIsAList", "fidelity: [separated]",
                 {"scene.yaml:5:11: error: scene: fidelity is a list, but must be rigid, separated, "
                  "spin-loaded, coupled, corotational, full or auto"}),
        bad_line("AttractorIsANumber", "attractor: 3.986e14",
                 {"scene.yaml:5:12: error: attractor is the text '3.986e14', but must be a mapping of at, "
                  "mu: write attractor: {mu: 3.986e14}"}),
        bad_line("AttractorWithoutStrength", "attractor: {at: [0, 0, 7e6]}",
                 {"scene.yaml:5:12: error: attractor: mu is missing; it must be a number > 0 [m^3/s^2]"}),
        bad_line("AttractorWithItsStrengthAtTheColon", "attractor: {mu:1, at: [0, 0, 0]}",
                 {"scene.yaml:5:13: error: attractor: the key 'mu:1' is unknown (write a space after the "
                  "colon: 'mu: 1'); allowed are at, mu"}),
        bad_line("AttractorThatRepels", "attractor: {mu: -1, at: [0, 0]}",
                 {"scene.yaml:5:17: error: attractor: mu is -1 m^3/s^2, but must be > 0",
                  "scene.yaml:5:25: error: attractor: at has 2 items, but must be a list of 3 numbers [m]"}),
        bad_line("AttractorInKilometres", "attractor: {mu: 398600 km^3/s^2, mass: 6e24}",
                 {"scene.yaml:5:17: error: attractor: mu '398600 km^3/s^2' has a unit, but must be a plain "
                  "number in SI units [m^3/s^2]; write 3.986e+14",
                  "scene.yaml:5:34: error: attractor: the key 'mass' is unknown; allowed are at, mu"}),
        bad_line("LocalWrench",
                 "groups: {panel: all}\n"
                 "loads:\n"
                 "  - {name: w, axes: local, wrenches: {panel: {force: [0, 0, 1]}}}",
                 {"scene.yaml:7:38: error: load 'w': wrenches cannot have axes local, because a group has no "
                  "single local rotation; use axes body, or forces on its points"})),
    bad_scene_name);

class FeedbackItem : public ::testing::TestWithParam<BadScene> {};

TEST_P(FeedbackItem, EachFaultIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    BadScene, FeedbackItem,
    ::testing::Values(
        bad_line("IsText", "feedback: hub",
                 {"scene.yaml:5:11: error: feedback is the text 'hub', but must be a list of feedbacks "
                  "{name, at, from and gains}"}),
        bad_line("ItemIsText", "feedback: [hub]",
                 {"scene.yaml:5:12: error: feedback 1 is the text 'hub', but must be a mapping of name, at, "
                  "from, displacement, velocity, acceleration"}),
        bad_line("NoPoint", "feedback: {name: f, velocity: 1}",
                 {"scene.yaml:5:11: error: feedback 'f': at is missing; it must be the name of the point "
                  "that the force acts on"}),
        bad_line("UnknownPoints", "feedback: {name: f, at: hbu, from: tpi, velocity: 1}",
                 {"scene.yaml:5:25: error: feedback 'f': at names the point 'hbu', which the scene does not "
                  "have (did you mean 'hub'?)",
                  "scene.yaml:5:36: error: feedback 'f': from names the point 'tpi', which the scene does "
                  "not have (did you mean 'tip'?)"}),
        bad_line(
            "PointIsAList", "feedback: {name: f, at: [hub], from: {}, velocity: 1}",
            {"scene.yaml:5:25: error: feedback 'f': at is a list, but must be the name of a point",
             "scene.yaml:5:38: error: feedback 'f': from is a mapping, but must be the name of a point"}),
        bad_line("NoGain", "feedback: {name: f, at: hub}",
                 {"scene.yaml:5:11: error: feedback 'f' has no gain; it must have displacement, velocity or "
                  "acceleration"}),
        bad_line("UnknownGain", "feedback: {name: f, at: hub, velocty: 1}",
                 {"scene.yaml:5:30: error: feedback 'f': the key 'velocty' is unknown (did you mean "
                  "'velocity'?); allowed are name, at, from, displacement, velocity, acceleration"}),
        bad_line("GainInAnotherUnit",
                 "feedback: {name: f, at: hub, displacement: 1 kN, velocity: 1 kN s/m, acceleration: 2 kg}",
                 {"scene.yaml:5:44: error: feedback 'f': displacement '1 kN' has a unit of another kind, but "
                  "must be a number [N/m], in SI without a unit",
                  "scene.yaml:5:60: error: feedback 'f': velocity '1 kN s/m' has a unit, but must be a plain "
                  "number in SI units [N s/m]; write 1000",
                  "scene.yaml:5:84: error: feedback 'f': acceleration '2 kg' has a unit, but must be a plain "
                  "number in SI units [N s^2/m]; write 2"}),
        bad_line("GainOfTwoAxes", "feedback: {name: f, at: hub, velocity: [1, 2]}",
                 {"scene.yaml:5:40: error: feedback 'f': velocity has 2 items, but must be a number, a list "
                  "of 3 (one for each body axis) or 3 lists of 3 (rows of a matrix) [N s/m]"}),
        bad_line("GainIsAMapping", "feedback: {name: f, at: hub, velocity: {x: 1}}",
                 {"scene.yaml:5:40: error: feedback 'f': velocity is a mapping, but must be a number, a list "
                  "of 3 (one for each body axis) or 3 lists of 3 (rows of a matrix) [N s/m]"}),
        bad_line("GainOfNumbersAndRows", "feedback: {name: f, at: hub, velocity: [1, [1, 2, 3], 2]}",
                 {"scene.yaml:5:40: error: feedback 'f': velocity mixes numbers and lists, but must be a "
                  "number, a list of 3 (one for each body axis) or 3 lists of 3 (rows of a matrix) [N s/m]"}),
        bad_line("RowOfTwoNumbers",
                 "feedback: {name: f, at: hub, velocity: [[1, 2, 3], [4, 5], [.inf, 8, 9]]}",
                 {"scene.yaml:5:52: error: feedback 'f': velocity: row 2 has 2 items, but must be a list of "
                  "3 numbers [N s/m]",
                  "scene.yaml:5:61: error: feedback 'f': velocity: row 3 '.inf' is not finite, but must be a "
                  "number [N s/m]"}),
        bad_line("NameTwice",
                 "feedback:\n"
                 "  - {name: f, at: hub, velocity: 1}\n"
                 "  - {name: f, at: tip, velocity: 1}",
                 {"scene.yaml:7:5: error: feedback 'f' is defined twice, first on line 6; give each feedback "
                  "a name of its own"})),
    bad_scene_name);

}  // namespace
}  // namespace freeflex::testing
