// Tracks which pages of a set have arrived. A set is all pages of one tick of POINTS or LOADS, of the scene,
// or of a mode shape.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/index.hpp"

namespace freeflex::io {

/// Counts pages, and limits the memory of a program that collects them, because anybody on the bus may send a
/// page that claims to be one of two billion.
class PageSet {
 public:
  /// Identifies a set of pages, in POINTS and LOADS by session, epoch and tick.
  using Key = std::array<std::int64_t, 3>;
  /// [bytes] Largest size of one set of pages. For comparison: 200,000 points give 20 MB of POINTS at each
  /// tick.
  static constexpr std::size_t kMaxBytes = std::size_t{64} << 20;

  struct Taken {
    bool is_kept = false;   // true: the page belongs to the set and is new; false: ignore the page
    bool is_first = false;  // true: the page begins a new set; forget the earlier pages
    bool is_whole = false;  // true: the set is complete; the next page begins a new set
  };
  /// Adds a page. Refuses the page and changes nothing if num_pages is not 1 to max_pages, if the page number
  /// is not 0 to num_pages - 1, or if the set would exceed kMaxBytes.
  /// \param max_pages  number of items that the scene publishes, because each page has at least one item
  /// \param size  [bytes] of the page's message
  Taken take(const Key& key, std::int32_t page, std::int32_t num_pages, std::int64_t max_pages,
             std::size_t size) {
    if (num_pages < 1 || num_pages > max_pages || page < 0 || page >= num_pages) return {};
    Taken taken;
    const auto count = index(num_pages);
    taken.is_first = has_.size() != count || key != key_;
    if (taken.is_first) {
      key_ = key;
      has_.assign(count, false);
      num_missing_ = count;
      num_bytes_ = 0;
    }
    const auto at = index(page);
    if (has_[at] || num_bytes_ + size > kMaxBytes) return taken;
    taken.is_kept = has_[at] = true;
    num_bytes_ += size;
    taken.is_whole = --num_missing_ == 0;
    if (taken.is_whole) clear();
    return taken;
  }
  /// Forgets all pages.
  void clear() { has_.clear(); }

 private:
  Key key_{};
  std::vector<bool> has_;  // empty: no page has arrived
  std::size_t num_missing_ = 0;
  std::size_t num_bytes_ = 0;
};

}  // namespace freeflex::io
