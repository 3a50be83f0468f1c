// The scenes in these tests are refused for values out of range, unknown names, duplicates, geometry and
// units.
#include "tests/scene/bad_scene.hpp"

namespace freeflex::testing {
namespace {

class Range : public ::testing::TestWithParam<BadScene> {};

TEST_P(Range, EachValueOutOfRangeIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    BadScene, Range,
    ::testing::Values(
        BadScene{"NegativeMass",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: a, mass: -1.5, at: [0, 0, 0]}\n"}},
                 {"scene.yaml:2:21: error: point 'a': mass is -1.5 kg, but must be >= 0"}},
        BadScene{"ZeroStiffness",
                 {{"scene.yaml", kThreePoints + "links:\n"
                                                "  - {name: l, spring: [hub, tip], stiffness: 0}\n"}},
                 {"scene.yaml:6:46: error: link 'l': stiffness is 0 N/m, but must be > 0"}},
        BadScene{"NegativeRatio",
                 {{"scene.yaml", kThreePoints + "damping: {ratio: -0.01}\n"}},
                 {"scene.yaml:5:18: error: damping: ratio is -0.01, but must be >= 0"}},
        BadScene{"ZeroRate",
                 {{"scene.yaml", "rate: 0\n" + kThreePoints}},
                 {"scene.yaml:1:7: error: scene: rate is 0 Hz, but must be from 0.001 to 1000000"}},
        BadScene{"TinyRate",
                 {{"scene.yaml", "rate: 1e-300\n" + kThreePoints}},
                 {"scene.yaml:1:7: error: scene: rate is 1e-300 Hz, but must be from 0.001 to 1000000"}},
        BadScene{"HugeRate",
                 {{"scene.yaml", "rate: 1e15\n" + kThreePoints}},
                 {"scene.yaml:1:7: error: scene: rate is 1e15 Hz, but must be from 0.001 to 1000000"}},
        BadScene{
            "NotFinite",
            {{"scene.yaml", kThreePoints + "gravity: [0, .nan, -.inf]\n"}},
            {"scene.yaml:5:14: error: scene: gravity '.nan' is not finite, but must be a number [m/s^2]",
             "scene.yaml:5:20: error: scene: gravity '-.inf' is not finite, but must be a number [m/s^2]"}},
        BadScene{"TooLargeForADouble",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: a, mass: 1e999, at: [0, 0, 0]}\n"}},
                 {"scene.yaml:2:21: error: point 'a': mass '1e999' is too large or too small for a double, "
                  "but must be a number >= 0 [kg]"}},
        BadScene{"AttitudeNotUnit",
                 {{"scene.yaml", kThreePoints + "initial: {attitude: [1, 1, 0, 0]}\n"}},
                 {"scene.yaml:5:21: error: initial: attitude has norm 1.4142135623730951, but must be a unit "
                  "quaternion [w, x, y, z]"}},
        BadScene{
            "TimesDoNotIncrease",
            {{"scene.yaml",
              kThreePoints +
                  "loads:\n"
                  "  - {forces: {tip: [0, 0, 1]}, table: {times: [0, 1, 1], values: [0, 1, 0]}}\n"}},
            {"scene.yaml:6:54: error: load 1: table: the time 1 s comes after 1 s, but times must increase"}},
        BadScene{"TableOfUnequalColumns",
                 {{"scene.yaml",
                   kThreePoints + "loads:\n"
                                  "  - {forces: {tip: [0, 0, 1]}, table: {times: [0, 1], values: [0]}}\n"}},
                 {"scene.yaml:6:63: error: load 1: table has 2 times and 1 values, but must have as many of "
                  "each"}},
        BadScene{"ZeroDuration",
                 {{"scene.yaml", kThreePoints +
                                     "loads:\n"
                                     "  - {forces: {tip: [0, 0, 1]}, pulse: {start: -1, duration: 0}}\n"}},
                 {"scene.yaml:6:47: error: load 1: pulse: start is -1 s, but must be >= 0",
                  "scene.yaml:6:61: error: load 1: pulse: duration is 0 s, but must be > 0"}},
        BadScene{"NegativePublicationRate",
                 {{"scene.yaml", kThreePoints + "publish: {state: -50}\n"}},
                 {"scene.yaml:5:18: error: publish: state is -50 Hz, but must be >= 0"}},
        BadScene{"LeadingZero",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: a, mass: 010, at: [-07.5, 0, 0]}\n"}},
                 {"scene.yaml:2:21: error: point 'a': mass '010' has a leading zero, which some programs "
                  "read as octal; write 10",
                  "scene.yaml:2:31: error: point 'a': at '-07.5' has a leading zero, which some programs "
                  "read as octal; write -7.5"}},
        BadScene{
            "Hexadecimal",
            {{"scene.yaml",
              "points:\n"
              "  - {name: a, mass: 0x1F, at: [0, 0, 0]}\n"}},
            {"scene.yaml:2:21: error: point 'a': mass '0x1F' is hexadecimal, but must be a decimal number"}},
        BadScene{"BadName",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: my hub, mass: 1, at: [0, 0, 0]}\n"
                   "  - {name: all, mass: 1, at: [1, 0, 0]}\n"
                   "  - {name: a..b, mass: 1, at: [2, 0, 0]}\n"}},
                 {"scene.yaml:2:12: error: point 1: name 'my hub' must be 1 to 63 of A-Z a-z 0-9 _ . -",
                  "scene.yaml:3:12: error: point 2: name 'all' stands for every name; choose another",
                  "scene.yaml:4:12: error: point 3: name 'a..b' must not contain '..', which stands for a "
                  "range of names"}},
        BadScene{"ModeBeyondTheLast",
                 {{"scene.yaml", kThreePoints + "links: {bar: [hub, mid, tip, hub], EA: 1e6}\n"
                                                "initial: {modes: {4: {q: 0.1}}}\n"}},
                 {"scene.yaml:6:10: error: initial state names elastic mode 4, but there are only 3, "
                  "numbered from 1"}}),
    bad_scene_name);

