// Campaign files: what is read, and what is refused with which words.
#include <gtest/gtest.h>

#include <string>

#include "service/campaign/campaign.hpp"
#include "tests/scene/temporary_folder.hpp"

namespace freeflex::campaign {
namespace {

using testing::TemporaryFolder;

const std::string kHead = "scene: pair.yaml\ncases: 100\nuntil: 2\n";
const std::string kMeasure = "measure: {of: point.a.x, take: final}\n";

CampaignResult read_text(const std::string& text) {
  const TemporaryFolder folder;
  folder.write("campaign.yaml", text);
  return read_campaign("campaign.yaml");
}

std::string faults_of(const std::string& text) {
  const CampaignResult result = read_text(text);
  std::string all;
  for (const Fault& fault : result.faults)
    all += (all.empty() ? "" : "\n") + io::format_fault(fault, result.sources, false);
  return all;
}

TEST(CampaignFile, HoldsAllThatIsWritten) {
  const CampaignResult result = read_text(
      "name: pointing\nscene: pair.yaml\ncases: 5000\nseed: 7\ndesign: sobol\nuntil: 60\ntime_limit: 20\n"
      "set: {rate: 500}\n"
      "controller: {python: ctl.py, every: 0.1, parameters: {gain: 2, delay: 0.05}}\n"
      "vary:\n"
      "  - {path: points.a.mass, normal: {mean: 28, sd: 2}, min: 20}\n"
      "  - {name: stiffness, path: [links.1.stiffness*, links.2.stiffness*], uniform: [0.9, 1.1]}\n"
      "  - {path: controller.gain, lognormal: {median: 2, log_sd: 0.1}, nominal: 2.5}\n"
      "  - {path: fidelity, list: [separated, coupled]}\n"
      "correlation: {of: [stiffness, points.a.mass], matrix: [[1, 0.5], [0.5, 1]]}\n"
      "measure:\n"
      "  - {name: late, of: point.a.x, take: settling_time, target: 1, band: 0.1, from: 1, to: 50, "
      "fail_above: 9}\n"
      "  - {of: attitude, take: largest, reference: [0, 1, 0, 0]}\n");
  for (const Fault& fault : result.faults) ADD_FAILURE() << fault.message;
  ASSERT_TRUE(result.campaign.has_value());
  const Campaign& campaign = *result.campaign;
  EXPECT_EQ(campaign.name, "pointing");
  EXPECT_EQ(campaign.sampling.cases, 5000);
  EXPECT_EQ(campaign.sampling.seed, 7u);
  EXPECT_EQ(campaign.sampling.design, Design::kSobol);
  EXPECT_EQ(campaign.until, 60.0);
  EXPECT_EQ(campaign.time_limit, 20.0);
  ASSERT_EQ(campaign.set.size(), 1u);
  EXPECT_EQ(campaign.set[0].path + "=" + campaign.set[0].value, "rate=500");
  EXPECT_EQ(campaign.controller.kind, ControllerFile::Kind::kPython);
  EXPECT_EQ(campaign.controller.every, 0.1);
  EXPECT_EQ(campaign.controller.parameters.size(), 2u);
  ASSERT_EQ(campaign.variables.size(), 4u);
  EXPECT_EQ(campaign.variables[0].name, "points.a.mass");
  EXPECT_EQ(std::get<Normal>(campaign.sampling.variables[0]).truncation.min, 20.0);
  EXPECT_EQ(campaign.variables[1].paths.size(), 2u);
  EXPECT_EQ(campaign.variables[1].nominal, "1");
  EXPECT_EQ(campaign.variables[2].nominal, "2.5");
  EXPECT_EQ(campaign.variables[3].nominal, "separated");
  EXPECT_EQ(campaign.sampling.correlation,
            (std::vector<double>{1, 0.5, 0, 0, 0.5, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}));
  ASSERT_EQ(campaign.measures.size(), 2u);
  EXPECT_EQ(campaign.measures[0].statistic, Statistic::kSettlingTime);
  EXPECT_EQ(campaign.measures[0].fail_above, 9.0);
  EXPECT_EQ(campaign.measures[1].name, "attitude.largest");
  EXPECT_EQ(campaign.measures[1].reference, (std::array<double, 4>{0, 1, 0, 0}));
}

struct Bad {
  const char* name;
  std::string text, fault;
};
class BadCampaign : public ::testing::TestWithParam<Bad> {};
TEST_P(BadCampaign, SaysWhereAndWhat) { EXPECT_EQ(faults_of(GetParam().text), GetParam().fault); }

INSTANTIATE_TEST_SUITE_P(
    Files, BadCampaign,
    ::testing::Values(
        Bad{"WithoutMeasures", kHead,
            "campaign.yaml:1:1: error: campaign: measure is missing; it must be a list of {name, of, take}"},
        Bad{"HalfACase", "scene: pair.yaml\ncases: 1.5\nuntil: 2\n" + kMeasure,
            "campaign.yaml:2:8: error: campaign: cases is the text '1.5', but must be a whole number from 1 "
            "to 1e+09"},
        Bad{"TwoDistributions", kHead + "vary: {path: rate, uniform: [1, 2], list: [1]}\n" + kMeasure,
            "campaign.yaml:4:7: error: variable 1 has more than one distribution; it must have one of "
            "normal, lognormal, uniform, list"},
        Bad{"MinOfAUniform", kHead + "vary: {path: rate, uniform: [1, 2], min: 0}\n" + kMeasure,
            "campaign.yaml:4:7: error: variable 1 has min or max, which only normal and lognormal take"},
        Bad{"EmptyTruncation",
            kHead + "vary: {path: rate, normal: {mean: 0, sd: 1}, min: 2, max: 1}\n" + kMeasure,
            "campaign.yaml:4:7: error: variable 1: min must be below max"},
        Bad{"BadPath", kHead + "vary: {path: 'points[1].mass', uniform: [1, 2]}\n" + kMeasure,
            "campaign.yaml:4:15: error: path 'points[1].mass': 'points[1]' must be a key, a name, a number "
            "or * at "
            "character 1 of the path; separate keys and names by dots, as in points.hub.mass"},
        Bad{"OverlappingPaths",
            kHead +
                "vary: [{path: points.a.mass, uniform: [1, 2]}, {path: points.1.mass, uniform: [1, 2]}]\n" +
                kMeasure,
            "campaign.yaml:4:55: error: path 'points.1.mass' may set a value that 'points.a.mass' sets too, "
            "but only the last value would count; remove one, multiply with a path that ends with *, or name "
            "both items by their names"},
        Bad{"NoPath", kHead + "vary: {path: [], uniform: [1, 2]}\n" + kMeasure,
            "campaign.yaml:4:7: error: variable 1: path is an empty list"},
        Bad{"ParameterWithoutAController",
            kHead + "vary: {path: controller.gain, uniform: [1, 2]}\n" + kMeasure,
            "campaign.yaml:4:14: error: path 'controller.gain' names a parameter, but the campaign has no "
            "controller; add the key controller"},
        Bad{"UnknownParameter",
            kHead +
                "controller: {python: a.py, parameters: {gain: 1}}\n"
                "vary: {path: controller.gian, uniform: [1, 2]}\n" +
                kMeasure,
            "campaign.yaml:5:14: error: path 'controller.gian' names no parameter of the controller (did you "
            "mean 'gain'?); its parameters, with the values of all other cases, are listed under controller: "
            "parameters"},
        Bad{"ParameterThatIsAWord",
            kHead +
                "controller: {python: a.py, parameters: {law: 1}}\n"
                "vary: {path: controller.law, list: [pd, 2]}\n" +
                kMeasure,
            "campaign.yaml:5:7: error: variable 1 has the value 'pd', but a parameter of the controller must "
            "be a "
            "number"},
        Bad{"OnePathTwice",
            kHead + "vary: [{path: rate, uniform: [1, 2]}, {path: rate, uniform: [1, 2]}]\n" + kMeasure,
            "campaign.yaml:4:46: error: path 'rate' is varied twice, but only the last value would count; "
            "remove one, "
            "or multiply with a path that ends with *"},
        Bad{"UnknownInACorrelation",
            kHead + "vary: {name: a, path: rate, uniform: [1, 2]}\ncorrelation: {of: [b], matrix: [[1]]}\n" +
                kMeasure,
            "campaign.yaml:5:20: error: correlation: of names 'b', which is the name of no variable"},
        Bad{"ImpossibleCorrelation",
            kHead +
                "vary: [{name: a, path: rate, uniform: [1, 2]}, {name: b, path: gravity.0, uniform: [1, "
                "2]}]\n"
                "correlation: {of: [a, b], matrix: [[1, 2], [2, 1]]}\n" +
                kMeasure,
            "campaign.yaml:5:35: error: correlation: no variables have these correlations, because the "
            "matrix is "
            "not positive definite; make some smaller"},
        Bad{"TwoControllers", kHead + "controller: {python: a.py, library: b.so}\n" + kMeasure,
            "campaign.yaml:4:13: error: controller must have one of library, python, program"},
        Bad{"ControllerAndCommands", kHead + "commands: a.log\ncontroller: {python: a.py}\n" + kMeasure,
            "campaign.yaml:5:13: error: a campaign has either a controller or commands of a recording; "
            "remove one"},
        Bad{"SettlingTimeWithoutBand", kHead + "measure: {of: point.a.x, take: settling_time}\n",
            "campaign.yaml:4:10: error: measure 1: band is missing; it must be the largest distance from the "
            "target at which the quantity counts as settled"},
        Bad{"BandOfALargest", kHead + "measure: {of: point.a.x, take: largest, band: 1}\n",
            "campaign.yaml:4:47: error: measure 1: band has no effect, because it is only for settling_time"},
        Bad{"MeasureAfterTheEnd", kHead + "measure: {of: point.a.x, take: largest, from: 3}\n",
            "campaign.yaml:4:10: error: measure 'point.a.x.largest' begins at 3 s, after the end of the "
            "cases; set a "
            "later until"},
        Bad{"TwoOfOneName", kHead + "measure: [{of: wx, take: largest}, {of: wx, take: largest}]\n",
            "campaign.yaml:4:36: error: two variables or measures are called 'wx.largest'; give one of them "
            "another name"}),
    [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace freeflex::campaign
