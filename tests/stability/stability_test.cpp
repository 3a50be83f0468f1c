// These tests run the cases of the stability table. Either the error of a case is within the limit of the
// case, or the case is refused or reported in a message.
#include "tools/verification/stability/stability.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <sstream>

#include "tools/terminal/json.hpp"

namespace freeflex::tools {

/// Prints the name that GoogleTest and ctest show for a case.
void PrintTo(const StabilityCase& what, std::ostream* out) { *out << what.group << ": " << what.name; }

namespace {

/// Returns the group and the name of a case as letters and digits, for the name of its test.
std::string test_name(const StabilityCase& what) {
  std::string name;
  for (const char c : what.group + " " + what.name) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) name += c;
    if (c == '-') name += "minus";
    if (c == '.') name += "point";
  }
  return name;
}

class Stability : public ::testing::TestWithParam<StabilityCase> {};

TEST_P(Stability, EachCaseIsWithinItsLimitOrIsRefusedWithTheCause) {
  const StabilityCase& what = GetParam();
  StabilityOptions options;
  options.is_quick = true;
  options.has_peers = false;
  const Outcome outcome = what.run(options);
  print_row({what, outcome});
  EXPECT_LE(outcome.measured, what.limit) << what.group << ": " << what.name << ": " << outcome.message;
}

INSTANTIATE_TEST_SUITE_P(Table, Stability, ::testing::ValuesIn(stability_cases()),
                         [](const auto& given) { return test_name(given.param); });

StabilityRow row_of(double measured, double limit) {
  StabilityRow row;
  row.what.group = "a < b";
  row.what.name = "case \"one\"";
  row.what.limit = limit;
  row.outcome.measured = measured;
  return row;
}

TEST(StabilityTable, AResultThatIsNotANumberFails) {
  EXPECT_TRUE(row_of(1e-9, 1e-8).holds());
  EXPECT_FALSE(row_of(1e-7, 1e-8).holds());
  EXPECT_FALSE(row_of(NAN, 1e-8).holds());
  EXPECT_STREQ(row_of(NAN, 1e-8).verdict(), "FAILS");
  StabilityReport report;
  report.rows = {row_of(1e-9, 1e-8), row_of(NAN, 1e-8)};
  EXPECT_FALSE(report.holds());
  EXPECT_FALSE(to_json(report)["holds"].get<bool>());
}

TEST(StabilityTable, LinesFitTheScreen) {
  StabilityReport report;
  const std::string words = "the words of a long message that names the error, its position and the remedy";
  report.machine.processor = words;
  report.machine.compiler = words;
  StabilityRow long_name = row_of(1e-9, 1e-8), refused = long_name;
  long_name.what.name = "stiffness ratio 1e15, mass ratio 1e12, nearly planar, askew";
  long_name.outcome.message = words;
  long_name.outcome.peers = {{"ARKODE implicit 5", NAN, words + ": " + words}};
  refused.what.must_refuse = true;
  refused.outcome.message = words + "; " + words + "; " + words;
  report.rows = {long_name, refused};
  ::testing::internal::CaptureStdout();
  print_text(report);
  std::istringstream text(::testing::internal::GetCapturedStdout());
  std::string line, all;
  for (; std::getline(text, line); all += line) EXPECT_LE(line.size(), 120U) << line;
  EXPECT_NE(all.find("remedy; "), std::string::npos) << "every word of the text must be in the table";
}

TEST(StabilityTable, TextOfCasesIsQuotedInCsvAndEscapedInHtml) {
  StabilityReport report;
  report.rows = {row_of(1e-9, 1e-8)};
  EXPECT_NE(to_csv(report).find("\"case \"\"one\"\"\""), std::string::npos);
  const std::string page = to_html(report);
  EXPECT_NE(page.find("a &lt; b"), std::string::npos);
  EXPECT_EQ(page.find("a < b"), std::string::npos);
}

// At omega h = pi, velocity Verlet and RK4 are unstable, but methods that choose their own step are not.
TEST(StabilityTable, EachOtherMethodHasAnErrorOrAReasonForNone) {
  const auto cases = stability_cases();
  const auto found = std::find_if(cases.begin(), cases.end(),
                                  [](const StabilityCase& what) { return what.name == "omega h pi"; });
  ASSERT_NE(found, cases.end());
  StabilityOptions options;
  options.is_quick = true;
  options.peer_budget = 60.0;
  const Outcome outcome = found->run(options);
  ASSERT_GE(outcome.peers.size(), 6U);
  for (const PeerFigure& peer : outcome.peers) {
    EXPECT_EQ(std::isfinite(peer.figure), peer.failure.empty()) << peer.method;
    const bool is_by_hand = peer.method == "velocity Verlet" || peer.method == "Runge-Kutta 4";
    EXPECT_EQ(peer.figure < 1e-2, !is_by_hand) << peer.method << ": " << peer.figure << " " << peer.failure;
  }
}

}  // namespace
}  // namespace freeflex::tools
