#include "tools/bus/strays.hpp"

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <unordered_set>

#include "freeflex_msgs/applied_t.hpp"
#include "freeflex_msgs/scene_t.hpp"
#include "freeflex_msgs/state_t.hpp"
#include "freeflex_msgs/wire_layouts.hpp"
#include "messages/channels.hpp"
#include "tools/bus/recording.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

// messages on STATE, APPLIED and SCENE begin with fingerprint, utime and session, eight bytes each
constexpr std::int64_t kSessionAt = 16;  // [bytes]
constexpr bool has_session(const wire::Layout& layout) {
  return layout.fields[0].name == "utime" && layout.fields[1].name == "session";
}
static_assert(has_session(wire::layouts::state_t) && has_session(wire::layouts::applied_t) &&
              has_session(wire::layouts::scene_t));

std::int64_t read_integer(std::span<const std::byte> bytes, std::int64_t at) {
  std::uint64_t value = 0;
  for (const std::byte byte : bytes.subspan(index(at), sizeof value))
    value = value << 8 | static_cast<std::uint64_t>(byte);
  return static_cast<std::int64_t>(value);
}

/// Returns the suffix of the channel on which messages of this type are sent, or an empty text for types that
/// a replay does not use.
std::string_view suffix_of(std::span<const std::byte> bytes) {
  if (bytes.size() < index(kSessionAt) + sizeof(std::int64_t)) return {};
  const std::int64_t fingerprint = read_integer(bytes, 0);
  if (fingerprint == freeflex_msgs::state_t::getHash()) return channels::kState;
  if (fingerprint == freeflex_msgs::applied_t::getHash()) return channels::kApplied;
  if (fingerprint == freeflex_msgs::scene_t::getHash()) return channels::kScene;
  return {};
}

/// Returns the index of the only byte in which two names of one length differ. Otherwise returns nullopt.
std::optional<std::size_t> find_one_byte(std::string_view a, std::string_view b) {
  std::optional<std::size_t> found;
  if (a.size() != b.size()) return found;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i] == b[i]) continue;
    if (found) return std::nullopt;
    found = i;
  }
  return found;
}

}  // namespace

void StrayFinder::take(const io::LogEvent& event, std::int64_t session, Group& group) {
  if (group.num_messages++ > 0) return;
  group.session = session;
  group.offset = event.offset;
  group.channel = event.channel;
}

void StrayFinder::take_own(const io::LogEvent& event, std::int64_t session) {
  take(event, session, own_[session]);
}

void StrayFinder::take_foreign(const io::LogEvent& event) {
  const std::string_view suffix = suffix_of(event.bytes);
  if (suffix.empty() || !find_one_byte(event.channel, prefix_ + std::string(suffix))) return;
  const std::int64_t session = read_integer(event.bytes, kSessionAt);
  std::string_view prefix = event.channel;
  if (prefix.ends_with(suffix)) prefix.remove_suffix(suffix.size());
  take(event, session, foreign_[std::to_string(session) + ' ' + std::string(prefix)]);
}

std::vector<StrayFinder::Stray> StrayFinder::find() const {
  std::vector<Stray> strays;
  find_renamed(strays);
  find_renumbered(strays);
  return strays;
}

void StrayFinder::find_renamed(std::vector<Stray>& strays) const {
  for (const auto& [key, group] : foreign_) {
    if (group.num_messages > 1 || !own_.contains(group.session)) continue;
    for (const char* suffix : {channels::kState, channels::kApplied, channels::kScene}) {
      const std::string meant = prefix_ + suffix;
      const std::optional<std::size_t> at = find_one_byte(group.channel, meant);
      if (!at) continue;
      const std::int64_t byte = group.offset + io::kLogHeaderBytes + static_cast<std::int64_t>(*at);
      strays.push_back({"the message at byte " + std::to_string(group.offset) + " is of session " +
                            std::to_string(group.session) + " and of the type of " + meant +
                            ", but on the channel " + printable(group.channel) +
                            ", so the channel name is damaged at byte " + std::to_string(byte) + ", where " +
                            format_text("%02x", static_cast<unsigned char>(meant[*at])) + " is meant",
                        std::nullopt});
      break;
    }
  }
}

void StrayFinder::find_renumbered(std::vector<Stray>& strays) const {
  bool has_lone = false;
  for (const auto& [session, group] : own_) has_lone = has_lone || group.num_messages == 1;
  if (!has_lone) return;
  std::unordered_set<std::int64_t> found;
  for (int byte = 0; byte < 8; ++byte) {
    // sessions that differ only in this byte become equal if this byte is set to 0
    const auto rest = [byte](std::int64_t session) {
      return static_cast<std::uint64_t>(session) & ~(std::uint64_t{0xff} << 8 * byte);
    };
    std::unordered_map<std::uint64_t, std::int64_t> whole;
    for (const auto& [session, group] : own_)
      if (group.num_messages > 1) whole[rest(session)] = session;
    for (const auto& [session, group] : own_) {
      const auto meant = whole.find(rest(session));
      if (group.num_messages > 1 || meant == whole.end() || !found.insert(session).second) continue;
      const std::int64_t at = group.offset + io::kLogHeaderBytes +
                              static_cast<std::int64_t>(group.channel.size()) + kSessionAt + 7 - byte;
      strays.push_back({"the message on " + group.channel + " at byte " + std::to_string(group.offset) +
                            " is the only one of session " + std::to_string(session) +
                            ", so that number is damaged at byte " + std::to_string(at) + ", where session " +
                            std::to_string(meant->second) + " is meant",
                        session});
    }
  }
}

}  // namespace freeflex::tools
