#include "service/hang_watch.hpp"

#include <time.h>

#include <algorithm>
#include <cstdio>
#include <cstring>

namespace freeflex::service {

namespace {
/// Readings begin after this silence. It is half of kSilence, so the processor time used during the second
/// half is known.
constexpr std::chrono::milliseconds kFirstReading = HangWatch::kSilence / 2;
}  // namespace

ProcessReading read_process(int pid) {
  ProcessReading reading;
  clockid_t clock = 0;
  timespec used{};
  if (clock_getcpuclockid(pid, &clock) == 0 && clock_gettime(clock, &used) == 0)
    reading.cpu_ns = used.tv_sec * 1'000'000'000 + used.tv_nsec;
  char line[256] = {};
  if (std::FILE* file = std::fopen(("/proc/" + std::to_string(pid) + "/stat").c_str(), "r");
      file != nullptr) {
    if (std::fgets(line, sizeof line, file) == nullptr) line[0] = '\0';
    std::fclose(file);
  }
  // the state follows the name, which may contain any character
  if (const char* name_end = std::strrchr(line, ')'); name_end != nullptr && name_end[1] == ' ')
    reading.state = name_end[2];
  return reading;
}

void HangWatch::start(std::int64_t now_ns) {
  *this = HangWatch{};
  looked_ns_ = now_ns;
}

std::string HangWatch::look(std::int64_t now_ns, std::uint64_t beat,
                            const std::function<ProcessReading()>& read) {
  const std::chrono::nanoseconds passed{now_ns - looked_ns_};
  looked_ns_ = now_ns;
  if (beat != beat_) {
    beat_ = beat;
    silence_ = {};
    has_first_ = false;
    return {};
  }
  silence_ += std::clamp<std::chrono::nanoseconds>(passed, std::chrono::nanoseconds{0}, kLongestLook);
  if (silence_ < kFirstReading) return {};
  const ProcessReading now = read();
  if (!has_first_) {
    has_first_ = true;
    first_ = now;
    has_slept_ = true;
  }
  has_slept_ = has_slept_ && now.state == 'S';
  if (silence_ < kSilence) return {};
  if (now.state == 'T' || now.state == 't') return "was stopped";
  const std::chrono::nanoseconds used{now.cpu_ns - first_.cpu_ns};
  const bool is_starting = beat == 0;
  if (used >= (is_starting ? kStart : kLoopTime)) return "was in an endless loop";
  if (silence_ >= (is_starting ? kStart : kLongSilence) && has_slept_ && used.count() == 0)
    return "slept and did not wake";
  return {};
}

}  // namespace freeflex::service
