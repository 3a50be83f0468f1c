// These tests check log files. Records are read back as written, and damage is never taken for the end of the
// file.
#include "service/io/wire/log.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <csignal>
#include <limits>
#include <optional>
#include <random>
#include <sstream>

#include "tests/tools/shell.hpp"

namespace freeflex::io {
namespace {

using testing::contains;
using testing::read_text;
using testing::TemporaryFolder;
using testing::write_text;

constexpr std::size_t kHeader = 28;  // [bytes] header of a record, before channel and data

std::vector<std::byte> bytes_of(std::string_view text) {
  const auto* first = reinterpret_cast<const std::byte*>(text.data());
  return {first, first + text.size()};
}

/// Writes three records of 28 + 3 + 5, 28 + 4 + 0 and 28 + 3 + 2 bytes and returns the file's bytes.
std::string three_records(const TemporaryFolder& folder) {
  LogWriter writer(folder / "three.log");
  writer.write("ONE", 11, bytes_of("abcde"));
  writer.write("NULL", 12, {});
  writer.write("TWO", 13, bytes_of("xy"));
  EXPECT_EQ(writer.close(), "");
  return read_text(folder / "three.log");
}

/// Returns the number of records in a file. Sets `error` to the reader's report on the rest of the file.
int count_records(const std::string& path, std::string& error, bool& is_damaged) {
  LogReader reader(path);
  LogEvent event;
  int count = 0;
  while (reader.next(event)) ++count;
  error = reader.error() + reader.damage();
  is_damaged = reader.is_damaged();
  return count;
}

TEST(LogFile, RecordsAreReadBackAsWritten) {
  const TemporaryFolder folder;
  three_records(folder);
  LogReader reader(folder / "three.log");
  LogEvent first;
  LogEvent second;
  LogEvent third;
  ASSERT_TRUE(reader.next(first) && reader.next(second) && reader.next(third)) << reader.error();
  EXPECT_EQ(first.channel, "ONE");
  EXPECT_EQ(first.utime, 11);
  EXPECT_EQ(first.bytes, bytes_of("abcde"));
  EXPECT_EQ(second.channel, "NULL");
  EXPECT_TRUE(second.bytes.empty());
  EXPECT_EQ(third.bytes, bytes_of("xy"));
  LogEvent none;
  EXPECT_FALSE(reader.next(none));
  EXPECT_EQ(reader.error(), "");
  ASSERT_TRUE(reader.read_at(first.offset, none));
  EXPECT_EQ(none.channel, "ONE");
}

TEST(LogFile, AFileCutAnywhereGivesItsCompleteRecordsAndTheCutPosition) {
  const TemporaryFolder folder;
  const std::string whole = three_records(folder);
  const std::size_t first_end = kHeader + 3 + 5;
  const std::size_t second_end = first_end + kHeader + 4;
  for (std::size_t length = 0; length <= whole.size(); ++length) {
    write_text(folder / "cut.log", std::string_view(whole).substr(0, length));
    std::string error;
    bool is_damaged = false;
    const int count = count_records(folder / "cut.log", error, is_damaged);
    const bool is_boundary =
        length == 0 || length == first_end || length == second_end || length == whole.size();
    EXPECT_EQ(is_damaged, !is_boundary) << length << ": " << error;
    EXPECT_EQ(error.empty(), is_boundary) << length;
    const int complete = (length >= first_end) + (length >= second_end) + (length >= whole.size());
    EXPECT_EQ(count, complete) << length;
    if (is_boundary) continue;
    const std::size_t begin = length < first_end ? 0 : length < second_end ? first_end : second_end;
    const std::size_t all = begin == 0           ? first_end
                            : begin == first_end ? second_end - begin
                                                 : whole.size() - begin;
    const bool is_in_header = length - begin < kHeader;
    const std::string there = std::to_string(length - begin) + " of " +
                              std::to_string(is_in_header ? kHeader : all) + " bytes" +
                              (is_in_header ? " of its header" : "");
    EXPECT_TRUE(error.ends_with(there)) << length << ": " << error;
    EXPECT_TRUE(contains(error, "damaged at byte " + std::to_string(begin) + ": ")) << error;
  }
}

TEST(LogFile, BytesBetweenRecordsAreReportedAsDamageAtTheirOffset) {
  const TemporaryFolder folder;
  std::string text = three_records(folder);
  const std::size_t first_end = kHeader + 3 + 5;
  text.insert(first_end, "?");
  write_text(folder / "bad.log", text);
  std::string error;
  bool is_damaged = false;
  // the record before these bytes is lost too, because its lengths may be damaged
  EXPECT_EQ(count_records(folder / "bad.log", error, is_damaged), 2);
  EXPECT_TRUE(is_damaged);
  EXPECT_TRUE(
      contains(error, "damaged at byte 36: no record starts here; nothing is read from byte 0 to byte 37"))
      << error;
}

TEST(LogFile, BytesAfterTheLastRecordAreReportedAsDamage) {
  const TemporaryFolder folder;
  write_text(folder / "tail.log", three_records(folder) + "garbage");
  std::string error;
  bool is_damaged = false;
  EXPECT_EQ(count_records(folder / "tail.log", error, is_damaged), 2);
  EXPECT_TRUE(is_damaged);
}

TEST(LogFile, ImpossibleLengthsAreReportedAsDamageAndReserveNoMemory) {
  const TemporaryFolder folder;
  const std::string whole = three_records(folder);
  for (const std::size_t field : {std::size_t{20}, std::size_t{24}}) {
    for (const std::string_view length :
         {std::string_view("\xff\xff\xff\xff", 4), std::string_view("\x7f\xff\xff\xff", 4),
          std::string_view("\x00\x00\x04\x00", 4)}) {
      std::string text = whole;
      text.replace(field, 4, length);
      write_text(folder / "long.log", text);
      std::string error;
      bool is_damaged = false;
      EXPECT_EQ(count_records(folder / "long.log", error, is_damaged), 2);
      EXPECT_TRUE(is_damaged) << error;
      EXPECT_TRUE(error.ends_with("nothing is read from byte 0 to byte 36")) << error;
    }
  }
}

TEST(LogFile, ALengthThatCoversTheNextRecordIsReportedAsDamage) {
  const TemporaryFolder folder;
  const std::string whole = three_records(folder);
  const std::size_t second_size = kHeader + 4, third_size = kHeader + 3 + 2;
  for (const std::size_t extra : {second_size, second_size + third_size}) {
    for (const std::size_t field :
         {std::size_t{23}, std::size_t{27}}) {  // positions of the two lengths in the first record
      std::string text = whole;
      text[field] = static_cast<char>(text[field] + static_cast<char>(extra));
      write_text(folder / "long.log", text);
      std::string error;
      bool is_damaged = false;
      EXPECT_EQ(count_records(folder / "long.log", error, is_damaged), 2);
      EXPECT_TRUE(is_damaged);
      EXPECT_TRUE(contains(error, "damaged at byte 0: ")) << error;
      EXPECT_TRUE(contains(error, "at byte 36")) << error;
    }
  }
}

TEST(LogFile, APieceOfAnotherLogInAMessageIsNotReportedAsDamage) {
  const TemporaryFolder folder;
  const std::string piece = three_records(folder);
  {
    LogWriter writer(folder / "piece.log");
    for (int i = 0; i < 4; ++i) writer.write("FILE", i, bytes_of(i == 3 ? piece : "?"));
    EXPECT_EQ(writer.close(), "");
  }
  std::string error;
  bool is_damaged = false;
  EXPECT_EQ(count_records(folder / "piece.log", error, is_damaged), 4) << error;
}

/// Returns the channels in a file, with their time stamps.
std::string stamps(const std::string& path) {
  LogReader reader(path);
  LogEvent event;
  std::string found;
  while (reader.next(event)) found += event.channel + std::to_string(event.utime) + " ";
  return found;
}

// the search for the next record reads blocks of 65536 bytes
TEST(LogFile, TheNextRecordIsFoundAfterAnyNumberOfBytes) {
  const TemporaryFolder folder;
  const std::string whole = three_records(folder);
  std::mt19937_64 random(5);
  for (const std::size_t around : {0, 1 << 16, 1 << 17}) {
    for (std::size_t size = around < 40 ? 1 : around - 40; size < around + 8; ++size) {
      std::string garbage(size, '\0');
      for (char& c : garbage) c = static_cast<char>(random());
      write_text(folder / "a.log", whole.substr(0, 36) + garbage + whole.substr(36));
      ASSERT_EQ(stamps(folder / "a.log"), "NULL12 TWO13 ") << size;
    }
  }
}

TEST(LogFile, DamageAtTwoPlacesIsCountedWithItsBytes) {
  const TemporaryFolder folder;
  {
    LogWriter writer(folder / "a.log");
    for (int i = 0; i < 9; ++i) writer.write("A", i, {});
    EXPECT_EQ(writer.close(), "");
  }
  std::string text = read_text(folder / "a.log");  // records of 29 bytes
  text[2 * 29] = 'x';
  text[6 * 29 + 1] = 'x';
  write_text(folder / "a.log", text);
  EXPECT_EQ(stamps(folder / "a.log"), "A0 A3 A4 A7 A8 ");
  std::string error;
  bool is_damaged = false;
  count_records(folder / "a.log", error, is_damaged);
  EXPECT_TRUE(error.ends_with(
      "a.log is damaged at byte 58: no record starts here; nothing is read from byte 29 to byte "
      "87, nor at 1 place more, in all 116 of 261 bytes"))
      << error;
}

// lcm-logger numbers the records that it appends from 0 again
TEST(LogFile, ALogAppendedToACutLogIsRead) {
  const TemporaryFolder folder;
  const std::string whole = three_records(folder);
  write_text(folder / "a.log", whole.substr(0, whole.size() - 3) + whole);
  EXPECT_EQ(stamps(folder / "a.log"), "ONE11 NULL12 ONE11 NULL12 TWO13 ");
}

TEST(LogFile, RecordsInsideADamagedMessageAreNotRead) {
  const TemporaryFolder folder;
  const std::string inner = three_records(folder).substr(36);  // the records numbered 1 and 2, from 0
  {
    LogWriter writer(folder / "a.log");
    for (int i = 0; i < 8; ++i) writer.write("FILE", i, bytes_of(i < 3 ? "" : inner));
    EXPECT_EQ(writer.close(), "");
  }
  std::string text = read_text(folder / "a.log");
  text[3 * 32 + 2 * (32 + inner.size())] = 'x';
  write_text(folder / "a.log", text);
  EXPECT_EQ(stamps(folder / "a.log"), "FILE0 FILE1 FILE2 FILE3 FILE6 FILE7 ");
}

TEST(LogFile, ARecordNextToDamageCanBeReadAgain) {
  const TemporaryFolder folder;
  write_text(folder / "a.log", three_records(folder).substr(0, 80));
  LogReader reader(folder / "a.log");
  LogEvent event, again;
  while (reader.next(event)) {
  }
  EXPECT_TRUE(reader.is_damaged());
  ASSERT_TRUE(reader.read_at(36, again));
  EXPECT_EQ(again.channel, "NULL");
  EXPECT_FALSE(reader.read_at(68, again));
  EXPECT_FALSE(reader.next(again));
}

TEST(LogFile, AMissingFileIsAnErrorAndNotDamage) {
  const LogReader reader("/nonexistent/flight.log");
  EXPECT_FALSE(reader.is_damaged());
  EXPECT_TRUE(contains(reader.error(), "No such file")) << reader.error();
}

TEST(LogFile, AnUnfinishedFileIsRemoved) {
  const TemporaryFolder folder;
  {
    LogWriter writer(folder / "a.log");
    writer.write("ONE", 1, {});
    EXPECT_TRUE(std::filesystem::exists(folder / "a.log.partial"));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(LogFile, AFileThatCannotBeRenamedIsKeptAsPartial) {
  const TemporaryFolder folder;
  LogWriter log(folder / "a.log");
  log.write("ONE", 7, {});
  CsvWriter table(folder / "a.csv");
  table.header({"tick", "x"});
  table.row(3, std::array{1.0});
  // a folder that is not empty cannot be replaced by a file
  std::filesystem::create_directories(std::filesystem::path(folder / "a.log") / "full");
  std::filesystem::create_directories(std::filesystem::path(folder / "a.csv") / "full");
  EXPECT_TRUE(contains(log.close(), "a.log.partial cannot be renamed to "));
  EXPECT_TRUE(contains(table.close(), "a.csv.partial cannot be renamed to "));
  EXPECT_EQ(log.kept_utime(), 7);
  EXPECT_EQ(table.kept_tick(), 3);
  std::string error;
  bool is_damaged = false;
  EXPECT_EQ(count_records(folder / "a.log.partial", error, is_damaged), 1);
  EXPECT_EQ(read_text(folder / "a.csv.partial"), "tick,x\n3,1\n");
}

TEST(LogFile, AnInterruptedFileStaysMarkedAsPartial) {
  const TemporaryFolder folder;
  LogWriter writer(folder / "a.log");
  writer.write("ONE", 1, {});
  EXPECT_EQ(writer.close_partial(), "");
  EXPECT_FALSE(std::filesystem::exists(folder / "a.log"));
  std::string error;
  bool is_damaged = false;
  EXPECT_EQ(count_records(folder / "a.log.partial", error, is_damaged), 1);
  EXPECT_EQ(error, "");
}

/// Limits the size of files while the object exists. A write beyond the limit is an error.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

// some records are smaller than the buffer of the stream and some are larger, and the limits lie in every
// part of a record
TEST(LogFile, AtASizeLimitEveryRecordThatFitsIsKept) {
  const TemporaryFolder folder;
  std::mt19937_64 random(3);
  for (int k = 0; k < 60; ++k) {
    const std::size_t limit = 1 + random() % 400'000, largest = k % 2 == 0 ? 3'000 : 200'000;
    std::optional<LogWriter> writer(std::in_place, folder / "a.log");
    std::size_t size = 0, whole = 0;
    std::int64_t fits = 0, at = 0;
    {
      const FileSizeLimit limited(limit);
      for (; size <= 2 * limit + 2 * RecordEnds::kBufferBytes; ++at) {
        const std::vector<std::byte> bytes(random() % largest);
        writer->write("ONE", at, bytes);
        size += kHeader + 3 + bytes.size();
        if (size <= limit) fits = at + 1, whole = size;
      }
      EXPECT_TRUE(contains(writer->close(), "File too large"));
    }
    const std::optional<std::int64_t> kept = writer->kept_utime();
    writer.reset();
    EXPECT_EQ(kept.has_value(), fits > 0) << limit;
    if (fits == 0) {
      EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << limit;
      continue;
    }
    EXPECT_EQ(kept, fits - 1) << limit;
    EXPECT_EQ(std::filesystem::file_size(folder / "a.log.partial"), whole) << limit;
    std::string error;
    bool is_damaged = false;
    EXPECT_EQ(count_records(folder / "a.log.partial", error, is_damaged), fits) << limit;
    EXPECT_EQ(error, "") << limit;
    std::filesystem::remove(folder / "a.log.partial");
  }
}

TEST(CsvFile, AtASizeLimitEveryRowThatFitsIsKept) {
  const TemporaryFolder folder;
  for (const rlim_t limit : {3, 11, 12, 15, 16, 70'000}) {
    std::optional<CsvWriter> writer(std::in_place, folder / "t.csv");
    {
      const FileSizeLimit limited(limit);
      writer->header({"tick", "value"});
      for (int tick = 0; tick < 50'000; ++tick) writer->row(tick, std::array{0.5 * tick});
      EXPECT_TRUE(contains(writer->close(), "File too large"));
    }
    const std::optional<std::int64_t> kept = writer->kept_tick();
    writer.reset();
    // the column names have 11 bytes, and the row of tick 0 has 4
    EXPECT_EQ(kept.has_value(), limit >= 15) << limit;
    if (limit < 15) {
      EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << limit;
      continue;
    }
    const std::string text = read_text(folder / "t.csv.partial");
    EXPECT_TRUE(text.ends_with("\n")) << limit;
    EXPECT_GT(text.size() + 20, limit);
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), *kept + 2) << limit;
    std::filesystem::remove(folder / "t.csv.partial");
  }
}

TEST(LogFile, AFullDiskIsReported) {
  LogWriter writer("/dev/full");
  for (int i = 0; i < 1000; ++i) writer.write("ONE", i, bytes_of("0123456789"));
  EXPECT_TRUE(contains(writer.close(), "No space left"));
}

TEST(CsvFile, NumbersAreReadBackWithTheSameBits) {
  const TemporaryFolder folder;
  std::mt19937_64 random(7);
  std::vector<double> values{0.0, -0.0, 5e-324, std::numeric_limits<double>::max(), 0.1, 1.0 / 3.0};
  while (values.size() < 500) {
    const auto value = std::bit_cast<double>(random());
    if (value - value == 0.0) values.push_back(value);
  }
  CsvWriter writer(folder / "t.csv");
  writer.header({"tick", "value"});
  for (std::size_t i = 0; i < values.size(); ++i)
    writer.row(static_cast<std::int64_t>(i), std::span(&values[i], 1));
  ASSERT_EQ(writer.close(), "");
  std::istringstream lines(read_text(folder / "t.csv"));
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "tick,value");
  for (std::size_t i = 0; i < values.size(); ++i) {
    ASSERT_TRUE(std::getline(lines, line));
    const std::size_t comma = line.find(',');
    EXPECT_EQ(line.substr(0, comma), std::to_string(i));
    double value = 1.0;
    std::from_chars(line.data() + comma + 1, line.data() + line.size(), value);
    EXPECT_EQ(std::bit_cast<std::uint64_t>(value), std::bit_cast<std::uint64_t>(values[i])) << line;
  }
}

}  // namespace
}  // namespace freeflex::io
