// Files of matrices and names that pandas, NumPy and MATLAB read.
#pragma once

#include <string>

#include "tools/control/state_space.hpp"

namespace freeflex::control {

inline constexpr const char* kModelFiles = "NAME.csv, NAME.mat or NAME.npz";
bool is_model_file(const std::string& path);

/// Writes A, B, C, D and the names of states, inputs and outputs. Returns an empty text or the error.
///   .csv  one table: a row for the rate of each state and for each output, a column for each state and input
///   .mat  MATLAB's level 4, which scipy.io.loadmat reads too; names are rows of texts of equal length
///   .npz  NumPy's archive
std::string write_model(const StateSpace& model, const std::string& path);

}  // namespace freeflex::control
