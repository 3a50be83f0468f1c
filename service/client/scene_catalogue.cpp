#include "service/client/scene_catalogue.hpp"

#include <algorithm>

#include "core/limits.hpp"

namespace freeflex::client {
namespace {

constexpr std::int32_t kMaxLinks = 1'048'576;  // largest number of links in a scene file

bool is_between(std::int32_t value, std::int32_t least, std::int32_t most) {
  return value >= least && value <= most;
}

/// Returns true if a daemon's scene can have the counts of this page.
bool is_sane(const freeflex_msgs::scene_t& page) {
  return is_between(page.total_points, 0, kMaxPoints) && is_between(page.total_links, 0, kMaxLinks) &&
         is_between(page.total_groups, 0, kMaxGroups) && is_between(page.total_elastic, 0, kMaxPlanElastic) &&
         is_between(page.num_wheels, 0, kMaxWheels);
}

/// Returns true if the indices of the items, which start at `first`, are below the total.
template <class Item>
bool fits(std::int32_t first, const std::vector<Item>& items, std::int32_t total) {
  return first >= 0 && index(first) + items.size() <= index(total);
}

template <class Item>
void place(std::vector<Item>& all, std::int32_t first, const std::vector<Item>& items) {
  std::copy(items.begin(), items.end(), all.begin() + first);
}

template <class Items>
std::optional<std::int32_t> find_name(const Items& items, std::string_view name) {
  const auto found =
      std::find_if(items.begin(), items.end(), [&](const auto& item) { return item.name == name; });
  if (found == items.end() || name.empty()) return std::nullopt;
  return static_cast<std::int32_t>(found - items.begin());
}

}  // namespace

void SceneCatalogue::take(const freeflex_msgs::scene_t& page, std::size_t size) {
  if (!is_sane(page) || !fits(page.first_point, page.points, page.total_points) ||
      !fits(page.first_link, page.links, page.total_links) ||
      !fits(page.first_group, page.groups, page.total_groups) ||
      !fits(page.first_elastic, page.frequencies, page.total_elastic))
    return;
  // each page lists at least one item, except the single page of an empty scene
  const std::int64_t max_pages =
      std::int64_t{1} + page.total_points + page.total_links + page.total_groups + page.total_elastic;
  const bool is_other = page.session != head_.session || page.plan_fingerprint != head_.plan_fingerprint ||
                        page.total_elastic != head_.total_elastic;
  // the daemon repeats the pages once a second, but a complete catalogue learns nothing new from them
  if (is_complete_ && !is_other) return;
  const io::PageSet::Taken taken = pages_.take({page.session, page.plan_fingerprint, page.total_elastic},
                                               page.page, page.num_pages, max_pages, size);
  if (taken.is_first) {
    is_complete_ = false;
    points_.assign(index(page.total_points), {});
    links_.clear();
    groups_.assign(index(page.total_groups), {});
    frequencies_.assign(index(page.total_elastic), 0.0);
    point_index_.clear();
    num_listed_ = 0;
  }
  if (!taken.is_kept || points_.size() != index(page.total_points) ||
      groups_.size() != index(page.total_groups))
    return;
  head_ = page;
  place(points_, page.first_point, page.points);
  place(groups_, page.first_group, page.groups);
  place(frequencies_, page.first_elastic, page.frequencies);
  for (std::size_t k = 0; k < page.links.size(); ++k)
    links_[page.first_link + static_cast<std::int32_t>(k)] = page.links[k];
  num_listed_ = std::min(num_listed_ + page.points.size(), points_.size());
  if (taken.is_whole) finish();
}

void SceneCatalogue::finish() {
  is_complete_ = true;
  point_index_.clear();
  for (std::size_t i = 0; i < points_.size(); ++i)
    point_index_.emplace(points_[i].name, static_cast<std::int32_t>(i));
  const auto is_published = [](const auto& item) { return item.is_published != 0; };
  // a published point counts twice, because a point with inertia also has a body state
  max_point_pages_ = 2 * std::count_if(points_.begin(), points_.end(), is_published) + std::ssize(groups_);
  max_load_pages_ = std::count_if(links_.begin(), links_.end(),
                                  [&](const auto& link) { return is_published(link.second); });
}

std::optional<std::int32_t> SceneCatalogue::find_point(std::string_view name) const {
  const auto found = point_index_.find(name);
  if (found == point_index_.end() || name.empty()) return std::nullopt;
  return found->second;
}
std::optional<std::int32_t> SceneCatalogue::find_group(std::string_view name) const {
  return find_name(groups_, name);
}
std::optional<std::int32_t> SceneCatalogue::find_wheel(std::string_view name) const {
  return find_name(head_.wheels, name);
}
std::optional<std::int32_t> SceneCatalogue::find_link(std::string_view name) const {
  const auto found =
      std::find_if(links_.begin(), links_.end(), [&](const auto& link) { return link.second.name == name; });
  if (found == links_.end() || name.empty()) return std::nullopt;
  return found->first;
}

}  // namespace freeflex::client
