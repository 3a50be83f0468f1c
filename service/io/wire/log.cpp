#include "service/io/wire/log.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

namespace freeflex::io {
namespace {

// a record consists of sync word, event number, time stamp, channel length, data length, channel and data,
// with big-endian numbers
constexpr std::string_view kSync = "\xED\xA1\xDA\x01";
constexpr const char* kNoRecord = "no record starts here";
constexpr std::int64_t kMaxChannelBytes = 999;  // [bytes] liblcm refuses longer names

std::string error_text(int error_number) {
  return std::error_code(error_number, std::generic_category()).message();
}

/// Returns the size of the file behind a stream [bytes].
std::int64_t size_of(std::FILE* stream) {
  struct stat status {};
  return fstat(fileno(stream), &status) == 0 ? status.st_size : 0;
}

std::uint64_t big_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char byte : bytes) value = value << 8 | static_cast<unsigned char>(byte);
  return value;
}

}  // namespace

bool LogReader::Head::is_possible() const {
  return channel_bytes > 0 && channel_bytes <= kMaxChannelBytes && data_bytes >= 0;
}

/// Parses a header.  \pre there are kLogHeaderBytes bytes
LogReader::Head LogReader::parse_head(std::string_view bytes) {
  return {big_endian(bytes.substr(4, 8)), static_cast<std::int64_t>(big_endian(bytes.substr(12, 8))),
          static_cast<std::int32_t>(big_endian(bytes.substr(20, 4))),
          static_cast<std::int32_t>(big_endian(bytes.substr(24, 4)))};
}

/// Returns the offset at which the record with the number `number` + 1 begins inside the body of a record, or
/// nullopt. If this record is there, a length of the outer record is wrong. A message may also contain a
/// piece of another log, but records of that piece with this number are not expected.
std::optional<std::size_t> LogReader::find_next_record(std::string_view body, std::uint64_t number) {
  for (std::size_t at = body.find(kSync); at != body.npos; at = body.find(kSync, at + 1)) {
    const std::int64_t room = static_cast<std::int64_t>(body.size() - at) - kLogHeaderBytes;
    if (room < 0) break;
    const Head inner = parse_head(body.substr(at, kLogHeaderBytes));
    if (inner.is_possible() && inner.number == number + 1 && inner.body_bytes() <= room) return at;
  }
  return std::nullopt;
}

LogReader::LogReader(const std::string& path) : path_(path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) {
    error_ = path + ": " + error_text(errno);
    return;
  }
  if (!S_ISREG(status.st_mode)) {
    error_ = path + " is not a regular file";
    return;
  }
  size_ = status.st_size;
  errno = 0;
  file_.reset(std::fopen(path.c_str(), "rb"));
  if (!file_) error_ = path + ": " + error_text(errno);
}

bool LogReader::fail(std::int64_t at, const std::string& what) {
  flaw_.at = at;
  flaw_.what = what;
  return false;
}

bool LogReader::seek(std::int64_t offset) {
  return ftello(file_.get()) == offset || fseeko(file_.get(), offset, SEEK_SET) == 0;
}

bool LogReader::read_head(std::int64_t offset) {
  std::array<char, kLogHeaderBytes> bytes{};
  if (!seek(offset)) return fail(offset, "the file cannot be read there");
  const std::size_t found = std::fread(bytes.data(), 1, bytes.size(), file_.get());
  // a short file of another kind must not be reported as the damaged start of a log
  const std::string_view start(bytes.data(), std::min(found, kSync.size()));
  if (found == 0) return fail(offset, "the file cannot be read there");
  if (start != kSync.substr(0, start.size())) return fail(offset, kNoRecord);
  if (found != bytes.size())
    return fail(offset, "the file ends inside a record, after " + std::to_string(found) + " of " +
                            std::to_string(kLogHeaderBytes) + " bytes of its header");
  head_ = parse_head({bytes.data(), bytes.size()});
  return head_.is_possible() || fail(offset, "the record has impossible lengths");
}

/// Returns true if the file ends at `end`, where a record ends, or if another record, perhaps a cut one,
/// begins there.
bool LogReader::is_followed(std::int64_t end) {
  if (end == size_) return true;
  std::array<char, kSync.size()> bytes{};
  const auto wanted = index(std::min<std::int64_t>(kSync.size(), size_ - end));
  if (!seek(end) || std::fread(bytes.data(), 1, wanted, file_.get()) != wanted)
    return fail(end, "the file cannot be read there");
  return std::string_view(bytes.data(), wanted) == kSync.substr(0, wanted) || fail(end, kNoRecord);
}

/// Reads a record into head_ and body_. If the record is not complete, returns false and sets flaw_ to the
/// cause.
bool LogReader::read_record(std::int64_t offset) {
  if (!read_head(offset)) return false;
  const std::int64_t all = kLogHeaderBytes + head_.body_bytes(), there = size_ - offset;
  if (all > there)
    return fail(offset, "the file ends inside a record, after " + std::to_string(there) + " of " +
                            std::to_string(all) + " bytes");
  body_.resize(static_cast<std::size_t>(head_.body_bytes()));
  if (std::fread(body_.data(), 1, body_.size(), file_.get()) != body_.size())
    return fail(offset, "the record cannot be read");
  if (!is_followed(offset + all)) return false;
  if (const auto inner = find_next_record(body_, head_.number))
    return fail(
        offset,
        "a length in the header of this record is wrong, because the next record begins inside this one, "
        "at byte " +
            std::to_string(offset + kLogHeaderBytes + static_cast<std::int64_t>(*inner)));
  return true;
}

