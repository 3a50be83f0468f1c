// These tests check the error measures of `freeflex report`, and runs of the complete program. No test
// depends on the measured times.
#include "tools/verification/report/report.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "core/structure/structure.hpp"
#include "tests/tools/shell.hpp"
#include "tools/verification/report/measure.hpp"

namespace freeflex::testing {
namespace {

/// Holds four points, six springs and a pulse of force of 20 ms.
const std::string kTetrahedron =
    "name: tetrahedron\npoints:\n"
    "  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: b, mass: 1, at: [1, 0, 0]}\n"
    "  - {name: c, mass: 1, at: [0, 1, 0]}\n  - {name: d, mass: 1, at: [0, 0, 1]}\n"
    "links:\n  - {spring: [a, b, c, a, d, b], stiffness: 1e4}\n  - {spring: [c, d], stiffness: 1e4}\n"
    "loads:\n  - {name: kick, forces: {d: [0.3, 0.5, 0.2]}, pulse: {start: 0, duration: 0.02}}\n";

/// Holds a cube of springs and makes vibrations of the cube for the error measures.
class Measures : public ::testing::Test {
 protected:
  Measures() {
    Scene scene;
    for (int i = 0; i < 8; ++i) {
      PointMass point;
      point.mass = 1.0 + 0.1 * i;
      point.position = Eigen::Vector3d(i / 4, i / 2 % 2, i % 2);
      scene.points.push_back(point);
    }
    for (int i = 0; i < 8; ++i)
      for (int j = i + 1; j < 8; ++j) {
        Link link;
        link.points = {i, j};
        link.kind = Spring{1e3};
        scene.links.push_back(link);
      }
    std::string error;
    system = make_cartesian_system(scene, error);
    Faults faults;
    structure = build_structure(scene, faults);
  }

  /// Returns a vibration of mode l with amplitude q [m] and frequency omega [rad/s], sampled every 10 ms for
  /// 2 s.
  tools::Trajectory vibration(Eigen::Index l, double q, double omega) const {
    tools::Trajectory motion;
    const Eigen::Map<const Eigen::Matrix3Xd> shape(structure->shapes.col(l).data(), 3, 8);
    for (int k = 1; k <= 200; ++k)
      motion.frames.emplace_back(system->r + q * std::sin(omega * tools::kFramePeriod * k) * shape);
    motion.end = {2.0, motion.frames.back(), Eigen::Matrix3Xd::Zero(3, 8)};
    return motion;
  }

  std::optional<CartesianSystem> system;
  std::optional<Structure> structure;
};

TEST_F(Measures, FrequencyErrorIsMeasuredOnTheModeThatVibrates) {
  const double omega = structure->omega[2];
  const tools::ErrorMeter meter(*system, *structure, 0.0, vibration(2, 1e-6, omega));
  for (const double error : {1e-2, 1e-4, 1e-6})
    EXPECT_NEAR(*meter.frequency(vibration(2, 1e-6, omega * (1.0 + error))), error, 1e-4 * error + 1e-9);
  EXPECT_FALSE(meter.frequency({}).has_value()) << "a motion without frames has no frequency";
}

TEST_F(Measures, PositionAttitudeAndElasticErrorsAreSeparated) {
  const tools::Trajectory motion = vibration(1, 1e-6, structure->omega[1]);
  const tools::ErrorMeter meter(*system, *structure, 0.0, motion);
  const double angle = 1e-7;
  Eigen::Matrix3d rotation = Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, 2) / 3.0).toRotationMatrix();
  Eigen::Matrix3Xd p_W = rotation * motion.end.p_W;
  p_W.row(1).array() += 0.25;
  EXPECT_NEAR(meter.attitude(p_W), angle, 1e-14);
  EXPECT_NEAR(meter.position(p_W), 0.25, 1e-6);
  EXPECT_LT(meter.elastic(p_W), 1e-8) << "a rigid motion is not an elastic error";
}

