#include "service/io/wire/log.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

namespace freeflex::io {
namespace {

// record: sync word, event number, time stamp, channel length, data length, channel, data; big-endian
constexpr std::uint32_t kSyncWord = 0xEDA1DA01;
constexpr std::int64_t kHeaderBytes = 28;       // [bytes]
constexpr std::int64_t kMaxChannelBytes = 999;  // [bytes] liblcm refuses longer names

std::string error_text(int error_number) {
  return std::error_code(error_number, std::generic_category()).message();
}

std::uint32_t big_endian(const unsigned char* bytes) {
  return (std::uint32_t{bytes[0]} << 24) | (std::uint32_t{bytes[1]} << 16) | (std::uint32_t{bytes[2]} << 8) |
         std::uint32_t{bytes[3]};
}

}  // namespace

LogReader::LogReader(const std::string& path) : path_(path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) {
    error_ = path + ": " + error_text(errno);
    return;
  }
  if (!S_ISREG(status.st_mode)) {
    error_ = path + ": not a regular file";
    return;
  }
  size_ = status.st_size;
  errno = 0;
  log_.reset(lcm_eventlog_create(path.c_str(), "r"));
  if (!log_) error_ = path + ": " + error_text(errno);
}

bool LogReader::damage(std::int64_t offset, const std::string& what) {
  is_damaged_ = true;
  error_ = path_ + ": damaged at byte " + std::to_string(offset) + ": " + what;
  return false;
}

bool LogReader::next(LogEvent& event) {
  if (!error_.empty()) return false;
  std::FILE* file = log_->f;
  const std::int64_t offset = ftello(file);
  if (offset == size_) return false;

  // look at the header first: liblcm would search on, or allocate whatever the lengths say
  std::array<unsigned char, kHeaderBytes> header{};
  const std::size_t header_bytes = std::fread(header.data(), 1, header.size(), file);
  constexpr std::array<unsigned char, 4> kSync{kSyncWord >> 24, (kSyncWord >> 16) & 0xff,
                                               (kSyncWord >> 8) & 0xff, kSyncWord & 0xff};
  // a short file of something else is no log either, not the damaged start of one
  if (std::memcmp(header.data(), kSync.data(), std::min(header_bytes, kSync.size())) != 0) {
    if (offset > 0) return damage(offset, "no record starts here");
    error_ = path_ + ": not an LCM event log";
    return false;
  }
  if (header_bytes != header.size()) return damage(offset, "the file ends inside a record header");
  const auto channel_bytes = static_cast<std::int32_t>(big_endian(&header[20]));
  const auto data_bytes = static_cast<std::int32_t>(big_endian(&header[24]));
  if (channel_bytes <= 0 || channel_bytes > kMaxChannelBytes || data_bytes < 0) {
    return damage(offset, "record with impossible lengths");
  }
  const std::int64_t end = offset + kHeaderBytes + channel_bytes + data_bytes;
  if (end > size_) return damage(offset, "the file ends inside a record");

  // liblcm also reads ahead to the next sync word and complains on stderr: stop at the end of this record
  if (end < size_) {
    std::array<unsigned char, 4> following{};
    const std::size_t wanted = static_cast<std::size_t>(std::min<std::int64_t>(4, size_ - end));
    if (fseeko(file, end, SEEK_SET) != 0 || std::fread(following.data(), 1, wanted, file) != wanted) {
      return damage(end, "cannot be read");
    }
    if (wanted < 4) return damage(end, "the file ends inside a record header");
    if (big_endian(following.data()) != kSyncWord) return damage(end, "no record starts here");
  }

  if (fseeko(file, offset, SEEK_SET) != 0) return damage(offset, "cannot be read");
  lcm_eventlog_event_t* raw = lcm_eventlog_read_next_event(log_.get());
  if (raw == nullptr) return damage(offset, "record cannot be read");
  event.offset = offset;
  event.utime = raw->timestamp;
  event.channel.assign(raw->channel, static_cast<std::size_t>(raw->channellen));
  const auto* bytes = static_cast<const std::byte*>(raw->data);
  event.bytes.assign(bytes, bytes + raw->datalen);
  lcm_eventlog_free_event(raw);
  return true;
}

