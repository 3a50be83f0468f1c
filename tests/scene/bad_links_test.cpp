// The links in these tests are refused for the points, values, releases or losses that their kind requires.
#include "tests/scene/bad_scene.hpp"

namespace freeflex::testing {
namespace {

// the link under test is on line 6
BadScene bad_link(const std::string& name, const std::string& link, std::vector<std::string> messages) {
  return {name, {{"scene.yaml", kThreePoints + "links:\n  - " + link + "\n"}}, std::move(messages)};
}

const std::string kBeam = "{name: l, beam: [hub, mid], EA: 1, GJ: 1, EIy: 1, EIz: 1, ";

class ListOfLinks : public ::testing::TestWithParam<BadScene> {};

TEST_P(ListOfLinks, EachFaultyItemIsReportedAtItsPosition) { expect_refused(GetParam()); }

const std::string kKinds =
    "it must have one of spring, bar, beam, bending, torsion, plate, matrix, flexibility, rigid, dashpot";

INSTANTIATE_TEST_SUITE_P(
    BadScene, ListOfLinks,
    ::testing::Values(
        bad_link(
            "EveryItemIsFaulty",
            "{spring: [hub, tpi], stiffness: 1}\n"
            "  - {sprng: [hub, tip], stiffness: 1}\n"
            "  - {bar: [hub], EA: 1}\n"
            "  - {spring: [[hub, mid], [mid, tip]], stiffness: 1}\n"
            "  - {spring: [hub, mid, mid], stiffness: 1}\n"
            "  - {name: strut, bar: [hub, tip], EA: 0}\n"
            "  - {bar: [hub, tip], EA: -5}",
            {"scene.yaml:6:20: error: link 1: spring names the point 'tpi', which the scene does not have "
             "(did you mean 'tip'?)",
             "scene.yaml:7:5: error: link 2 has no kind (did you mean 'spring'?); " + kKinds,
             "scene.yaml:8:11: error: link 3: bar has 1 point, but must be a list of 2 or more",
             "scene.yaml:9:15: error: link 4: spring holds a list, but must be the name of a point",
             "scene.yaml:9:27: error: link 4: spring holds a list, but must be the name of a point",
             "scene.yaml:10:14: error: link 5: spring joins the point 'mid' to itself; give two different "
             "points",
             "scene.yaml:11:40: error: link 'strut': EA is 0 N, but must be > 0",
             "scene.yaml:12:27: error: link 7: EA is -5 N, but must be > 0"}),
        bad_link("AfterAChain",
                 "{spring: [hub..tip, hub], stiffness: 1}\n"
                 "  - {spring: [hub, tip], stiffness: -5}",
                 {"scene.yaml:7:37: error: link 2: stiffness is -5 N/m, but must be > 0"}),
        // the messages give the positions of the two links in the list, 2.2 and 3; their numbers among all
        // links are 5 and 6
        bad_link("PhysicsAfterAChain",
                 "{spring: [hub..tip, hub], stiffness: 1}\n"
                 "  - {beam: [hub, mid, tip], EA: 1, GJ: 1, EIy: 1, EIz: 1, y_axis: [0, 1, 0]}\n"
                 "  - {beam: [hub, mid], EA: 1, GJ: 1, EIy: 1, EIz: 1, y_axis: [1, 0, 0]}",
                 {"scene.yaml:7:5: error: link 2.2: y_axis (0 1 0) is parallel to the beam; give a "
                  "direction across it, or omit y_axis to have one chosen",
                  "scene.yaml:8:5: error: link 3: y_axis (1 0 0) is parallel to the beam; give a direction "
                  "across it, or omit y_axis to have one chosen"}),
        // links that could not be read are counted too
        BadScene{
            "PhysicsAndReading",
            {{"scene.yaml",
              "points:\n"
              "  - {name: a, mass: 1, at: [0, 0, 0]}\n"
              "  - {name: b, mass: 1, at: [0, 0, 0]}\n"
              "  - {name: c, mass: 1, at: [1, 0, 0]}\n"
              "links:\n"
              "  - {spring: [a, d], stiffness: 1}\n"
              "  - {spring: [a, b], stiffness: 1}\n"}},
            {"scene.yaml:6:18: error: link 1: spring names the point 'd', which the scene does not have; "
             "it has a, b, c",
             "scene.yaml:7:5: error: link 2 joins 'a', 'b', which are in one place, but a link needs a "
             "length > 0; move a point or remove the link"}}),
    bad_scene_name);

class BeamKeys : public ::testing::TestWithParam<BadScene> {};

TEST_P(BeamKeys, EachFaultIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    BadScene, BeamKeys,
    ::testing::Values(
        bad_link("ZeroShearStiffness", kBeam + "GAy: 0, GAz: -2}",
                 {"scene.yaml:6:68: error: link 'l': GAy is 0 N, but must be > 0",
                  "scene.yaml:6:76: error: link 'l': GAz is -2 N, but must be > 0"}),
        bad_link("ShearStiffnessOfAnotherKind", kBeam + "GAy: 5 kN m^2, GAz: 3 kN}",
                 {"scene.yaml:6:68: error: link 'l': GAy '5 kN m^2' has a unit of another kind, but must be "
                  "a number > 0 [N], in SI without a unit",
                  "scene.yaml:6:83: error: link 'l': GAz '3 kN' has a unit, but must be a plain number in SI "
                  "units [N]; write 3000"}),
        bad_link("ReleaseIsAList", kBeam + "release: [x, y]}",
                 {"scene.yaml:6:72: error: link 'l': release is a list, but must be a mapping of from, to"}),
        bad_link("ReleaseOfAnUnknownEnd", kBeam + "release: {form: [x]}}",
                 {"scene.yaml:6:73: error: link 'l': release: the key 'form' is unknown (did you mean "
                  "'from'?); allowed are from, to"}),
        bad_link("ReleaseOfAnUnknownAxis", kBeam + "release: {from: [x, w], to: [rx, ~, [x]]}}",
                 {"scene.yaml:6:83: error: link 'l': release: from holds the text 'w', but must be x, y or "
                  "z, a local axis about which the end rotates freely",
                  "scene.yaml:6:92: error: link 'l': release: to holds the text 'rx', but must be x, y or z, "
                  "a local axis about which the end rotates freely",
                  "scene.yaml:6:96: error: link 'l': release: to holds nothing, but must be x, y or z, a "
                  "local axis about which the end rotates freely",
                  "scene.yaml:6:99: error: link 'l': release: to holds a list, but must be x, y or z, a "
                  "local axis about which the end rotates freely"}),
        bad_link("ReleaseOfNoAxis", kBeam + "release: {from: {x: true}, to: }}",
                 {"scene.yaml:6:79: error: link 'l': release: from is a mapping, but must be a list of x, y, "
                  "z, the local axes about which the end rotates freely",
                  "scene.yaml:6:90: error: link 'l': release: to is empty, but must be a list of x, y, z, "
                  "the local axes about which the end rotates freely"}),
        bad_link("ReleaseTwice", kBeam + "release: {to: [z, y, z]}}",
                 {"scene.yaml:6:84: error: link 'l': release: to: 'z' appears twice; remove one"}),
        bad_link("ReleaseOfFourAxes", kBeam + "release: {to: [x, y, z, z]}}",
                 {"scene.yaml:6:77: error: link 'l': release: to has 4 items, but must be a list of x, y, z, "
                  "the local axes about which the end rotates freely"}),
        bad_link("ReleaseOnAChain",
                 "{name: tube, beam: [hub..tip], EA: 1, GJ: 1, EIy: 1, EIz: 1, release: {from: [y]}}",
                 {"scene.yaml:6:75: error: link 'tube': release belongs to one beam, but this chain has 2; "
                  "write the beam with released ends as a link of its own"}),
        bad_link("Viscous", kBeam + "viscous: 0.1}",
                 {"scene.yaml:6:63: error: link 'l': viscous is not for beams and plates, because rotations "
                  "carry no mass, and a moment that depends on their rate would make them states of their "
                  "own; use loss_factor, or damping: rayleigh"})),
    bad_scene_name);

class AngleSpring : public ::testing::TestWithParam<BadScene> {};

TEST_P(AngleSpring, EachFaultIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    BadScene, AngleSpring,
    ::testing::Values(
        bad_link("BendingOfTwoPoints", "{name: l, bending: [hub, mid], stiffness: 5}",
                 {"scene.yaml:6:24: error: link 'l': bending has 2 points, but must be a list of 3 or more"}),
        bad_link("TorsionOfThreePoints", "{name: l, torsion: [hub..tip], stiffness: 5}",
                 {"scene.yaml:6:24: error: link 'l': torsion has 3 points, but must be a list of 4 or more"}),
        bad_link("BendingBackAndForth", "{name: l, bending: [hub, mid, hub], stiffness: 5}",
                 {"scene.yaml:6:24: error: link 'l': bending names the point 'hub' twice among 3 successive "
                  "points, which must be different points"}),
        bad_link("TorsionOfATriangle", "{name: l, torsion: [hub..tip, hub], stiffness: 5}",
                 {"scene.yaml:6:24: error: link 'l': torsion names the point 'hub' twice among 4 successive "
                  "points, which must be different points"}),
        bad_link("BendingWithoutStiffness", "{name: l, bending: [hub..tip], EI: 5}",
                 {"scene.yaml:6:5: error: link 'l': stiffness is missing; it must be a number > 0 [N m/rad]",
                  "scene.yaml:6:36: error: link 'l': the key 'EI' is unknown; allowed are name, bending, "
                  "stiffness, viscous, loss_factor"}),
        bad_link("TorsionStiffnessInAnotherUnit", "{bending: [hub..tip], stiffness: 5 kN m/rad, viscous: -1}",
                 {"scene.yaml:6:38: error: link 1: stiffness '5 kN m/rad' has a unit, but must be a plain "
                  "number in SI units [N m/rad]; write 5000",
                  "scene.yaml:6:59: error: link 1: viscous is -1 s, but must be >= 0"}),
        bad_link("BendingStiffnessNotPositive", "{bending: [hub..tip], stiffness: -5, loss_factor: 2 %}",
                 {"scene.yaml:6:38: error: link 1: stiffness is -5 N m/rad, but must be > 0",
                  "scene.yaml:6:55: error: link 1: loss_factor '2 %' has a unit, but must be a plain number "
                  "in SI units; write 0.02"})),
    bad_scene_name);

class PlateLink : public ::testing::TestWithParam<BadScene> {};

TEST_P(PlateLink, EachFaultIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    BadScene, PlateLink,
    ::testing::Values(
        bad_link("TwoPoints", "{name: l, plate: [hub, mid], E: 7e10, nu: 0.3, thickness: 0.01}",
                 {"scene.yaml:6:22: error: link 'l': plate has 2 points, but must be a list of 3"}),
        BadScene{"FourPoints",
                 {{"scene.yaml",
                   "points: {csv: points.csv}\n"
                   "links: {plate: all, E: 7e10, nu: 0.3, thickness: 0.01}\n"},
                  {"points.csv", "mass,x,y,z\n1,0,0,0\n1,1,0,0\n1,1,1,0\n1,0,1,0\n"}},
                 {"scene.yaml:2:16: error: link 1: plate has 4 points, but must be a list of 3"}},
        bad_link("PointTwice", "{name: l, plate: [hub, mid, hub], E: 7e10, nu: 0.3, thickness: 0.01}",
                 {"scene.yaml:6:33: error: link 'l': plate: 'hub' names a point that is in the list already; "
                  "remove it"}),
        bad_link("PoissonRatioOfAFluid", "{name: l, plate: [hub..tip], E: 7e10, nu: 0.5, thickness: 0.01}",
                 {"scene.yaml:6:47: error: link 'l': nu is 0.5, but must be > -1 and < 0.5"}),
        bad_link("PoissonRatioTooLow", "{name: l, plate: [hub..tip], E: 7e10, nu: -1, thickness: 0.01}",
                 {"scene.yaml:6:47: error: link 'l': nu is -1, but must be > -1 and < 0.5"}),
        bad_link("Units", "{name: l, plate: [hub..tip], E: 70 GPa, nu: a third, thickness: 2 mm}",
                 {"scene.yaml:6:37: error: link 'l': E '70 GPa' has a unit, but must be a plain number in SI "
                  "units [Pa]; write 70000000000",
                  "scene.yaml:6:49: error: link 'l': nu 'a third' is not a number, but must be a number > -1 "
                  "and < 0.5",
                  "scene.yaml:6:69: error: link 'l': thickness '2 mm' has a unit, but must be a plain number "
                  "in SI units [m]; write 0.002"}),
        bad_link("OnlyPoints", "{name: l, plate: [hub..tip]}",
                 {"scene.yaml:6:5: error: link 'l': E is missing; it must be a number > 0 [Pa]",
                  "scene.yaml:6:5: error: link 'l': nu is missing; it must be a number > -1 and < 0.5",
                  "scene.yaml:6:5: error: link 'l': thickness is missing; it must be a number > 0 [m]"}),
        bad_link("Viscous", "{name: l, plate: [hub..tip], E: 7e10, nu: 0.3, thickness: 0.01, viscous: 1}",
                 {"scene.yaml:6:69: error: link 'l': viscous is not for beams and plates, because rotations "
                  "carry no mass, and a moment that depends on their rate would make them states of their "
                  "own; use loss_factor, or damping: rayleigh"})),
    bad_scene_name);

class RigidLink : public ::testing::TestWithParam<BadScene> {};

TEST_P(RigidLink, EachFaultIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    BadScene, RigidLink,
    ::testing::Values(
        bad_link("OnePoint", "{name: l, rigid: hub}",
                 {"scene.yaml:6:22: error: link 'l': rigid has 1 point, but must be a list of 2 or more"}),
        bad_link("PointTwice", "{name: l, rigid: [hub, mid, hub]}",
                 {"scene.yaml:6:33: error: link 'l': rigid: 'hub' names a point that is in the list already; "
                  "remove it"}),
        bad_link("UnknownPoint", "{name: l, rigid: [hub, mdi]}",
                 {"scene.yaml:6:28: error: link 'l': rigid names the point 'mdi', which the scene does not "
                  "have (did you mean 'mid'?)"}),
        bad_link("Losses", "{name: l, rigid: [hub, mid], viscous: 1, loss_factor: 1}",
                 {"scene.yaml:6:34: error: link 'l': viscous is not for rigid links, because they do not "
                  "deform; remove it",
                  "scene.yaml:6:46: error: link 'l': loss_factor is not for rigid links, because they do not "
                  "deform; remove it"})),
    bad_scene_name);

class DashpotLink : public ::testing::TestWithParam<BadScene> {};

TEST_P(DashpotLink, EachFaultIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    BadScene, DashpotLink,
    ::testing::Values(
        bad_link("OnePoint", "{name: l, dashpot: [hub], damping: 1}",
                 {"scene.yaml:6:24: error: link 'l': dashpot has 1 point, but must be a list of 2 or more"}),
        bad_link("ToItself", "{name: l, dashpot: [hub, mid, mid], damping: 1}",
                 {"scene.yaml:6:24: error: link 'l': dashpot joins the point 'mid' to itself; give two "
                  "different points"}),
        bad_link("DampingInAnotherUnit", "{name: l, dashpot: [hub, mid], damping: 2 kN s/m}",
                 {"scene.yaml:6:45: error: link 'l': damping '2 kN s/m' has a unit, but must be a plain "
                  "number in SI units [N s/m]; write 2000"}),
        bad_link("ZeroDamping", "{name: l, dashpot: [hub, mid], damping: 0}",
                 {"scene.yaml:6:45: error: link 'l': damping is 0 N s/m, but must be > 0"}),
        bad_link("Losses", "{name: l, dashpot: [hub, mid], damping: 1, viscous: 1, loss_factor: 1}",
                 {"scene.yaml:6:48: error: link 'l': viscous is not for dashpots, because they have no "
                  "stiffness; use damping, or add a spring",
                  "scene.yaml:6:60: error: link 'l': loss_factor is not for dashpots, because they have no "
                  "stiffness; use damping, or add a spring"})),
    bad_scene_name);

class Losses : public ::testing::TestWithParam<BadScene> {};

TEST_P(Losses, EachFaultIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    BadScene, Losses,
    ::testing::Values(bad_link("Negative",
                               "{name: l, spring: [hub, mid], stiffness: 1, viscous: -0.1, loss_factor: -1}",
                               {"scene.yaml:6:58: error: link 'l': viscous is -0.1 s, but must be >= 0",
                                "scene.yaml:6:77: error: link 'l': loss_factor is -1, but must be >= 0"}),
                      bad_link("Units", "{name: l, bar: [hub, mid], EA: 1, viscous: 2 ms, loss_factor: 2 %}",
                               {"scene.yaml:6:48: error: link 'l': viscous '2 ms' has a unit, but must be a "
                                "plain number in SI units [s]; write 0.002",
                                "scene.yaml:6:67: error: link 'l': loss_factor '2 %' has a unit, but must be "
                                "a plain number in SI units; write 0.02"})),
    bad_scene_name);

class Flexibility : public ::testing::TestWithParam<BadScene> {};

TEST_P(Flexibility, EachFaultIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

const std::string kFlexibilityScene =
    "points:\n"
    "  - {name: a, mass: 1, at: [0, 0, 0]}\n"
    "  - {name: b, mass: 1, at: [1, 0, 0]}\n"
    "links:\n"
    "  - {name: body, flexibility: F.mtx, points: all}\n";

INSTANTIATE_TEST_SUITE_P(
    BadScene, Flexibility,
    ::testing::Values(
        BadScene{"WrongSize",
                 {{"scene.yaml", kFlexibilityScene}, {"F.mtx", kMatrixHeader + "9 9 0\n"}},
                 {"F.mtx:2:1: error: the flexibility matrix is 9 x 9, but must be 6 x 6 (3 rows for each of "
                  "2 points)"}},
        BadScene{"NotANumber",
                 {{"scene.yaml", kFlexibilityScene}, {"F.mtx", kMatrixHeader + "6 6 2\n1 1 nan\n4 4 2 mm\n"}},
                 {"F.mtx:3:5: error: flexibility 'nan' is not finite, but must be a number [m/N]",
                  "F.mtx:4:1: error: an entry must be row, column and value"}},
        BadScene{"NotSymmetric",
                 {{"scene.yaml", kFlexibilityScene},
                  {"F.mtx", "%%MatrixMarket matrix coordinate real general\n6 6 3\n1 1 2\n4 1 1\n1 4 1.5\n"}},
                 {"F.mtx:4:1: error: the flexibility matrix is not symmetric. Row 4, column 1 is 1 and its "
                  "mirror is 1.5, but they may differ by at most 1e-06 of the largest entry; correct one, or "
                  "write their mean in both"}},
        BadScene{"MissingFile",
                 {{"scene.yaml", kFlexibilityScene}},
                 {"scene.yaml:5:31: error: cannot read 'F.mtx': No such file or directory"}},
        bad_link("MissingPoints", "{name: l, flexibility: F.mtx}",
                 {"scene.yaml:6:5: error: link 'l': points is missing; it must be all or a list of points in "
                  "the order of the matrix rows",
                  "scene.yaml:6:28: error: cannot read 'F.mtx': No such file or directory"}),
        bad_link("OnePoint", "{name: l, flexibility: scene.yaml, points: [hub]}",
                 {"scene.yaml:6:48: error: link 'l': points has 1 point, but must be a list of 2 or more"}),
        bad_link("BesideAStiffness", "{name: l, matrix: K.mtx, flexibility: F.mtx, points: all}",
                 {"scene.yaml:6:5: error: link 'l' is both matrix and flexibility; it must have one of "
                  "spring, bar, beam, bending, torsion, plate, matrix, flexibility, rigid, dashpot"})),
    bad_scene_name);

}  // namespace
}  // namespace freeflex::testing
