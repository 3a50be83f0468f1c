// Processes that run the cases of a campaign.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/campaign/results.hpp"

namespace freeflex::campaign {

struct PoolOptions {
  std::vector<std::string> command;  // program and arguments of a worker
  std::string log;                   // file to which workers write what they print
  int num_workers = 1;
  double time_limit = 600.0;  // [s] wall clock of a case
};

/// What a pool asks of its owner.
struct PoolCalls {
  /// Returns the next job, or nullopt if there is none now.
  std::function<std::optional<std::string>()> next;
  std::function<bool(StoredRow)> take;  // stores a row; false: stop
  /// Makes the row of a case whose worker ended, or took too long.
  std::function<StoredRow(std::int64_t number, bool is_hung, const std::string& why)> lost;
  std::function<bool()> is_ended;  // true: stop, without waiting for cases in hand
};

/// Runs cases in worker processes until none has a job and there is no other. A worker writes kReady and an
/// end of line to file descriptor 3 when it can run cases. Then it reads jobs, one a line, from its standard
/// input: the number of a case and, if they are not those that are drawn, a tab and the text of each value.
/// It writes a line for each job: the row, a tab, the seconds of the set-up, a tab, and those of the run; or
/// kFaultMark and why it ends. If a worker ends, or needs too long for a case, that case is lost, and another
/// worker takes its place. Returns an empty text, or why the cases could not be run.
std::string run_pool(const PoolOptions& options, const PoolCalls& calls);

inline constexpr int kResultDescriptor = 3;
inline constexpr const char* kReady = "ready";
inline constexpr char kFaultMark = '!';
inline constexpr const char* kTraceMark = ">";  // is no YAML value

}  // namespace freeflex::campaign
