// Valid values that are probably given in a wrong unit cause one warning for each kind of value. Coordinates
// that are rounded too coarsely to resolve the structure cause an error.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "service/io/scene/input.hpp"
#include "tests/scene/bad_scene.hpp"
#include "tests/scene/temporary_folder.hpp"

namespace freeflex::testing {
namespace {

std::vector<std::string> texts_of(const Faults& faults, const std::vector<std::string>& sources) {
  std::vector<std::string> texts;
  for (const Fault& fault : faults) texts.push_back(io::format_fault(fault, sources, false));
  return texts;
}

// returns the warnings on a valid scene
std::vector<std::string> warnings_of(const std::string& text) {
  const io::SceneResult result = io::read_scene_text({.text = text, .name = "s"});
  EXPECT_TRUE(result.scene.has_value());
  return texts_of(result.faults, result.sources);
}

// returns the warnings on a plate between the three points, with `values` as further keys
std::vector<std::string> warnings_of_plate(const std::string& values) {
  return warnings_of(kThreePoints + "links:\n  - {name: skin, plate: [hub..tip], nu: 0.3, " + values + "}\n");
}

using Texts = std::vector<std::string>;

TEST(Plausibility, AWarningAboutAModulusStatesTheLikelyUnit) {
  EXPECT_EQ(
      warnings_of_plate("E: 70, thickness: 0.01"),
      Texts{"s:6:5: warning: link 'skin': E of 70 Pa is less than rubber has; if it is in GPa, write 70e9"});
  EXPECT_EQ(warnings_of_plate("E: 210000, thickness: 0.01"),
            Texts{"s:6:5: warning: link 'skin': E of 210000 Pa is less than rubber has; if it is in MPa, "
                  "write 210000e6"});
  EXPECT_EQ(warnings_of_plate("E: 7e19, thickness: 0.01"),
            Texts{"s:6:5: warning: link 'skin': E of 7e+19 Pa is more than diamond has; check its unit"});
  for (const char* value : {"1e6", "70e9", "1.2e12", "1e13"})
    EXPECT_EQ(warnings_of_plate(std::string("thickness: 0.01, E: ") + value), Texts{}) << value;
}

TEST(Plausibility, AWarningAboutADensityStatesTheLikelyUnit) {
  EXPECT_EQ(warnings_of_plate("E: 7e10, thickness: 0.01, density: 2.7e-9"),
            Texts{"s:6:5: warning: link 'skin': density of 2.7e-09 kg/m^3 is less than a light foam has; if "
                  "it is in t/mm^3, write 2700"});
  EXPECT_EQ(warnings_of_plate("E: 7e10, thickness: 0.01, density: 7.85"),
            Texts{"s:6:5: warning: link 'skin': density of 7.85 kg/m^3 is less than a light foam has; if it "
                  "is in g/cm^3, write 7.85e3"});
  EXPECT_EQ(warnings_of_plate("E: 7e10, thickness: 0.01, density: 2.7e6"),
            Texts{"s:6:5: warning: link 'skin': density of 2700000 kg/m^3 is more than any metal has; check "
                  "its unit"});
  for (const char* value : {"0", "10", "2700", "30000"})
    EXPECT_EQ(warnings_of_plate(std::string("E: 7e10, thickness: 0.01, density: ") + value), Texts{})
        << value;
}

TEST(Plausibility, ThicknessIsComparedWithTheWidthOfThePlate) {
  EXPECT_EQ(warnings_of_plate("E: 7e10, thickness: 2"),
            Texts{"s:6:5: warning: link 'skin': the thickness of 2 m is more than the width of the plate, "
                  "0.707106781 m; if it is in mm, write 0.002"});
  EXPECT_EQ(warnings_of_plate("E: 7e10, thickness: 0.7"), Texts{});
}

// a plate 2 mm wide and 3 mm thick is implausible, and no other unit would make it plausible
TEST(Plausibility, AThicknessThatNoUnitMakesPlausibleGivesAWarning) {
  const std::string points =
      "points:\n  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: b, mass: 1, at: [0.002, 0, 0]}\n"
      "  - {name: c, mass: 1, at: [0, 0.002, 0]}\n";
  const Texts texts =
      warnings_of(points + "links:\n  - {plate: [a..c], nu: 0.3, E: 7e10, thickness: 0.003}\n");
  ASSERT_EQ(texts.size(), 1U);
  EXPECT_TRUE(texts[0].ends_with(" m; check both")) << texts[0];
}

// the radius of gyration sqrt(EI / EA) of an aluminium tube of 1 m diameter is 0.35 m; with EI in N mm^2 it
// would come out as 350 m
TEST(Plausibility, BeamStiffnessIsJudgedByItsRadiusOfGyration) {
  const auto beam = [](const std::string& stiffness) {
    return warnings_of(kThreePoints + "links:\n  - {name: tube, beam: [hub, mid], GJ: 1e6, " + stiffness +
                       "}\n");
  };
  EXPECT_EQ(beam("EA: 1e8, EIy: 1.225e7, EIz: 1e7"), Texts{});
  EXPECT_EQ(beam("EA: 1e8, EIy: 2.4e9, EIz: 1e7"), Texts{});
  EXPECT_EQ(
      beam("EA: 1e8, EIy: 1e10, EIz: 1e7"),
      Texts{
          "s:6:5: warning: link 'tube': EI of 1e+10 N m^2 and EA of 100000000 N are those of a section with "
          "a radius of gyration of 10 m on a beam of 1 m, which is too large; check the units of both"});
}

TEST(Plausibility, TheSizeOfABodyIsComparedWithTheSpanOfTheStructure) {
  const auto body = [](const std::string& values) {
    return warnings_of(kThreePoints + "  - {name: bus, mass: 100, at: [0, 0, 1], " + values +
                       "}\nlinks:\n  - {rigid: [hub, mid, tip, bus]}\n");
  };
  EXPECT_EQ(body("inertia: [100, 100, 100], offset: [0, 0, 1]"), Texts{});
  EXPECT_EQ(body("inertia: [2e7, 2e7, 2e7]"),
            Texts{"s:5:5: warning: point 'bus': inertia and mass give a radius of gyration of 547.722558 m "
                  "in a structure that spans 1.73205081 m; check that inertia is in kg m^2"});
  EXPECT_EQ(body("inertia: [1, 1, 1], offset: [0, 0, 100]"),
            Texts{"s:5:5: warning: point 'bus': the offset is 100 m in a structure that spans 1.73205081 m; "
                  "check that it is in m"});
}

TEST(Plausibility, ADampingRatioAboveOneGivesAWarning) {
  const std::string springs = kThreePoints + "links:\n  - {spring: [hub, mid, tip], stiffness: 100}\n";
  EXPECT_EQ(warnings_of(springs + "damping: {ratio: 1}\n"), Texts{});
  EXPECT_EQ(warnings_of(springs + "damping: {ratio: 2}\n"),
            Texts{"s:7:10: warning: damping: a ratio of 2 is above 1, which is critical damping; if it is in "
                  "per cent, write 0.02"});
}

// the plate has 4 x 4 cells of 5 mm and is 10 mm thick. Each triangle is narrower than 10 mm, but the whole
// plate is 20 mm wide
TEST(Plausibility, ThicknessIsComparedWithTheWholePlateInAFineMesh) {
  std::string text = "points:\n";
  for (int i = 0; i < 5; ++i)
    for (int k = 0; k < 5; ++k)
      text += "  - {name: p" + std::to_string(i) + std::to_string(k) + ", mass: 1, at: [" +
              std::to_string(0.005 * i) + ", " + std::to_string(0.005 * k) + ", 0]}\n";
  text += "links:\n";
  const auto name = [](int i, int k) { return "p" + std::to_string(i) + std::to_string(k); };
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 4; ++k)
      for (const std::string& third : {name(i + 1, k), name(i, k + 1)})
        text += "  - {plate: [" + name(i, k) + ", " + name(i + 1, k + 1) + ", " + third +
                "], E: 7e10, nu: 0.3, thickness: 0.01}\n";
  EXPECT_EQ(warnings_of(text), Texts{});
}

TEST(Plausibility, EachCauseGivesOneWarningWithTheNumberOfOtherLinks) {
  std::string text = "points:\n";
  for (int i = 0; i < 5; ++i)
    text += "  - {name: p" + std::to_string(i) + ", mass: 1, at: [" + std::to_string(i) + ", " +
            std::to_string(i % 2) + ", 0]}\n";
  text += "links:\n";
  const auto plate = [&](int i, const char* modulus) {
    const std::string end = std::to_string(i + 2);
    text += "  - {plate: [p" + std::to_string(i) + "..p" + end + "], E: " + modulus +
            ", nu: 0.3, thickness: 0.01}\n";
  };
  plate(0, "70");
  plate(1, "70e18");
  EXPECT_EQ(warnings_of(text),
            (Texts{"s:8:5: warning: link 1: E of 70 Pa is less than rubber has; if it is in GPa, write 70e9",
                   "s:9:5: warning: link 2: E of 7e+19 Pa is more than diamond has; check its unit"}));
  plate(2, "70");
  EXPECT_EQ(warnings_of(text).front(),
            "s:8:5: warning: link 1: E of 70 Pa is less than rubber has; if it is in GPa, write 70e9; the "
            "same holds for 1 other link");
  plate(0, "71");
  EXPECT_EQ(warnings_of(text).front(),
            "s:8:5: warning: link 1: E of 70 Pa is less than rubber has; if it is in GPa, write 70e9; the "
            "same holds for 2 other links");
}

TEST(Plausibility, LengthsInARatioOf1e12GiveAWarning) {
  const auto scene = [](const std::string& least) {
    return "points:\n  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: b, mass: 1, at: [" + least +
           ", 0, 0]}\n  - {name: c, mass: 1, at: [1e6, 0, 0]}\nlinks:\n"
           "  - {name: short, spring: [a, b], stiffness: 1}\n  - {name: long, spring: [b, c], stiffness: "
           "1}\n";
  };
  EXPECT_EQ(warnings_of(scene("1e-6")),
            Texts{"s:6:5: warning: lengths of links range from 1e-06 m (link 'short') to 1000000 m (link "
                  "'long'); check that all coordinates are in m"});
  EXPECT_EQ(warnings_of(scene("1e-5")), Texts{});
}

TEST(Plausibility, FrequenciesAboveAThousandTimesTheRateGiveAWarning) {
  const auto warnings = [](const std::string& stiffness) {
    const io::PlanResult result = io::load_plan_text(
        {.text = "points: [{name: a, mass: 0.001, at: [0, 0, 0]}, {name: b, mass: 0.001, at: [1, 0, 0]}]\n"
                 "links: {spring: [a, b], stiffness: " +
                 stiffness + "}\n",
         .name = "s"});
    EXPECT_TRUE(result.plan.has_value());
    return texts_of(result.faults, result.sources);
  };
  // the frequency [Hz] of two points of mass m, joined by a spring of stiffness k, is sqrt(2 k / m) / (2 pi)
  EXPECT_EQ(warnings("1e12"),
            Texts{"s: warning: the highest frequency, 7117625.43 Hz, is 7117.62543 times the rate of 1000 "
                  "Hz; check that masses are in kg, lengths in m, and stiffnesses in N/m, N or N m^2"});
  EXPECT_EQ(warnings("1e10"), Texts{}) << "the frequency is 711 times the rate";
}

// returns a scene of beams some metres long at `offset` [m] from the origin along each axis; all its
// coordinates are exact doubles
std::string far_scene(double offset) {
  std::string text = "points:\n";
  const double positions[4][3] = {{0, 0, 0}, {1.5, 0, 0}, {3, 0, 0.5}, {3, 1, 0}};
  const char* masses[4] = {"40", "1", "1", "2"};
  for (int i = 0; i < 4; ++i) {
    text += "  - {name: p" + std::to_string(i) + ", mass: " + masses[i] + ", at: [";
    for (int axis = 0; axis < 3; ++axis)
      text += (axis ? ", " : "") + std::to_string(offset + positions[i][axis]);
    text += "]}\n";
  }
  return text +
         "links: [{beam: [p0..p3], EA: 6.4e7, GJ: 5.6e4, EIy: 7.5e4, EIz: 6e4, y_axis: [0.1, 1, 0.3]}]\n";
}

TEST(FarFromTheOrigin, CoordinatesThatDoNotResolveTheStructureAreRefused) {
  const auto errors = [](double offset) {
    const io::PlanResult result = io::load_plan_text({.text = far_scene(offset), .name = "s"});
    EXPECT_FALSE(result.plan.has_value());
    return texts_of(result.faults, result.sources);
  };
  EXPECT_EQ(
      errors(std::ldexp(1.0, 50)),
      Texts{"s:6:9: error: link 1.1 of 1.5 m has points 1.12589991e+15 m from the origin, where numbers of "
            "64 bits are 0.25 m apart and do not resolve the link; give coordinates from an origin in the "
            "structure, and the position of that origin by initial: position; the same holds for 2 other "
            "links"});
  EXPECT_EQ(
      errors(std::ldexp(1.0, 46)),
      Texts{"s:6:9: error: link 1.1 of 1.5 m has points 7.03687442e+13 m from the origin, where numbers of "
            "64 bits are 0.015625 m apart and do not resolve the link; give coordinates from an origin in "
            "the structure, and the position of that origin by initial: position; the same holds for 2 "
            "other links"});
}

TEST(FarFromTheOrigin, CoordinatesThatResolveTheStructureKeepItsFrequencies) {
  const io::PlanResult near = io::load_plan_text({far_scene(0.0)});
  const io::PlanResult far = io::load_plan_text({far_scene(std::ldexp(1.0, 40))});
  ASSERT_TRUE(near.plan.has_value() && far.plan.has_value());
  EXPECT_EQ(far.faults.size(), 0u);
  EXPECT_EQ(far.plan->omega, near.plan->omega) << "positions relative to the first point are exact";
}

}  // namespace
}  // namespace freeflex::testing
