#include "tools/bus/wire_layout.hpp"

#include <array>
#include <cstdint>
#include <limits>

namespace freeflex::tools {
namespace {

constexpr std::size_t kFingerprintBytes = 8;  // [bytes]
constexpr int kMaxCounts = 8;                 // per scope

class Walker {
 public:
  explicit Walker(std::span<const std::byte> bytes) : bytes_(bytes) {}

  bool take(std::size_t size) {
    if (bytes_.size() < size) return false;
    bytes_ = bytes_.subspan(size);
    return true;
  }
  bool take_int32(std::int32_t& value) {
    if (bytes_.size() < 4) return false;
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < 4; ++i) bits = (bits << 8) | std::to_integer<std::uint32_t>(bytes_[i]);
    value = static_cast<std::int32_t>(bits);
    return take(4);
  }
  bool take_string() {
    std::int32_t length = 0;
    if (!take_int32(length) || length < 1) return false;
    const auto size = static_cast<std::size_t>(length);
    if (bytes_.size() < size || bytes_[size - 1] != std::byte{0}) return false;
    return take(size);
  }
  bool is_at_end() const { return bytes_.empty(); }

  /// Walks one scope of a layout.
  bool walk(std::string_view layout) {
    std::array<std::int32_t, kMaxCounts> counts{};
    std::size_t num_counts = 0;
    for (std::size_t i = 0; i < layout.size(); ++i) {
      const char item = layout[i];
      if (item == '8' || item == '4' || item == '1') {
        if (!take(static_cast<std::size_t>(item - '0'))) return false;
      } else if (item == 's') {
        if (!take_string()) return false;
      } else if (item == '#') {
        std::int32_t& count = counts.at(num_counts++);
        if (!take_int32(count) || count < 0) return false;
      } else if (item == '[') {
        const std::size_t close = matching(layout, i);
        const std::string_view body = layout.substr(i + 3, close - i - 3);
        const std::int32_t count = counts.at(static_cast<std::size_t>(layout[i + 1] - '0'));
        // ends early on a wrong count: every body takes at least one byte
        for (std::int32_t k = 0; k < count; ++k) {
          if (!walk(body)) return false;
        }
        i = close;
      }
    }
    return true;
  }

 private:
  static std::size_t matching(std::string_view layout, std::size_t open) {
    int depth = 0;
    for (std::size_t i = open; i < layout.size(); ++i) {
      if (layout[i] == '[') ++depth;
      if (layout[i] == ']' && --depth == 0) return i;
    }
    return layout.size();
  }

  std::span<const std::byte> bytes_;
};

}  // namespace

bool fits_layout(std::span<const std::byte> bytes, std::string_view layout) {
  if (bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) return false;
  Walker walker(bytes);
  return walker.take(kFingerprintBytes) && walker.walk(layout) && walker.is_at_end();
}

#define FREEFLEX_FORCE_LAYOUT "88s8 44 84 88 ## [0:4 888][1:4 888 888]"

std::string_view layout_of(const freeflex_msgs::ack_t&) { return "88s8 48s"; }
std::string_view layout_of(const freeflex_msgs::applied_t&) { return "8888 48" FREEFLEX_FORCE_LAYOUT; }
std::string_view layout_of(const freeflex_msgs::control_t&) { return "88s8 48"; }
std::string_view layout_of(const freeflex_msgs::force_t&) { return FREEFLEX_FORCE_LAYOUT; }
std::string_view layout_of(const freeflex_msgs::loads_t&) { return "8888 44# [0:4# [0:8]]"; }
std::string_view layout_of(const freeflex_msgs::points_t&) {
  return "8888 44## [0:4 888 888 888 888][1:4 888 8888 888 888]";
}
std::string_view layout_of(const freeflex_msgs::scene_t&) {
  return "8888 ss 88 888 888 888 444 4444 4# 4# 4# 4# [0:s8 888 11][1:ss# [0:4] 1][2:s# [0:4]][3:8]";
}
std::string_view layout_of(const freeflex_msgs::shapes_t&) { return "888 48 44# [0:4][0:888]"; }
std::string_view layout_of(const freeflex_msgs::state_t&) {
  return "8888 88 888 8888 888 888 888 # [0:8][0:8]";
}
std::string_view layout_of(const freeflex_msgs::status_t&) {
  return "8888 4ss8 8888 8 4 8888 8888 8888 88 #[0:48] 84 8s 888 888 888 88 8888 8888 8888 4s";
}

}  // namespace freeflex::tools
