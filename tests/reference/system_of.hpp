// The Cartesian system of a scene.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "tools/verification/reference/cartesian.hpp"

namespace freeflex {

inline CartesianSystem system_of(const Scene& scene) {
  std::string error;
  const auto system = make_cartesian_system(scene, error);
  EXPECT_TRUE(system.has_value()) << error;
  return *system;
}

}  // namespace freeflex