void LogReader::give(std::int64_t offset, LogEvent& event) const {
  const auto channel_bytes = static_cast<std::size_t>(head_.channel_bytes);
  event.offset = offset;
  event.utime = head_.utime;
  event.channel.assign(body_, 0, channel_bytes);
  const auto* data = reinterpret_cast<const std::byte*>(body_.data());
  event.bytes.assign(data + channel_bytes, data + body_.size());
}

/// Returns true if a complete record begins at the offset and can follow the last complete record. It can if
/// its number is larger than the number of that record, or 0 because a second log was appended. The rule
/// excludes records of a log inside a message if their numbers are not larger.
bool LogReader::is_continuation(std::int64_t offset) {
  if (!read_head(offset) || kLogHeaderBytes + head_.body_bytes() > size_ - offset) return false;
  if (number_ && head_.number != 0 && head_.number <= *number_) return false;
  return read_record(offset);
}

/// Returns the offset [bytes] of the first complete record that begins at or after `from` and can follow the
/// last complete record, or the end of the file if there is none.
std::int64_t LogReader::find_record(std::int64_t from) {
  constexpr std::int64_t kBlock = std::int64_t{1} << 16;
  constexpr auto kOverlap = static_cast<std::int64_t>(kSync.size()) - 1;
  std::string block;
  while (from + kLogHeaderBytes < size_) {
    block.resize(index(std::min(kBlock, size_ - from)));
    if (!seek(from) || std::fread(block.data(), 1, block.size(), file_.get()) != block.size()) return size_;
    for (std::size_t at = block.find(kSync); at != block.npos; at = block.find(kSync, at + 1)) {
      const std::int64_t offset = from + static_cast<std::int64_t>(at);
      if (is_continuation(offset)) return offset;
    }
    from += static_cast<std::int64_t>(block.size()) - kOverlap;
  }
  return size_;
}

bool LogReader::next(LogEvent& event) {
  while (error_.empty() && at_ < size_) {
    if (read_record(at_)) {
      give(at_, event);
      number_ = head_.number;
      at_ += kLogHeaderBytes + head_.body_bytes();
      return true;
    }
    if (at_ == 0 && flaw_.at == 0 && flaw_.what == kNoRecord) {
      error_ = path_ + " is not an LCM event log";
      return false;
    }
    LogDamage damage = flaw_;
    damage.begin = at_;
    damage.end = at_ = find_record(at_ + 1);
    lost_bytes_ += damage.end - damage.begin;
    if (num_damages_++ == 0) first_damage_ = std::move(damage);
  }
  return false;
}

std::string LogReader::damage() const {
  if (num_damages_ == 0) return {};
  const LogDamage& first = first_damage_;
  std::string text = path_ + " is damaged at byte " + std::to_string(first.at) + ": " + first.what;
  // if the only damage is a record cut at the end of the file, the message gives no range
  if (first.begin != first.at || first.end != size_)
    text += "; nothing is read from byte " + std::to_string(first.begin) +
            (first.end == size_ ? " on" : " to byte " + std::to_string(first.end));
  if (num_damages_ > 1)
    text += ", nor at " + std::to_string(num_damages_ - 1) + (num_damages_ == 2 ? " place" : " places") +
            " more, in all " + std::to_string(lost_bytes_) + " of " + std::to_string(size_) + " bytes";
  return text;
}

bool LogReader::read_at(std::int64_t offset, LogEvent& event) {
  if (!error_.empty() || !read_record(offset)) return false;
  give(offset, event);
  return true;
}

PartialFile::PartialFile(std::string path) : path_(std::move(path)), working_path_(path_) {
  struct stat status {};
  const bool is_special = stat(path_.c_str(), &status) == 0 && !S_ISREG(status.st_mode);
  if (!is_special) working_path_ += ".partial";
}

PartialFile::~PartialFile() {
  if (is_open_ && working_path_ != path_) {
    std::error_code ignored;
    std::filesystem::remove(working_path_, ignored);
  }
}

std::string PartialFile::commit() {
  if (working_path_ == path_) return {};
  std::error_code error;
  std::filesystem::rename(working_path_, path_, error);
  if (error) return working_path_ + " cannot be renamed to " + path_ + ": " + error.message();
  is_open_ = false;
  return {};
}

bool PartialFile::keep_first(std::int64_t size) {
  if (size <= 0 || working_path_ == path_) return false;
  std::error_code error;
  std::filesystem::resize_file(working_path_, static_cast<std::uintmax_t>(size), error);
  if (error) return false;
  keep();
  return true;
}

