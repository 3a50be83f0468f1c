// What the subcommands of freeflex campaign share.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/campaign/opened.hpp"
#include "tools/campaign/pool.hpp"
#include "tools/campaign/results.hpp"
#include "tools/campaign/shard.hpp"

namespace freeflex::tools {

struct CampaignOptions {
  std::string file;
  std::string out;
  int jobs = 0;  // 0: one for each processor
  std::string shard;
  bool retries_lost = false;
  bool is_partial = false;
  bool writes_hdf5 = false;
  std::int64_t number = 0;
  std::int64_t num_tasks = 0;  // of slurm
  std::vector<std::string> directives;
  bool submits = false;
};

/// Returns the path of a file in the folder of the results.
std::string in_folder(const campaign::Opened& opened, const std::string& name);
/// Reads the results, and prints an error if they cannot be used.
std::optional<campaign::Results> read_or_explain(const campaign::Opened& opened,
                                                 const std::optional<campaign::Shard>& shard = std::nullopt);
/// Returns the row of a case whose worker was lost.  \param values  texts of the variables; empty: as drawn
campaign::StoredRow lost_row(const campaign::Campaign& of, std::int64_t number,
                             std::vector<std::string> values, bool is_hung, const std::string& why);
campaign::PoolOptions pool_options(const campaign::Opened& opened, int num_workers);

// the subcommands; each returns the exit code
int rerun_case(const CampaignOptions& options);
int shrink_case(const CampaignOptions& options);
int write_for_slurm(const CampaignOptions& options);

}  // namespace freeflex::tools
