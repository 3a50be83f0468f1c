// The merged table of a campaign and other files of its folder.
#pragma once

#include <string>

#include "service/campaign/case.hpp"
#include "tools/campaign/opened.hpp"
#include "tools/campaign/results.hpp"

namespace freeflex::campaign {

/// Writes the table of all rows, in the order of the cases. It does not depend on which process ran which
/// case. Returns an empty text or the error.
std::string write_table(const Opened& opened, const Results& results, const std::string& path);

/// Writes a scene that has the values of a case: a base and `set`. Sets `path` to the campaign's own file if
/// it is a plan, of which no case has other values. Returns an empty text or the error.
std::string write_case_scene(const Case& of, std::string& path);

}  // namespace freeflex::campaign
