// Tests that need a bus: the main that gives them a network of their own.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "tests/support/private_network.hpp"

namespace freeflex::testing {

inline std::string refusal;  // why there is no private network; empty: there is one

/// Runs all tests in a private network. Listing them needs none.
inline int run_network_tests(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  if (!GTEST_FLAG_GET(list_tests)) refusal = enter_private_network();
  return RUN_ALL_TESTS();
}

}  // namespace freeflex::testing
