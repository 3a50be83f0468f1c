// What the indices of the messages mean, gathered from the pages of FREEFLEX_SCENE.
#pragma once

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

/// The scene of a daemon, as far as it lists it. Holds no more than the pages that came: at most 200,000
/// points and PageSet::kMaxBytes.
class SceneCatalogue {
 public:
  /// Takes a page of so many bytes. Pages of another session or plan start over. Refuses pages with counts
  /// that no daemon has.
  void take(const freeflex_msgs::scene_t& page, std::size_t size);
  bool is_complete() const { return is_complete_; }
  /// Points that no page lists: nobody reads, pushes or loads them. \pre is_complete()
  std::size_t num_unlisted() const { return points_.size() - num_listed_; }
  /// The last page: its front part is that of all. The lists in it are one page's.
  const freeflex_msgs::scene_t& head() const { return head_; }
  /// By index, without a name where they are not listed.
  const std::vector<freeflex_msgs::scene_point_t>& points() const { return points_; }
  /// Those listed, by index.
  const std::map<std::int32_t, freeflex_msgs::scene_link_t>& links() const { return links_; }
  const std::vector<freeflex_msgs::scene_group_t>& groups() const { return groups_; }
  const std::vector<double>& frequencies() const { return frequencies_; }  // [Hz]
  /// Pages that one tick of POINTS or LOADS has at most: one for each item that is published.
  std::int64_t max_point_pages() const { return max_point_pages_; }
  std::int64_t max_load_pages() const { return max_load_pages_; }

  /// Index by name; nullopt when there is none.
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
