// What the scene reader shares: limits, the list of faults, and the files it has read.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/limits.hpp"
#include "core/scene/scene.hpp"

struct XXH3_state_s;

namespace freeflex::io::reader {

/// Sizes beyond which a scene is refused rather than read. Points and groups: the tables that commands index.
inline constexpr std::size_t kMaxFileBytes = std::size_t{256} << 20;
inline constexpr std::size_t kMaxFiles = 64;
inline constexpr std::size_t kMaxYamlNodes = 1'000'000;
inline constexpr std::size_t kMaxYamlDepth = 32;
inline constexpr std::size_t kMaxLinks = 1'048'576;
inline constexpr std::size_t kMaxLoads = 256;
inline constexpr std::size_t kMaxFeedbacks = 256;
inline constexpr std::size_t kMaxMatrixEntries = std::size_t{16} << 20;  // before mirroring
inline constexpr std::size_t kMaxMentions = std::size_t{8} << 20;  // points, links and groups named in lists
inline constexpr std::size_t kMaxFaults = 1000;

/// Why the file at path cannot be read, or its bytes in `text`. Regular files of at most max_bytes only.
std::string read_whole_file(const std::string& path, std::size_t max_bytes, std::string& text);

/// Collects faults and keeps every file that was read, hashed in order of first mention.
class Report {
 public:
  Report();
  ~Report();
  Report(const Report&) = delete;
  Report& operator=(const Report&) = delete;

  void error(Origin origin, std::string message);
  void warning(Origin origin, std::string message);
  bool has_error() const { return has_error_; }
  /// Faults beyond kMaxFaults are counted as errors but not kept.
  bool is_full() const { return faults_.size() >= kMaxFaults; }

  /// Index of the source, its bytes in text(); nullopt after reporting at `asked` why it cannot be read.
  /// A file named twice is one source.
  std::optional<int> open(const std::string& path, Origin asked);
  std::string_view text(int source) const { return *texts_[static_cast<std::size_t>(source)]; }
  const std::vector<std::string>& sources() const { return sources_; }
  std::uint64_t hash() const;

  /// Counts names mentioned in lists; false, reported once, when there are more than kMaxMentions.
  bool count_mentions(std::size_t count, Origin origin);

  const Faults& faults() const { return faults_; }
  /// Faults in the order of the files, then of their lines.
  Faults take_faults();

 private:
  void add(Fault fault);

  Faults faults_;
  bool has_error_ = false;
  std::size_t mentions_ = 0;
  std::vector<std::string> sources_;
  std::vector<std::unique_ptr<std::string>> texts_;
  std::map<std::string, int> opened_;
  XXH3_state_s* hash_;
};

/// "at boom.yaml:3:5", or "on line 3" when it is in the file of `near`.
std::string describe_place(const Report& report, const Origin& place, const Origin& near);

}  // namespace freeflex::io::reader
