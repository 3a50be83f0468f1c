// freeflex inspect shows the paper's quantities of a scene: basis, Maxwell and influence coefficients.
#include <CLI/App.hpp>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/structure/structure.hpp"
#include "tools/cli/commands.hpp"
#include "tools/cli/inspection.hpp"
#include "tools/terminal/json.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

struct InspectOptions {
  std::string scene;
  std::string basis = "auto";
  bool json = false;
};

constexpr const char* kInspectFooter = R"(Example:
  freeflex inspect service/scenes/boom.yaml --basis formal
JSON fields:
  name, points, links, shape, rigid_freedoms, constraints, redundant_constraints, elastic_freedoms
               shape is collinear, planar or spatial; the other fields except name are counts
  mass, masses [kg] total, and of each point;  centre [m], scene axes
  inertia, principal_moments, principal_axes
               [kg m^2], about the centre of mass; the axes are unit vectors, one per row
  basis        recipe, rank, expected; gram_error, force_residual, moment_residual, constraint_residual; b, the
               unit elastic displacements; with force groups also rank_as_numbered, numbering, groups, kept, skipped,
               least_kept, most_skipped, C [N], flat_points
  delta, c     Maxwell [m/N] and influence [N/m] coefficients: exists, and either reason, or size,
               least_diagonal, largest_diagonal, largest_off_diagonal, symmetry_error, matrix; delta also has
               redundant_links
  inverse_error, conditioning
               max |c delta - 1| (null where c or delta is missing); condition number of c
  mechanisms   for each: names of the points that it moves
  frequencies  [Hz];  frequency_accuracy [-] of the lowest
  b, C and matrix are included if the structure has at most 200 elastic freedoms.
Exit codes: 0 done, 1 the basis is not complete, 2 the scene has errors or another shape than the recipe
needs.)";

constexpr std::array kRecipes{Recipe::kCollinear, Recipe::kPlanar,      Recipe::kSpatial,
                              Recipe::kFormal,    Recipe::kHouseholder, Recipe::kModes};

std::vector<std::string> basis_names() {
  std::vector<std::string> names;
  names.reserve(kRecipes.size() + 1);
  for (const Recipe recipe : kRecipes) names.push_back(name_of(recipe));
  names.push_back("auto");
  return names;
}

/// Returns the recipe with this name, or nullopt for auto.
std::optional<Recipe> recipe_named(const std::string& name) {
  for (const Recipe recipe : kRecipes)
    if (name == name_of(recipe)) return recipe;
  return std::nullopt;
}

int inspect(const InspectOptions& options) {
  if (io::is_plan_file(options.scene)) {
    print_error(options.scene + " is a plan, which contains no links; name the scene that it was made from");
    return kExitUsage;
  }
  io::SceneResult read = io::read_scene(options.scene);
  std::optional<Structure> structure;
  if (read.scene) {
    Progress progress("set-up");
    structure = build_structure(*read.scene, read.faults, progress.of_setup());
  }
  print_faults(read.faults, read.sources);
  if (!structure || has_error(read.faults)) return kExitUsage;

  std::string why_not;
  const std::optional<Inspection> inspection = [&] {
    const Progress progress("inspect");
    return inspect_scene(std::move(*read.scene), std::move(*structure), recipe_named(options.basis), why_not);
  }();
  if (!inspection) {
    print_error(why_not);
    return kExitUsage;
  }
  if (options.json)
    print_json(to_json(*inspection));
  else
    print_text(*inspection);
  return inspection->basis.is_complete() ? kExitOk : kExitDiffers;
}

}  // namespace

void add_inspect(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<InspectOptions>();
  CLI::App* command = app.add_subcommand(kInspect.name, kInspect.meaning);
  command->add_option("SCENE", options->scene, "scene file")->required();
  command
      ->add_option(
          "--basis", options->basis,
          "recipe of the unit elastic displacements: " + listed(basis_names(), basis_names().size()) +
              "; auto: the explicit recipe of the shape if that is complete, else formal")
      ->capture_default_str()
      ->check(one_of(basis_names()))
      ->type_name("RECIPE");
  command->add_flag(
      "--json", options->json,
      "one JSON object on standard output; its matrices are written for at most 200 elastic freedoms");
  command->footer(kInspectFooter);
  command->callback([options, &exit_code] { exit_code = inspect(*options); });
}

}  // namespace freeflex::tools
