// The scenes in these tests are refused for bodies, wheels, masses of links and kept modes. The messages are
// compared word for word.
#include "tests/scene/bad_scene.hpp"

namespace freeflex::testing {
namespace {

class Bodies : public ::testing::TestWithParam<BadScene> {};

TEST_P(Bodies, EachFaultIsReportedAtItsPosition) { expect_refused(GetParam()); }

const std::string kBeamOfBodies =
    "points:\n"
    "  - {name: hub, mass: 10, at: [0, 0, 0], inertia: [1, 1, 1]}\n"
    "  - {name: tip, mass: 1, at: [1, 0, 0]}\n"
    "links:\n"
    "  - {beam: [hub, tip], EA: 1, GJ: 1, EIy: 1, EIz: 1}\n";

BadScene bad_body(const std::string& name, const std::string& text, std::vector<std::string> messages) {
  return {name, {{"scene.yaml", kBeamOfBodies + text + "\n"}}, std::move(messages)};
}

INSTANTIATE_TEST_SUITE_P(
    BadScene, Bodies,
    ::testing::Values(
        // the only message gives the point by its name, not by an index
        bad_body("WheelOfAnUnknownPoint", "wheels: [{name: w, at: hubb, axis: [0, 0, 1]}]",
                 {"scene.yaml:6:24: error: wheel 'w': at names the point 'hubb', which the scene does not "
                  "have (did you mean 'hub'?)"}),
        bad_body("WheelInAPointWithoutInertia", "wheels: [{name: w, at: tip, axis: [0, 0, 1]}]",
                 {"scene.yaml:6:10: error: wheel 'w' is in point 'tip', which has no inertia; give it the "
                  "inertia of the body that holds the wheel"}),
        bad_body("WheelWithoutAxis", "wheels:\n  - {at: hub, axis: [0, 0, 0]}\n  - {at: hub}",
                 {"scene.yaml:7:21: error: wheel 1: axis is zero, but must be a direction",
                  "scene.yaml:8:5: error: wheel 2: axis is missing; it must be a direction [x, y, z] in the "
                  "axes of the scene"}),
        bad_body("CountOfZeroModes", "modes: {count: 0}",
                 {"scene.yaml:6:16: error: modes: count is 0, but must be a whole number from 1 to 3700, the "
                  "most that one state message can hold"}),
        bad_body("CountOfHalfAMode", "modes: {count: 1.5}",
                 {"scene.yaml:6:16: error: modes: count is 1.5, but must be a whole number from 1 to 3700, "
                  "the most that one state message can hold"}),
        bad_body("CountAsText", "modes: {count: all}",
                 {"scene.yaml:6:16: error: modes: count 'all' is not a number, but must be a number >= 0"}),
        bad_body("CountOfMoreThanAMessageHolds", "modes: {count: 3701}",
                 {"scene.yaml:6:16: error: modes: count is 3701, but must be a whole number from 1 to 3700, "
                  "the most that one state message can hold"}),
        bad_body("ModesBelowZero", "modes: {below: 0}",
                 {"scene.yaml:6:16: error: modes: below is 0 Hz, but must be > 0"}),
        bad_body("ModesByFrequencyAndCount", "modes: {below: 5, count: 3}",
                 {"scene.yaml:6:8: error: modes has both below and count; give one of them"}),
        bad_body("EmptyModes", "modes: {}",
                 {"scene.yaml:6:8: error: modes is empty, but must be {below: HZ} or {count: N}"}),
        BadScene{"InertiaOfTwoNumbersAndZeroAxes",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: d, mass: 1, at: [3, 0, 0], inertia: [1, 2]}\n"
                   "  - {name: e, mass: 1, at: [4, 0, 0], axes: [1, 0, 0, 0]}\n"}},
                 {"scene.yaml:2:48: error: point 'd': inertia has 2 items, but must be 3 moments or 6 "
                  "entries xx, yy, zz, xy, xz, yz [kg m^2]",
                  "scene.yaml:3:45: error: point 'e': axes are those of inertia and offset, but neither is "
                  "given; remove axes"}},
        BadScene{"ImpossibleInertia",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: a, mass: 1, at: [0, 0, 0], inertia: [1, 1, 3]}\n"
                   "  - {name: b, mass: 1, at: [1, 0, 0], inertia: [1, 1, 1, 5, 0, 0]}\n"
                   "  - {name: c, mass: 0, at: [2, 0, 0], offset: [0, 0, 0.1]}\n"}},
                 {"scene.yaml:2:5: error: point 'a': inertia has the principal moments 1 1 3 kg m^2, but no "
                  "moment may exceed the sum of the two others; check their order and that they are about "
                  "the centre of mass",
                  "scene.yaml:3:5: error: point 'b': inertia has the principal moment -4 kg m^2, but it must "
                  "be >= 0; give the entries of the inertia matrix, which off the diagonal are -sum m x y",
                  "scene.yaml:4:5: error: point 'c' has inertia or an offset, but no mass; give its mass"}},
        BadScene{
            "MassOfALink",
            {{"scene.yaml",
              kThreePoints + "links:\n"
                             "  - {bar: [hub, mid], EA: 1, mass_per_length: -1}\n"
                             "  - {bar: [mid, tip], EA: 1, lumped: true}\n"
                             "  - {bar: [hub, tip], EA: 1, mass_per_length: 1, lumped: perhaps}\n"
                             "  - {plate: [hub, mid, tip], E: 1, nu: 0.3, thickness: 0.1, density: -2}\n"}},
            {"scene.yaml:6:47: error: link 1: mass_per_length is -1 kg/m, but must be >= 0",
             "scene.yaml:7:38: error: link 2: lumped sets how the mass of the link is distributed, but the "
             "link has no mass; give a mass, or remove this key",
             "scene.yaml:8:58: error: link 3: lumped is the text 'perhaps', but must be true or false",
             "scene.yaml:9:70: error: link 4: density is -2 kg/m^3, but must be >= 0"}},
        BadScene{"AxesOfWheels",
                 {{"scene.yaml",
                   "points: [{name: a, mass: 1, at: [0, 0, 0], inertia: [1, 1, 1]}]\n"
                   "wheels: [{name: w, at: a, axis: [0, 0, 1]}]\n"
                   "loads: [{name: l, axes: local, wheels: {w: 1}}]\n"}},
                 {"scene.yaml:3:25: error: load 'l': axes has no effect on wheels, which have axes of "
                  "their own; remove it"}},
        BadScene{
            "MassOfAMatrixThatIsNotThere",
            {{"scene.yaml",
              "points:\n"
              "  - {name: a, mass: 0, at: [0, 0, 0]}\n"
              "  - {name: b, mass: 0, at: [1, 0, 0]}\n"
              "links:\n"
              "  - {name: body, matrix: K.mtx, mass: M.mtx, points: all}\n"},
             {"K.mtx", kMatrixHeader + "6 6 3\n1 1 1\n4 4 1\n4 1 -1\n"},
             {"M.mtx", kMatrixHeader + "5 5 1\n1 1 1\n"}},
            {"M.mtx:2:1: error: the mass matrix is 5 x 5, but must be 6 x 6 (3 rows for each of 2 points)"}},
        BadScene{
            "MassOfAMatrix",
            {{"scene.yaml",
              "points:\n"
              "  - {name: a, mass: 1, at: [0, 0, 0]}\n"
              "  - {name: b, mass: 1, at: [1, 0, 0]}\n"
              "links:\n"
              "  - {name: body, matrix: K.mtx, mass: M.mtx, points: all}\n"},
             {"K.mtx", kMatrixHeader + "6 6 3\n1 1 1\n4 4 1\n4 1 -1\n"},
             {"M.mtx", kMatrixHeader + "5 5 1\n1 1 1\n"}},
            {"M.mtx:2:1: error: the mass matrix is 5 x 5, but must be 6 x 6 (3 rows for each of 2 points)"}}),
    bad_scene_name);

}  // namespace
}  // namespace freeflex::testing
