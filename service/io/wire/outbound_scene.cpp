// scene_t and shapes_t: what indices mean, and mode shapes. Rarely sent, so clarity before speed.
#include <algorithm>
#include <cstddef>
#include <numbers>

#include "messages/channels.hpp"
#include "service/io/wire/outbound.hpp"

namespace freeflex::io {
namespace {

using Scene = freeflex_msgs::scene_t;
using Shapes = freeflex_msgs::shapes_t;

double frequency(const Plan& plan, int mode) {
  return plan.omega[static_cast<std::size_t>(mode)] / (2.0 * std::numbers::pi);
}

std::vector<freeflex_msgs::scene_point_t> make_points(const Plan& plan) {
  std::vector<freeflex_msgs::scene_point_t> points(plan.points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].name = plan.points[i].name;
    points[i].mass = plan.points[i].mass;
    std::copy_n(plan.points[i].r.begin(), 3, points[i].rest);
    points[i].is_pushable = plan.points[i].pushable ? 1 : 0;
    points[i].is_published = 0;
  }
  for (const std::int32_t point : plan.published_points)
    points[static_cast<std::size_t>(point)].is_published = 1;
  return points;
}

std::vector<freeflex_msgs::scene_link_t> make_links(const Plan& plan) {
  std::vector<freeflex_msgs::scene_link_t> links(plan.links.size());
  for (std::size_t i = 0; i < links.size(); ++i) {
    links[i].name = plan.links[i].name;
    links[i].kind = plan.links[i].kind;
    links[i].num_points = static_cast<std::int32_t>(plan.links[i].points.size());
    links[i].points = plan.links[i].points;
    links[i].is_published = 0;
  }
  for (const PlanLinkOutput& output : plan.link_outputs)
    links[static_cast<std::size_t>(output.link)].is_published = 1;
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

Scene make_front(const Plan& plan, const std::string& plan_file, const Stamp& stamp) {
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
  front.total_elastic = plan.num_elastic;
  for (const PlanWheel& wheel : plan.wheels.all) {
    freeflex_msgs::scene_wheel_t each{};
    each.name = wheel.name;
    each.point = plan.particles.turning[static_cast<std::size_t>(wheel.turning)];
    std::copy_n(wheel.axis.begin(), 3, each.axis);
    front.wheels.push_back(std::move(each));
  }
  front.num_wheels = static_cast<std::int32_t>(front.wheels.size());
  return front;
}

/// Pages of a scene, filled front to back; every page says where its part of each list begins.
class ScenePages {
 public:
  explicit ScenePages(Scene front) : front_(std::move(front)) { open(); }

  template <class Item>
  void add(std::vector<Item> Scene::*items, std::int32_t Scene::*first, const std::vector<Item>& all) {
    for (std::size_t i = 0; i < all.size(); ++i) {
      take(size_of(all[i]));
      Scene& page = pages_.back();
      if ((page.*items).empty()) page.*first = static_cast<std::int32_t>(i);
      (page.*items).push_back(all[i]);
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
  int room_ = 0;  // [B] left on the last page
};

}  // namespace

std::vector<Scene> make_scene_messages(const Plan& plan, const std::string& plan_file, const Stamp& stamp) {
  ScenePages pages(make_front(plan, plan_file, stamp));
  std::vector<double> frequencies(static_cast<std::size_t>(plan.num_elastic));
  for (int l = 0; l < plan.num_elastic; ++l) frequencies[static_cast<std::size_t>(l)] = frequency(plan, l);
  pages.add(&Scene::points, &Scene::first_point, make_points(plan));
  pages.add(&Scene::links, &Scene::first_link, make_links(plan));
  pages.add(&Scene::groups, &Scene::first_group, make_groups(plan));
  pages.add(&Scene::frequencies, &Scene::first_elastic, frequencies);
  return pages.finish();
}

std::vector<Shapes> make_shapes_messages(const Plan& plan, int mode, const Stamp& stamp) {
  Shapes front{};
  front.utime = stamp.utime;
  front.session = stamp.session;
  front.plan_fingerprint = static_cast<std::int64_t>(stamp.plan_fingerprint);
  front.mode = mode;
  front.frequency = frequency(plan, mode - 1);
  constexpr int kItemSize = 4 + 3 * 8;  // [B] point and its three numbers
  const auto capacity =
      static_cast<std::size_t>((channels::kMaxMessageBytes - front.getEncodedSize()) / kItemSize);
  const auto stride = static_cast<std::size_t>(plan.num_padded);
  std::vector<Shapes> pages{front};
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    if (plan.points[i].row < 0) continue;
    if (pages.back().point.size() == capacity) pages.push_back(front);
    const std::size_t row = 3 * static_cast<std::size_t>(plan.points[i].row);
    std::vector<double> b(3);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      b[axis] = plan.rows[(row + axis) * stride + static_cast<std::size_t>(mode - 1)];
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
