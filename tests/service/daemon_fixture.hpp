// What the tests of the real freeflexd share.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/service/bus_client.hpp"

namespace freeflex::testing {

/// Skips, with the reason, where the kernel refuses a private network.
class Daemon : public ::testing::Test {
 protected:
  void SetUp() override;
};

/// freeflexd on the truss of 104 points.
std::vector<std::string> command_line(const std::string& prefix, std::vector<std::string> more = {});

/// Every number of a published motion.
std::vector<double> motion(const freeflex_msgs::state_t& state);

/// The ingress of a daemon, which is its only child; -1 while there is none.
pid_t find_ingress(const Process& daemon);

/// A file's path for this process alone.
std::string temporary_path(const std::string& name);

}  // namespace freeflex::testing
