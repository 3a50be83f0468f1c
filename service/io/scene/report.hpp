// What the scene reader shares: limits, the list of faults, and the files it has read.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "core/limits.hpp"
#include "core/scene/scene.hpp"
#include "service/io/scene/input.hpp"

struct XXH3_state_s;

namespace freeflex::io::reader {

struct Node;

/// Sizes beyond which a scene is refused rather than read. Points and groups: the tables that commands index.
inline constexpr std::size_t kMaxFileBytes = std::size_t{256} << 20;
inline constexpr std::size_t kMaxFiles = 64;
inline constexpr std::size_t kMaxSettings = 10'000;
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

  /// An error at a place where an item before this one has one is left out: it is the same fault, reached by
  /// an alias or by a setting of several items. So is a message that stands at its place already.
  void error(Origin origin, std::string message);
  /// Says that a key is missing from a mapping, unless that was said of a mapping that it merges.
  void missing(const Node& mapping, std::string_view key, std::string message);
  void warning(Origin origin, std::string message);
  bool has_error() const { return has_error_; }
  /// Faults beyond kMaxFaults are counted as errors but not kept.
  bool is_full() const { return faults_.size() >= kMaxFaults; }

  /// Index of the source, its bytes in text(); nullopt after reporting at `asked` why it cannot be read.
  /// A file named twice is one source.
  std::optional<int> open(const std::string& path, Origin asked);
  /// Index of a source that is no file.
  int add_text(const std::string& name, std::string_view text);
  /// Index of a setting, whose text is its value. Places in it have no line.
  int add_setting(const Setting& setting);
  bool is_setting(int source) const { return settings_.contains(source); }
  /// Notes where in the scene a setting's value came to stand.
  void note_target(int setting, const Origin& place) { settings_[setting].push_back(place); }
  /// Where the values of the fault's setting stand in the scene; the fault's own place when it is of none.
  std::vector<Origin> targets(const Origin& fault) const;

  std::string_view text(int source) const { return *texts_[static_cast<std::size_t>(source)]; }
  const std::vector<std::string>& sources() const { return sources_; }
  std::uint64_t hash() const;

  /// Notes a name that is not known and not reported, because the names are not all known.
  void note_unresolved(const Origin& place) { unresolved_.push_back(place); }
  const std::vector<Origin>& unresolved() const { return unresolved_; }

  /// Counts names mentioned in lists; false, reported once, when there are more than kMaxMentions.
  bool count_mentions(std::size_t count, Origin origin);

  const Faults& faults() const { return faults_; }
  /// Faults in the order of the files, then of their lines.
  Faults take_faults();

 private:
  friend class ItemOfReport;
  using Place = std::tuple<int, int, int>;  // source, line, column
  struct First {
    int item;
    std::string message;
  };

  void add(Fault fault);

  Faults faults_;
  bool has_error_ = false;
  std::size_t mentions_ = 0;
  std::vector<std::string> sources_;
  std::vector<std::unique_ptr<std::string>> texts_;
  std::map<std::string, int> opened_;
  std::map<int, std::vector<Origin>> settings_;  // by source
  std::vector<Origin> unresolved_;
  int item_ = 0, num_items_ = 0;
  std::map<Place, First> first_errors_;
  std::set<std::pair<Place, std::string>> missing_;  // keys by the place of their mapping
  XXH3_state_s* hash_;
};

/// While it lives, errors are those of one more item of the scene.
class ItemOfReport {
 public:
  explicit ItemOfReport(Report& report)
      : report_(report), before_(std::exchange(report.item_, ++report.num_items_)) {}
  ~ItemOfReport() { report_.item_ = before_; }
  ItemOfReport(const ItemOfReport&) = delete;
  ItemOfReport& operator=(const ItemOfReport&) = delete;

 private:
  Report& report_;
  int before_;
};

/// "at boom.yaml:3:5", "on line 3" when it is in the file of `near`, or "by --set points.hub.name=tip".
std::string describe_place(const Report& report, const Origin& place, const Origin& near);

}  // namespace freeflex::io::reader
