// A page with pictures of the results of a campaign.
#pragma once

#include <string>

#include "tools/campaign/opened.hpp"
#include "tools/campaign/results.hpp"

namespace freeflex::campaign {

/// Returns an HTML page that needs no other file: outcomes, the probability of failure with its confidence
/// interval, a histogram of each measure, which variables separate the cases that fail, the strongest
/// relations between variables and measures, and the worst cases.
std::string make_page(const Opened& opened, const Results& results);

}  // namespace freeflex::campaign
