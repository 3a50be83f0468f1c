#include "tools/bus/losses.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <tuple>

#include "tools/bus/recording.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

using freeflex_msgs::status_t;

// larger ticks are treated as this tick, because a damaged tick may be any number, and ticks are increased by
// 1
constexpr std::int64_t kLastTick = std::numeric_limits<std::int64_t>::max() - 1;

/// Returns the ticks of which all pages have arrived, ascending. A tick that occurs in two epochs is returned
/// if the pages of one of these epochs are complete.
std::vector<std::int64_t> whole_ticks(std::vector<PageRecord> pages) {
  const auto key = [](const PageRecord& page) { return std::tie(page.tick, page.epoch, page.page); };
  std::sort(pages.begin(), pages.end(),
            [&](const PageRecord& a, const PageRecord& b) { return key(a) < key(b); });
  const auto is_same = [&](const PageRecord& a, const PageRecord& b) { return key(a) == key(b); };
  pages.erase(std::unique(pages.begin(), pages.end(), is_same), pages.end());
  std::vector<std::int64_t> ticks;
  for (std::size_t i = 0, first = 0; i < pages.size(); ++i) {
    if (pages[i].tick != pages[first].tick || pages[i].epoch != pages[first].epoch) first = i;
    if (static_cast<std::int64_t>(i - first) + 1 == pages[i].num_pages) ticks.push_back(pages[i].tick);
  }
  return ticks;
}

/// Returns the number of multiples of `every` that are at least 0 and less than the tick.
std::int64_t multiples_below(std::int64_t tick, std::int64_t every) {
  return tick > 0 ? (tick - 1) / every + 1 : 0;
}

/// Returns which multiples of `every` are missing from a list of ticks, from 0 to end_tick or, if that is
/// later, to the last tick of the list.  \param ticks  ascending, not empty
Loss find_loss(const std::vector<std::int64_t>& ticks, std::int64_t every, std::int64_t end_tick) {
  Loss loss;
  std::int64_t next = 0;  // all ticks below this tick were examined
  const auto miss = [&](std::int64_t until) {
    const std::int64_t count = multiples_below(until, every) - multiples_below(next, every);
    if (count <= 0) return;
    if (loss.num_ticks == 0) loss.first_tick = multiples_below(next, every) * every;
    if (next == 0) loss.num_before = count;
    loss.num_ticks += count;
  };
  for (const std::int64_t tick : ticks) {
    miss(tick);
    next = std::max(next, std::min(tick, kLastTick) + 1);
  }
  miss(std::min(end_tick, kLastTick) + 1);
  return loss;
}

}  // namespace

void UnsentCounts::take(const status_t& status) {
  // counts never decrease, so the smallest count is the first and the largest is the last, whatever the order
  // of the messages in the log is
  const auto widen = [this](Range& range, std::int64_t published) {
    const std::int64_t count = std::max<std::int64_t>(published, 0);
    range.first = has_any ? std::min(range.first, count) : count;
    range.last = has_any ? std::max(range.last, count) : count;
  };
  for (std::size_t i = 0; i < kNumMotionChannels; ++i) widen(dropped[i], status.*io::kEncoders[i].dropped);
  widen(failed, status.sends_failed);
  if (status.mode == status_t::STOPPED) end_tick = std::max(end_tick, status.tick);
  has_any = true;
}

std::vector<Loss> find_losses(const RecordedSession& session, const Plan& plan) {
  std::vector<Loss> losses;
  for (std::size_t i = 0; i < kNumMotionChannels; ++i) {
    const std::int64_t every = io::ticks_between(plan.rates[i], plan.period);
    const std::vector<std::int64_t> ticks = whole_ticks(session.pages[i]);
    if (every == 0 || ticks.empty()) continue;
    Loss loss = find_loss(ticks, every, session.unsent.end_tick);
    loss.channel = io::kEncoders[i].suffix + 1;  // without the underscore
    loss.num_unsent = std::min(loss.num_ticks - loss.num_before, session.unsent.dropped[i].size());
    losses.push_back(loss);
  }
  return losses;
}

std::string describe(const Loss& loss, const UnsentCounts& counts) {
  if (loss.num_ticks == 0) return {};
  std::string text = loss.channel + " of " + counted(loss.num_ticks, "tick") +
                     " that the daemon publishes at the scene's rate is not in the log, first at tick " +
                     std::to_string(loss.first_tick) + ". Of these,";
  const auto some = [](std::int64_t count, const char* one, const char* more) {
    return " " + std::to_string(count) + (count == 1 ? one : more);
  };
  if (loss.num_before > 0) text += some(loss.num_before, " is", " are") + " from before the log begins;";
  if (loss.num_unsent > 0)
    text += some(loss.num_unsent, " was", " were") + " not sent, by the counts of the status;";
  if (loss.num_lost_in_transit() > 0)
    text += some(loss.num_lost_in_transit(), " was", " were") +
            (counts.has_any ? " lost in transit;" : " not sent or lost in transit (no status in the log);");
  text.pop_back();
  return text;
}

}  // namespace freeflex::tools
