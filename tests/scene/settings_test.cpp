// Values are set in a scene, by their paths, before the scene is read.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/plan/file/plan_bytes.hpp"
#include "service/io/scene/input.hpp"
#include "service/io/scene/schema.hpp"
#include "tests/scene/bad_scene.hpp"
#include "tests/scene/temporary_folder.hpp"

namespace freeflex::testing {
namespace {

// the scene has every kind of target that a path can reach: items, an alias, a name that contains a dot, and
// tables
const std::string kScene =
    "points:\n"
    "  - &hub {name: hub, mass: 10, at: [0, 0, 0]}\n"
    "  - {<<: *hub, name: mid, at: [1, 0, 0]}\n"
    "  - {name: a.b, mass: 2, at: [1, 1, 0]}\n"
    "  - {mass: 2, at: [1, 1, 2]}\n"
    "  - csv: points.csv\n"
    "links:\n"
    "  - {name: tube, spring: [hub, mid, a.b, '4'], stiffness: 1e5}\n"
    "  - {name: ring, bar: [hub, '4'], EA: 1e6}\n"
    "  - {name: skin, plate: [hub, mid, a.b], E: 7e10, nu: 0.3, thickness: 0.001}\n"
    "  - csv: links.csv\n"
    "loads:\n"
    "  - {name: kick, forces: {mid: [0, 5, 0]}, pulse: {start: 1, duration: 0.1}}\n";
const std::string kPointsTable = "name,mass,x,y,z\nr1,1,2,0,0\nr2,1,2,1,0\n";
const std::string kLinksTable = "from,to,stiffness\nr1,r2,100\nr1,mid,200\nr2,a.b,300\nr1,hub,400\n";

io::Settings settings_of(const std::vector<std::string>& arguments) {
  io::Settings settings;
  for (const std::string& argument : arguments) settings.push_back(io::parse_setting(argument).value());
  return settings;
}

std::vector<std::string> texts_of(const io::SceneResult& result) {
  std::vector<std::string> texts;
  for (const Fault& fault : result.faults) texts.push_back(io::format_fault(fault, result.sources, false));
  return texts;
}

io::SceneResult read_with(const std::vector<std::string>& arguments, const std::string& scene = kScene) {
  const TemporaryFolder folder;
  folder.write("scene.yaml", scene);
  folder.write("points.csv", kPointsTable);
  folder.write("links.csv", kLinksTable);
  return io::read_scene("scene.yaml", settings_of(arguments));
}

Scene good(const std::vector<std::string>& arguments, const std::string& scene = kScene) {
  const io::SceneResult result = read_with(arguments, scene);
  EXPECT_EQ(texts_of(result), std::vector<std::string>{});
  return result.scene.value_or(Scene{});
}

std::vector<double> masses(const Scene& scene) {
  std::vector<double> values;
  for (const PointMass& point : scene.points) values.push_back(point.mass);
  return values;
}

std::vector<double> stiffnesses(const Scene& scene) {
  std::vector<double> values;
  for (const Link& link : scene.links)
    if (const auto* spring = std::get_if<Spring>(&link.kind)) values.push_back(spring->stiffness);
  return values;
}

TEST(Settings, AreSplitAtTheFirstEqualsSignOutsideQuotes) {
  const auto setting = io::parse_setting("points.\"a=b\".at=[0, 0, 1]");
  ASSERT_TRUE(setting.has_value());
  EXPECT_EQ(setting->path, "points.\"a=b\".at");
  EXPECT_EQ(setting->value, "[0, 0, 1]");
  EXPECT_EQ(setting->source, "--set points.\"a=b\".at=[0, 0, 1]");
  EXPECT_FALSE(io::parse_setting("points.hub.mass").has_value());
  EXPECT_FALSE(io::parse_setting("=41").has_value());
  EXPECT_EQ(io::parse_setting("rate=").value().value, "");
}

TEST(Settings, ChangeTheItemWithTheGivenName) {
  EXPECT_EQ(masses(good({"points.hub.mass=41"})), (std::vector<double>{41, 10, 2, 2, 1, 1}))
      << "the point that merges the changed point by an alias does not change";
  EXPECT_EQ(masses(good({"points.mid.mass=41"})), (std::vector<double>{10, 41, 2, 2, 1, 1}));
  EXPECT_EQ(good({"points.mid.at=[1, 0, 0.5]"}).points[1].position, Eigen::Vector3d(1, 0, 0.5));
}

TEST(Settings, ChangeTheItemAtTheGivenPositionCountedFromOne) {
  EXPECT_EQ(masses(good({"points.4.mass=41"})), (std::vector<double>{10, 10, 2, 41, 1, 1}));
  EXPECT_EQ(masses(good({"points.1.mass=41"})), (std::vector<double>{41, 10, 2, 2, 1, 1}));
}

TEST(Settings, ChangeTheItemWithAQuotedName) {
  EXPECT_EQ(masses(good({"points.\"a.b\".mass=41"})), (std::vector<double>{10, 10, 41, 2, 1, 1}));
  EXPECT_EQ(masses(good({"points.'a.b'.mass=41"})), (std::vector<double>{10, 10, 41, 2, 1, 1}));
  const std::string numbered =
      "points: [{name: 2, mass: 1, at: [0, 0, 0]}, {name: 1, mass: 1, at: [1, 0, 0]}]\n"
      "links: {spring: [1, 2], stiffness: 1}\n";
  EXPECT_EQ(masses(good({"points.\"2\".mass=41"}, numbered)), (std::vector<double>{41, 1}));
}

TEST(Settings, ChangeAllItemsThatAcceptTheKey) {
  EXPECT_EQ(masses(good({"points.*.mass=3"})), (std::vector<double>(6, 3.0))) << "rows of tables change too";
  const Scene scene = good({"links.*.E=6.9e10"});
  EXPECT_EQ(std::get<Plate>(scene.links[4].kind).E, 6.9e10);
  EXPECT_EQ(stiffnesses(scene), (std::vector<double>{1e5, 1e5, 1e5, 100, 200, 300, 400}));
  EXPECT_EQ(stiffnesses(good({"links.*.stiffness=7"})), (std::vector<double>(7, 7.0)));
}

TEST(Settings, ChangeRowsOfTablesByTheirNames) {
  const Scene scene = good({"points.r2.mass=41", "points.r2.at=[2, 1, 5]"});
  EXPECT_EQ(masses(scene), (std::vector<double>{10, 10, 2, 2, 1, 41}));
  EXPECT_EQ(scene.points[5].position, Eigen::Vector3d(2, 1, 5));
  EXPECT_EQ(scene.points[5].name, "r2");
  EXPECT_EQ(scene.points[5].origin.line, 3);
}

TEST(Settings, ChangeOneNumberOfAList) {
  const Scene scene = good({"points.hub.at.3=0.25", "points.r2.at.1=7", "loads.kick.forces.mid.2=6"});
  EXPECT_EQ(scene.points[0].position, Eigen::Vector3d(0, 0, 0.25));
  EXPECT_EQ(scene.points[1].position, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(scene.points[5].position, Eigen::Vector3d(7, 1, 0));
  EXPECT_EQ(scene.loads[0].forces[0].force, Eigen::Vector3d(0, 6, 0));
}

TEST(Settings, MultiplyIfThePathEndsWithAStar) {
  EXPECT_EQ(masses(good({"points.hub.mass*=1.5"})), (std::vector<double>{15, 10, 2, 2, 1, 1}));
  EXPECT_EQ(masses(good({"points.*.mass*=3"})), (std::vector<double>{30, 30, 6, 6, 3, 3}));
  EXPECT_EQ(stiffnesses(good({"links.*.stiffness*=2"})),
            (std::vector<double>{2e5, 2e5, 2e5, 200, 400, 600, 800}));
  const Scene scene = good({"loads.kick.forces.mid*=2", "points.r2.at.1*=4", "points.hub.mass=3",
                            "points.hub.mass*=2", "points.hub.mass*=2"});
  EXPECT_EQ(scene.loads[0].forces[0].force, Eigen::Vector3d(0, 10, 0));
  EXPECT_EQ(scene.points[5].position, Eigen::Vector3d(8, 1, 0));
  EXPECT_EQ(scene.points[0].mass, 12.0) << "settings apply one after the other";
  const std::string partial =
      "points: [{name: a, mass: 1, at: [0, 0, 0]}, {name: b, mass: 1, at: [1, 0, 0]}]\n"
      "links: [{spring: [a, b], stiffness: 1, viscous: 0.5}, {spring: [a, b], stiffness: 2}]\n";
  const Scene damped = good({"links.*.viscous*=3"}, partial);
  EXPECT_EQ(damped.links[0].viscous, 1.5);
  EXPECT_EQ(damped.links[1].viscous, 0.0) << "items without the value keep their default";
}

TEST(Settings, AddAKeyThatTheItemAcceptsButLacks) {
  const Scene scene = good({"points.hub.inertia=[1, 1, 1]", "points.r1.offset=[0, 0, 0.1]",
                            "damping.ratio=0.02", "damping.modes.1=0.03", "links.skin.density=2700",
                            "loads.kick.forces.hub=[1, 0, 0]", "groups.end=[a.b, r1]", "rate=500"});
  EXPECT_EQ(scene.points[0].inertia.diagonal(), Eigen::Vector3d(1, 1, 1));
  EXPECT_EQ(scene.points[4].offset, Eigen::Vector3d(0, 0, 0.1));
  EXPECT_EQ(scene.damping.modal_ratio, 0.02);
  EXPECT_EQ(scene.damping.mode_ratios, (std::vector<std::pair<int, double>>{{1, 0.03}}));
  EXPECT_EQ(std::get<Plate>(scene.links[4].kind).density, 2700);
  ASSERT_EQ(scene.loads[0].forces.size(), 2u);
  EXPECT_EQ(scene.loads[0].forces[1].force, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(scene.groups[0].points, (std::vector<int>{2, 4}));
  EXPECT_EQ(scene.rate, 500);
}

TEST(Settings, MaySetAMappingOrOneValueWithinIt) {
  const Scene scene = good({"damping={ratio: 0.02}", "loads.kick.pulse.duration=0.2"});
  EXPECT_EQ(scene.damping.modal_ratio, 0.02);
  EXPECT_EQ(std::get<PulseHistory>(scene.loads[0].history).duration, 0.2);
  EXPECT_EQ(std::get<PulseHistory>(scene.loads[0].history).start, 1.0);
}

TEST(Settings, ApplyInTheOrderGiven) {
  EXPECT_EQ(masses(good({"points.*.mass=3", "points.hub.mass=41"})),
            (std::vector<double>{41, 3, 3, 3, 3, 3}));
  EXPECT_EQ(masses(good({"points.r1.mass=41", "points.*.mass=3"})), (std::vector<double>(6, 3.0)));
  EXPECT_EQ(good({"rate=500", "rate=600"}).rate, 600);
}

TEST(Settings, ChangeTheHashOfTheScene) {
  const std::uint64_t plain = good({}).hash, set = good({"rate=500"}).hash;
  EXPECT_NE(set, plain);
  EXPECT_EQ(good({"rate=500"}).hash, set);
  EXPECT_NE(good({"rate=501"}).hash, set);
  EXPECT_NE(good({"points.hub.mass=1", "points.mid.mass=12"}).hash,
            good({"points.hub.mass=11", "points.mid.mass=2"}).hash);
}

TEST(Settings, GiveTheSamePlanAsASceneFileWithTheseValues) {
  const TemporaryFolder folder;
  folder.write("scene.yaml", kThreePoints + "links: {spring: [hub, mid, tip], stiffness: 1e4}\n");
  folder.write("written.yaml",
               "name: scene\n" + kThreePoints + "links: {spring: [hub, mid, tip], stiffness: 2e4}\n");
  io::PlanResult set = io::load_plan("scene.yaml", 0.0, {}, settings_of({"links.1.stiffness=2e4"}));
  io::PlanResult written = io::load_plan("written.yaml");
  ASSERT_TRUE(set.plan.has_value() && written.plan.has_value());
  EXPECT_EQ(set.plan->omega, written.plan->omega);
  EXPECT_NE(plan_fingerprint(*set.plan), plan_fingerprint(*written.plan))
      << "the scene hash covers the text and the settings";
  set.plan->scene_hash = written.plan->scene_hash;
  EXPECT_EQ(plan_fingerprint(*set.plan), plan_fingerprint(*written.plan))
      << "everything except the scene hash agrees";
}

TEST(Settings, AreRefusedForAPlanFile) {
  const TemporaryFolder folder;
  folder.write("scene.yaml", kThreePoints + "links: {spring: [hub, mid, tip], stiffness: 1e4}\n");
  const io::PlanResult made = io::load_plan("scene.yaml");
  ASSERT_TRUE(made.plan.has_value());
  ASSERT_EQ(io::save_plan(*made.plan, "boom.plan"), "");
  const io::PlanResult result = io::load_plan("boom.plan", 0.0, {}, settings_of({"points.hub.mass=41"}));
  EXPECT_FALSE(result.plan.has_value());
  ASSERT_EQ(result.faults.size(), 1u);
  EXPECT_EQ(io::format_fault(result.faults[0], result.sources),
            "--set points.hub.mass=41: error: 'boom.plan' is a plan, but values can be set only in a scene, "
            "before its set-up; name the scene that the plan was made from");
}

TEST(SceneText, SceneTextIsReadLikeASceneFile) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "beside");
  folder.write("beside/scene.yaml", kScene);
  folder.write("beside/points.csv", kPointsTable);
  folder.write("beside/links.csv", kLinksTable);
  const io::SceneResult file = io::read_scene("beside/scene.yaml", settings_of({"points.hub.mass=41"}));
  const io::SceneResult text =
      io::read_scene_text({.text = kScene, .folder = "beside"}, settings_of({"points.hub.mass=41"}));
  ASSERT_TRUE(file.scene.has_value() && text.scene.has_value());
  EXPECT_EQ(text.scene->hash, file.scene->hash);
  EXPECT_EQ(text.scene->name, "scene");
  EXPECT_EQ(masses(*text.scene), masses(*file.scene));
  EXPECT_EQ(text.sources.front(), "<text>");
}

TEST(SceneText, SceneTextMayBeJson) {
  const io::PlanResult result =
      io::load_plan_text({R"({"name": "pair", "points": [{"name": "a", "mass": 1, "at": [0, 0, 0]},
                                      {"name": "b", "mass": 1e0, "at": [1.0, 0, 0]}],
           "links": [{"spring": ["a", "b"], "stiffness": 50000.0}]})"},
                         200.0, {}, settings_of({"points.b.mass=2"}));
  for (const Fault& fault : result.faults) ADD_FAILURE() << fault.message;
  ASSERT_TRUE(result.plan.has_value());
  EXPECT_EQ(result.plan->name, "pair");
  EXPECT_EQ(result.plan->mass, 3.0);
  EXPECT_EQ(result.plan->period, 0.005);
}

