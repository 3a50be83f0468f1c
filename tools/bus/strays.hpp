// Finds messages that one damaged byte, in the channel name or in the session number, moved out of their
// session.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "service/io/wire/log.hpp"

namespace freeflex::tools {

/// Finds single messages whose channel or session differs in one byte from the channel or session of other
/// messages. A log may contain messages of other programs, so a stray message must have the type of STATE,
/// APPLIED or SCENE and be the only message with its channel and session. Session numbers come from a clock
/// in nanoseconds, so it is very unlikely that two of them differ in one byte by chance.
class StrayFinder {
 public:
  /// \param prefix  first part of the channel names
  explicit StrayFinder(std::string prefix) : prefix_(std::move(prefix)) {}

  /// Adds a message of a session, on STATE, APPLIED or SCENE of the prefix.
  void take_own(const io::LogEvent& event, std::int64_t session);
  /// Adds a message on any other channel.
  void take_foreign(const io::LogEvent& event);
  struct Stray {
    std::string text;                     // text that names the message and the damaged byte
    std::optional<std::int64_t> session;  // damaged session number; nullopt if the channel name is damaged
  };
  /// Returns the strays. The time is linear in the number of sessions.
  std::vector<Stray> find() const;

 private:
  /// Counts the messages of one session on the channels of one prefix.
  struct Group {
    std::int64_t session = 0;
    std::int64_t num_messages = 0;
    std::int64_t offset = 0;  // [bytes] offset of the record of the first message
    std::string channel;      // of the first message
  };
  static void take(const io::LogEvent& event, std::int64_t session, Group& group);
  void find_renamed(std::vector<Stray>& strays) const;
  void find_renumbered(std::vector<Stray>& strays) const;

  std::string prefix_;
  std::unordered_map<std::int64_t, Group> own_;  // by session
  // by session and prefix, or by session and channel name if the name does not end with the suffix of the
  // type
  std::unordered_map<std::string, Group> foreign_;
};

}  // namespace freeflex::tools
