// The results of a campaign: a folder of files to which processes append rows.
//
// Each process has a file of its own, so processes on many machines can share the folder without locks. A
// line is written by one call of the operating system and ends with a checksum, so a killed process leaves at
// most one torn line, which readers skip.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/campaign/shard.hpp"

namespace freeflex::campaign {

/// Part of the error about results of other files.
inline constexpr const char* kOtherCampaign =
    "belongs to another campaign, or to an earlier state of its files";

/// A row of the table, and how long it took.
struct StoredRow {
  std::string row;
  double setup_seconds = 0.0, run_seconds = 0.0;  // wall clock
};

/// Returns the number of the case in a row.
std::int64_t number_of(std::string_view row);
/// Returns the outcome in a row, as text.
std::string_view outcome_of(std::string_view row);
/// Returns true if the case may end otherwise when it runs again: its process ended, or took too long.
bool is_lost(std::string_view row);

/// Appends rows to a new file in a folder.
class PartFile {
 public:
  PartFile() = default;
  ~PartFile();
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;

  /// Creates the folder, if need be, and a file with a name that no other process uses. Returns an empty text
  /// or the error.
  /// \param stamp  first line of the file, which says to which campaign it belongs
  /// \param shard  the cases of which the file has some
  std::string create(const std::string& folder, const std::string& stamp, const Shard& shard);
  /// Appends a row. After an error, which is returned, the file ends after the last whole line.
  std::string append(const StoredRow& row);
  const std::string& path() const { return path_; }

 private:
  int file_ = -1;
  std::string path_;
  std::int64_t size_ = 0;  // [bytes] of whole lines
};

/// What a folder contains.
struct Results {
  std::map<std::int64_t, StoredRow> rows;  // by the number of the case
  std::int64_t num_files = 0;
  std::int64_t num_torn = 0;     // lines that a killed process left incomplete
  std::int64_t num_retried = 0;  // lost cases that ended in another process; that result counts
  std::string error;             // why the results cannot be used, or empty
};
/// Reads all files of a folder. A row that is_lost() gives way to another row of the same case. If two other
/// rows of one case differ, or a file has another stamp, that is an error.
/// \param shard  leaves out files that cannot have cases of this shard, so that many tasks do not read the
/// files of
///   each other
Results read_results(const std::string& folder, const std::string& stamp,
                     const std::optional<Shard>& shard = std::nullopt);

}  // namespace freeflex::campaign
