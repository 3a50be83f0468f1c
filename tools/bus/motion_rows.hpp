// Reads a motion tick by tick from a file, which is a recording or a table.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/bus/motion_columns.hpp"

namespace freeflex::tools {

struct MotionRow {
  std::int64_t tick = 0;
  std::vector<double> values;  // one for each column of the part
};

/// Reads the rows of one part, beginning with the first.
class RowReader {
 public:
  virtual ~RowReader() = default;
  /// Reads the next row. The ticks of the rows ascend. Returns false at the end of the part, or at damage,
  /// which ends the rows (see error()).
  virtual bool next(MotionRow& row) = 0;
  const std::string& error() const { return error_; }
  /// Returns the number of ticks that were skipped because they lack pages or have other columns than the
  /// part.
  std::int64_t num_odd() const { return num_odd_; }

 protected:
  std::string error_;
  std::int64_t num_odd_ = 0;
};

/// The parts of a file. A table is one part, but a recording has one part for each of STATE, POINTS and
/// LOADS.
class MotionFile {
 public:
  virtual ~MotionFile() = default;
  struct Part {
    std::string name;  // "STATE", or "the table"
    Columns columns;
  };
  const std::vector<Part>& parts() const { return parts_; }
  virtual std::unique_ptr<RowReader> open(std::size_t part) = 0;
  /// Returns texts about the contents that are not read.
  const std::vector<std::string>& ignored() const { return ignored_; }
  /// Returns the damage that prevents reading a part of the file, or an empty text if there is none.
  const std::string& damage() const { return damage_; }
  virtual bool is_recording() const = 0;

 protected:
  std::vector<Part> parts_;
  std::vector<std::string> ignored_;
  std::string damage_;
};

/// Opens a recording, or a table with the columns of `freeflex run`. Returns nullptr and sets `error` to the
/// reason if nothing of the file can be read, if its states contradict each other, or if it contains several
/// sessions and none is chosen. If a part of the file is damaged, opens the file (see damage()).
/// \param prefix  first part of the channel names in a recording
std::unique_ptr<MotionFile> open_motion(const std::string& path, const std::string& prefix,
                                        std::optional<std::int64_t> session, std::string& error);

}  // namespace freeflex::tools
