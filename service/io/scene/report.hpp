// Limits of a scene, and the report of a reading: its faults, and the files that were read.
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

/// Largest sizes of a scene. core/limits.hpp has the limits on points and groups.
inline constexpr std::size_t kMaxFileBytes = std::size_t{256} << 20;
inline constexpr std::size_t kMaxFiles = 64;
inline constexpr std::size_t kMaxSettings = 10'000;
inline constexpr std::size_t kMaxYamlNodes = 1'000'000;
inline constexpr std::size_t kMaxYamlDepth = 32;
inline constexpr std::size_t kMaxLinks = 1'048'576;
inline constexpr std::size_t kMaxLoads = 256;
inline constexpr std::size_t kMaxFeedbacks = 256;
inline constexpr std::size_t kMaxMatrixEntries = std::size_t{16} << 20;  // before entries are mirrored
inline constexpr std::size_t kMaxMentions = std::size_t{8} << 20;        // largest total number of items in
                                                                         // the lists of a scene
inline constexpr std::size_t kMaxFaults = 1000;

/// Reads a regular file of at most max_bytes into `text`. Returns an empty string, or the reason why the file
/// cannot be read.
std::string read_whole_file(const std::string& path, std::size_t max_bytes, std::string& text);

/// Collects faults and keeps every file that was read. Hashes the files in the order in which they are first
/// named.
class Report {
 public:
  Report();
  ~Report();
  Report(const Report&) = delete;
  Report& operator=(const Report&) = delete;

  /// Adds an error. Ignores an error if another item has an error at the same position, because it is then
  /// the same fault, reached again through an alias or through a setting of several items. Also ignores a
  /// repetition of the first message at a position.
  void error(Origin origin, std::string message);
  /// Reports a missing key of a mapping, unless the key was reported as missing in a mapping that this
  /// mapping merges.
  void missing(const Node& mapping, std::string_view key, std::string message);
  void warning(Origin origin, std::string message);
  bool has_error() const { return has_error_; }
  /// Returns true if the report has kMaxFaults faults. Once it has, errors only set has_error().
  bool is_full() const { return faults_.size() >= kMaxFaults; }

  /// Reads a file as a source and returns the index of the source; text() then returns its bytes. If the file
  /// cannot be read, reports the reason at the position `asked` and returns nullopt. A file that is named
  /// twice is one source.
  std::optional<int> open(const std::string& path, Origin asked);
  /// Adds a text as a source and returns its index.
  int add_text(const std::string& name, std::string_view text);
  /// Adds a setting as a source, with its value as text, and returns its index. Positions in a setting have
  /// no line.
  int add_setting(const Setting& setting);
  bool is_setting(int source) const { return settings_.contains(source); }
  /// Records a position in the scene at which a setting put its value.
  void note_target(int setting, const Origin& place) { settings_[setting].push_back(place); }
  /// If the fault is in a setting, returns the positions in the scene at which that setting put its value;
  /// else returns the position of the fault.
  std::vector<Origin> targets(const Origin& fault) const;

  std::string_view text(int source) const { return *texts_[index(source)]; }
  const std::vector<std::string>& sources() const { return sources_; }
  std::uint64_t hash() const;

  /// Records an unknown name that is not reported because the list of names is incomplete.
  void note_unresolved(const Origin& place) { unresolved_.push_back(place); }
  const std::vector<Origin>& unresolved() const { return unresolved_; }

  /// Adds to the total number of items in lists. Returns false if the total exceeds kMaxMentions, and reports
  /// that only once.
  bool count_mentions(std::size_t count, Origin origin);

  const Faults& faults() const { return faults_; }
  /// Returns the faults in the order of file, line and column.
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
  std::map<int, std::vector<Origin>> settings_;  // positions, by source
  std::vector<Origin> unresolved_;
  int item_ = 0, num_items_ = 0;
  std::map<Place, First> first_errors_;
  std::set<std::pair<Place, std::string>>
      missing_;  // keys that were reported as missing, and the positions of their mappings
  XXH3_state_s* hash_;
};

/// Assigns the errors reported during its lifetime to a new item of the scene.
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

/// Returns "at boom.yaml:3:5", "on line 3" if the position is in the same file as `near`, or "by --set
/// points.hub.name=tip" if the position is in a setting.
std::string describe_place(const Report& report, const Origin& place, const Origin& near);

}  // namespace freeflex::io::reader