void expect_every_method(const nlohmann::json& json) {
  ASSERT_EQ(json["scenes"].size(), 1u);
  const auto& scene = json["scenes"][0];
  EXPECT_EQ(scene["elastic_freedoms"], 6);
  EXPECT_LT(scene["reference"]["accuracy"], 1e-6);
  std::set<std::string> methods;
  for (const auto& item : scene["runs"]) {
    methods.insert(item["method"]);
    if (item.contains("failure")) continue;
    EXPECT_GT(item["cpu_once"], 0.0);
    EXPECT_GE(item["elastic_error"], 0.0);
  }
  for (const char* method : {"rigid",
                             "separated",
                             "spin-loaded",
                             "coupled",
                             "corotational",
                             "corotational, points",
                             "full",
                             "velocity Verlet",
                             "Runge-Kutta 4",
                             "Stoermer 8",
                             "Stoermer 12",
                             "Stoermer 16",
                             "Kahan-Li 8",
                             "ARKODE explicit 4",
                             "ARKODE explicit 8",
                             "ARKODE implicit 5",
                             "CVODE Adams",
                             "CVODE BDF",
                             "leapfrog, linear",
                             "Krylov, linear"})
    EXPECT_TRUE(methods.count(method)) << method;
  EXPECT_EQ(methods.size(), 20u) << "springs and bars need no method for forces that depend on velocities";
  EXPECT_TRUE(scene["evaluation_cpu"].is_null());
  EXPECT_FALSE(contains(scene["left_out"].dump(), "midpoint"));
  for (const char* key : {"processor", "compiler", "flags", "commit", "date"})
    EXPECT_FALSE(json["machine"][key].get<std::string>().empty()) << key;
  EXPECT_FALSE(json["findings"].empty());
}

// the propagator is exact for any step, so one step over a free motion gives the same result as many steps
void expect_free_motion_in_one_step(const nlohmann::json& json) {
  std::map<std::string, nlohmann::json> many, one;  // by rung
  for (const auto& item : json["scenes"][0]["runs"]) {
    if (item["family"] != "freeflex" || item["step"] != 0.02) continue;
    (item["free_step"].is_null() ? many : one)[item["method"]] = item;
  }
  EXPECT_EQ(one.size(), 3u) << "there are three rungs without stages";
  for (const auto& [rung, item] : one) {
    EXPECT_EQ(item["steps"], 2) << rung;
    EXPECT_NEAR(item["free_step"], 0.08, 1e-12);
    ASSERT_TRUE(many.count(rung));
    EXPECT_NEAR(item["elastic_error"], many[rung]["elastic_error"], 1e-6) << rung;
    EXPECT_TRUE(item["cpu_10ms"].is_null()) << "there are no frames within a single step";
  }
}

// each rung is closer to the full system than the next lower rung, and the elastic error of a converged
// linear method is its model error
void expect_falling_model_errors(const nlohmann::json& json) {
  std::map<std::string, double> model, least;
  for (const auto& item : json["scenes"][0]["runs"]) {
    if (item.contains("failure")) continue;
    model[item["method"]] = item["model_error"];
    auto [found, is_new] = least.try_emplace(item["method"], item["elastic_error"]);
    if (!is_new) found->second = std::min(found->second, item["elastic_error"].get<double>());
  }
  EXPECT_NEAR(model["rigid"], 1.0, 1e-9)
      << "the rigid rung has no elastic motion; the remainder is the rounding error of positions";
  EXPECT_LT(model["separated"], 0.01);
  EXPECT_LT(model["coupled"], model["separated"]);
  EXPECT_LT(model["corotational"], 0.1 * model["coupled"]);
  EXPECT_EQ(model["Krylov, linear"], model["spin-loaded"]);
  EXPECT_NEAR(least["Krylov, linear"] / model["spin-loaded"], 1.0, 0.05);
  EXPECT_EQ(model["Runge-Kutta 4"], 0.0);
  EXPECT_LT(least["Runge-Kutta 4"], 1e-5);
}

