// Collects from the pages of FREEFLEX_SCENE the points, links, groups and modes to which indices in messages
// refer.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "freeflex_msgs/scene_t.hpp"
#include "service/io/wire/page_set.hpp"

namespace freeflex::client {

/// The part of a daemon's scene that the daemon lists on the bus. Whatever pages arrive, the catalogue stores
/// at most 200,000 points and pages of at most PageSet::kMaxBytes in total.
class SceneCatalogue {
 public:
  /// Adds a page. A page of another session or plan starts a new catalogue. Ignores pages with impossible
  /// counts.
  /// \param size  [bytes] of the page's message
  void take(const freeflex_msgs::scene_t& page, std::size_t size);
  bool is_complete() const { return is_complete_; }
  /// Number of points that no page lists, because they are neither published, pushed nor loaded.
  /// \pre is_complete()
  std::size_t num_unlisted() const {
    assert(is_complete());
    return points_.size() - num_listed_;
  }
  /// Returns the latest page. All pages agree in the fields before the lists, but the lists contain only the
  /// items of one page.
  const freeflex_msgs::scene_t& head() const { return head_; }
  /// All points by index. A point that no page lists has an empty name.
  const std::vector<freeflex_msgs::scene_point_t>& points() const { return points_; }
  /// The listed links by index.
  const std::map<std::int32_t, freeflex_msgs::scene_link_t>& links() const { return links_; }
  const std::vector<freeflex_msgs::scene_group_t>& groups() const { return groups_; }
  const std::vector<double>& frequencies() const { return frequencies_; }  // [Hz]
  /// Largest number of pages of one tick of POINTS or LOADS: one page for each published item.
  std::int64_t max_point_pages() const { return max_point_pages_; }
  std::int64_t max_load_pages() const { return max_load_pages_; }

  /// Returns the index of the item with this name, or nullopt if there is none.
  std::optional<std::int32_t> find_point(std::string_view name) const;
  std::optional<std::int32_t> find_link(std::string_view name) const;
  std::optional<std::int32_t> find_group(std::string_view name) const;
  std::optional<std::int32_t> find_wheel(std::string_view name) const;

 private:
  void finish();

  freeflex_msgs::scene_t head_{};
  io::PageSet pages_;
  bool is_complete_ = false;
  std::size_t num_listed_ = 0;
  std::int64_t max_point_pages_ = 0, max_load_pages_ = 0;
  std::vector<freeflex_msgs::scene_point_t> points_;
  std::map<std::string, std::int32_t, std::less<>> point_index_;  // by name
  std::map<std::int32_t, freeflex_msgs::scene_link_t> links_;
  std::vector<freeflex_msgs::scene_group_t> groups_;
  std::vector<double> frequencies_;
};

}  // namespace freeflex::client
