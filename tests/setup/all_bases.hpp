// Makes every basis of a scene. Header only.
#pragma once

#include <string>
#include <vector>

#include "core/paper/basis.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {

struct Bases {
  Structure structure;
  LinkFactor factor;
  std::vector<Basis> all;  // first the explicit recipe for the shape, last the modes
};

inline Bases bases_of(const Scene& scene) {
  Bases bases;
  bases.structure = build(scene);
  Faults faults;
  bases.factor = factor_links(scene, false, faults);
  std::vector<Recipe> recipes{Recipe::kFormal, Recipe::kHouseholder, Recipe::kModes};
  const Recipe own = recipe_of(shape_class(scene.points, bases.structure.mass_properties));
  if (own != Recipe::kFormal) recipes.insert(recipes.begin(), own);
  for (const Recipe recipe : recipes) {
    std::string why_not;
    bases.all.push_back(find_basis(scene, bases.structure, bases.factor, recipe, why_not));
    EXPECT_EQ(why_not, "") << name_of(recipe);
  }
  return bases;
}

}  // namespace freeflex::testing
