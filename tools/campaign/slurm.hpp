// Job arrays of Slurm for campaigns.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tools/campaign/opened.hpp"

namespace freeflex::campaign {

struct SlurmOptions {
  std::int64_t num_tasks = 1;
  int num_jobs = 1;                     // processes of a task
  std::vector<std::string> directives;  // further options of sbatch, such as --time=1:00:00
};

/// Writes the script of a job array in the folder of the results. Each task runs one shard, and runs it again
/// from where it was if its node is lost. Returns an empty text or the error. \param script  receives the
/// path
std::string write_slurm_script(const Opened& opened, const SlurmOptions& options, std::string& script);
/// Submits the script, and notes the number of the job in the folder. Returns an empty text or the error.
std::string submit_to_slurm(const Opened& opened, const std::string& script, std::string& job);

/// Returns the jobs that were submitted for the campaign.
std::vector<std::string> slurm_jobs(const Opened& opened);
/// Asks squeue for the states of the tasks of these jobs that have not ended, such as {"RUNNING": 3,
/// "PENDING": 12}. Returns an empty text or the error.
std::string slurm_states(const std::vector<std::string>& jobs, std::map<std::string, std::int64_t>& states);

}  // namespace freeflex::campaign
