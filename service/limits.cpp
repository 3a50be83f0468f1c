#include "service/limits.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <fstream>
#include <optional>
#include <string>

namespace freeflex::service {
namespace {

std::string megabytes(double bytes) { return std::to_string(std::llround(1e-6 * bytes)) + " MB"; }

/// Returns the limit ([B], or a number of files or threads), or nullopt if the resource has no limit.
std::optional<double> limit_of(__rlimit_resource resource) {
  rlimit limit{};
  if (getrlimit(resource, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return std::nullopt;
  return static_cast<double>(limit.rlim_cur);
}

/// Memory that this process uses.
struct Usage {
  double address_space = 0.0;  // [B]
  double data = 0.0;           // [B]
  double locked = 0.0;         // [B]
};

Usage read_usage() {
  Usage usage;
  // the lines have the form "VmSize: 1234 kB" (proc(5))
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    double* const value = word == "VmSize:"   ? &usage.address_space
                          : word == "VmData:" ? &usage.data
                          : word == "VmLck:"  ? &usage.locked
                                              : nullptr;
    if (value == nullptr) continue;
    status >> *value;
    *value *= 1024.0;
  }
  return usage;
}

/// Collects sentences about the limits that are set.
class Explanation {
 public:
  void add_bytes(__rlimit_resource resource, const char* what, double used, const char* option) {
    // privileged processes may exceed some limits, so a limit below the present use cannot be the cause
    const auto limit = limit_of(resource);
    if (limit && used <= *limit)
      add(std::string(what) + " is limited to " + megabytes(*limit) + ", and " + megabytes(used) +
          " are used; allow more, as with ulimit " + option + " " +
          std::to_string(std::llround(2.0 * *limit / 1024.0)));
  }
  void add_count(__rlimit_resource resource, const char* what, const char* option) {
    if (const auto limit = limit_of(resource))
      add(std::string(what) + " are limited to " + std::to_string(std::llround(*limit)) +
          "; allow more with ulimit " + option);
  }
  void add(const std::string& sentence) { text_ += ". " + sentence; }
  bool is_empty() const { return text_.empty(); }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

}  // namespace

std::string explain_limits(int error) {
  if (error != ENOMEM && error != EAGAIN && error != EMFILE) return {};
  Explanation explanation;
  if (error == EMFILE) {
    explanation.add_count(RLIMIT_NOFILE, "Open files", "-n");
    return explanation.text();
  }
  const Usage usage = read_usage();
  explanation.add_bytes(RLIMIT_AS, "Address space", usage.address_space, "-v");
  explanation.add_bytes(RLIMIT_DATA, "Data", usage.data, "-d");
  if (usage.locked > 0.0) explanation.add_bytes(RLIMIT_MEMLOCK, "Locked memory", usage.locked, "-l");
  if (error == EAGAIN) {
    if (const auto stack = limit_of(RLIMIT_STACK))
      explanation.add("A thread takes " + megabytes(*stack) + " of address space (ulimit -s)");
    // RLIMIT_NPROC does not apply to root
    if (geteuid() != 0)
      explanation.add_count(RLIMIT_NPROC, "Threads and processes of this user, all together,", "-u");
  }
  if (explanation.is_empty())
    explanation.add(
        "No limit of this process is set, so the machine or its control group has reached its own limit");
  return explanation.text();
}

}  // namespace freeflex::service
