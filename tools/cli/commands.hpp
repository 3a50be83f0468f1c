// The subcommands of freeflex. Each function add_*() declares the options of a subcommand and a callback that
// stores the exit code in exit_code.
#pragma once

#include <CLI/App.hpp>

namespace freeflex::tools {

inline constexpr int kExitOk = 0;
inline constexpr int kExitDiffers =
    1;                                // negative result: states differ, command rejected, output not written
inline constexpr int kExitUsage = 2;  // wrong arguments, scene or plan
inline constexpr int kExitIncomplete = 3;     // a log that is damaged or incomplete
inline constexpr int kExitInterrupted = 130;  // Ctrl-C, SIGTERM

/// Name and meaning of a subcommand, as the list of subcommands shows them.
struct Description {
  const char* name;
  const char* meaning;
};
// subcommands of freeflex-study
inline constexpr Description kInspect{
    "inspect", "mass, freedoms, unit elastic displacements, Maxwell and influence coefficients"};
inline constexpr Description kReport{
    "report", "error against run time of every rung, and of other methods on the same scene"};
inline constexpr Description kStability{
    "stability", "stiff and extreme cases, each with the limit that it must meet and other methods"};

void add_check(CLI::App& app, int& exit_code);
void add_schema(CLI::App& app, int& exit_code);
void add_modes(CLI::App& app, int& exit_code);
void add_loads(CLI::App& app, int& exit_code);
void add_inspect(CLI::App& app, int& exit_code);
void add_plan(CLI::App& app, int& exit_code);
void add_report(CLI::App& app, int& exit_code);
void add_stability(CLI::App& app, int& exit_code);
void add_compile(CLI::App& app, int& exit_code);
void add_run(CLI::App& app, int& exit_code);
void add_keygen(CLI::App& app, int& exit_code);
void add_push(CLI::App& app, int& exit_code);
void add_monitor(CLI::App& app, int& exit_code);
void add_view(CLI::App& app, int& exit_code);
void add_replay(CLI::App& app, int& exit_code);
void add_compare(CLI::App& app, int& exit_code);
void add_export(CLI::App& app, int& exit_code);
void add_campaign(CLI::App& app, int& exit_code);

}  // namespace freeflex::tools