// the table, the page and the picture load no other file
void expect_files(const TemporaryFolder& folder) {
  const std::string csv = read_text(folder / "out/report.csv");
  const auto json = nlohmann::json::parse(read_text(folder / "out/report.json"));
  std::istringstream lines(csv);
  std::string line;
  std::getline(lines, line);
  const auto columns = std::count(line.begin(), line.end(), ',');
  EXPECT_EQ(
      line.find("scene,family,method,step,free_step,tolerance,elastic_error,integration_error,model_error"),
      0u);
  std::size_t rows = 0;
  while (std::getline(lines, line)) {
    ++rows;
    if (line.find('"') == std::string::npos) {
      EXPECT_EQ(std::count(line.begin(), line.end(), ','), columns) << line;
    }
  }
  EXPECT_EQ(rows, json["scenes"][0]["runs"].size());
  const std::string page = read_text(folder / "out/report.html"),
                    svg = read_text(folder / "out/work-precision.svg");
  EXPECT_TRUE(contains(page, "<svg")) << "the page contains the picture";
  for (const std::string& text : {page, svg}) {
    // the SVG namespace is only a name, not an address that a browser loads
    std::string rest = text;
    const std::string name = "http://www.w3.org/2000/svg";
    for (std::size_t at = rest.find(name); at != std::string::npos; at = rest.find(name))
      rest.erase(at, name.size());
    for (const char* part : {"http:", "https:", "src=", "href=", "@import", "url("})
      EXPECT_FALSE(contains(rest, part)) << part;
    EXPECT_FALSE(contains(text, "nan"));
  }
  for (const char* part : {"tetrahedron", "corotational", "Krylov, linear", "<title>"})
    EXPECT_TRUE(contains(svg, part)) << part;
}

