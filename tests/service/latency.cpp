#include "tests/service/latency.hpp"

#include <cstdio>
#include <sstream>
#include <utility>
#include <vector>

#include "tests/service/bus_client.hpp"

namespace freeflex::testing {

void print_row(const std::string& name, const std::array<double, 4>& us) {
  std::printf("%-28s %10.1f %10.1f %10.1f %10.1f\n", name.c_str(), us[0], us[1], us[2], us[3]);
}

void print_cyclictest(const std::string& name, int seconds) {
  Process cyclictest(
      {"cyclictest", "-q", "-m", "-p", "80", "-i", "1000", "-D", std::to_string(seconds), "-h", "50000"});
  const int status = cyclictest.wait();
  std::vector<std::pair<double, std::int64_t>> counts;
  std::int64_t total = 0;
  std::istringstream lines(cyclictest.output());
  for (std::string line; std::getline(lines, line);) {
    double us = 0.0;
    std::int64_t count = 0;
    if (line.starts_with("#") || !(std::istringstream(line) >> us >> count) || count == 0) continue;
    counts.emplace_back(us, count);
    total += count;
  }
  if (status != 0 || total == 0) {
    std::printf("%-28s not measured (cyclictest, package rt-tests, ended with %d)\n", name.c_str(), status);
    return;
  }
  std::array<double, 4> result{};
  const std::array<double, 4> quantiles{0.5, 0.99, 0.999, 1.0};
  std::int64_t below = 0;
  std::size_t next = 0;
  for (const auto& [us, count] : counts) {
    below += count;
    while (next < 4 && static_cast<double>(below) >= quantiles[next] * static_cast<double>(total))
      result[next++] = us;
  }
  print_row(name, result);
}

}  // namespace freeflex::testing
