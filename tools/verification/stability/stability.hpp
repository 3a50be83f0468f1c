// The table of freeflex stability: stiff and extreme cases, each with the limit that its error must meet.
#pragma once

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tools/terminal/console.hpp"
#include "tools/verification/report/machine.hpp"

namespace freeflex::tools {

struct StabilityOptions {
  bool is_quick = false;      // fewer ticks, for tests
  bool has_peers = true;      // true: other methods run too
  double peer_budget = 0.25;  // [s] limit of the CPU time of one run of another method
  std::function<bool()> is_stopped = [] { return false; };
};

/// Result of another method in the same case.
struct PeerFigure {
  std::string method;
  double figure = NAN;  // value of the case's quantity
  std::string failure;  // reason why there is no value, else empty
};

/// The result of a case. `measured` is NaN if there is no result.
struct Outcome {
  double measured = NAN;
  std::string message;  // the message of a refusal, else a remark or the reason why there is no result
  std::vector<PeerFigure> peers;
};

/// A case. A case holds if the measured value is at most the limit. In cases that must be refused or
/// reported, the measured value is the number of expected words that the message lacks.
struct StabilityCase {
  std::string group, name, quantity;
  double limit = 0.0;
  bool must_refuse = false;
  std::function<Outcome(const StabilityOptions&)> run;
};
std::vector<StabilityCase> stability_cases();

struct StabilityRow {
  StabilityCase what;
  Outcome outcome;
  double cpu = 0.0;  // [s] CPU time of the case, including other methods
  bool holds() const { return outcome.measured <= what.limit; }
  /// Returns "holds", "reported" (the case was refused or reported with the expected words) or "FAILS".
  const char* verdict() const;
};

struct StabilityReport {
  Machine machine;
  std::vector<StabilityRow> rows;
  bool is_interrupted = false;
  std::size_t num_cases = 0;  // number of cases in the table; `rows` contains only those that ran
  bool holds() const;
};

/// Runs every case.  \param report_progress  called with the finished fraction, 0 to 1
StabilityReport check_stability(const StabilityOptions& options,
                                const std::function<void(double)>& report_progress);

void print_row(const StabilityRow& row);
void print_text(const StabilityReport& report);
Json to_json(const StabilityReport& report);
std::string to_csv(const StabilityReport& report);
/// Returns the table as one page that needs no other file and no network.
std::string to_html(const StabilityReport& report);

}  // namespace freeflex::tools
