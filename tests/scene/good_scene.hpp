// Reads scenes that must have no fault.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "service/io/scene/input.hpp"
#include "tests/scene/temporary_folder.hpp"

namespace freeflex::testing {

/// Writes the text into scene.yaml of the folder and reads this scene. The test fails if there is any fault.
inline Scene read_good(const TemporaryFolder& folder, const std::string& text) {
  folder.write("scene.yaml", text);
  const io::SceneResult result = io::read_scene("scene.yaml");
  for (const Fault& fault : result.faults) ADD_FAILURE() << io::format_fault(fault, result.sources);
  return result.scene.value_or(Scene{});
}

/// Reads the text as scene.yaml of a temporary folder.
inline Scene read_good(const std::string& text) { return read_good(TemporaryFolder(), text); }

/// Holds two lines of text, which give two points 1 m apart, joined by a spring.
inline const std::string kTwoPoints =
    "points: [{name: a, mass: 1, at: [0, 0, 0]}, {name: b, mass: 1, at: [1, 0, 0]}]\n"
    "links: {spring: [a, b], stiffness: 1}\n";

}  // namespace freeflex::testing
