// Which pages of one thing came: of a tick of POINTS or LOADS, of the scene, of a mode shape.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace freeflex::io {

/// Counts pages, and bounds what whoever gathers them holds: anybody on the bus may send a page that claims
/// two thousand million others.
class PageSet {
 public:
  /// What one thing is told from another by: session, epoch and tick, or the like.
  using Key = std::array<std::int64_t, 3>;
  /// [bytes] of pages that one thing may have: a tick of 200,000 points has 22 MB.
  static constexpr std::size_t kMaxBytes = std::size_t{64} << 20;

  struct Taken {
    bool is_kept = false;   // the page belongs to the thing and had not come; else leave it
    bool is_first = false;  // it begins another thing: forget the pages before
    bool is_whole = false;  // all pages are there now; the next page begins anew
  };
  /// Takes the page of a thing. Refuses it, and changes nothing, when num_pages is not 1 to max_pages or the
  /// page not 0 to num_pages - 1, and when the thing's pages have more than kMaxBytes.
  /// \param max_pages  as many as the scene publishes items, for each page has one at least
  /// \param size  [bytes] of the page's message
  Taken take(const Key& key, std::int32_t page, std::int32_t num_pages, std::int64_t max_pages,
             std::size_t size) {
    if (num_pages < 1 || num_pages > max_pages || page < 0 || page >= num_pages) return {};
    Taken taken;
    const auto count = static_cast<std::size_t>(num_pages);
    taken.is_first = has_.size() != count || key != key_;
    if (taken.is_first) {
      key_ = key;
      has_.assign(count, false);
      num_missing_ = count;
      num_bytes_ = 0;
    }
    const auto at = static_cast<std::size_t>(page);
    if (has_[at] || num_bytes_ + size > kMaxBytes) return taken;
    taken.is_kept = has_[at] = true;
    num_bytes_ += size;
    taken.is_whole = --num_missing_ == 0;
    if (taken.is_whole) clear();
    return taken;
  }
  /// Forgets the pages that came.
  void clear() { has_.clear(); }

 private:
  Key key_{};
  std::vector<bool> has_;  // empty: nothing came
  std::size_t num_missing_ = 0;
  std::size_t num_bytes_ = 0;
};

}  // namespace freeflex::io
