// A report on several scenes, on the error estimate, on long ticks and on omissions. Writes the report as
// text, JSON, CSV, one page or one picture.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/terminal/console.hpp"
#include "tools/verification/report/estimates.hpp"
#include "tools/verification/report/machine.hpp"
#include "tools/verification/report/omissions.hpp"
#include "tools/verification/report/study.hpp"
#include "tools/verification/report/ticks.hpp"

namespace freeflex::tools {

struct Report {
  Machine machine;
  std::vector<Study> studies;
  bool is_interrupted = false;         // true if some requested results are missing
  std::uint64_t seed = 0;              // seed of the random scenes
  std::vector<EstimateRow> estimates;  // empty unless asked for
  std::uint64_t ticks_seed = 0;        // seed of the random bodies
  std::vector<TickRow> ticks;          // empty unless asked for
  std::vector<OmissionRow> omissions;  // empty unless asked for
};

/// Returns the CPU time of a step with the first read-out [ns], or NaN if the run failed.
double ns_per_step(const Study& study, const Run& run);

/// Returns what one evaluation of the forces costs the other methods at true geometry, or an empty text for
/// springs and bars.
std::string forces_note(const Study& study);

/// Returns the conclusions, one sentence each: which other method is the cheapest relative to freeflex, and
/// on which scenes freeflex is slower than another method.
std::vector<std::string> findings(const Report& report);

void print_text(const Report& report);
Json to_json(const Report& report);
std::string to_csv(const Report& report);

/// Returns the report as one page that needs no other file and no network.
std::string to_html(const Report& report);

/// Returns a picture of elastic error over CPU time, with a row of panels per scene and one panel per
/// read-out.
std::string work_precision_svg(const Report& report);

// The section on the error estimate.
void print_estimates(const Report& report);
Json estimates_to_json(const Report& report);
std::string estimates_to_csv(const Report& report);
std::string estimates_section(const Report& report);

// The section on long ticks.
void print_ticks(const Report& report);
Json ticks_to_json(const Report& report);
std::string ticks_to_csv(const Report& report);
std::string ticks_section(const Report& report);

// The section on omissions.
void print_omissions(const Report& report);
Json omissions_to_json(const Report& report);
std::string omissions_section(const Report& report);

/// Returns the head of a page, with its style, up to the body.
std::string page_head(const std::string& title);

/// Returns a text with the special characters of HTML and SVG escaped.
std::string escaped(const std::string& text);

}  // namespace freeflex::tools
