// These tests check the findings and the layout of `freeflex report`.
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "tests/tools/shell.hpp"
#include "tools/verification/report/report.hpp"

namespace freeflex::testing {
namespace {

using tools::Family;
using tools::ReadOut;
using tools::Run;
using tools::Study;

Run made_run(Family family, const std::string& method, double step, double error, double cpu) {
  Run run;
  run.family = family;
  run.method = method;
  run.step = step;
  run.elastic_error = error;
  run.cpu.fill(cpu);
  run.steps = 100;
  return run;
}

Study made_study() {
  Study study;
  study.scene = "made <up> & \"quoted\"";
  study.end = 1.0;
  study.runs = {made_run(Family::kRung, "separated", 0.1, 2e-4, 1e-6),
                made_run(Family::kRung, "separated", 0.01, 1e-4, 1e-5),
                made_run(Family::kRung, "coupled", 0.01, 1e-6, 1e-4),
                made_run(Family::kHandWritten, "Runge-Kutta 4", 1e-3, 1e-1, 1e-3),
                made_run(Family::kHandWritten, "Runge-Kutta 4", 1e-4, 1e-5, 1e-2),
                made_run(Family::kPackaged, "CVODE Adams", 0.0, 1e-3, 2e-2),
                made_run(Family::kLinearised, "Krylov, linear", 0.1, 2e-4, 3e-4)};
  return study;
}

// The error of Runge-Kutta 4 is proportional to h^4 and its cost to 1 / h. Its runs have the error 1e-1 at
// 1e-3 s of CPU time per simulated second and 1e-5 at 1e-2 s, so the error 2e-4 costs 10^-(3 - 2.7 / 4) s
TEST(ReportComparison, ChoosesTheCheapestRungAndInterpolatesOtherMethods) {
  const auto found = tools::compare_at(made_study(), 1e-3, ReadOut::kOnce);
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->ours, 0u);
  EXPECT_DOUBLE_EQ(found->cpu, 1e-6);
  EXPECT_EQ(found->hand_written.method, "Runge-Kutta 4");
  const double error = 2e-4 * 1.05;
  EXPECT_NEAR(found->hand_written.cpu, std::pow(10.0, -3.0 + 0.25 * (-1.0 - std::log10(error))), 1e-9);
  EXPECT_EQ(found->packaged.method, "") << "the error of every packaged method stays above that of freeflex";
  EXPECT_EQ(found->linearised.method, "Krylov, linear");
  EXPECT_NEAR(found->linearised.ratio, 300.0, 1e-9);
  EXPECT_EQ(found->best.method, "Krylov, linear");
}

// runs of two methods with the same model error have slightly different errors, so an error up to 5 % above
// the model error counts as equal
TEST(ReportComparison, AnErrorUpTo5PercentAboveTheModelErrorCountsAsEqual) {
  Study study = made_study();
  study.runs[0].model_error = 2.1e-4;
  study.runs[6].elastic_error = 2.2e-4;
  EXPECT_EQ(tools::compare_at(study, 1e-3, ReadOut::kOnce)->linearised.method, "Krylov, linear");
  study.runs[6].elastic_error = 2.21e-4;
  EXPECT_EQ(tools::compare_at(study, 1e-3, ReadOut::kOnce)->linearised.method, "");
}

// other methods are run for errors down to kFinest, so a rung with a smaller error is compared at kFinest
TEST(ReportComparison, ComparesOtherMethodsOnlyDownToTheirSmallestTestedError) {
  Study study = made_study();
  study.runs[2].elastic_error = 1e-9;
  study.runs[5].elastic_error = tools::kFinest;
  const auto found = tools::compare_at(study, 1e-5, ReadOut::kOnce);
  EXPECT_EQ(found->packaged.method, "CVODE Adams");
  EXPECT_NEAR(found->error, 1.05 * tools::kFinest, 1e-14);
}

TEST(ReportComparison, AnInterruptedReportComparesNothing) {
  tools::Report report;
  report.studies.push_back(made_study());
  report.is_interrupted = true;
  const std::vector<std::string> sentences = tools::findings(report);
  ASSERT_EQ(sentences.size(), 1u);
  EXPECT_TRUE(contains(sentences[0], "Interrupted"));
}

TEST(ReportComparison, ChoosesAHigherRungOnlyIfTheErrorLevelRequiresIt) {
  const Study study = made_study();
  EXPECT_EQ(study.runs[tools::compare_at(study, 1e-5, ReadOut::kOnce)->ours].method, "coupled");
  EXPECT_FALSE(tools::compare_at(study, 1e-7, ReadOut::kOnce).has_value());
}

TEST(ReportComparison, ReportsWhereOtherMethodsAreCheaper) {
  tools::Report report;
  report.studies.push_back(made_study());
  report.studies[0].runs[6].cpu[2] = 1e-7;
  const std::vector<std::string> sentences = tools::findings(report);
  EXPECT_NE(sentences[2].find("We lose. With "), std::string::npos) << sentences[2];
  EXPECT_NE(sentences[2].find("10 times cheaper"), std::string::npos) << sentences[2];
  EXPECT_EQ(sentences[0].find("We lose"), std::string::npos);
}

TEST(ReportText, FitsTheScreenAndKeepsEveryRun) {
  tools::Report report;
  report.studies.push_back(made_study());
  Study& study = report.studies[0];
  study.scene =
      "a scene whose name is so long that the line which begins with it would end beyond the screen";
  study.runs[0].step = 0.5;
  study.runs[0].free_step = 1.925;
  study.runs.push_back(made_run(Family::kPackaged, "ARKODE explicit 8", 1e-4, 1e-99, 1e-99));
  study.runs.push_back(made_run(Family::kPackaged, "ARKODE implicit 5", 1e-4, 1e-5, 1.0));
  study.runs.back().failure =
      std::string("the solver says in many words, which no line holds, why it stops: ") +
      "the error test failed too often, or with the smallest step";
  report.machine.flags = "Release -O2 -DNDEBUG -ffp-contract=off -march=native -fno-math-errno, the step -O3";
  report.machine.processor = "AMD EPYC 9999 96-Core Processor at 3.70 GHz, some of it";
  ::testing::internal::CaptureStdout();
  tools::print_text(report);
  const std::string text = ::testing::internal::GetCapturedStdout();
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 120u) << line;
  for (const char* part : {"set-up s", "att.rad", "500 ms, then 1.93 s", "x300", "with the smallest step"})
    EXPECT_TRUE(contains(text, part)) << text;
}

TEST(ReportPage, EscapesTheNameOfTheScene) {
  tools::Report report;
  report.studies.push_back(made_study());
  for (const std::string& text : {tools::to_html(report), tools::work_precision_svg(report)}) {
    EXPECT_NE(text.find("made &lt;up&gt; &amp; &quot;quoted&quot;"), std::string::npos);
    EXPECT_EQ(text.find("<up>"), std::string::npos);
    EXPECT_EQ(text.find("nan"), std::string::npos);
    EXPECT_EQ(text.find("inf"), std::string::npos);
  }
}

}  // namespace
}  // namespace freeflex::testing
