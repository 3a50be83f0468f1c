// Where freeflex run puts what it computes.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "core/step/step.hpp"
#include "core/validity/judgement.hpp"

namespace freeflex::tools {

class RunOutput {
 public:
  virtual ~RunOutput() = default;
  /// Writes what is due at the state's tick; everything when is_edge (start, end, reset).
  virtual void publish(const State& state, bool is_edge) = 0;
  /// Writes the verdict on a state where it is due; always when is_edge.
  virtual void judge(const State& state, const Judgement& judgement, Budget& budget, bool is_edge) = 0;
  /// A reset took effect at a tick.
  virtual void applied_reset(std::int64_t tick) = 0;
  /// What a step at this tick took in.
  virtual void applied_step(std::int64_t tick, const StepReport& report,
                            std::span<const ForceCommand> commands) = 0;
  virtual bool has_error() const = 0;
  /// Completes the file, or leaves it as NAME.partial. Empty, or what went wrong.
  virtual std::string close(bool is_partial) = 0;
  /// The tick up to which NAME.partial holds the run after close() returned an error; nullopt: no file is
  /// left.
  virtual std::optional<std::int64_t> kept_tick() const = 0;
  virtual const std::string& working_path() const = 0;
};

/// What --out may name.
inline constexpr const char* kOutputs =
    "NAME.csv (a table), NAME.log (an LCM log) or - (a table on standard output)";

/// kOutputs, endings in any case; or a device or pipe, which takes a log.
bool is_output(const std::string& path);
/// True for a path under which make_run_output writes a table.
bool is_table(const std::string& path);
bool is_standard_output(const std::string& path);

/// \param path   empty: nothing is written; of a table, or of an LCM log with the daemon's channels,
/// deterministic: session 1, time stamps
///               in simulated time
/// \param input  scene or plan file, for FREEFLEX_SCENE
std::unique_ptr<RunOutput> make_run_output(const Plan& plan, const std::string& input,
                                           const std::string& prefix, const std::string& path);

}  // namespace freeflex::tools
