// Outputs of freeflex run: a log, a table or nothing.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "core/motion.hpp"

namespace freeflex::tools {

class RunOutput {
 public:
  virtual ~RunOutput() = default;
  /// Writes the messages, or the row, that are due at the tick of a motion. If is_edge is true (at start, end
  /// and reset), STATE, POINTS and LOADS, or the row, are due at any tick.
  virtual void publish(const Motion& motion, bool is_edge) = 0;
  /// Writes a STATUS with the verdict on a motion to a log, if a STATUS is due or is_edge is true.
  virtual void judge(Motion& motion, bool is_edge) = 0;
  /// Adds what a motion lacks most to the causes that later messages publish.
  virtual void set_effect(const std::string& text) { (void)text; }
  /// Records that a reset took effect at a tick.
  virtual void applied_reset(std::int64_t tick) = 0;
  /// Records the commands that the step of a tick applied, and the slots that ended in that step.
  virtual void applied_step(std::int64_t tick, const StepReport& report,
                            std::span<const ForceCommand> commands) = 0;
  virtual bool has_error() const = 0;
  /// Completes the file, or keeps it as NAME.partial if is_partial is true. Returns an empty text or the
  /// error.
  virtual std::string close(bool is_partial) = 0;
  /// If close() returned an error, returns the last tick in NAME.partial, or nullopt if no file was kept.
  virtual std::optional<std::int64_t> kept_tick() const = 0;
  virtual const std::string& working_path() const = 0;
};

/// Kinds of file that --out accepts, for messages.
inline constexpr const char* kOutputs =
    "NAME.csv (a table), NAME.log (an LCM log) or - (a table on standard output)";

/// Returns true if a path is of a kind in kOutputs, with the ending in capitals or not, or is a device or
/// pipe, to which a log is written.
bool is_output(const std::string& path);
/// Returns true if make_run_output writes a table to the path.
bool is_table(const std::string& path);
bool is_standard_output(const std::string& path);

/// Makes the output for a path. A log has the daemon's channels. The log is deterministic, because its
/// session is 1 and its time stamps are simulated time.
/// \param path   path of a table or an LCM log; empty: nothing is written
/// \param input  scene or plan file, for FREEFLEX_SCENE
std::unique_ptr<RunOutput> make_run_output(const Plan& plan, const std::string& input,
                                           const std::string& prefix, const std::string& path);

}  // namespace freeflex::tools
