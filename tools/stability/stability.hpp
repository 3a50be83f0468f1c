// freeflex stability: stiff and extreme cases, each beside the figure that it must meet.
#pragma once

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tools/report/machine.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {

struct StabilityOptions {
  bool is_quick = false;      // fewer ticks, for tests
  bool has_peers = true;      // other methods run beside ours
  double peer_budget = 0.25;  // [s] CPU that one run of another method may take
  std::function<bool()> is_stopped = [] { return false; };
};

/// What another method comes to in the same case.
struct PeerFigure {
  std::string method;
  double figure = NAN;  // in the quantity of the case
  std::string failure;  // why there is no figure, else empty
};

/// What a case comes to. Not a number where there is no answer.
struct Outcome {
  double measured = NAN;
  std::string
      said;  // what the user reads: of refusals the message, of others a remark or why there is no answer
  std::vector<PeerFigure> peers;
};

/// A case holds when what is measured is at most the limit. Of what must be refused or flagged, measured
/// counts the words that were to be named and were not.
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
  double cpu = 0.0;  // [s] of the case with its peers
  bool holds() const { return outcome.measured <= what.limit; }
  /// "holds", "refused", "FAILS"
  const char* verdict() const;
};

struct StabilityReport {
  Machine machine;
  std::vector<StabilityRow> rows;
  bool is_interrupted = false;
  std::size_t num_cases = 0;  // of which rows holds those that ran
  bool holds() const;
};

/// Every case in turn.  \param told  called with the share done, 0 to 1
StabilityReport check_stability(const StabilityOptions& options, const std::function<void(double)>& told);

void print_row(const StabilityRow& row);
void print_text(const StabilityReport& report);
Json to_json(const StabilityReport& report);
std::string to_csv(const StabilityReport& report);
/// One page that needs no other file and no network.
std::string to_html(const StabilityReport& report);

}  // namespace freeflex::tools
