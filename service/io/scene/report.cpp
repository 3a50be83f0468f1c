#include "service/io/scene/report.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <tuple>

#include "service/io/scene/yaml.hpp"

namespace freeflex::io::reader {

std::string read_whole_file(const std::string& path, std::size_t max_bytes, std::string& text) {
  if (path.empty()) return "the file name is empty";
  if (path.find('\0') != std::string::npos) return "the file name contains a zero byte";
  // O_NONBLOCK is set because opening a named pipe must not wait for a writer
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return std::strerror(errno);
  struct Closer {
    int file;
    ~Closer() { ::close(file); }
  } closer{file};
  struct stat status {};
  if (::fstat(file, &status) != 0) return std::strerror(errno);
  if (S_ISDIR(status.st_mode)) return "it is a directory";
  if (!S_ISREG(status.st_mode)) return "it is not a regular file";
  const auto too_large = [&](std::size_t bytes) {
    return "it has " + std::to_string(bytes) + " bytes, but at most " + std::to_string(max_bytes) +
           " are read";
  };
  const auto size = index(status.st_size);
  if (size > max_bytes) return too_large(size);
  text.resize(size + 1);  // one more byte, to detect a file that grew
  std::size_t filled = 0;
  while (true) {
    if (filled == text.size()) text.resize(std::min(2 * text.size(), max_bytes + 1));
    const ssize_t got = ::read(file, text.data() + filled, text.size() - filled);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return std::strerror(errno);
    if (got == 0) break;
    filled += index(got);
    if (filled > max_bytes) return too_large(filled);
  }
  text.resize(filled);
  return {};
}

Report::Report() : hash_(XXH3_createState()) { XXH3_64bits_reset(hash_); }

Report::~Report() { XXH3_freeState(hash_); }

void Report::add(Fault fault) {
  if (faults_.size() < kMaxFaults) faults_.push_back(std::move(fault));
}

void Report::error(Origin origin, std::string message) {
  has_error_ = true;
  if (is_setting(origin.source)) origin.line = 0;
  if (!is_full() && (origin.line > 0 || is_setting(origin.source))) {
    const auto [first, is_first] =
        first_errors_.emplace(Place{origin.source, origin.line, origin.column}, First{item_, message});
    if (!is_first && (first->second.item != item_ || first->second.message == message)) return;
  }
  add({Fault::Severity::kError, origin, std::move(message)});
}

void Report::missing(const Node& mapping, std::string_view key, std::string message) {
  const auto at = [&](const Origin& origin) {
    return std::pair(Place{origin.source, origin.line, origin.column}, std::string(key));
  };
  const bool is_reported = std::any_of(mapping.merged.begin(), mapping.merged.end(), [&](const Node* merged) {
    return missing_.contains(at(merged->origin));
  });
  if (!is_full()) missing_.insert(at(mapping.origin));
  if (is_reported)
    has_error_ = true;
  else
    error(mapping.origin, std::move(message));
}

void Report::warning(Origin origin, std::string message) {
  if (is_setting(origin.source)) origin.line = 0;
  add({Fault::Severity::kWarning, origin, std::move(message)});
}

int Report::add_text(const std::string& name, std::string_view text) {
  XXH3_64bits_update(hash_, text.data(), text.size());
  sources_.push_back(name);
  texts_.push_back(std::make_unique<std::string>(text));
  return static_cast<int>(sources_.size()) - 1;
}

int Report::add_setting(const Setting& setting) {
  // the zero byte separates path and value in the hash
  XXH3_64bits_update(hash_, setting.path.c_str(), setting.path.size() + 1);
  const int source = add_text(setting.source, setting.value);
  settings_[source];
  return source;
}

std::vector<Origin> Report::targets(const Origin& fault) const {
  const auto setting = settings_.find(fault.source);
  return setting == settings_.end() ? std::vector<Origin>{fault} : setting->second;
}

std::optional<int> Report::open(const std::string& path, Origin asked) {
  if (const auto known = opened_.find(path); known != opened_.end()) {
    if (known->second >= 0) return known->second;
    return std::nullopt;  // the fault was reported where the file was first named
  }
  if (opened_.size() >= kMaxFiles) {
    error(asked, "the scene names more than " + std::to_string(kMaxFiles) + " files; merge some of them");
    return std::nullopt;
  }
  auto text = std::make_unique<std::string>();
  if (const std::string problem = read_whole_file(path, kMaxFileBytes, *text); !problem.empty()) {
    opened_[path] = -1;
    if (asked.source < 0) {  // the scene itself
      sources_.push_back(path);
      texts_.push_back(std::make_unique<std::string>());
      asked.source = 0;
    }
    error(asked, "cannot read '" + path + "': " + problem);
    return std::nullopt;
  }
  XXH3_64bits_update(hash_, text->data(), text->size());
  const int source = static_cast<int>(sources_.size());
  opened_[path] = source;
  sources_.push_back(path);
  texts_.push_back(std::move(text));
  return source;
}

std::uint64_t Report::hash() const { return XXH3_64bits_digest(hash_); }

bool Report::count_mentions(std::size_t count, Origin origin) {
  const bool was_within = mentions_ <= kMaxMentions;
  mentions_ = std::min(mentions_ + count, 2 * kMaxMentions);
  if (mentions_ <= kMaxMentions) return true;
  if (was_within)
    error(origin, "the scene's lists name more than " + std::to_string(kMaxMentions) +
                      " items, so it is not read further; shorten the lists");
  return false;
}

Faults Report::take_faults() {
  const bool is_full = faults_.size() >= kMaxFaults;
  const auto key = [](const Fault& fault) {
    return std::tuple(fault.origin.source, fault.origin.line, fault.origin.column);
  };
  std::stable_sort(faults_.begin(), faults_.end(),
                   [&](const Fault& a, const Fault& b) { return key(a) < key(b); });
  if (is_full)
    faults_.push_back(
        {Fault::Severity::kError,
         {0, 0, 0},
         "there are more than " + std::to_string(kMaxFaults) + " faults; the rest is not listed"});
  return std::move(faults_);
}

std::string describe_place(const Report& report, const Origin& place, const Origin& near) {
  if (report.is_setting(place.source)) return "by " + report.sources()[index(place.source)];
  if (place.source == near.source) return "on line " + std::to_string(place.line);
  return "at " + report.sources()[index(place.source)] + ":" + std::to_string(place.line) + ":" +
         std::to_string(place.column);
}

}  // namespace freeflex::io::reader
