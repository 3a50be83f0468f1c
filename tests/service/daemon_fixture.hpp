// Helpers for the tests of the real freeflexd.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/service/bus_client.hpp"

namespace freeflex::testing {

/// A fixture that skips its tests, with the reason, if the kernel refuses a private network.
class Daemon : public ::testing::Test {
 protected:
  void SetUp() override;
};

/// Returns the command line of freeflexd on the truss of 104 points.
std::vector<std::string> command_line(const std::string& prefix, std::vector<std::string> more = {});

/// Returns a shell command that runs `set_up` and then the program with its streams redirected by `streams`.
std::vector<std::string> by_shell(const std::string& set_up, const std::vector<std::string>& arguments,
                                  const std::string& streams = "");

/// Returns every number of the motion in a STATE message.
std::vector<double> motion(const freeflex_msgs::state_t& state);

/// Returns the process id of the ingress of a daemon, the first child process of the daemon, or -1 while
/// there is none.
pid_t find_ingress(const Process& daemon);

/// Returns a temporary path that only this process uses.
std::string temporary_path(const std::string& name);

}  // namespace freeflex::testing
