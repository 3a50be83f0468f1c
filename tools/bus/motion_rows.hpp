// A motion in a file, tick by tick: a recording or a table.
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
  std::vector<double> values;  // of the part's columns
};

/// Reads the rows of one part from the first on.
class RowReader {
 public:
  virtual ~RowReader() = default;
  /// The next row, ticks ascending; false at the end, or at damage, which ends the rows (see error()).
  virtual bool next(MotionRow& row) = 0;
  const std::string& error() const { return error_; }
  /// Ticks that hold other columns than the part has: they are passed over.
  std::int64_t num_odd() const { return num_odd_; }

 protected:
  std::string error_;
  std::int64_t num_odd_ = 0;
};

/// What a file holds: a table is one part, a recording has one of each of STATE, POINTS and LOADS.
class MotionFile {
 public:
  virtual ~MotionFile() = default;
  struct Part {
    std::string name;  // "STATE", or "the table"
    Columns columns;
  };
  const std::vector<Part>& parts() const { return parts_; }
  virtual std::unique_ptr<RowReader> open(std::size_t part) = 0;
  /// What it holds beside that and nothing reads, in words.
  const std::vector<std::string>& ignored() const { return ignored_; }
  /// Empty, or what of it cannot be read though the rest can.
  const std::string& damage() const { return damage_; }
  virtual bool is_recording() const = 0;

 protected:
  std::vector<Part> parts_;
  std::vector<std::string> ignored_;
  std::string damage_;
};

/// A table that `freeflex run` wrote or that has its columns, or a recording. nullptr, with the reason: it
/// cannot be read, is damaged, or holds several sessions and none is chosen. \param prefix  of the channels
/// in a recording
std::unique_ptr<MotionFile> open_motion(const std::string& path, const std::string& prefix,
                                        std::optional<std::int64_t> session, std::string& error);

}  // namespace freeflex::tools
