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

/// The same program started by a shell that runs set_up first, with its standard streams sent as said.
std::vector<std::string> by_shell(const std::string& set_up, const std::vector<std::string>& arguments,
                                  const std::string& streams = "");

/// Every number of a published motion.
std::vector<double> motion(const freeflex_msgs::state_t& state);

/// The ingress of a daemon, which is its only child; -1 while there is none.
pid_t find_ingress(const Process& daemon);

/// A file's path for this process alone.
std::string temporary_path(const std::string& name);

}  // namespace freeflex::testing
