// The scenes in these tests are refused for their syntax or the types of their values.
#include "tests/scene/bad_scene.hpp"

namespace freeflex::testing {
namespace {

class Syntax : public ::testing::TestWithParam<BadScene> {};

TEST_P(Syntax, EachSyntaxErrorIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    BadScene, Syntax,
    ::testing::Values(
        BadScene{"UnclosedBracket",
                 {{"scene.yaml", "points: [{name: a, mass: 1, at: [0, 0, 0]}\n"}},
                 {"scene.yaml:2:1: error: YAML syntax: a flow sequence has no closing bracket; it was opened "
                  "on line 1, column 9; close it with ']'"}},
        BadScene{
            "UnclosedQuote",
            {{"scene.yaml",
              "name: \"boom\n"
              "points: []\n"}},
            {"scene.yaml:1:7: error: YAML syntax: wrongly indented double-quoted scalar; close the quote"}},
        BadScene{"TabIndent",
                 {{"scene.yaml",
                   "points:\n"
                   "\t- {name: a}\n"}},
                 {"scene.yaml:2:1: error: YAML syntax: tab character may not be used as indentation; indent "
                  "with spaces"}},
        BadScene{"BadIndent",
                 {{"scene.yaml",
                   "damping:\n"
                   "    ratio: 0.1\n"
                   "  modes: {}\n"}},
                 {"scene.yaml:3:3: error: YAML syntax: invalid indentation in mapping; items of one mapping "
                  "or list must start in the same column"}},
        BadScene{"TextAfterValue",
                 {{"scene.yaml", "name: 'boom' boom\n"}},
                 {"scene.yaml:1:14: error: YAML syntax: invalid trailing content after single-quoted scalar; "
                  "quote all of a value or nothing of it; separate values by commas"}},
        BadScene{"ControlByte",
                 {{"scene.yaml",
                   "name: bo\x01"
                   "om\n"}},
                 {"scene.yaml:1:9: error: byte 0x01 is not text, but a scene must be UTF-8 without control "
                  "characters"}},
        BadScene{"Latin1",
                 {{"scene.yaml",
                   "name: b\xe9"
                   "am\n"}},
                 {"scene.yaml:1:8: error: byte 0xe9 is not text, but a scene must be UTF-8 without control "
                  "characters"}},
        BadScene{"TwoDocuments",
                 {{"scene.yaml",
                   "points: []\n"
                   "---\n"
                   "points: []\n"}},
                 {"scene.yaml:2:1: error: a second document starts here, but a scene is one document; remove "
                  "the others"}},
        BadScene{"EmptyFile",
                 {{"scene.yaml", "# nothing here\n"}},
                 {"scene.yaml:1:1: error: the file is empty, but a scene needs at least points"}},
        BadScene{
            "Tag",
            {{"scene.yaml", kThreePoints + "gravity: !!seq [0, 0, 0]\n"}},
            {"scene.yaml:5:16: error: tag 'tag:yaml.org,2002:seq' has no meaning in a scene; remove it"}},
        BadScene{"UnknownAlias",
                 {{"scene.yaml",
                   "a: &hub [0, 0, 0]\n"
                   "points:\n"
                   "  - {name: a, mass: 1, at: *hbu}\n"}},
                 {"scene.yaml:3:29: error: alias 'hbu' has no anchor before it (did you mean 'hub'?)"}}),
    bad_scene_name);

class Bracket : public ::testing::TestWithParam<BadScene> {};

TEST_P(Bracket, AnUnclosedBracketIsReportedWithThePositionOfItsOpening) { expect_refused(GetParam()); }

const std::string kOpenBrace =
    "YAML syntax: a flow mapping has no closing brace; it was opened on line 2, column 5; close it with '}'";

INSTANTIATE_TEST_SUITE_P(
    BadScene, Bracket,
    ::testing::Values(
        BadScene{"BraceOpenBeforeTheNextItem",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: hub, mass: 40\n"
                   "  - {name: tip, mass: 40, at: [1, 0, 0]}\n"}},
                 {"scene.yaml:3:3: error: " + kOpenBrace}},
        BadScene{"BraceOpenBehindAList",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: hub, mass: 40, at: [0, 0, 0]\n"
                   "  # a '}' in a comment closes nothing, nor does one in quotes\n"
                   "  - {name: \"}\", mass: 40, at: [1, 0, 0]}\n"}},
                 {"scene.yaml:4:3: error: " + kOpenBrace}},
        BadScene{"BraceOpenBehindAComma",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: hub, mass: 40,\n"
                   "  - {name: tip, mass: 40, at: [1, 0, 0]}\n"
                   "links: []\n"}},
                 {"scene.yaml:3:3: error: " + kOpenBrace}},
        BadScene{"BraceOpenBeforeTheNextSection",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: hub, mass: 40, at: [0, 0, 0]\n"
                   "\n"
                   "links: []\n"}},
                 {"scene.yaml:4:1: error: " + kOpenBrace}},
        BadScene{"BraceOpenAtTheEnd",
                 {{"scene.yaml",
                   "links: []\n"
                   "xx: {ratio: 0.01, modes: {1: 0.02}"}},
                 {"scene.yaml:2:35: error: " + kOpenBrace}},
        BadScene{"BracketAndBraceOpen",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: hub, mass: 40, at: [0, 0, 0\n"
                   "  - {name: tip, mass: 40, at: [1, 0, 0]}\n"}},
                 {"scene.yaml:3:3: error: YAML syntax: a flow sequence has no closing bracket; it was opened "
                  "on line 2, column 31; close it with ']', and the '{' on line 2, column 5 with '}'"}},
        BadScene{"BracketOpenInABrace",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: hub, mass: 40, at: [0, 0, 0}\n"}},
                 {"scene.yaml:2:39: error: YAML syntax: a flow sequence has no closing bracket; it was "
                  "opened on line 2, column 31; close it with ']' before this '}', or remove this one"}},
        BadScene{
            "CommaMissingInABraceThatStaysOpen",
            {{"scene.yaml",
              "points:\n"
              "  - {name: hub mass: 40\n"
              "  - {name: tip, mass: 40, at: [1, 0, 0]}\n"}},
            {"scene.yaml:2:20: error: YAML syntax: missing comma in flow mapping; separate items by commas",
             "scene.yaml:3:3: error: " + kOpenBrace}},
        BadScene{
            "CommaMissingInABraceThatIsClosed",
            {{"scene.yaml",
              "points:\n"
              "  - {name: hub, mass: 40\n"
              "    at: [0, 0, 0]}\n"}},
            {"scene.yaml:3:7: error: YAML syntax: missing comma in flow mapping; separate items by commas"}},
        BadScene{"BraceNeverOpened",
                 {{"scene.yaml",
                   "points:\n"
                   "  - name: hub, mass: 40, at: [0, 0, 0]}\n"}},
                 {"scene.yaml:2:20: error: YAML syntax: invalid nested block mapping on the same line; give "
                  "each key a line of its own, or open a brace before the first: {name: hub, mass: 40}"}},
        BadScene{"CommaAtTheStart",
                 {{"scene.yaml", "rate: ,5\n"}},
                 {"scene.yaml:1:7: error: YAML syntax: did not find expected node content; a value is "
                  "missing here, or begins with a comma; write 0.5, not ,5"}},
        BadScene{
            "BracketNotIndented",
            {{"scene.yaml",
              "points: [\n"
              "  {name: a, mass: 1, at: [0, 0, 0]}\n"
              "]\n"}},
            {"scene.yaml:3:1: error: YAML syntax: wrongly indented sequence end in flow mode; indent the "
             "closing bracket deeper than the line that opens it"}}),
    bad_scene_name);

