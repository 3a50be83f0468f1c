// Describes the machine and the build with which a time was measured: processor, compiler, flags, commit,
// date.
#pragma once

#include <string>

namespace freeflex::tools {

struct Machine {
  std::string processor;  // model name
  int cores = 0;
  std::string system;  // name and version of the kernel
  std::string compiler, flags, commit, version;
  std::string date;  // UTC, ISO 8601
};

Machine this_machine();

}  // namespace freeflex::tools
