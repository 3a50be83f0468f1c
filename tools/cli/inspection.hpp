// What freeflex inspect shows: the paper's quantities of one scene (Alekseev 1970).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/paper/basis.hpp"
#include "core/paper/maxwell.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {

/// Smallest and largest of what can be told of a square matrix at a glance.
struct MatrixSummary {
  double least_diagonal = 0.0, largest_diagonal = 0.0;
  double largest_beside = 0.0;  // largest |entry| off the diagonal
  double symmetry_error = 0.0;  // [-] largest |a_lu - a_ul| over the largest |entry|
};
MatrixSummary summary_of(const Eigen::MatrixXd& matrix);

struct Inspection {
  Scene scene;
  Structure structure;
  ShapeClass shape = ShapeClass::kSpatial;
  int num_rigid_rows = 0;  // freedoms that rigid links remove, counted link by link
  Basis basis;
  Maxwell maxwell;
  std::optional<double> inverse_error;  // [-] max |c delta - 1|, where both stand over a complete basis
};

/// An empty recipe name is that of the shape where it is complete, else the formal one.
/// \param why_not  set, and nothing returned, when the recipe does not apply to the shape
std::optional<Inspection> inspect_scene(Scene scene, Structure structure, std::optional<Recipe> recipe,
                                        std::string& why_not);

/// "hub x" for a unit load of the formal recipe, "hub - mid" for others: the points that a group acts on.
std::string group_name(const Inspection& inspection, int group);

/// Full matrices are in the JSON up to this many elastic freedoms.
inline constexpr Eigen::Index kFullMatrices = 200;

Json to_json(const Inspection& inspection);
void print_text(const Inspection& inspection);

}  // namespace freeflex::tools
