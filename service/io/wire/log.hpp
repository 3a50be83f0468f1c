// Reads and writes LCM event logs, and writes CSV files. Readers report all damage. A written file is either
// complete or marked as partial.
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

// [bytes] Header of a record: sync word, event number, time stamp, channel length, data length.
inline constexpr std::int64_t kLogHeaderBytes = 28;

/// One recorded message.
struct LogEvent {
  std::int64_t offset = 0;  // [bytes] offset of the record in the file; the channel begins kLogHeaderBytes
                            // later
  std::int64_t utime = 0;   // [us] time of recording
  std::string channel;
  std::vector<std::byte> bytes;
};

/// A range of a log that cannot be read.
struct LogDamage {
  std::int64_t at = 0;              // [bytes] offset at which the damage was found
  std::string what;                 // description
  std::int64_t begin = 0, end = 0;  // [bytes] of the range
};

/// Reads an LCM event log record by record. liblcm's own reader skips bytes up to the next sync word without
/// a report, and returns the end of the file at a record that it cannot read. This reader requires that every
/// record begins where the previous record ends, that no record contains the next one, and that the file ends
/// where the last record ends. The reader skips ranges without a complete record, and damage() reports these
/// ranges.
class LogReader {
 public:
  /// Opens a log. If the file cannot be read, error() is not empty.
  explicit LogReader(const std::string& path);

  /// Reads the next complete record. Returns false at the end of the file, or if there is an error().
  bool next(LogEvent& event);
  /// Reads the record at an offset that an earlier next() gave. Returns false if the record is no longer
  /// there. Does not change which record next() reads.
  bool read_at(std::int64_t offset, LogEvent& event);

  /// Returns the reason why the file cannot be read, for example that it does not exist or does not begin
  /// like a log, or an empty text.
  const std::string& error() const { return error_; }
  /// Returns true if next() has skipped a damaged range.
  bool is_damaged() const { return num_damages_ > 0; }
  /// Returns a description of the first damage that next() has found, with the number of other damages and of
  /// skipped bytes, or an empty text if next() has found no damage.
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
  Head head_;                            // header of the record read last
  std::string body_;                     // channel, then data, of the record read last
  LogDamage flaw_;                       // reason why the record read last is not complete
  std::int64_t size_ = 0;                // [bytes]
  std::int64_t at_ = 0;                  // [bytes] where the next record begins
  std::optional<std::uint64_t> number_;  // number of the last complete record
  LogDamage first_damage_;
  std::int64_t num_damages_ = 0, lost_bytes_ = 0;
};

/// A file that gets its name only when it is complete. The file is written as NAME.partial, and commit()
/// renames it. Devices and pipes are written directly. The destructor removes a partial file that was neither
/// committed nor kept.
class PartialFile {
 public:
  explicit PartialFile(std::string path);
  ~PartialFile();
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;

  const std::string& working_path() const { return working_path_; }
  /// Gives the file its final name. Returns an empty string, or the error. After an error the file still has
  /// the name NAME.partial.
  std::string commit();
  /// Keeps the partial file.
  void keep() { is_open_ = false; }
  /// Cuts the partial file to its first `size` bytes and keeps it. Returns false if the size is 0, the file
  /// is a device or a pipe, or the file cannot be cut.
  bool keep_first(std::int64_t size);

 private:
  std::string path_;
  std::string working_path_;
  bool is_open_ = true;
};

/// Finds the last complete record of a file after a write failed. Because the stream buffers at most
/// kBufferBytes, all older records are in the file already, and only the ends of the latest records are
/// stored.
class RecordEnds {
 public:
  static constexpr std::size_t kBufferBytes = std::size_t{1} << 16;
  struct End {
    std::int64_t offset = 0;  // [bytes] where the record ends
    std::int64_t mark = 0;    // time stamp or tick that identifies the record for the writer
  };

  /// Adds a record of this size [bytes].  \pre the stream accepted the whole record
  void add(std::size_t size, std::int64_t mark);
  /// Returns the end of the last record that lies within the first file_size bytes. The offset is 0 if there
  /// is no such record.
  End last_within(std::int64_t file_size) const;
  /// Returns the end of the last record. The offset is 0 if there is no record.
  End last() const { return latest_.empty() ? End{} : latest_.back(); }

 private:
  std::deque<End> latest_;
};

/// Writes an LCM event log. close() returns the first error. If a write fails, NAME.partial keeps the
/// complete records (see kept_utime()).
class LogWriter {
 public:
  explicit LogWriter(const std::string& path);
  /// Writes a record. \param utime  [us] time stamp of the message
  void write(const std::string& channel, std::int64_t utime, std::span<const std::byte> bytes);
  /// Flushes the file and gives it its final name. Returns an empty string, or the first error.
  std::string close();
  /// Flushes the file and keeps it as NAME.partial, because the run was interrupted. Returns an empty string,
  /// or the first error.
  std::string close_partial();
  const std::string& working_path() const { return file_.working_path(); }
  bool has_error() const { return !error_.empty(); }
  /// Returns the time stamp [us] of the last record that NAME.partial keeps after a failed write, or nullopt
  /// if no write failed, nothing was kept, or the writer is not closed.
  std::optional<std::int64_t> kept_utime() const { return kept_utime_; }

 private:
  void fail();
  void finish();

  struct Close {
    void operator()(lcm_eventlog_t* log) const { lcm_eventlog_destroy(log); }
  };
  PartialFile file_;
  std::vector<char> buffer_;  // buffer of the stream; must outlive log_
  std::unique_ptr<lcm_eventlog_t, Close> log_;
  RecordEnds ends_;
  RecordEnds::End whole_;  // end of the last complete record in the file when a write failed
  std::optional<std::int64_t> kept_utime_;
  std::string error_;
};

/// Writes rows of numbers with a header line. Every double is printed so that the same bits are read back. If
/// a write fails, NAME.partial keeps the complete rows, as with LogWriter.
class CsvWriter {
 public:
  explicit CsvWriter(const std::string& path);
  /// Writes to an open stream, such as standard output, and leaves it open.
  CsvWriter(std::FILE* stream, std::string name);
  void header(const std::vector<std::string>& names);
  void row(std::int64_t tick, std::span<const double> values);
  std::string close();
  std::string close_partial();
  const std::string& working_path() const { return name_; }
  bool has_error() const { return !error_.empty(); }
  /// Returns the tick of the last row that NAME.partial keeps after a failed write, or nullopt in the cases
  /// of LogWriter::kept_utime.
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
  std::string name_;                 // name of the file while it is written, or of the stream
  std::optional<PartialFile> file_;  // empty: an external stream
  std::vector<char> buffer_;         // buffer of own_stream_; must outlive own_stream_
  std::unique_ptr<std::FILE, Close> own_stream_;
  std::FILE* stream_ = nullptr;
  RecordEnds ends_;
  RecordEnds::End whole_;  // end of the last complete record in the file when a write failed
  std::optional<std::int64_t> kept_tick_;
  std::string error_;
};

}  // namespace freeflex::io
