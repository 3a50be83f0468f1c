#include "service/limited_log.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "service/clock.hpp"

namespace freeflex::service {

namespace {

spdlog::level::level_enum level_of(LineKind kind) {
  switch (kind) {
    case LineKind::kOtherDaemon:
    case LineKind::kFault:
      return spdlog::level::err;
    case LineKind::kRecovery:
    case LineKind::kReplan:
      return spdlog::level::info;
    case LineKind::kIngressEnded:
    case LineKind::kNotHeard:
    case LineKind::kNotSent:
    case LineKind::kSlip:
    case LineKind::kRefused:
    case LineKind::kVerdict:
      break;
  }
  return spdlog::level::warn;
}

}  // namespace

void write_line(LineKind kind, const std::string& text) { spdlog::log(level_of(kind), "{}", text); }

void LimitedLog::write(LineKind kind, std::int64_t now_ns, const std::string& text) {
  write_due(now_ns);
  Record& record = records_[static_cast<std::size_t>(kind)];
  const std::int64_t oldest_ns = record.written_ns[static_cast<std::size_t>(record.num_written % kMost)];
  const bool is_free = record.num_written < kMost || now_ns - oldest_ns >= kSecond;
  if (record.num_held == 0 && is_free) return put(kind, now_ns, text);
  if (record.num_held == 0) record.held_since_ns = now_ns;
  ++record.num_held;
  record.last_held = text;
}

void LimitedLog::write_due(std::int64_t now_ns) {
  for (std::size_t i = 0; i < kNumLineKinds; ++i)
    // all written lines are older than the first suppressed line, so a second after that line the line with
    // the count is within the limit
    if (records_[i].num_held > 0 && now_ns - records_[i].held_since_ns >= kSecond)
      put_count(static_cast<LineKind>(i), now_ns);
}

void LimitedLog::end() {
  for (std::size_t i = 0; i < kNumLineKinds; ++i)
    if (records_[i].num_held > 0) put_count(static_cast<LineKind>(i), records_[i].held_since_ns);
}

void LimitedLog::put(LineKind kind, std::int64_t now_ns, const std::string& text) {
  Record& record = records_[static_cast<std::size_t>(kind)];
  record.written_ns[static_cast<std::size_t>(record.num_written++ % kMost)] = now_ns;
  write_(kind, text);
}

void LimitedLog::put_count(LineKind kind, std::int64_t now_ns) {
  Record& record = records_[static_cast<std::size_t>(kind)];
  const std::int64_t num_held = std::exchange(record.num_held, 0);
  put(kind, now_ns,
      fmt::format("... and {} more of this kind in the last second, the last: {}", num_held,
                  record.last_held));
}

}  // namespace freeflex::service
