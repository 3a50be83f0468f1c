// Defines the main function of tests that need a bus. It runs the tests in a private network.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "tests/support/private_network.hpp"

namespace freeflex::testing {

inline std::string refusal;  // reason why there is no private network; empty if there is one

/// Runs all tests in a private network. Listing the tests needs no network.
inline int run_network_tests(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  if (!GTEST_FLAG_GET(list_tests)) refusal = enter_private_network();
  return RUN_ALL_TESTS();
}

}  // namespace freeflex::testing
