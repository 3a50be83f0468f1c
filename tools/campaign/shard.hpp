// The share of the cases that one task of a cluster runs.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace freeflex::campaign {

/// The cases whose number leaves the remainder `index` when it is divided by `count`.
struct Shard {
  std::int64_t index = 0, count = 1;
};

/// Parses K/N with 0 <= K < N, auto or auto/N. With auto, K and N are those that a launcher gives its tasks:
///   Slurm job array  SLURM_ARRAY_TASK_ID - SLURM_ARRAY_TASK_MIN of SLURM_ARRAY_TASK_COUNT
///   Kubernetes       JOB_COMPLETION_INDEX; N must be given
///   Open MPI         OMPI_COMM_WORLD_RANK of OMPI_COMM_WORLD_SIZE
/// \param variable  returns the value of an environment variable, or nullptr
/// \param error     receives what is wrong, if the result is nullopt
std::optional<Shard> parse_shard(const std::string& text,
                                 const std::function<const char*(const char*)>& variable, std::string& error);

}  // namespace freeflex::campaign
