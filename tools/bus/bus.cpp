#include "tools/bus/bus.hpp"

#include <CLI/App.hpp>
#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>

#include "service/io/wire/lcm_url.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

constexpr std::int32_t kMaxItems = 1'000'000;  // points, links, groups or modes that a catalogue takes

/// Puts a page's items in their place. False when they do not fit.
template <class Item>
bool place(std::vector<Item>& all, std::int32_t first, const std::vector<Item>& items) {
  if (first < 0 || static_cast<std::size_t>(first) + items.size() > all.size()) return false;
  std::copy(items.begin(), items.end(), all.begin() + first);
  return true;
}

template <class Item>
std::optional<std::int32_t> find_name(const std::vector<Item>& items, const std::string& name) {
  const auto found =
      std::find_if(items.begin(), items.end(), [&](const Item& item) { return item.name == name; });
  if (found == items.end() || name.empty()) return std::nullopt;
  return static_cast<std::int32_t>(found - items.begin());
}

}  // namespace

void add_bus_options(CLI::App& command, BusOptions& options) {
  command.add_option("--lcm-url", options.lcm_url, "LCM network, default LCM_DEFAULT_URL, else LCM's own")
      ->type_name("URL");
  command.add_option("--prefix", options.prefix, "first part of the channel names")
      ->check(channel_prefix())
      ->type_name("NAME")
      ->capture_default_str();
}

Bus::Bus(const BusOptions& options) : options_(options) {
  if (options_.lcm_url.empty()) {
    const char* from_environment = std::getenv("LCM_DEFAULT_URL");
    options_.lcm_url =
        from_environment != nullptr && *from_environment != '\0' ? from_environment : service::kDefaultUrl;
  }
  // liblcm would print its own text, or take what it cannot read for its default
  error_ = service::check_lcm_url(options_.lcm_url);
  is_usage_ = !error_.empty();
  if (error_.empty()) error_ = service::find_network_fault(options_.lcm_url);
  if (!error_.empty()) return;
  lcm_.reset(lcm_create(options_.lcm_url.c_str()));
  if (!lcm_) error_ = "no message bus at " + options_.lcm_url;
}

void Bus::receive(const lcm_recv_buf_t* buffer, const char* channel, void* handler) {
  const auto* bytes = static_cast<const std::byte*>(buffer->data);
  (*static_cast<Handler*>(handler))({channel, {bytes, buffer->data_size}, buffer->recv_utime});
}

void Bus::subscribe(const std::string& pattern, Handler handler) {
  handlers_.push_back(std::make_unique<Handler>(std::move(handler)));
  lcm_subscription_t* subscription =
      lcm_subscribe(lcm_.get(), pattern.c_str(), &Bus::receive, handlers_.back().get());
  if (subscription != nullptr) lcm_subscription_set_queue_capacity(subscription, 10'000);
}

bool Bus::publish(const std::string& channel, std::span<const std::byte> bytes) {
  return lcm_publish(lcm_.get(), channel.c_str(), bytes.data(), static_cast<unsigned>(bytes.size())) == 0;
}

bool Bus::wait(std::chrono::milliseconds time, const std::function<bool()>& done) {
  const auto end = std::chrono::steady_clock::now() + time;
  while (!done()) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    if (left.count() <= 0 || is_interrupted()) return false;
    // short sleeps, so that an interruption is noticed
    if (lcm_handle_timeout(lcm_.get(), static_cast<int>(std::min<std::int64_t>(left.count(), 100))) < 0)
      return false;
  }
  return true;
}

std::string Bus::describe() const { return options_.lcm_url + ", channels " + options_.prefix + "_*"; }

void SceneCatalogue::take(const freeflex_msgs::scene_t& page) {
  const bool is_new =
      page.session != head_.session || page.plan_fingerprint != head_.plan_fingerprint || has_page_.empty();
  const bool is_sane =
      page.num_pages >= 1 && page.num_pages <= kMaxItems && page.page >= 0 && page.page < page.num_pages &&
      std::max({page.total_points, page.total_links, page.total_groups, page.total_elastic}) <= kMaxItems &&
      std::min({page.total_points, page.total_links, page.total_groups, page.total_elastic}) >= 0;
  if (!is_sane) return;
  if (is_new || has_page_.size() != static_cast<std::size_t>(page.num_pages)) {
    has_page_.assign(static_cast<std::size_t>(page.num_pages), false);
    points_.assign(static_cast<std::size_t>(page.total_points), {});
    links_.assign(static_cast<std::size_t>(page.total_links), {});
    groups_.assign(static_cast<std::size_t>(page.total_groups), {});
    frequencies_.assign(static_cast<std::size_t>(page.total_elastic), 0.0);
    num_listed_ = 0;
  }
  head_ = page;
  const bool is_placed = place(points_, page.first_point, page.points) &&
                         place(links_, page.first_link, page.links) &&
                         place(groups_, page.first_group, page.groups) &&
                         place(frequencies_, page.first_elastic, page.frequencies);
  const auto at = static_cast<std::size_t>(page.page);
  if (is_placed && !has_page_[at]) num_listed_ = std::min(num_listed_ + page.points.size(), points_.size());
  has_page_[at] = is_placed;
}

bool SceneCatalogue::is_complete() const {
  return !has_page_.empty() && std::all_of(has_page_.begin(), has_page_.end(), [](bool has) { return has; });
}

std::optional<std::int32_t> SceneCatalogue::find_point(const std::string& name) const {
  return find_name(points_, name);
}
std::optional<std::int32_t> SceneCatalogue::find_group(const std::string& name) const {
  return find_name(groups_, name);
}

const char* validity_name(std::int32_t validity) {
  static constexpr std::array kNames{"good", "watch", "outside"};
  return validity >= 0 && validity < 3 ? kNames[static_cast<std::size_t>(validity)] : "?";
}

const char* mode_name(std::int32_t mode) {
  using freeflex_msgs::status_t;
  switch (mode) {
    case status_t::STARTING:
      return "starting";
    case status_t::RUNNING:
      return "running";
    case status_t::HOLDING:
      return "holding";
    case status_t::FAULT:
      return "fault";
    case status_t::STOPPED:
      return "stopped";
    default:
      return "unknown";
  }
}

std::int64_t wall_clock_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace freeflex::tools
