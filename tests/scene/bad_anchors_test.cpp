// A fault is reported once, at the position where it was written. Aliases do not repeat the fault, and if a
// key is misspelt, the correct key is not reported as missing too.
#include "tests/scene/bad_scene.hpp"

namespace freeflex::testing {
namespace {

class WrittenOnce : public ::testing::TestWithParam<BadScene> {};

TEST_P(WrittenOnce, AFaultThatIsWrittenOnceIsReportedOnce) { expect_refused(GetParam()); }

const std::string kKeysOfPoints = "allowed are name, mass, at, inertia, offset, axes";

INSTANTIATE_TEST_SUITE_P(
    Anchor, WrittenOnce,
    ::testing::Values(
        BadScene{"FourFaults",
                 {{"scene.yaml",
                   "points:\n"
                   "  - &p {name: a, mas: 1, at: [0, 0]}\n"
                   "  - {<<: *p, name: b}\n"
                   "  - {<<: *p, name: c}\n"
                   "links:\n"
                   "  - &l {name: ab, beam: [a, b], EA: -1, GJ: 1, EIy: 1, EIZ: 1}\n"
                   "  - {<<: *l, name: bc, beam: [b, c]}\n"}},
                 {"scene.yaml:2:18: error: point 'a': the key 'mas' is unknown (did you mean 'mass'?); " +
                      kKeysOfPoints,
                  "scene.yaml:2:30: error: point 'a': at has 2 items, but must be a list of 3 numbers [m]",
                  "scene.yaml:6:37: error: link 'ab': EA is -1 N, but must be > 0",
                  "scene.yaml:6:56: error: link 'ab': the key 'EIZ' is unknown (did you mean 'EIz'?); "
                  "allowed are name, beam, EA, GJ, EIy, EIz, GAy, GAz, y_axis, release, mass_per_length, "
                  "lumped, mean_axial, loss_factor"}},
        BadScene{"MissingKeyOfAMergedMapping",
                 {{"scene.yaml",
                   "points:\n"
                   "  - &p {name: a, at: [0, 0, 0]}\n"
                   "  - &q {<<: *p, name: b}\n"
                   "  - {<<: *q, name: c}\n"}},
                 {"scene.yaml:2:8: error: point 'a': mass is missing; it must be a number >= 0 [kg]"}},
        BadScene{"MissingKindOfAMergedLink",
                 {{"scene.yaml", kThreePoints + "links:\n"
                                                "  - &l {sprong: [hub, mid], stiffness: 1}\n"
                                                "  - {<<: *l, name: second}\n"}},
                 {"scene.yaml:6:8: error: link 1 has no kind (did you mean 'spring'?); it must have one of "
                  "spring, bar, beam, bending, torsion, plate, matrix, flexibility, rigid, dashpot"}},
        BadScene{"MergedMappingThatGivesTheKeyItself",
                 {{"scene.yaml",
                   "points:\n"
                   "  - &p {name: a, mas: 1, at: [0, 0, 0]}\n"
                   "  - {<<: *p, name: b, mass: 2}\n"}},
                 {"scene.yaml:2:18: error: point 'a': the key 'mas' is unknown (did you mean 'mass'?); " +
                  kKeysOfPoints}},
        BadScene{"ListThatManyLinksShare",
                 {{"scene.yaml", kThreePoints + "links:\n"
                                                "  - {spring: &ends [hub, tpi], stiffness: 1}\n"
                                                "  - {spring: *ends, stiffness: 2}\n"
                                                "  - {dashpot: *ends, damping: 2}\n"}},
                 {"scene.yaml:6:26: error: link 1: spring names the point 'tpi', which the scene does not "
                  "have (did you mean 'tip'?)"}},
        BadScene{
            "ForceThatManyPointsShare",
            {{"scene.yaml", kThreePoints + "loads: {forces: {hub: &f [0, 1], mid: *f, tip: *f}}\n"}},
            {"scene.yaml:5:26: error: load 1: forces: hub has 2 items, but must be a list of 3 numbers [N]"}},
        BadScene{"NumberThatOneListRepeats",
                 {{"scene.yaml", kThreePoints + "gravity: [&g 1 m, *g, *g]\n"}},
                 {"scene.yaml:5:14: error: scene: gravity '1 m' has a unit of another kind, but must be a "
                  "number [m/s^2], in SI without a unit"}},
        BadScene{"EqualFaultsOfTwoItems",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: a, mass: -1, at: [0, 0, 0]}\n"
                   "  - {name: b, mass: -1, at: [0, 0, 0]}\n"}},
                 {"scene.yaml:2:21: error: point 'a': mass is -1 kg, but must be >= 0",
                  "scene.yaml:3:21: error: point 'b': mass is -1 kg, but must be >= 0"}}),
    bad_scene_name);