TEST(SceneText, ReportsFaultsAtItsOwnLines) {
  const io::SceneResult result = io::read_scene_text({"points:\n  - {name: a, mass: -1, at: [0, 0, 0]}\n"});
  EXPECT_FALSE(result.scene.has_value());
  EXPECT_EQ(texts_of(result),
            std::vector<std::string>{"<text>:2:21: error: point 'a': mass is -1 kg, but must be >= 0"});
  EXPECT_EQ(texts_of(io::read_scene_text({.text = "", .name = "Plan(text)"})),
            std::vector<std::string>{
                "Plan(text):1:1: error: the file is empty, but a scene needs at least points"});
}

// the value 1 may be wrong for a key, but the path to the key must not be refused
TEST(Settings, AcceptEveryPathInTheSchema) {
  const auto schema = nlohmann::json::parse(io::scene_schema());
  const auto paths = schema["x-paths"]["paths"].get<std::vector<std::string>>();
  for (const std::string& path : paths)
    for (const std::string& text : texts_of(read_with({path + "=1"})))
      for (const char* fault :
           {"' is unknown", "a key must follow here", "is an item", "as a whole", "a name cannot be set"})
        EXPECT_EQ(text.find(fault), std::string::npos) << text;
  for (const char* path : {"rate", "points.*.mass", "links.*.E", "loads.*.forces.*", "loads.*.pulse.start",
                           "initial.modes.*.q", "groups.*", "points.*.csv"})
    EXPECT_EQ(std::count(paths.begin(), paths.end(), path), std::string(path) == "points.*.csv" ? 0 : 1)
        << path;
}