// one run with all parts serves all checks, because it takes some ten seconds
TEST(ReportProgram, MeasuresEveryRungAndEveryOtherMethod) {
  const TemporaryFolder folder;
  write_text(folder / "scene.yaml", kTetrahedron);
  const Outcome outcome = run(kFreeflex + " report --repeats 1 --until 0.1 --json --out " + folder / "out" +
                              " " + folder / "scene.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  expect_every_method(json);
  expect_free_motion_in_one_step(json);
  expect_falling_model_errors(json);
  expect_files(folder);
}

/// Holds three beams in space that spin, and a pulse of force of 20 ms.
const std::string kBeams =
    "name: beams\nrate: 1000\npoints:\n"
    "  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: b, mass: 1, at: [1, 0, 0]}\n"
    "  - {name: c, mass: 1, at: [1, 1, 0]}\n  - {name: d, mass: 2, at: [1, 1, 1]}\n"
    "links:\n  - {beam: [a, b, c, d], EA: 2e4, GJ: 500, EIy: 600, EIz: 600}\n"
    "loads:\n  - {name: kick, forces: {d: [30, 50, 20]}, pulse: {start: 0, duration: 0.02}}\n"
    "initial: {angular_velocity: [0.2, 0.1, 0.5]}\n";

/// Returns the scene in the JSON of a short report on kBeams with `more` at its end.
nlohmann::json report_beams(const std::string& more) {
  const TemporaryFolder folder;
  write_text(folder / "scene.yaml", kBeams + more);
  const Outcome outcome =
      run(kFreeflex + " report --repeats 1 --until 0.05 --budget 0.1 --json " + folder / "scene.yaml");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  if (outcome.exit_code != 0) return {};
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_TRUE(contains(json["findings"].dump(), "upper bounds"));
  return json["scenes"][0];
}

std::map<std::string, double> least_errors(const nlohmann::json& scene) {
  std::map<std::string, double> least;
  for (const auto& item : scene["runs"]) {
    if (item.contains("failure")) continue;
    auto [found, is_new] = least.try_emplace(item["method"], item["elastic_error"]);
    if (!is_new) found->second = std::min(found->second, item["elastic_error"].get<double>());
  }
  return least;
}

// The rung `corotational` and every method by hand must come to the motion of the reference
TEST(ReportTrueGeometry, BeamsShowTheRungsBesideTheMethodsByHand) {
  const auto scene = report_beams("");
  EXPECT_LT(scene["reference"]["accuracy"], 1e-8);
  EXPECT_TRUE(contains(scene["reference"]["method"].dump(), "Stoermer 16 with steps of"));
  EXPECT_GT(scene["evaluation_cpu"], 0.0);
  auto least = least_errors(scene);
  for (const char* method : {"separated", "spin-loaded", "coupled"})
    EXPECT_GT(least.at(method), 1e-4) << method;
  EXPECT_LT(least.at("corotational"), 1e-5);
  EXPECT_LT(least.at("full"), 1e-5);
  for (const char* method : {"Stoermer 8", "Stoermer 12", "Stoermer 16", "Kahan-Li 8", "ARKODE explicit 8"})
    EXPECT_LT(least.at(method), 1e-7) << method;
  for (const char* method : {"velocity Verlet", "Runge-Kutta 4", "ARKODE explicit 4", "ARKODE implicit 5",
                             "CVODE Adams", "CVODE BDF"})
    EXPECT_LT(least.at(method), 1e-3) << method;
  EXPECT_FALSE(least.count("midpoint 8"));
  EXPECT_TRUE(contains(scene["left_out"].dump(), "for which Stoermer's method is faster"));
  for (const auto& item : scene["runs"]) {
    EXPECT_EQ(item["evaluations"].is_null(), item["family"] == "freeflex") << item;
    if (item["method"] == "corotational" && !item["energy_drift"].is_null() && item["step"] <= 1e-3) {
      EXPECT_LT(item["energy_drift"], 1e-5);
    }
  }
}

TEST(ReportTrueGeometry, DampedBeamsRunWithTheMidpointRule) {
  const auto scene = report_beams("damping: {ratio: 0.02}\n");
  auto least = least_errors(scene);
  for (const char* method : {"midpoint 8", "midpoint 12", "midpoint 16"})
    EXPECT_LT(least.at(method), 1e-7) << method;
  EXPECT_LT(least.at("corotational"), 1e-3);
  EXPECT_FALSE(least.count("Stoermer 8"));
  EXPECT_TRUE(contains(scene["left_out"].dump(), "the forces depend on velocities"));
}

// Points of a rigid body that turns are read at their true positions; linear rows would give an error of 1e-4
TEST(ReportTrueGeometry, PointsOfTurningBodiesAreReadAtTheirTruePositions) {
  const TemporaryFolder folder;
  std::string scene = kTetrahedron;
  const std::size_t links = scene.find("links:");
  scene.replace(links, std::string::npos,
                "  - {name: e, mass: 1, at: [2, 0, 0]}\n  - {name: f, mass: 1, at: [3, 0.2, 0]}\nlinks:\n"
                "  - {rigid: [a, b, c, d]}\n  - {beam: [b, e, f], EA: 1e5, GJ: 500, EIy: 600, EIz: 600}\n"
                "loads:\n  - {name: kick, forces: {f: [3, 5, 20]}, pulse: {start: 0, duration: 0.02}}\n");
  write_text(folder / "scene.yaml", scene);
  const Outcome outcome =
      run(kFreeflex + " report --rungs --repeats 1 --until 0.1 --json " + folder / "scene.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto read = nlohmann::json::parse(outcome.out)["scenes"][0];
  EXPECT_TRUE(contains(read["reference"]["method"].dump(), "Stoermer 16 with steps of"));
  EXPECT_LT(least_errors(read).at("corotational"), 1e-6);
}

// The rival by hand has one body with a quaternion and a wheel; the reference has point masses on rigid links
TEST(ReportTrueGeometry, BodiesWithInertiaAndWheelsAreTaken) {
  const TemporaryFolder folder;
  write_text(folder / "scene.yaml",
             "name: wheel\nrate: 1000\npoints:\n"
             "  - {name: hub, mass: 10, inertia: [1, 2, 2.5], at: [0, 0, 0]}\n"
             "  - {name: a, mass: 1, at: [1, 0, 0]}\n  - {name: b, mass: 1, at: [2, 0.2, 0]}\n"
             "links: [{beam: [hub, a, b], EA: 1e5, GJ: 500, EIy: 600, EIz: 600}]\n"
             "wheels: [{name: w, at: hub, axis: [0, 0.6, 0.8], momentum: 2}]\n"
             "loads:\n  - {name: kick, forces: {b: [3, 5, 20]}, pulse: {start: 0, duration: 0.01}}\n"
             "  - {name: motor, wheels: {w: 5}, pulse: {start: 0, duration: 0.01}}\n"
             "initial: {angular_velocity: [0.2, 0.1, 0.5]}\n");
  const Outcome outcome =
      run(kFreeflex + " report --repeats 1 --until 0.02 --budget 0.1 --json " + folder / "scene.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto read = nlohmann::json::parse(outcome.out)["scenes"][0];
  EXPECT_LT(read["reference"]["accuracy"], 1e-8);
  auto least = least_errors(read);
  EXPECT_LT(least.at("corotational"), 1e-6);
  for (const char* method : {"Stoermer 8", "Stoermer 12", "midpoint 12"})
    EXPECT_LT(least.at(method), 1e-7) << method;
}

TEST(ReportEstimates, AreOnThePageAndInTheTableAndInTheJson) {
  const TemporaryFolder folder;
  const Outcome outcome = run(kFreeflex + " report --estimates 2 --seed 4 --json --out " + folder / "out");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["complete"], true);
  EXPECT_EQ(json["estimates"]["seed"], 4);
  EXPECT_EQ(json["estimates"]["scenes"].size(), 2u);
  EXPECT_EQ(json, nlohmann::json::parse(read_text(folder / "out/report.json")));
  const std::string csv = read_text(folder / "out/estimates.csv"),
                    page = read_text(folder / "out/report.html");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 3)
      << "the table has a header and a line for each scene";
  for (const char* part :
       {"Reliability of the error estimate", "2 random scenes of seed 4", "estimate over truth"})
    EXPECT_TRUE(contains(page, part)) << part;
  EXPECT_FALSE(contains(page, "Work and precision")) << "no times were measured";
  EXPECT_FALSE(std::filesystem::exists(folder / "out/report.csv"));
}

TEST(ReportArguments, RungsThatWouldTakeTooLongAreSkippedAndReported) {
  const TemporaryFolder folder;
  write_text(folder / "scene.yaml", kTetrahedron);
  const Outcome outcome = run(kFreeflex + " report --rungs --repeats 1 --until 0.1 --budget 1e-9 --json " +
                              folder / "scene.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto scene = nlohmann::json::parse(outcome.out)["scenes"][0];
  EXPECT_TRUE(scene["runs"].empty()) << scene["runs"];
  ASSERT_FALSE(scene["left_out"].empty());
  EXPECT_TRUE(contains(scene["left_out"][0].dump(),
                       "with steps of 0.25 ms, is not computed, because a run would take"))
      << scene["left_out"][0];
}

// The steps of the reference and of the run that tells its accuracy are limited by stability, at 67,000 rad
// of the fastest mode
TEST(ReportArguments, TheReferenceOfAStiffTrussIsStable) {
  const Outcome outcome = run(kFreeflex + " report --rungs --repeats 1 --until 0.1 --budget 1e-9 --json " +
                              FREEFLEX_SOURCE_DIR "/service/scenes/truss-s4.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto reference = nlohmann::json::parse(outcome.out)["scenes"][0]["reference"];
  EXPECT_TRUE(contains(reference["method"].dump(), "fixed step")) << reference;
  EXPECT_LT(reference["accuracy"].get<double>(), 1e-6) << reference;
}

// The reference moves the edges of a pulse to ticks of the scene, so runs with other steps must move the
// edges to the same times. A wrench acts on its group in every run
TEST(ReportArguments, PulseEdgesAndWrenchesActAlikeInEveryMethod) {
  const TemporaryFolder folder;
  std::string scene = kTetrahedron;
  scene.replace(
      scene.find("loads:"), std::string::npos,
      "groups: {top: [b, c, d]}\nloads:\n"
      "  - {name: kick, wrenches: {top: {force: [0.3, 0.5, 0.2]}}, pulse: {start: 0, duration: 0.0203}}\n");
  write_text(folder / "scene.yaml", scene);
  const Outcome outcome =
      run(kFreeflex + " report --rungs --repeats 1 --until 0.1 --json " + folder / "scene.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  int fine = 0;
  for (const auto& item : json["scenes"][0]["runs"])
    if (item["method"] == "corotational" && item["step"] <= 1e-3) {
      ++fine;
      EXPECT_LT(item["elastic_error"], 1e-6) << item;
      EXPECT_LT(item["model_error"], 1e-6) << item;
    }
  EXPECT_EQ(fine, 2);
}

TEST(ReportArguments, ASceneWithoutDeformationDoesNotStopTheReportOnOtherScenes) {
  const TemporaryFolder folder;
  write_text(folder / "scene.yaml", kTetrahedron);
  write_text(folder / "still.yaml", kTetrahedron.substr(0, kTetrahedron.find("loads:")));
  const Outcome outcome = run(kFreeflex + " report --rungs --repeats 1 --until 0.1 --out " + folder / "out" +
                              " " + folder / "still.yaml" + " " + folder / "scene.yaml");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_TRUE(contains(outcome.err, "nothing deforms within 0.1 s")) << outcome.err;
  EXPECT_TRUE(contains(read_text(folder / "out/report.csv"), "tetrahedron,freeflex,separated"));
}

TEST(ReportArguments, InputFilesAreNotOverwritten) {
  const TemporaryFolder folder;
  const std::string points = "name,mass,x,y,z\na,1,0,0,0\nb,1,1,0,0\nc,1,0,1,0\nd,1,0,0,1\n";
  write_text(folder / "report.csv", points);
  std::string scene = kTetrahedron;
  const std::size_t first = scene.find("points:"), links = scene.find("links:");
  scene.replace(first, links - first, "points: {csv: report.csv}\n");
  write_text(folder / "scene.yaml", scene);
  const Outcome outcome =
      run(kFreeflex + " report --rungs --until 0.1 --out " + folder.path() + " " + folder / "scene.yaml");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_TRUE(contains(outcome.err, "report.csv, which is read")) << outcome.err;
  EXPECT_EQ(read_text(folder / "report.csv"), points);
}

TEST(ReportArguments, ScenesAndOptionsThatCannotBeReportedAreRefused) {
  const TemporaryFolder folder;
  write_text(folder / "body.yaml",
             "points:\n  - {name: a, mass: 1, at: [0, 0, 0], inertia: [1, 1, 0]}\n"
             "  - {name: b, mass: 1, at: [1, 0, 0]}\n"
             "links:\n  - {beam: [a, b], EA: 1, GJ: 1, EIy: 1, EIz: 1}\n");
  const Outcome body = run(kFreeflex + " report " + folder / "body.yaml");
  EXPECT_EQ(body.exit_code, 2);
  EXPECT_TRUE(contains(body.err,
                       "body.yaml:2:5: error: point 'a' has inertia about two axes only or none with an "
                       "offset, but the reference needs "
                       "inertia about three"))
      << body.err;
  EXPECT_TRUE(contains(body.err, "there is no full system to compare with")) << body.err;
  write_text(folder / "chain.yaml",
             "points:\n  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: b, mass: 1, at: [1, 0, 0]}\n"
             "  - {name: c, mass: 1, at: [2, 0, 0]}\nlinks:\n  - rigid: [a, b]\n  - rigid: [b, c]\n");
  const Outcome chain = run(kFreeflex + " report --until 0.1 " + folder / "chain.yaml");
  EXPECT_EQ(chain.exit_code, 2);
  EXPECT_TRUE(contains(chain.err, "no link resists a deformation")) << chain.err;
  write_text(folder / "mass.yaml",
             "points:\n  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: b, mass: 1, at: [1, 0, 0]}\n"
             "links:\n  - {name: tube, beam: [a, b], EA: 1, GJ: 1, EIy: 1, EIz: 1, mass_per_length: 1}\n");
  const Outcome mass = run(kFreeflex + " report " + folder / "mass.yaml");
  EXPECT_EQ(mass.exit_code, 2);
  EXPECT_TRUE(contains(mass.err,
                       "has distributed mass, but the reference has mass at points only; give the mass to "
                       "points, or set lumped: true"))
      << mass.err;
  EXPECT_EQ(run(kFreeflex + " report " + folder / "none.yaml").exit_code, 2);
  EXPECT_EQ(run(kFreeflex + " report").exit_code, 2);
  EXPECT_EQ(run(kFreeflex + " report --until -1 " + folder / "body.yaml").exit_code, 2);
  const Outcome times = run(kFreeflex + " report --until 1,2 " + folder / "body.yaml");
  EXPECT_EQ(times.exit_code, 2);
  EXPECT_TRUE(
      contains(times.err, "2 times for 1 scenes; give one time for all scenes, or one for each scene"))
      << times.err;
  write_text(folder / "tetrahedron.yaml", kTetrahedron);
  write_text(folder / "file", "");
  const Outcome blocked = run(kFreeflex + " report --rungs --repeats 1 --until 0.1 --out " + folder / "file" +
                              " " + folder / "tetrahedron.yaml");
  EXPECT_EQ(blocked.exit_code, 1);
  EXPECT_TRUE(contains(blocked.err, "file: Not a directory")) << blocked.err;
  EXPECT_EQ(blocked.out, "") << "the report is refused before anything is measured";
}

}  // namespace
}  // namespace freeflex::testing
