#include "tools/campaign/results.hpp"

#include <fcntl.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "service/io/scene/text.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::campaign {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFront = "part-", kEnding = ".csv";
constexpr std::string_view kStampFront = "# ";

std::string checksum_of(std::string_view text) {
  return tools::fingerprint_text(XXH3_64bits(text.data(), text.size()));
}

/// Takes the text after the last tab off a line. Returns an empty text if there is no tab.
std::string_view take_last(std::string_view& line) {
  const std::size_t tab = line.rfind('\t');
  if (tab == std::string_view::npos) return {};
  const std::string_view last = line.substr(tab + 1);
  line = line.substr(0, tab);
  return last;
}

bool read_seconds(std::string_view text, double& seconds) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seconds);
  return error == std::errc() && end == text.data() + text.size();
}

/// Parses ROW, two times and the checksum, separated by tabs. Returns false if the line is torn.
bool parse_line(std::string_view line, StoredRow& stored) {
  const std::string_view checksum = take_last(line);
  if (checksum_of(line) != checksum) return false;
  const std::string_view run = take_last(line), setup = take_last(line);
  stored.row = line;
  return read_seconds(setup, stored.setup_seconds) && read_seconds(run, stored.run_seconds);
}

/// Adds a row. Returns an empty text, or the error if it differs from another row of the same case.
std::string add_row(StoredRow stored, Results& results) {
  const std::int64_t number = number_of(stored.row);
  const auto [known, is_new] = results.rows.try_emplace(number, stored);
  if (is_new || known->second.row == stored.row) return {};
  if (is_lost(stored.row) || is_lost(known->second.row)) {
    if (!is_lost(stored.row)) known->second = std::move(stored);
    ++results.num_retried;
    return {};
  }
  return "case " + std::to_string(number) + " has two results that differ: '" + known->second.row +
         "' and '" + stored.row +
         "'; either the controller does not give the same commands each time (does it read a clock, or draw "
         "random numbers of its own?), or the machines compute differently";
}

std::string read_part(const fs::path& path, const std::string& stamp, Results& results) {
  std::ifstream file(path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file) return "'" + path.string() + "' cannot be read: " + std::strerror(errno);
  ++results.num_files;
  std::string_view rest = text;
  for (bool is_first = true; !rest.empty(); is_first = false) {
    const std::size_t end = rest.find('\n');
    const std::string_view line = rest.substr(0, end);
    rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
    if (is_first) {
      if (line == stamp) continue;
      // a computer that lost its power may have left zero bytes
      if (end == std::string_view::npos || !line.starts_with(kStampFront))
        return ++results.num_torn, std::string();
      return "'" + path.string() + "' " + kOtherCampaign + " (it begins with '" +
             std::string(line.substr(0, 80)) + "', but must begin with '" + stamp +
             "'); choose another folder with --out, or remove this one";
    }
    StoredRow stored;
    if (end == std::string_view::npos || !parse_line(line, stored)) {
      ++results.num_torn;
      continue;
    }
    if (std::string error = add_row(std::move(stored), results); !error.empty()) return error;
  }
  return {};
}

/// Returns true if a file of this name may have cases of the shard.
bool may_have(const std::string& name, const std::optional<Shard>& shard) {
  if (!name.starts_with(kFront) || !name.ends_with(kEnding)) return false;
  if (!shard) return true;
  // part-K-of-N-...: other shards of the same number have other cases
  Shard of;
  const char* const end = name.data() + name.size();
  auto [at, error] = std::from_chars(name.data() + kFront.size(), end, of.index);
  constexpr std::string_view kOf = "-of-";
  if (error != std::errc() || !std::string_view(at, end).starts_with(kOf)) return true;
  std::from_chars(at + kOf.size(), end, of.count);
  return of.count != shard->count || of.index == shard->index;
}

}  // namespace

std::int64_t number_of(std::string_view row) {
  std::int64_t number = -1;
  std::from_chars(row.data(), row.data() + row.size(), number);
  return number;
}

std::string_view outcome_of(std::string_view row) {
  const std::size_t comma = row.find(',');
  if (comma == std::string_view::npos) return {};
  const std::string_view rest = row.substr(comma + 1);
  return rest.substr(0, rest.find(','));
}

bool is_lost(std::string_view row) {
  const std::string_view outcome = outcome_of(row);
  return outcome == "crashed" || outcome == "hung";
}

PartFile::~PartFile() {
  if (file_ >= 0) ::close(file_);
}

std::string PartFile::create(const std::string& folder, const std::string& stamp, const Shard& shard) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return "cannot create the folder '" + folder + "': " + error.message();
  std::array<char, 64> host{};
  ::gethostname(host.data(), host.size() - 1);
  const auto now = std::chrono::system_clock::now().time_since_epoch().count();
  const std::string name = std::string(kFront) + std::to_string(shard.index) + "-of-" +
                           std::to_string(shard.count) + "-" + std::to_string(now) + "-" + host.data() + "-" +
                           std::to_string(::getpid()) + std::string(kEnding);
  path_ = (fs::path(folder) / name).string();
  file_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0666);
  const std::string line = stamp + "\n";
  if (file_ < 0 || ::write(file_, line.data(), line.size()) != static_cast<ssize_t>(line.size()))
    return "cannot write '" + path_ + "': " + std::strerror(errno);
  size_ = static_cast<std::int64_t>(line.size());
  return {};
}

std::string PartFile::append(const StoredRow& row) {
  std::string line = row.row + "\t" + io::reader::format_number(row.setup_seconds) + "\t" +
                     io::reader::format_number(row.run_seconds);
  line += "\t" + checksum_of(line) + "\n";
  ssize_t written = 0;
  do written = ::write(file_, line.data(), line.size());
  while (written < 0 && errno == EINTR);
  if (written == static_cast<ssize_t>(line.size())) return size_ += written, std::string();
  const std::string reason = written < 0 ? std::strerror(errno) : "the disk is full, or a limit is reached";
  // readers would skip the torn line, but without it they need not report it
  if (::ftruncate(file_, size_) != 0)
    return "cannot write '" + path_ + "': " + reason + " (a torn line is left)";
  return "cannot write '" + path_ + "': " + reason;
}

Results read_results(const std::string& folder, const std::string& stamp, const std::optional<Shard>& shard) {
  Results results;
  std::error_code error;
  std::vector<fs::path> parts;
  const fs::directory_iterator entries(folder, error);
  if (error && error != std::errc::no_such_file_or_directory) {
    results.error = "the folder '" + folder + "' cannot be read: " + error.message();
    return results;
  }
  for (const auto& entry : entries)
    if (may_have(entry.path().filename().string(), shard)) parts.push_back(entry.path());
  std::sort(parts.begin(), parts.end());
  for (const fs::path& part : parts)
    if (results.error = read_part(part, stamp, results); !results.error.empty()) break;
  return results;
}

}  // namespace freeflex::campaign