class Reference : public ::testing::TestWithParam<BadScene> {};

TEST_P(Reference, EachUnknownNameIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    BadScene, Reference,
    ::testing::Values(
        BadScene{"UnknownPointInLink",
                 {{"scene.yaml", kThreePoints + "links:\n"
                                                "  - {name: l, spring: [hub, tpi], stiffness: 10}\n"}},
                 {"scene.yaml:6:29: error: link 'l': spring names the point 'tpi', which the scene does not "
                  "have (did you mean 'tip'?)"}},
        BadScene{
            "UnknownGroup",
            {{"scene.yaml", kThreePoints + "groups: {panel: [hub, tip]}\n"
                                           "loads:\n"
                                           "  - {name: turn, wrenches: {pannel: {torque: [0, 0, 1]}}}\n"}},
            {"scene.yaml:7:29: error: load 'turn': wrenches names the group 'pannel', which the scene does "
             "not have (did you mean 'panel'?)"}},
        BadScene{"UnknownLinkPublished",
                 {{"scene.yaml", kThreePoints + "links: {name: strut, bar: [hub, tip], EA: 1e6}\n"
                                                "publish: {loads: {of: [strutt]}}\n"}},
                 {"scene.yaml:6:24: error: publish: loads: of names the link 'strutt', which the scene does "
                  "not have (did you mean 'strut'?)"}},
        BadScene{"UnknownPointWithoutASimilarName",
                 {{"scene.yaml", kThreePoints + "commands: {points: [antenna]}\n"}},
                 {"scene.yaml:5:21: error: commands: points names the point 'antenna', which the scene does "
                  "not have; it has hub, mid, tip"}},
        BadScene{"RangeBackwards",
                 {{"scene.yaml", kThreePoints + "groups: {panel: [tip..hub]}\n"}},
                 {"scene.yaml:5:18: error: group 'panel': range 'tip..hub' runs backwards in the scene; swap "
                  "its ends"}},
        BadScene{"LinkToItself",
                 {{"scene.yaml", kThreePoints + "links:\n"
                                                "  - {name: l, spring: [hub, hub], stiffness: 10}\n"}},
                 {"scene.yaml:6:23: error: link 'l': spring joins the point 'hub' to itself; give two "
                  "different points"}},
        BadScene{"ChainOfOne",
                 {{"scene.yaml", kThreePoints + "links:\n"
                                                "  - {beam: [hub], EA: 1, GJ: 1, EIy: 1, EIz: 1}\n"}},
                 {"scene.yaml:6:12: error: link 1: beam has 1 point, but must be a list of 2 or more"}}),
    bad_scene_name);

class Duplicate : public ::testing::TestWithParam<BadScene> {};