INSTANTIATE_TEST_SUITE_P(
    MisspeltKey, WrittenOnce,
    ::testing::Values(
        BadScene{"RequiredKey",
                 {{"scene.yaml", "points:\n  - {name: a, mass: 1, att: [0, 0, 0]}\n"}},
                 {"scene.yaml:2:24: error: point 'a': the key 'att' is unknown (did you mean 'at'?); " +
                  kKeysOfPoints}},
        BadScene{"WithoutABlankBehindTheColon",
                 {{"scene.yaml", "points:\n  - {name: a, mass:1, at: [0, 0, 0]}\n"}},
                 {"scene.yaml:2:15: error: point 'a': the key 'mass:1' is unknown (write a space after the "
                  "colon: 'mass: 1'); " +
                  kKeysOfPoints}},
        BadScene{"Name",
                 {{"scene.yaml",
                   "points: [{nmae: a, mass: 1, at: [0, 0, 0]}, {name: b, mass: 1, at: [1, 0, 0]}]\n"
                   "links: {spring: [a, b], stiffness: 1}\n"}},
                 {"scene.yaml:1:11: error: point 1: the key 'nmae' is unknown (did you mean 'name'?); " +
                  kKeysOfPoints}},
        bad_line("OneOfSeveralKinds", "loads: {force: {tip: [0, 0, 1]}}",
                 {"scene.yaml:5:9: error: load 1: the key 'force' is unknown (did you mean 'forces'?); "
                  "allowed are name, axes, forces, wrenches, torques, wheels, pulse, sine, table"}),
        bad_line("Gain", "feedback: {at: tip, velocty: -1}",
                 {"scene.yaml:5:21: error: feedback 1: the key 'velocty' is unknown (did you mean "
                  "'velocity'?); allowed are name, at, from, displacement, velocity, acceleration"}),
        bad_line("Modes", "modes: {bellow: 3}",
                 {"scene.yaml:5:9: error: modes: the key 'bellow' is unknown (did you mean 'below'?); "
                  "allowed are below, count"}),
        bad_line(
            "Groups", "gruops: {end: tip}\nloads: {wrenches: {end: {force: [0, 0, 1]}}}",
            {"scene.yaml:5:1: error: scene: the key 'gruops' is unknown (did you mean 'groups'?); allowed "
             "are name, rate, fidelity, tolerance, integration, verdict, points, links, groups, damping, "
             "gravity, "
             "attractor, initial, wheels, loads, feedback, leave_out, modes, publish, commands"}),
        BadScene{"Column",
                 {{"scene.yaml", "points: {csv: points.csv}\n"}, {"points.csv", "mas,x,y,z\n1,0,0,0\n"}},
                 {"points.csv:1:1: error: the column 'mas' is unknown (did you mean 'mass'?); allowed are "
                  "name, mass, x, y, z"}},
        BadScene{"WithoutASimilarKey",
                 {{"scene.yaml", "points:\n  - {name: a, weight: 1, at: [0, 0, 0]}\n"}},
                 {"scene.yaml:2:5: error: point 'a': mass is missing; it must be a number >= 0 [kg]",
                  "scene.yaml:2:15: error: point 'a': the key 'weight' is unknown; " + kKeysOfPoints}}),
    bad_scene_name);

}  // namespace
}  // namespace freeflex::testing
