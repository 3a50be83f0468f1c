// A report on several scenes, and on the error estimate: as text, JSON, CSV, one page and one picture.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/report/estimates.hpp"
#include "tools/report/machine.hpp"
#include "tools/report/study.hpp"
#include "tools/report/ticks.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {

struct Report {
  Machine machine;
  std::vector<Study> studies;
  bool is_interrupted = false;         // something that was asked for is not in it
  std::uint64_t seed = 0;              // of the random scenes
  std::vector<EstimateRow> estimates;  // empty unless asked for
  std::uint64_t ticks_seed = 0;        // of the random bodies
  std::vector<TickRow> ticks;          // empty unless asked for
};

/// [ns] CPU time of a step with the first read-out; not a number for a run that failed.
double ns_per_step(const Study& study, const Run& run);

/// What the figures say, a sentence each: which method comes nearest, and where freeflex loses.
std::vector<std::string> findings(const Report& report);

void print_text(const Report& report);
Json to_json(const Report& report);
std::string to_csv(const Report& report);

/// One page that needs no other file and no network.
std::string to_html(const Report& report);

/// Elastic error over CPU time, a row of panels a scene, one panel a read-out; for the page and by itself.
std::string work_precision_svg(const Report& report);

/// The part on the error estimate, of a report that has one.
void print_estimates(const Report& report);
Json estimates_to_json(const Report& report);
std::string estimates_to_csv(const Report& report);
std::string estimates_section(const Report& report);

/// The part on long ticks, of a report that has one.
void print_ticks(const Report& report);
Json ticks_to_json(const Report& report);
std::string ticks_to_csv(const Report& report);
std::string ticks_section(const Report& report);

/// What every page begins with, its style included, up to the body.
std::string page_head(const std::string& title);

/// Text for HTML and SVG.
std::string escaped(const std::string& text);

}  // namespace freeflex::tools
