// Computes and prints what freeflex inspect shows: the paper's quantities of one scene (Alekseev 1970).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/paper/basis.hpp"
#include "core/paper/maxwell.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {

/// Ranges of the entries of a square matrix.
struct MatrixSummary {
  double least_diagonal = 0.0, largest_diagonal = 0.0;
  double largest_off_diagonal = 0.0;  // largest |entry| off the diagonal
  double symmetry_error = 0.0;        // [-] largest |a_lu - a_ul| divided by the largest |entry|
};
MatrixSummary summary_of(const Eigen::MatrixXd& matrix);

struct Inspection {
  Scene scene;
  Structure structure;
  ShapeClass shape = ShapeClass::kSpatial;
  int num_rigid_rows = 0;  // freedoms that rigid links remove, summed over links
  Basis basis;
  Maxwell maxwell;
  std::optional<double> inverse_error;  // [-] max |c delta - 1|, if both exist and the basis is complete
};

/// Computes the quantities of a scene. If no recipe is given, uses the explicit recipe of the shape if its
/// basis is complete, else the formal recipe. If the recipe does not apply, sets why_not to the reason and
/// returns nullopt.
std::optional<Inspection> inspect_scene(Scene scene, Structure structure, std::optional<Recipe> recipe,
                                        std::string& why_not);

/// Returns the points that a force group acts on: "hub x" for a unit load of the formal recipe, "hub - mid"
/// for other recipes.
std::string group_name(const Inspection& inspection, int group);

/// Largest number of elastic freedoms for which the JSON contains full matrices.
inline constexpr Eigen::Index kFullMatrices = 200;

Json to_json(const Inspection& inspection);
void print_text(const Inspection& inspection);

}  // namespace freeflex::tools
