// Messages that one damaged byte has moved out of their session: in the name of their channel, or in the
// number of the session itself.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "service/io/wire/log.hpp"

namespace freeflex::tools {

/// Other programs may record anything beside a session, so a message is a stray only when it is alone: its
/// type is that of STATE, APPLIED or SCENE, its channel and its session are those of other messages but for
/// one byte, and no second message is where it is. Sessions are numbered by a clock in nanoseconds, so two
/// that differ in one byte are not met by chance.
class StrayFinder {
 public:
  /// \param prefix  of the channel names
  explicit StrayFinder(std::string prefix) : prefix_(std::move(prefix)) {}

  /// A message of a session, on STATE, APPLIED or SCENE of the prefix.
  void take_own(const io::LogEvent& event, std::int64_t session);
  /// A message on any other channel.
  void take_foreign(const io::LogEvent& event);
  struct Stray {
    std::string text;                     // which message it is, and which byte makes it one
    std::optional<std::int64_t> session;  // that no other message has
  };
  /// Linear in the number of sessions.
  std::vector<Stray> find() const;

 private:
  /// What one session has on the channels of one prefix.
  struct Group {
    std::int64_t session = 0;
    std::int64_t num_messages = 0;
    std::int64_t offset = 0;  // [bytes] of the first one's record
    std::string channel;      // of the first one
  };
  static void take(const io::LogEvent& event, std::int64_t session, Group& group);
  void find_renamed(std::vector<Stray>& strays) const;
  void find_renumbered(std::vector<Stray>& strays) const;

  std::string prefix_;
  std::unordered_map<std::int64_t, Group> own_;     // by session
  std::unordered_map<std::string, Group> foreign_;  // by session and prefix, or name where it has no prefix
};

}  // namespace freeflex::tools