class Type : public ::testing::TestWithParam<BadScene> {};

TEST_P(Type, EachWrongTypeIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    BadScene, Type,
    ::testing::Values(
        BadScene{
            "SceneIsAList",
            {{"scene.yaml",
              "- points\n"
              "- links\n"}},
            {"scene.yaml:1:1: error: scene is a list, but must be a mapping of name, rate, fidelity, "
             "tolerance, integration, verdict, points, links, groups, damping, gravity, attractor, initial, "
             "wheels, loads, feedback, leave_out, modes, publish, commands"}},
        BadScene{"PointsAreText",
                 {{"scene.yaml", "points: points.csv\n"}},
                 {"scene.yaml:1:9: error: points is the text 'points.csv', but must be a list of points or "
                  "{csv: FILE}"}},
        BadScene{"PointIsText",
                 {{"scene.yaml", "points: [hub]\n"}},
                 {"scene.yaml:1:10: error: point 1 is the text 'hub', but must be a mapping of name, mass, "
                  "at, inertia, offset, axes"}},
        BadScene{"MassIsText",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: a, mass: heavy, at: [0, 0, 0]}\n"}},
                 {"scene.yaml:2:21: error: point 'a': mass 'heavy' is not a number, but must be a number >= "
                  "0 [kg]"}},
        BadScene{"MassIsQuoted",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: a, mass: \"2\", at: [0, 0, 0]}\n"}},
                 {"scene.yaml:2:22: error: point 'a': mass '2' is text in quotes, but must be a number >= 0 "
                  "[kg]; remove the quotes"}},
        BadScene{"MassIsEmpty",
                 {{"scene.yaml",
                   "points:\n"
                   "  - name: a\n"
                   "    mass:\n"
                   "    at: [0, 0, 0]\n"}},
                 {"scene.yaml:3:5: error: point 'a': mass is empty, but must be a number >= 0 [kg]"}},
        BadScene{"PositionOfTwoNumbers",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: a, mass: 1, at: [0, 0]}\n"}},
                 {"scene.yaml:2:28: error: point 'a': at has 2 items, but must be a list of 3 numbers [m]"}},
        BadScene{
            "UnknownKeys",
            {{"scene.yaml", kThreePoints + "dampnig: {ratio: 0.1}\n"
                                           "links:\n"
                                           "  - {name: l, spring: [hub, tip], stifness: 10}\n"}},
            {"scene.yaml:5:1: error: scene: the key 'dampnig' is unknown (did you mean 'damping'?); allowed "
             "are name, rate, fidelity, tolerance, integration, verdict, points, links, groups, damping, "
             "gravity, "
             "attractor, initial, wheels, loads, feedback, leave_out, modes, publish, commands",
             "scene.yaml:7:35: error: link 'l': the key 'stifness' is unknown (did you mean 'stiffness'?); "
             "allowed are name, spring, stiffness, viscous, loss_factor"}},
        BadScene{"MissingPoints",
                 {{"scene.yaml",
                   "name: boom\n"
                   "links: []\n"}},
                 {"scene.yaml:1:1: error: scene: points is missing; it must be a list of {name, mass, at} or "
                  "{csv: FILE}"}},
        BadScene{"LinkWithoutKind",
                 {{"scene.yaml", kThreePoints + "links:\n"
                                                "  - {name: l, sprng: [hub, tip], stiffness: 10}\n"}},
                 {"scene.yaml:6:5: error: link 'l' has no kind (did you mean 'spring'?); it must have one of "
                  "spring, bar, beam, bending, torsion, plate, matrix, flexibility, rigid, dashpot"}},
        BadScene{
            "LinkOfTwoKinds",
            {{"scene.yaml", kThreePoints + "links:\n"
                                           "  - {spring: [hub, tip], bar: [hub, mid], stiffness: 10}\n"}},
            {"scene.yaml:6:5: error: link 1 is both spring and bar; it must have one of spring, bar, beam, "
             "bending, torsion, plate, matrix, flexibility, rigid, dashpot"}},
        BadScene{"GroupIsMapping",
                 {{"scene.yaml", kThreePoints + "groups: {panel: {hub: 1}}\n"}},
                 {"scene.yaml:5:17: error: group 'panel' is a mapping, but must be all, or a list of names "
                  "and ranges a..b; [] for none"}},
        BadScene{"UnknownAxes",
                 {{"scene.yaml", kThreePoints + "loads:\n"
                                                "  - {axes: bdy, forces: {tip: [0, 0, 1]}}\n"}},
                 {"scene.yaml:6:12: error: load 1: axes is the text 'bdy', but must be world, body or local "
                  "(did you mean 'body'?)"}},
        BadScene{
            "TwoHistories",
            {{"scene.yaml",
              kThreePoints + "loads:\n"
                             "  - {forces: {tip: [0, 0, 1]}, pulse: {duration: 1}, sine: {frequency: 1}}\n"}},
            {"scene.yaml:6:60: error: load 1 has a second history, but may have only one of pulse, sine and "
             "table, or none for a constant load"}},
        BadScene{"LoadWithoutForces",
                 {{"scene.yaml", kThreePoints + "loads: [{name: idle}]\n"}},
                 {"scene.yaml:5:9: error: load 'idle' has neither forces, wrenches, torques nor wheels; it "
                  "must have one"}},
        BadScene{"ModeNotANumber",
                 {{"scene.yaml", kThreePoints + "damping: {modes: {first: 0.1}}\n"}},
                 {"scene.yaml:5:19: error: damping: modes: 'first' is not the number of a mode; it must be a "
                  "whole number from 1"}}),
    bad_scene_name);

}  // namespace
}  // namespace freeflex::testing