TEST_P(Duplicate, EachDuplicateIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    BadScene, Duplicate,
    ::testing::Values(
        BadScene{"KeyTwice",
                 {{"scene.yaml",
                   "rate: 1000\n"
                   "rate: 500\n" +
                       kThreePoints}},
                 {"scene.yaml:2:1: error: key 'rate' is written twice, first on line 1; remove one"}},
        BadScene{"PointTwice",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: a, mass: 1, at: [0, 0, 0]}\n"
                   "  - {name: a, mass: 1, at: [1, 0, 0]}\n"}},
                 {"scene.yaml:3:5: error: point 'a' is defined twice, first on line 2; give each point a "
                  "name of its own"}},
        BadScene{"LinkTwice",
                 {{"scene.yaml", kThreePoints + "links:\n"
                                                "  - {name: l, spring: [hub, tip], stiffness: 10}\n"
                                                "  - {name: l, spring: [hub, mid], stiffness: 10}\n"}},
                 {"scene.yaml:7:5: error: link 'l' is defined twice, first on line 6; give each link a name "
                  "of its own"}},
        BadScene{"PointTwiceInGroup",
                 {{"scene.yaml", kThreePoints + "groups: {panel: [hub..tip, mid]}\n"}},
                 {"scene.yaml:5:28: error: group 'panel': 'mid' names a point that is in the list already; "
                  "remove it"}},
        BadScene{"LoadTwice",
                 {{"scene.yaml", kThreePoints + "loads:\n"
                                                "  - {name: k, forces: {tip: [0, 0, 1]}}\n"
                                                "  - {name: k, forces: {hub: [0, 0, 1]}}\n"}},
                 {"scene.yaml:7:5: error: load 'k' is defined twice, first on line 6; give each load a name "
                  "of its own"}}),
    bad_scene_name);

class Geometry : public ::testing::TestWithParam<BadScene> {};

TEST_P(Geometry, EachFaultIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    BadScene, Geometry,
    ::testing::Values(
        BadScene{"PointsAtOnePosition",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: a, mass: 1, at: [1, 0, 0]}\n"
                   "  - {name: b, mass: 1, at: [1, 0, 0]}\n"
                   "links: {name: l, bar: [a, b], EA: 1e6}\n"}},
                 {"scene.yaml:4:8: error: link 'l' joins 'a', 'b', which are in one place, but a link needs "
                  "a length > 0; move a point or remove the link",
                  "scene.yaml:2:5: error: all 2 points are in one place, but a structure of more than one "
                  "point needs at least two places; move a point or keep only one"}},
        BadScene{
            "AxisAlongTheBeam",
            {{"scene.yaml",
              kThreePoints +
                  "links: {name: l, beam: [hub, mid], EA: 1, GJ: 1, EIy: 1, EIz: 1, y_axis: [2, 0, 0]}\n"}},
            {"scene.yaml:5:8: error: link 'l': y_axis (2 0 0) is parallel to the beam; give a direction "
             "across it, or omit y_axis to have one chosen"}},
        BadScene{
            "ZeroAxis",
            {{"scene.yaml",
              kThreePoints +
                  "links: {name: l, beam: [hub, mid], EA: 1, GJ: 1, EIy: 1, EIz: 1, y_axis: [0, 0, 0]}\n"}},
            {"scene.yaml:5:74: error: link 'l': y_axis is zero, but must be a direction"}}),
    bad_scene_name);

class Units : public ::testing::TestWithParam<BadScene> {};

