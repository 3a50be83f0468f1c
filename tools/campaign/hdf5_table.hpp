// The merged table of a campaign in a file of HDF5.
#pragma once

#include <string>

#include "tools/campaign/opened.hpp"
#include "tools/campaign/results.hpp"

namespace freeflex::campaign {

/// Writes one dataset for each column of the table, with the column's name and one element for each case:
/// 64-bit whole numbers for `case`, doubles for measures and for variables whose values are all numbers, and
/// UTF-8 strings for the rest. A number that a row lacks is not a number. Two files of the same rows have the
/// same bytes. Returns an empty text or the error.
std::string write_hdf5(const Opened& opened, const Results& results, const std::string& path);

}  // namespace freeflex::campaign