struct BadSettings {
  std::string name;
  std::vector<std::string> arguments;
  std::vector<std::string> messages;
};
void PrintTo(const BadSettings& bad, std::ostream* out) { *out << bad.name; }

std::string bad_settings_name(const ::testing::TestParamInfo<BadSettings>& info) { return info.param.name; }

class BadSetting : public ::testing::TestWithParam<BadSettings> {};

TEST_P(BadSetting, EachFaultIsReportedInTheExpectedWords) {
  const io::SceneResult result = read_with(GetParam().arguments);
  EXPECT_FALSE(result.scene.has_value());
  EXPECT_EQ(texts_of(result), GetParam().messages);
}

BadSettings bad(const std::string& name, const std::string& argument, const std::string& message) {
  return {name, {argument}, {"--set " + argument + ": error: " + message}};
}

INSTANTIATE_TEST_SUITE_P(
    Path, BadSetting,
    ::testing::Values(
        bad("UnknownSection", "pionts.hub.mass=1",
            "scene: the key 'pionts' is unknown (did you mean 'points'?); allowed are name, rate, fidelity, "
            "tolerance, integration, verdict, points, links, groups, damping, gravity, attractor, initial, "
            "wheels, "
            "loads, feedback, leave_out, modes, publish, commands"),
        bad("UnknownNameInAList", "points.hbu.mass=1",
            "points: no item is named 'hbu' (did you mean 'hub'?)"),
        bad("UnknownNameWithoutASimilarOne", "loads.xyz.axes=body",
            "loads: no item is named 'xyz'; there are kick"),
        bad("UnknownNameInTables", "points.r3.mass=1", "points: no item is named 'r3' (did you mean 'r1'?)"),
        bad("NameWithDots", "points.a.b.mass=1",
            "points: no item is named 'a'; write a name with dots in quotes, as in points.\"a.b\""),
        bad("NoSuchPosition", "loads.0.axes=body",
            "loads: there is no item 0; the items are numbered from 1 to 1"),
        bad("NoSuchPositionBesideATable", "points.6.mass=1",
            "points: there is no item 6; the items are numbered from 1 to 5, and a row of a table is set "
            "by its name; write points.\"6\""),
        bad("TableByPosition", "points.5.mass=1",
            "points.5 is a table; name a row of it, as in points.NAME.mass, or write points.*.mass for all "
            "rows"),
        bad("UnknownKeyOfAnItem", "points.hub.mas=1",
            "points.hub: the key 'mas' is unknown (did you mean 'mass'?); allowed are name, mass, at, "
            "inertia, offset, axes"),
        bad("UnknownKeyOfARow", "points.r1.mas=1",
            "points.r1: the key 'mas' is unknown (did you mean 'mass'?); allowed are name, mass, at, "
            "inertia, offset, axes"),
        bad("RefusedKey", "links.skin.viscous=1",
            "links.skin: viscous is not for beams and plates, because rotations carry no mass, and a moment "
            "that depends on their rate would make them states of their own; use loss_factor, or damping: "
            "rayleigh"),
        bad("KeyOfNoKind", "links.*.stifness=1",
            "links.*: the key 'stifness' is unknown (did you mean 'stiffness'?); allowed are name, spring, "
            "stiffness, viscous, loss_factor, bar, EA, mass_per_length, lumped, mean_axial, beam, GJ, EIy, "
            "EIz, GAy, GAz, y_axis, release, bending, torsion, plate, E, nu, thickness, density, matrix, "
            "points, mass, rotations, inner, flexibility, rigid, dashpot, damping"),
        bad("KeyOfAnotherKind", "links.*.GJ=1",
            "links.*: no item here can have the key GJ; it is a key of "
            "beam"),
        bad("NoItems", "wheels.*.momentum=1",
            "the scene has no wheels; a path can change items but cannot add them"),
        bad("EndsAtAnItem", "points.hub=1",
            "points.hub is an item, and its keys are set one by one; write points.hub.KEY"),
        bad("NameOfAnItem", "points.mid.name=hub",
            "points.mid.name: a name cannot be set, because paths and the scene refer to it; change it in "
            "the scene"),
        bad("GoesOnBeyondAValue", "points.hub.mass.x=1",
            "points.hub.mass is one value and is set as a whole; end the path there"),
        bad("GoesOnBeyondAList", "points.hub.at.x=1",
            "points.hub.at is a list of numbers and is set as a whole; end the path there"),
        bad("NumberBehindAList", "points.hub.at.4=1", "points.hub.at has the numbers 1 to 3, but not 4"),
        bad("NumberOfAnAbsentList", "points.hub.inertia.1=1",
            "there is no list at points.hub.inertia; set the whole list, as in points.hub.inertia=[0, 0, 1]"),
        bad("TextForANumberOfAList", "points.hub.at.2=[1]",
            "point 'hub': at is a list, but must be a number [m]"),
        bad("ProductOfAnAbsentValue", "points.hub.inertia*=2",
            "there is no value to multiply at points.hub.inertia; write it into the scene, or set it without "
            "the * at the end of the path"),
        bad("ProductOfValuesThatAllItemsLack", "links.*.viscous*=2",
            "there is no value to multiply at links.*.viscous; write it into the scene, or set it without "
            "the * at the end of the path"),
        bad("FactorThatIsNoNumber", "points.hub.mass*=[1]",
            "the value is a list, but must be a number, because the path ends with * and multiplies"),
        bad("ProductOfAMapping", "loads.kick.forces*=2",
            "the path ends with * and multiplies, but loads.kick.forces is a mapping, which is neither a "
            "number nor a list of numbers"),
        bad("ProductOutOfRange", "points.hub.mass*=-1", "point 'hub': mass is -10 kg, but must be >= 0"),
        bad("StarWithinAName", "points.r*.mass=1",
            "'r*' has a * beside other characters at character 8 of the path; * alone stands for all items, "
            "and a * at the end of the path multiplies"),
        bad("GoesOnBeyondANamedList", "loads.kick.forces.mid.x=1",
            "loads.kick.forces.mid is a list of numbers and is set as a whole; end the path there"),
        bad("AllKeys", "damping.*=1",
            "damping: * stands for items and names, but a key must follow here; the keys are ratio, modes, "
            "rayleigh"),
        bad("AllOfAnEmptyList", "damping.modes.*=1", "damping.modes is empty, so * matches nothing"),
        bad("EmptyStep", "points..mass=1", "a key or a name is missing at character 8 of the path"),
        bad("DotAtTheEnd", "points.hub.=1", "a key or a name is missing at character 12 of the path"),
        bad("OpenQuote", "points.hub'=1'.mass=1",
            "'hub'=1'' must be a key, a name, a number or * at character 8 of the path; separate keys and "
            "names by dots, as in points.hub.mass"),
        bad("Brackets", "points[0].mass=1",
            "'points[0]' must be a key, a name, a number or * at character 1 of the path; separate keys and "
            "names by dots, as in points.hub.mass")),
    bad_settings_name);