TEST_P(Units, EachWrongUnitIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    BadScene, Units,
    ::testing::Values(
        BadScene{"Lengths",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: a, mass: 500 g, at: [5 mm, 12in, 1 km]}\n"}},
                 {"scene.yaml:2:21: error: point 'a': mass '500 g' has a unit, but must be a plain number in "
                  "SI units [kg]; write 0.5",
                  "scene.yaml:2:33: error: point 'a': at '5 mm' has a unit, but must be a plain number in SI "
                  "units [m]; write 0.005",
                  "scene.yaml:2:39: error: point 'a': at '12in' has a unit, but must be a plain number in SI "
                  "units [m]; write 0.3048",
                  "scene.yaml:2:45: error: point 'a': at '1 km' has a unit, but must be a plain number in SI "
                  "units [m]; write 1000"}},
        BadScene{"RateInKilohertz",
                 {{"scene.yaml", "rate: 1 kHz\n" + kThreePoints}},
                 {"scene.yaml:1:7: error: scene: rate '1 kHz' has a unit, but must be a plain number in SI "
                  "units [Hz]; write 1000"}},
        BadScene{"WrongKindOfUnit",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: a, mass: 3 mm, at: [0, 0, 0]}\n"}},
                 {"scene.yaml:2:21: error: point 'a': mass '3 mm' has a unit of another kind, but must be a "
                  "number >= 0 [kg], in SI without a unit"}},
        BadScene{"UnknownUnit",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: a, mass: 3 stone, at: [0, 0, 0]}\n"}},
                 {"scene.yaml:2:21: error: point 'a': mass '3 stone' is not a number, but must be a number "
                  ">= 0 [kg], in SI without a unit"}},
        BadScene{"CompoundUnits",
                 {{"scene.yaml",
                   kThreePoints + "links:\n"
                                  "  - {spring: [hub, tip], stiffness: 2.5 kN/mm}\n"
                                  "  - {beam: [hub, mid], EA: 70 MN, GJ: 5 N*m^2, EIy: 1 kN m^2, EIz: 1}\n"}},
                 {"scene.yaml:6:37: error: link 1: stiffness '2.5 kN/mm' has a unit, but must be a plain "
                  "number in SI units [N/m]; write 2500000",
                  "scene.yaml:7:28: error: link 2: EA '70 MN' has a unit, but must be a plain number in SI "
                  "units [N]; write 70000000",
                  "scene.yaml:7:39: error: link 2: GJ '5 N*m^2' has a unit, but must be a plain number in SI "
                  "units [N m^2]; write 5",
                  "scene.yaml:7:53: error: link 2: EIy '1 kN m^2' has a unit, but must be a plain number in "
                  "SI units [N m^2]; write 1000"}},
        BadScene{"PercentAndDegrees",
                 {{"scene.yaml", kThreePoints + "damping: {ratio: 2 %}\n"
                                                "initial: {angular_velocity: [10 deg/s, 0, 6 rpm]}\n"}},
                 {"scene.yaml:5:18: error: damping: ratio '2 %' has a unit, but must be a plain number in SI "
                  "units; write 0.02",
                  "scene.yaml:6:30: error: initial: angular_velocity '10 deg/s' has a unit, but must be a "
                  "plain number in SI units [rad/s]; write 0.174532925199",
                  "scene.yaml:6:43: error: initial: angular_velocity '6 rpm' has a unit, but must be a plain "
                  "number in SI units [rad/s]; write 0.628318530718"}},
        BadScene{
            "DecimalComma",
            {{"scene.yaml",
              "points:\n"
              "  - {name: a, mass: \"1,5\", at: [0, 0, 0]}\n"
              "  - name: b\n"
              "    mass: 1,5\n"
              "    at: [1_000, 0, 0]\n"}},
            {"scene.yaml:2:22: error: point 'a': mass '1,5' has a comma, but must be a number with a decimal "
             "point; write 1.5",
             "scene.yaml:4:11: error: point 'b': mass '1,5' has a comma, but must be a number with a decimal "
             "point; write 1.5",
             "scene.yaml:5:10: error: point 'b': at '1_000' has an underscore, but must be digits only"}},
        BadScene{
            "DecimalCommaInBraces",
            {{"scene.yaml",
              "points:\n"
              "  - {name: a, mass: 1,5, at: [0, 0, 0]}\n"
              "links:\n"
              "  - {spring: [a, b], stiffness: 1,5e3, viscous: 0,5}\n"
              "damping: {modes: {1: 0,02, 2: 0,03}, ratio: -1,5}\n"}},
            {"scene.yaml:2:21: error: point 'a': mass '1,5' has a comma, but must be a number with a decimal "
             "point; write 1.5",
             "scene.yaml:4:18: error: link 1: spring names the point 'b', which the scene does not have; "
             "it has a",
             "scene.yaml:4:33: error: link 1: stiffness '1,5e3' has a comma, but must be a number with a "
             "decimal point; write 1.5e3",
             "scene.yaml:4:49: error: link 1: viscous '0,5' has a comma, but must be a number with a decimal "
             "point; write 0.5",
             "scene.yaml:5:22: error: damping: mode 1 '0,02' has a comma, but must be a number with a "
             "decimal point; write 0.02",
             "scene.yaml:5:31: error: damping: mode 2 '0,03' has a comma, but must be a number with a "
             "decimal point; write 0.03",
             "scene.yaml:5:45: error: damping: ratio '-1,5' has a comma, but must be a number with a decimal "
             "point; write -1.5"}},
        BadScene{"DecimalCommaInLists",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: a, mass: 1, at: [0,5, 1, -2,25]}\n"
                   "  - {name: b, mass: 1, at: [0,5,1,0]}\n"
                   "  - {name: c, mass: 1, at: [0, 5, 1, 0]}\n"
                   "loads: {forces: {a: [0, 0, 1]}, table: {times: [0, 1,5], values: [0, 1]}}\n"
                   "feedback: {at: a, velocity: [1,5, 2, 3]}\n"}},
                 {"scene.yaml:2:28: error: point 'a': at has 5 items, but must be a list of 3 numbers [m]; a "
                  "comma separates items, so write 0.5, -2.25",
                  "scene.yaml:3:28: error: point 'b': at has 4 items, but must be a list of 3 numbers [m]; a "
                  "comma separates items, so write decimals with a point",
                  "scene.yaml:4:28: error: point 'c': at has 4 items, but must be a list of 3 numbers [m]",
                  "scene.yaml:5:66: error: load 1: table has 3 times and 2 values, but must have as many of "
                  "each; a comma separates items, so write 1.5",
                  "scene.yaml:6:29: error: feedback 1: velocity has 4 items, but must be a number, a list of "
                  "3 (one for each body axis) or 3 lists of 3 (rows of a matrix) [N s/m]; a comma separates "
                  "items, so write 1.5"}},
        BadScene{"LimitsOfCommands",
                 {{"scene.yaml",
                   "points: {mass: 2, at: [0, 0, 0]}\n"
                   "commands:\n"
                   "  max_age: 0\n"
                   "  sender_share: 1.5\n"
                   "  max_hold: 0\n"}},
                 {"scene.yaml:3:12: error: commands: max_age is 0 s, but must be > 0",
                  "scene.yaml:4:17: error: commands: sender_share is 1.5, but must be a fraction, at most 1",
                  "scene.yaml:5:13: error: commands: max_hold is 0 s, but must be > 0"}},
        BadScene{"CommasOfOtherKinds",
                 {{"scene.yaml",
                   "rate: 1,000\n"
                   "points: {mass: 2, at: [0, 0, 0]}\n"
                   "leave_out:\n"
                   "  horizon: 1,000,000\n"
                   "commands:\n"
                   "  force_limit: 1,5 kN\n"
                   "  torque_limit: 1,2,3\n"}},
                 {"scene.yaml:1:7: error: scene: rate '1,000' has a comma, but must be a number with a "
                  "decimal point; write 1.000, or 1000",
                  "scene.yaml:4:12: error: leave_out: horizon '1,000,000' has a comma, but must be a number "
                  "with a decimal point; write 1000000",
                  "scene.yaml:6:16: error: commands: force_limit '1,5 kN' has a comma, but must be a number "
                  "with a decimal point",
                  "scene.yaml:7:17: error: commands: torque_limit '1,2,3' has a comma, but must be a number "
                  "with a decimal point"}}),
    bad_scene_name);

