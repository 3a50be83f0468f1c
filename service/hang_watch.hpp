// Distinguishes a process that hangs from a process that gets no processor time on a busy machine.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

namespace freeflex::service {

/// State and processor time of a process, as the system reports them.
struct ProcessReading {
  char state = '?';  // as in /proc/PID/stat: R running or ready, S asleep, D waiting for a disk, T stopped
  std::int64_t cpu_ns = 0;  // [ns] processor time that the process has used
};
ProcessReading read_process(int pid);

/// Detects a hanging process. A process increments its beat at least 50 times a second. A longer silence
/// alone does not prove that the process hangs, because a busy machine may give the process no processor
/// time. A process hangs if its beat does not change and the process
/// - is stopped (by a signal or a debugger), or
/// - has used kLoopTime of processor time during the silence: it is in an endless loop, because the work
///   between two beats takes only microseconds, or
/// - has slept during the silence and used no processor time, although a timer of kReceiveWait should have
///   woken it.
/// A process that is ready to run but gets no processor, or that waits for a disk, is never reported as
/// hanging. Each call of look() adds at most kLongestLook to the silence, because the process that looks may
/// itself have been stopped or have had no processor time.
class HangWatch {
 public:
  static constexpr std::chrono::milliseconds kSilence{100};  // silence until a stopped or looping process is
                                                             // reported
  static constexpr std::chrono::milliseconds kLongSilence{150};  // silence until a sleeping process is
                                                                 // reported
  static constexpr std::chrono::milliseconds kLoopTime{20};      // processor time that shows a loop
  // replaces kLongSilence and kLoopTime before the first beat
  static constexpr std::chrono::milliseconds kStart{2000};
  static constexpr std::chrono::milliseconds kLongestLook{10};

  /// Starts to watch a new process.
  void start(std::int64_t now_ns);
  /// Checks once. Returns an empty string, or a text that says how the process hangs.  \param read  called
  /// only after some silence
  std::string look(std::int64_t now_ns, std::uint64_t beat, const std::function<ProcessReading()>& read);

 private:
  std::uint64_t beat_ = 0;
  std::int64_t looked_ns_ = 0;
  std::chrono::nanoseconds silence_{0};
  bool has_first_ = false;  // first_ belongs to the present silence
  ProcessReading first_;
  bool has_slept_ = false;  // true if the process slept at every reading of the present silence
};

}  // namespace freeflex::service