INSTANTIATE_TEST_SUITE_P(
    Value, BadSetting,
    ::testing::Values(
        bad("OutOfRange", "points.hub.mass=-1", "point 'hub': mass is -1 kg, but must be >= 0"),
        bad("OutOfRangeInARow", "points.r1.mass=-1", "point 'r1': mass is -1 kg, but must be >= 0"),
        bad("OutOfRangeInAllOnce", "points.*.mass=-1", "point 'hub': mass is -1 kg, but must be >= 0"),
        bad("Unit", "points.hub.mass=5 g",
            "point 'hub': mass '5 g' has a unit, but must be a plain number in SI units [kg]; write 0.005"),
        bad("DecimalComma", "points.hub.at=[0,5, 1, 0]",
            "point 'hub': at has 4 items, but must be a list of 3 numbers [m]; a comma separates items, so "
            "write 0.5"),
        bad("Empty", "points.hub.mass=", "point 'hub': mass is empty, but must be a number >= 0 [kg]"),
        bad("List", "points.hub.mass=[1]", "point 'hub': mass is a list, but must be a number >= 0 [kg]"),
        bad("Syntax", "points.hub.at=[1, 2",
            "YAML syntax: a flow sequence has no closing bracket; it was opened on line 1, column 1; close "
            "it with ']'"),
        bad("UnknownName", "loads.kick.forces.mdi=[0, 0, 1]",
            "load 'kick': forces names the point 'mdi', which the scene does not have (did you mean 'mid'?)"),
        bad("NumberForASection", "damping=0.1",
            "damping is the text '0.1', but must be a mapping of ratio, modes, rayleigh: write damping: "
            "{ratio: 0.1}"),
        BadSettings{
            "BesideAFaultOfThePath",
            {"points.hub.mass=-1", "points.hbu.mass=1"},
            {"--set points.hub.mass=-1: error: point 'hub': mass is -1 kg, but must be >= 0",
             "--set points.hbu.mass=1: error: points: no item is named 'hbu' (did you mean 'hub'?)"}}),
    bad_settings_name);

}  // namespace
}  // namespace freeflex::testing
