// LCM event logs and CSV files: reading that passes over no damage in silence, writing that is complete, or
// marked as partial.
#pragma once

#include <lcm/eventlog.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace freeflex::io {

// [bytes] In front of a record: sync word, event number, time stamp, channel length, data length.
inline constexpr std::int64_t kLogHeaderBytes = 28;

/// One recorded message.
struct LogEvent {
  std::int64_t offset = 0;  // [bytes] of the record in the file; its channel stands kLogHeaderBytes behind
  std::int64_t utime = 0;   // [us] when it was recorded
  std::string channel;
  std::vector<std::byte> bytes;
};

/// A stretch of a log of which nothing is read.
struct LogDamage {
  std::int64_t at = 0;              // [bytes] where it shows
  std::string what;                 // in words
  std::int64_t begin = 0, end = 0;  // [bytes] of the stretch
};

/// Reads an LCM event log record by record. liblcm's own reader skips to the next thing that looks like a
/// record and takes damage for the end of the file; this one requires every record to follow the one before
/// it, none to hold the next one, and the file to end where the last record does. A stretch without a whole
/// record is passed over, and damage() tells it.
class LogReader {
 public:
  /// error() is not empty when the file cannot be read.
  explicit LogReader(const std::string& path);

  /// The next whole record; false at the end of the file, or when there is an error().
  bool next(LogEvent& event);
  /// The record at an offset that next() gave before; false when it is no longer there. next() goes on where
  /// it was.
  bool read_at(std::int64_t offset, LogEvent& event);

  /// Empty, or why nothing can be read: there is no such file, or it does not begin as a log does.
  const std::string& error() const { return error_; }
  /// True when next() passed over a stretch so far.
  bool is_damaged() const { return num_damages_ > 0; }
  /// Empty, or in words where the file is damaged and what is not read for that, as far as next() came.
  std::string damage() const;

 private:
  bool fail(std::int64_t at, const std::string& what);
  bool seek(std::int64_t offset);
  bool read_head(std::int64_t offset);
  bool read_record(std::int64_t offset);
  bool is_followed(std::int64_t end);
  bool is_continuation(std::int64_t offset);
  std::int64_t find_record(std::int64_t from);
  void give(std::int64_t offset, LogEvent& event) const;

  struct Head {
    std::uint64_t number = 0;
    std::int64_t utime = 0;          // [us]
    std::int32_t channel_bytes = 0;  // [bytes]
    std::int32_t data_bytes = 0;     // [bytes]

    bool is_possible() const;
    std::int64_t body_bytes() const { return std::int64_t{channel_bytes} + data_bytes; }
  };
  static Head parse_head(std::string_view bytes);
  static std::optional<std::size_t> find_next_record(std::string_view body, std::uint64_t number);

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file_;
  std::string path_;
  std::string error_;
  Head head_;                            // of the record at hand
  std::string body_;                     // its channel, then its data
  LogDamage flaw_;                       // why the record at hand is not whole
  std::int64_t size_ = 0;                // [bytes]
  std::int64_t at_ = 0;                  // [bytes] where the next record begins
  std::optional<std::uint64_t> number_;  // of the last whole record
  LogDamage first_damage_;
  std::int64_t num_damages_ = 0, lost_bytes_ = 0;
};

/// A file that stands under its name only when complete: written as NAME.partial, renamed by commit().
/// Devices and pipes are written directly. Not committed and not kept: the partial file is removed.
class PartialFile {
 public:
  explicit PartialFile(std::string path);
  ~PartialFile();
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;

  const std::string& working_path() const { return working_path_; }
  /// Renames to the final name. Empty, or what went wrong.
  std::string commit();
  /// Leaves the partial file where it is.
  void keep() { is_open_ = false; }
  /// Cuts the partial file to its first bytes and leaves it. False when there is none to leave, for no byte
  /// is asked for, the file is a device or a pipe, or it cannot be cut.
  bool keep_first(std::int64_t size);

 private:
  std::string path_;
  std::string working_path_;
  bool is_open_ = true;
};

/// Finds the last record that is whole in a file after a write to it failed. The stream holds back at most
/// kBufferBytes, so only the ends of the latest records are remembered.
class RecordEnds {
 public:
  static constexpr std::size_t kBufferBytes = std::size_t{1} << 16;
  struct End {
    std::int64_t offset = 0;  // [bytes] where the record ends
    std::int64_t mark = 0;    // what the writer knows the record by
  };

  /// Adds a record of so many bytes. \pre the stream took all of it
  void add(std::size_t size, std::int64_t mark);
  /// The last record within the first bytes of the file; offset 0: none.
  End last_within(std::int64_t file_size) const;

 private:
  std::deque<End> latest_;
};

/// Writes an LCM event log. Errors stick: the first one is what close() returns. After one the records that
/// are whole are left in NAME.partial, see kept_utime().
class LogWriter {
 public:
  explicit LogWriter(const std::string& path);
  /// \param utime  [us] time stamp of the record
  void write(const std::string& channel, std::int64_t utime, std::span<const std::byte> bytes);
  /// Flushes and gives the file its name. Empty, or what went wrong.
  std::string close();
  /// Flushes and leaves NAME.partial, for a run that was interrupted. Empty, or what went wrong.
  std::string close_partial();
  const std::string& working_path() const { return file_.working_path(); }
  bool has_error() const { return !error_.empty(); }
  /// [us] Time stamp of the last record in the file that is left after an error; nullopt: none is left, or
  /// there was no error, or the writer is not closed.
  std::optional<std::int64_t> kept_utime() const { return kept_utime_; }

 private:
  void fail();
  void finish();

  struct Close {
    void operator()(lcm_eventlog_t* log) const { lcm_eventlog_destroy(log); }
  };
  PartialFile file_;
  std::vector<char> buffer_;  // of the stream, which is closed first
  std::unique_ptr<lcm_eventlog_t, Close> log_;
  RecordEnds ends_;
  RecordEnds::End whole_;  // in the file when a write failed
  std::optional<std::int64_t> kept_utime_;
  std::string error_;
};

/// Writes rows of numbers with a header line. Every double is printed so that it reads back to the same bits.
/// Errors stick, as with a LogWriter, and the rows that are whole are left in NAME.partial.
class CsvWriter {
 public:
  explicit CsvWriter(const std::string& path);
  /// To a stream that is open and stays open, such as standard output: what was written stands.
  CsvWriter(std::FILE* stream, std::string name);
  void header(const std::vector<std::string>& names);
  void row(std::int64_t tick, std::span<const double> values);
  std::string close();
  std::string close_partial();
  const std::string& working_path() const { return name_; }
  bool has_error() const { return !error_.empty(); }
  /// Tick of the last row in the file that is left after an error; nullopt: see LogWriter::kept_utime.
  std::optional<std::int64_t> kept_tick() const { return kept_tick_; }

 private:
  static constexpr std::int64_t kHeaderMark = -1;
  void put(const std::string& line, std::int64_t mark);
  void fail();
  void finish();
  void keep_whole_rows();

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string name_;                 // of the file while it is written, or of the stream
  std::optional<PartialFile> file_;  // none: a stream of somebody else's
  std::vector<char> buffer_;         // of the own stream, which is closed first
  std::unique_ptr<std::FILE, Close> own_stream_;
  std::FILE* stream_ = nullptr;
  RecordEnds ends_;
  RecordEnds::End whole_;  // in the file when a write failed
  std::optional<std::int64_t> kept_tick_;
  std::string error_;
};

}  // namespace freeflex::io
