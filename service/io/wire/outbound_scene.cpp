// Makes scene_t and shapes_t messages. These messages are sent rarely, so clarity matters more than speed.
#include <algorithm>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <set>

#include "core/limits.hpp"
#include "messages/channels.hpp"
#include "service/io/wire/outbound.hpp"

namespace freeflex::io {
namespace {

using Scene = freeflex_msgs::scene_t;
using Shapes = freeflex_msgs::shapes_t;

bool lists_part(const Plan& plan) { return plan.points.size() > std::size_t{kMostByDefault}; }

double frequency(const StepPlan& plan, int mode) {
  return plan.omega[index(mode)] / (2.0 * std::numbers::pi);
}

/// Indices of the items that are sent, ascending.
using Listed = std::vector<std::int32_t>;

Listed list_all(std::size_t count) {
  Listed all(count);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

/// Lists all points. If there are more than kMostByDefault points, lists only points with inertia or with
/// stored mode shapes, because only these points can be published, pushed or loaded.
Listed list_points(const Plan& plan) {
  Listed listed = list_all(plan.points.size());
  if (!lists_part(plan)) return listed;
  std::erase_if(listed, [&](std::int32_t i) {
    return plan.points[index(i)].row < 0 && attitude_index_of(plan, i) < 0;
  });
  return listed;
}

/// Lists all links. If there are more than kMostByDefault points, lists only the published links.
Listed list_links(const Plan& plan) {
  if (!lists_part(plan)) return list_all(plan.links.size());
  Listed listed;
  for (const PlanLinkOutput& output : plan.link_outputs) listed.push_back(output.link);
  std::sort(listed.begin(), listed.end());
  return listed;
}

/// Adds the indices in short gaps between listed indices. A gap begins a new page, which needs more space
/// than the items in a short gap.
void fill_gaps(Listed& listed) {
  constexpr std::int32_t kShort = 4;
  Listed filled;
  for (const std::int32_t i : listed) {
    if (!filled.empty() && i - filled.back() <= kShort + 1)
      while (filled.back() + 1 < i) filled.push_back(filled.back() + 1);
    filled.push_back(i);
  }
  listed = std::move(filled);
}

std::vector<freeflex_msgs::scene_point_t> make_points(const Plan& plan, const Listed& listed) {
  std::vector<freeflex_msgs::scene_point_t> points(listed.size());
  const std::set<std::int32_t> published(plan.published_points.begin(), plan.published_points.end());
  for (std::size_t k = 0; k < points.size(); ++k) {
    const PlanPoint& point = plan.points[index(listed[k])];
    points[k].name = point.name;
    points[k].mass = point.mass;
    std::copy_n(point.r.begin(), 3, points[k].rest);
    points[k].is_pushable = point.pushable ? 1 : 0;
    points[k].is_published = published.contains(listed[k]) ? 1 : 0;
  }
  return points;
}

std::vector<freeflex_msgs::scene_link_t> make_links(const Plan& plan, const Listed& listed) {
  std::vector<freeflex_msgs::scene_link_t> links(listed.size());
  std::set<std::int32_t> published;
  for (const PlanLinkOutput& output : plan.link_outputs) published.insert(output.link);
  for (std::size_t k = 0; k < links.size(); ++k) {
    const PlanLink& link = plan.links[index(listed[k])];
    links[k].name = link.name;
    links[k].kind = traits_of(link.type).name;
    links[k].num_points = static_cast<std::int32_t>(link.points.size());
    links[k].points = link.points;
    links[k].is_published = published.contains(listed[k]) ? 1 : 0;
  }
  return links;
}

std::vector<freeflex_msgs::scene_group_t> make_groups(const Plan& plan) {
  std::vector<freeflex_msgs::scene_group_t> groups(plan.groups.size());
  for (std::size_t i = 0; i < groups.size(); ++i) {
    groups[i].name = plan.groups[i].name;
    groups[i].num_points = static_cast<std::int32_t>(plan.groups[i].points.size());
    groups[i].points = plan.groups[i].points;
  }
  return groups;
}

Scene make_front(const Plan& plan, int num_elastic, const std::string& plan_file, const Stamp& stamp) {
  Scene front{};
  front.utime = stamp.utime;
  front.session = stamp.session;
  front.plan_fingerprint = static_cast<std::int64_t>(stamp.plan_fingerprint);
  front.scene_hash = static_cast<std::int64_t>(plan.scene_hash);
  front.name = plan.name;
  front.plan_file = plan_file;
  front.rate = 1.0 / plan.period;
  front.mass = plan.mass;
  std::copy_n(plan.inertia.begin(), 9, &front.inertia[0][0]);
  front.rigid_freedoms = plan.rigid_freedoms;
  front.total_points = static_cast<std::int32_t>(plan.points.size());
  front.total_links = static_cast<std::int32_t>(plan.links.size());
  front.total_groups = static_cast<std::int32_t>(plan.groups.size());
  front.total_elastic = num_elastic;
  for (const PlanWheel& wheel : plan.wheels) {
    freeflex_msgs::scene_wheel_t each{};
    each.name = wheel.name;
    each.point = plan.particles.attitude_points[index(wheel.attitude_index)];
    std::copy_n(wheel.axis.begin(), 3, each.axis);
    front.wheels.push_back(std::move(each));
  }
  front.num_wheels = static_cast<std::int32_t>(front.wheels.size());
  return front;
}

/// Pages of a scene, filled in order. Of each list, a page contains a range of items without gaps, and the
/// index of the first of them.
class ScenePages {
 public:
  explicit ScenePages(Scene front) : front_(std::move(front)) { open(); }

  template <class Item>
  void add(std::vector<Item> Scene::*items, std::int32_t Scene::*first, const Listed& listed,
           const std::vector<Item>& all) {
    for (std::size_t k = 0; k < all.size(); ++k) {
      if (k > 0 && listed[k] != listed[k - 1] + 1) open();
      take(size_of(all[k]));
      Scene& page = pages_.back();
      if ((page.*items).empty()) page.*first = listed[k];
      (page.*items).push_back(all[k]);
    }
  }

  std::vector<Scene> finish() {
    for (std::size_t i = 0; i < pages_.size(); ++i) {
      Scene& page = pages_[i];
      page.page = static_cast<std::int32_t>(i);
      page.num_pages = static_cast<std::int32_t>(pages_.size());
      page.num_points = static_cast<std::int32_t>(page.points.size());
      page.num_links = static_cast<std::int32_t>(page.links.size());
      page.num_groups = static_cast<std::int32_t>(page.groups.size());
      page.num_frequencies = static_cast<std::int32_t>(page.frequencies.size());
    }
    return std::move(pages_);
  }

 private:
  static int size_of(double) { return 8; }
  template <class Item>
  static int size_of(const Item& item) {
    return item.getEncodedSize() - 8;  // an item inside a message has no fingerprint
  }
  void open() {
    pages_.push_back(front_);
    room_ = channels::kMaxMessageBytes - front_.getEncodedSize();
  }
  void take(int size) {
    if (size > room_) open();
    room_ -= size;
  }

  Scene front_;
  std::vector<Scene> pages_;
  int room_ = 0;  // [B] free on the last page
};

}  // namespace

SceneListing scene_listing(const Plan& plan) {
  return {static_cast<std::int32_t>(list_points(plan).size()),
          static_cast<std::int32_t>(list_links(plan).size())};
}

std::vector<Scene> make_scene_messages(const Plan& plan, bool uses_fallback, const std::string& plan_file,
                                       const Stamp& stamp) {
  const StepPlan& active = uses_fallback ? plan.fallback.front() : plan;
  ScenePages pages(make_front(plan, active.num_elastic, plan_file, stamp));
  std::vector<double> frequencies(index(active.num_elastic));
  for (int l = 0; l < active.num_elastic; ++l) frequencies[index(l)] = frequency(active, l);
  Listed points = list_points(plan), links = list_links(plan);
  fill_gaps(points);
  fill_gaps(links);
  pages.add(&Scene::points, &Scene::first_point, points, make_points(plan, points));
  pages.add(&Scene::links, &Scene::first_link, links, make_links(plan, links));
  pages.add(&Scene::groups, &Scene::first_group, list_all(plan.groups.size()), make_groups(plan));
  pages.add(&Scene::frequencies, &Scene::first_elastic, list_all(frequencies.size()), frequencies);
  return pages.finish();
}

std::vector<Shapes> make_shapes_messages(const StepPlan& plan, int mode, const Stamp& stamp) {
  Shapes front{};
  front.utime = stamp.utime;
  front.session = stamp.session;
  front.plan_fingerprint = static_cast<std::int64_t>(stamp.plan_fingerprint);
  front.mode = mode;
  front.frequency = frequency(plan, mode - 1);
  constexpr int kItemSize = 4 + 3 * 8;  // [B] index of a point, and three numbers
  const auto capacity =
      static_cast<std::size_t>((channels::kMaxMessageBytes - front.getEncodedSize()) / kItemSize);
  const auto stride = index(plan.num_padded);
  std::vector<Shapes> pages{front};
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    if (plan.points[i].row < 0) continue;
    if (pages.back().point.size() == capacity) pages.push_back(front);
    const std::size_t row = 3 * index(plan.points[i].row);
    std::vector<double> b(3);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      b[axis] = plan.rows[(row + axis) * stride + index(mode - 1)];
    }
    pages.back().point.push_back(static_cast<std::int32_t>(i));
    pages.back().shape.push_back(std::move(b));
  }
  for (std::size_t i = 0; i < pages.size(); ++i) {
    pages[i].page = static_cast<std::int32_t>(i);
    pages[i].num_pages = static_cast<std::int32_t>(pages.size());
    pages[i].num_points = static_cast<std::int32_t>(pages[i].point.size());
  }
  return pages;
}

}  // namespace freeflex::io