bool LogReader::read_at(std::int64_t offset, LogEvent& event) {
  if (!error_.empty()) return false;
  if (fseeko(log_->f, offset, SEEK_SET) != 0) return damage(offset, "cannot be read");
  return next(event);
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
  if (error) return path_ + ": " + error.message();
  is_open_ = false;
  return {};
}

LogWriter::LogWriter(const std::string& path) : file_(path) {
  errno = 0;
  log_.reset(lcm_eventlog_create(file_.working_path().c_str(), "w"));
  if (!log_) error_ = path + ": " + error_text(errno);
}

void LogWriter::write(const std::string& channel, std::int64_t utime, std::span<const std::byte> bytes) {
  if (!error_.empty()) return;
  lcm_eventlog_event_t event{};
  event.timestamp = utime;
  event.channellen = static_cast<std::int32_t>(channel.size());
  event.datalen = static_cast<std::int32_t>(bytes.size());
  // liblcm takes mutable pointers and only reads through them
  event.channel = const_cast<char*>(channel.data());
  event.data = const_cast<std::byte*>(bytes.data());
  errno = 0;
  if (lcm_eventlog_write_event(log_.get(), &event) != 0)
    error_ = file_.working_path() + ": " + error_text(errno);
}

void LogWriter::finish() {
  if (!log_) return;
  errno = 0;
  if (std::fflush(log_->f) != 0 && error_.empty()) error_ = file_.working_path() + ": " + error_text(errno);
  log_.reset();
}

std::string LogWriter::close() {
  finish();
  if (error_.empty()) error_ = file_.commit();
  return error_;
}

std::string LogWriter::close_partial() {
  finish();
  if (error_.empty()) file_.keep();
  return error_;
}

CsvWriter::CsvWriter(const std::string& path) {
  file_.emplace(path);
  name_ = file_->working_path();
  errno = 0;
  own_stream_.reset(std::fopen(name_.c_str(), "w"));
  stream_ = own_stream_.get();
  if (stream_ == nullptr) error_ = path + ": " + error_text(errno);
}

CsvWriter::CsvWriter(std::FILE* stream, std::string name) : name_(std::move(name)), stream_(stream) {}

void CsvWriter::put(const std::string& line) {
  if (!error_.empty()) return;
  errno = 0;
  if (std::fwrite(line.data(), 1, line.size(), stream_) != line.size()) {
    error_ = name_ + ": " + error_text(errno);
  }
}

void CsvWriter::header(const std::vector<std::string>& names) {
  std::string line;
  for (const std::string& name : names) line += (line.empty() ? "" : ",") + name;
  put(line + "\n");
}

void CsvWriter::row(std::int64_t tick, std::span<const double> values) {
  std::string line = std::to_string(tick);
  std::array<char, 32> text{};
  for (const double value : values) {
    // shortest text that reads back to the same double
    const auto result = std::to_chars(text.data(), text.data() + text.size(), value);
    line += ',';
    line.append(text.data(), result.ptr);
  }
  put(line + "\n");
}

void CsvWriter::finish() {
  if (stream_ == nullptr) return;
  errno = 0;
  if (std::fflush(stream_) != 0 && error_.empty()) error_ = name_ + ": " + error_text(errno);
  stream_ = nullptr;
  own_stream_.reset();
}

std::string CsvWriter::close() {
  finish();
  if (error_.empty() && file_) error_ = file_->commit();
  return error_;
}

std::string CsvWriter::close_partial() {
  finish();
  if (error_.empty() && file_) file_->keep();
  return error_;
}

}  // namespace freeflex::io