void RecordEnds::add(std::size_t size, std::int64_t mark) {
  const std::int64_t begin = latest_.empty() ? 0 : latest_.back().offset;
  latest_.push_back({begin + static_cast<std::int64_t>(size), mark});
  const std::int64_t written = latest_.back().offset - static_cast<std::int64_t>(kBufferBytes);
  while (latest_.size() > 1 && latest_[1].offset <= written) latest_.pop_front();
}

RecordEnds::End RecordEnds::last_within(std::int64_t file_size) const {
  End last;
  for (const End& end : latest_)
    if (end.offset <= file_size) last = end;
  return last;
}

LogWriter::LogWriter(const std::string& path) : file_(path), buffer_(RecordEnds::kBufferBytes) {
  errno = 0;
  log_.reset(lcm_eventlog_create(file_.working_path().c_str(), "w"));
  if (!log_) {
    error_ = path + ": " + error_text(errno);
    return;
  }
  std::setvbuf(log_->f, buffer_.data(), _IOFBF, buffer_.size());
}

/// Stores the error and the end of the last complete record. After an error nothing more is written, so the
/// file has no gap.
void LogWriter::fail() {
  error_ = file_.working_path() + ": " + error_text(errno);
  whole_ = ends_.last_within(size_of(log_->f));
}

void LogWriter::write(const std::string& channel, std::int64_t utime, std::span<const std::byte> bytes) {
  if (!error_.empty()) return;
  lcm_eventlog_event_t event{};
  event.timestamp = utime;
  event.channellen = static_cast<std::int32_t>(channel.size());
  event.datalen = static_cast<std::int32_t>(bytes.size());
  // liblcm requires pointers to non-const data but only reads through them
  event.channel = const_cast<char*>(channel.data());
  event.data = const_cast<std::byte*>(bytes.data());
  errno = 0;
  if (lcm_eventlog_write_event(log_.get(), &event) != 0) return fail();
  ends_.add(index(kLogHeaderBytes) + channel.size() + bytes.size(), utime);
}

void LogWriter::finish() {
  if (!log_) return;
  errno = 0;
  if (error_.empty() && std::fflush(log_->f) != 0) fail();
  log_.reset();
}

std::string LogWriter::close() {
  finish();
  if (error_.empty()) {
    error_ = file_.commit();
    if (!error_.empty()) whole_ = ends_.last();
  }
  if (file_.keep_first(whole_.offset)) kept_utime_ = whole_.mark;
  return error_;
}

std::string LogWriter::close_partial() {
  finish();
  if (error_.empty()) file_.keep();
  if (file_.keep_first(whole_.offset)) kept_utime_ = whole_.mark;
  return error_;
}

CsvWriter::CsvWriter(const std::string& path) : buffer_(RecordEnds::kBufferBytes) {
  file_.emplace(path);
  name_ = file_->working_path();
  errno = 0;
  own_stream_.reset(std::fopen(name_.c_str(), "w"));
  stream_ = own_stream_.get();
  if (stream_ == nullptr) {
    error_ = path + ": " + error_text(errno);
    return;
  }
  std::setvbuf(stream_, buffer_.data(), _IOFBF, buffer_.size());
}

CsvWriter::CsvWriter(std::FILE* stream, std::string name) : name_(std::move(name)), stream_(stream) {}

void CsvWriter::fail() {
  error_ = name_ + ": " + error_text(errno);
  whole_ = ends_.last_within(size_of(stream_));
}

void CsvWriter::put(const std::string& line, std::int64_t mark) {
  if (!error_.empty()) return;
  errno = 0;
  if (std::fwrite(line.data(), 1, line.size(), stream_) != line.size()) return fail();
  ends_.add(line.size(), mark);
}

void CsvWriter::header(const std::vector<std::string>& names) {
  std::string line;
  for (const std::string& name : names) line += (line.empty() ? "" : ",") + name;
  put(line + "\n", kHeaderMark);
}

void CsvWriter::row(std::int64_t tick, std::span<const double> values) {
  std::string line = std::to_string(tick);
  std::array<char, 32> text{};
  for (const double value : values) {
    // the shortest text from which the same double is read back
    const auto result = std::to_chars(text.data(), text.data() + text.size(), value);
    line += ',';
    line.append(text.data(), result.ptr);
  }
  put(line + "\n", tick);
}

void CsvWriter::finish() {
  if (stream_ == nullptr) return;
  errno = 0;
  if (error_.empty() && std::fflush(stream_) != 0) fail();
  stream_ = nullptr;
  own_stream_.reset();
}

void CsvWriter::keep_whole_rows() {
  if (whole_.mark != kHeaderMark && file_ && file_->keep_first(whole_.offset)) kept_tick_ = whole_.mark;
}

std::string CsvWriter::close() {
  finish();
  if (error_.empty() && file_) {
    error_ = file_->commit();
    if (!error_.empty()) whole_ = ends_.last();
  }
  keep_whole_rows();
  return error_;
}

std::string CsvWriter::close_partial() {
  finish();
  if (error_.empty() && file_) file_->keep();
  keep_whole_rows();
  return error_;
}

}  // namespace freeflex::io