class NumberForAMapping : public ::testing::TestWithParam<BadScene> {};

TEST_P(NumberForAMapping, ANumberInPlaceOfAMappingIsRefusedWithTheValidMapping) {
  expect_refused(GetParam());
}

// the text under test is on line 5
BadScene bad_number(const std::string& name, const std::string& text, std::vector<std::string> messages) {
  return {name, {{"scene.yaml", kThreePoints + text + "\n"}}, std::move(messages)};
}

INSTANTIATE_TEST_SUITE_P(
    BadScene, NumberForAMapping,
    ::testing::Values(
        bad_number("Damping", "damping: 0.02",
                   {"scene.yaml:5:10: error: damping is the text '0.02', but must be a mapping of ratio, "
                    "modes, rayleigh: write damping: {ratio: 0.02}"}),
        bad_number("DampingInPercent", "damping: 2 %",
                   {"scene.yaml:5:10: error: damping is the text '2 %', but must be a mapping of ratio, "
                    "modes, rayleigh: write damping: {ratio: NUMBER}"}),
        bad_number("DampingIsAWord", "damping: none",
                   {"scene.yaml:5:10: error: damping is the text 'none', but must be a mapping of ratio, "
                    "modes, rayleigh"}),
        bad_number("Publication", "publish: {points: 50}",
                   {"scene.yaml:5:19: error: publish: points is the text '50', but must be a mapping of "
                    "rate, of: write points: {rate: 50}"}),
        bad_number("Histories",
                   "loads: [{forces: {tip: [0, 0, 1]}, pulse: 1}, {forces: {tip: [0, 0, 1]}, sine: 2}]",
                   {"scene.yaml:5:43: error: load 1: pulse is the text '1', but must be a mapping of start, "
                    "duration: write pulse: {duration: 1}",
                    "scene.yaml:5:80: error: load 2: sine is the text '2', but must be a mapping of "
                    "frequency, phase: write sine: {frequency: 2}"})),
    bad_scene_name);

}  // namespace
}  // namespace freeflex::testing
