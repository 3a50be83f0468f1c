// SIGINT, SIGTERM and SIGHUP as a question to ask; signals that a write can bring.
#pragma once

namespace freeflex::service {

/// A write that fails returns an error and does nothing else to the process. Otherwise a pipe that nobody
/// reads any more (SIGPIPE) or a log as large as a file may be (SIGXFSZ, `ulimit -f`) would kill it, and a
/// terminal that background jobs must not write to would stop it (SIGTTOU, `stty tostop`).
void ignore_signals_of_writing();

/// Takes the three signals over for the whole process, whatever mask and dispositions it inherited. A shell
/// starts background jobs with SIGINT ignored; `kill -INT` is to end a daemon all the same. SIGHUP stays
/// ignored where it was: that is what nohup asks for. The first signal sets a flag. Two ends are at once,
/// within the handler, and need no order since the ingress dies with its daemon: during start-up (exit status
/// 0), and by a signal that comes kPatience or more after the first, when the orderly end hangs (exit status
/// 1). One a process.
class SignalWatch {
 public:
  static constexpr long long kPatience = 1'000'000'000;  // [ns] an orderly end takes a few milliseconds

  SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;

  /// The signal that came first, or 0. Any thread.
  int received() const;
  /// From here on the first signal only sets the flag. Any thread.
  void end_start_up();
};

}  // namespace freeflex::service
