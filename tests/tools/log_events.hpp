// Reads and writes all messages of an LCM event log at once.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "service/io/wire/log.hpp"

namespace freeflex::testing {

inline std::vector<io::LogEvent> read_events(const std::string& path) {
  io::LogReader reader(path);
  std::vector<io::LogEvent> events(1);
  while (reader.next(events.back())) events.emplace_back();
  events.pop_back();
  EXPECT_EQ(reader.error() + reader.damage(), "");
  return events;
}

inline void write_events(const std::string& path, const std::vector<io::LogEvent>& events) {
  io::LogWriter writer(path);
  for (const io::LogEvent& event : events) writer.write(event.channel, event.utime, event.bytes);
  EXPECT_EQ(writer.close(), "");
}

}  // namespace freeflex::testing
