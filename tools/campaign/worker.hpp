// A worker process of a campaign, which runs the cases that a pool gives it.
#pragma once

#include <string>

namespace freeflex::campaign {

/// Runs cases as run_pool() asks for, until the standard input ends. Returns an empty text or the error.
/// \param path  campaign file
std::string work(const std::string& path);

}  // namespace freeflex::campaign
