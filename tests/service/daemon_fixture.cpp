#include "tests/service/daemon_fixture.hpp"

#include <unistd.h>

#include <fstream>

#include "tests/support/private_network.hpp"

namespace freeflex::testing {

namespace {
std::string no_network;  // reason why there is no private network; empty if there is one
}

void Daemon::SetUp() {
  if (!no_network.empty()) GTEST_SKIP() << no_network;
}

std::vector<std::string> command_line(const std::string& prefix, std::vector<std::string> more) {
  std::vector<std::string> arguments{program("freeflexd"), scene_path("truss104.yaml"), "--prefix", prefix};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

std::vector<std::string> by_shell(const std::string& set_up, const std::vector<std::string>& arguments,
                                  const std::string& streams) {
  std::string line = set_up + " exec";
  for (const std::string& argument : arguments) line += " '" + argument + "'";
  return {"/bin/sh", "-c", line + " " + streams};
}

std::vector<double> motion(const freeflex_msgs::state_t& state) {
  std::vector<double> numbers(state.q);
  numbers.insert(numbers.end(), state.q_dot.begin(), state.q_dot.end());
  for (const double* v : {state.position, state.velocity, state.angular_velocity, state.angular_momentum}) {
    numbers.insert(numbers.end(), v, v + 3);
  }
  numbers.insert(numbers.end(), state.attitude, state.attitude + 4);
  return numbers;
}

pid_t find_ingress(const Process& daemon) {
  const std::string task = "/proc/" + std::to_string(daemon.pid()) + "/task/" + std::to_string(daemon.pid());
  std::ifstream children(task + "/children");
  pid_t ingress = -1;
  return children >> ingress ? ingress : -1;
}

std::string temporary_path(const std::string& name) {
  return std::string(P_tmpdir) + "/freeflex-" + std::to_string(getpid()) + "-" + name;
}

}  // namespace freeflex::testing

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  freeflex::testing::no_network = freeflex::testing::enter_private_network();
  return RUN_ALL_TESTS();
}
