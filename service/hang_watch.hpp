// Tells a process that hangs from one that a busy machine keeps waiting.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

namespace freeflex::service {

/// What the system says of a process.
struct ProcessReading {
  char state = '?';  // as in /proc/PID/stat: R running or ready, S asleep, D waits for a disk, T stopped
  std::int64_t cpu_ns = 0;  // [ns] processor time it has used
};
ProcessReading read_process(int pid);

/// A process raises its beat 50 times a second or more. Silence alone proves nothing, for a busy machine may
/// give it no turn. It hangs when it is silent and
/// - stopped (a signal, a debugger), or
/// - has used kLoopTime of processor time meanwhile: an endless loop, for between two beats it works for
///   microseconds, or
/// - has slept all the while and used none, although a timer of kReceiveWait was to wake it.
/// One that is ready to run and gets no processor, or waits for a disk, is never said to hang. Silence is
/// counted in looks, of which each is worth kLongestLook at most: whoever looks may have had no turn itself,
/// or been stopped.
class HangWatch {
 public:
  static constexpr std::chrono::milliseconds kSilence{100};      // stopped, or in a loop
  static constexpr std::chrono::milliseconds kLongSilence{150};  // asleep
  static constexpr std::chrono::milliseconds kLoopTime{20};      // of processor time
  static constexpr std::chrono::milliseconds kStart{2000};  // in place of the last two before the first beat
  static constexpr std::chrono::milliseconds kLongestLook{10};

  /// Begins anew, with another process.
  void start(std::int64_t now_ns);
  /// One look. Empty, or in what way it hangs.  \param read  called only when it has been silent for some
  /// time
  std::string look(std::int64_t now_ns, std::uint64_t beat, const std::function<ProcessReading()>& read);

 private:
  std::uint64_t beat_ = 0;
  std::int64_t looked_ns_ = 0;
  std::chrono::nanoseconds silence_{0};
  bool has_first_ = false;  // reading of this silence
  ProcessReading first_;
  bool has_slept_ = false;  // at every reading of this silence
};

}  // namespace freeflex::service
