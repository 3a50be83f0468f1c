#include "tools/cli/program.hpp"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <string>

#include "core/faults.hpp"
#include "tools/cli/commands.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

/// Returns the exit code. If not all of the output was written, prints an error, and returns 1 instead of 0.
int end_output(int exit_code) {
  errno = 0;
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return exit_code;
  print_error(std::string("standard output: ") + (errno != 0 ? std::strerror(errno) : "cannot be written"));
  return exit_code == kExitOk ? kExitDiffers : exit_code;
}

/// Makes a value of a flag, as in --json=2, an error for the program and all its subcommands.
void refuse_values_of_flags(CLI::App& app) {
  for (CLI::Option* option : app.get_options())
    if (option->get_items_expected_max() == 0) option->disable_flag_override();
  for (CLI::App* command : app.get_subcommands({})) refuse_values_of_flags(*command);
}

int run_command_line(int argc, char** argv, AddCommands add_commands) {
  end_when_interrupted(kExitInterrupted);
  // a write beyond the size limit of files then fails instead of ending the process
  std::signal(SIGXFSZ, SIG_IGN);
  CLI::App app{"freeflex: scenes, plans, runs and recordings of free flexible structures", "freeflex"};
  app.formatter(make_help_formatter());
  app.set_help_flag("-h,--help", "this text");
  app.set_version_flag("--version", std::string("freeflex ") + FREEFLEX_VERSION, "name and version");
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done, 1 negative result (differs, rejected, not written), 2 wrong arguments, scene or "
      "plan,\n"
      "3 log damaged or incomplete, 130 interrupted. 'freeflex COMMAND --help' shows examples.");

  int exit_code = kExitOk;
  add_commands(app, exit_code);
  refuse_values_of_flags(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // CLI11 reports --help and --version as exceptions too
    if (error.get_exit_code() == 0) return app.exit(error), end_output(kExitOk);
    print_error(explain(app, error));
    return kExitUsage;
  }
  return end_output(exit_code);
}

}  // namespace

int run_program(int argc, char** argv, AddCommands add_commands) {
  try {
    return run_command_line(argc, argv, add_commands);
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "freeflex: error: memory ran out%s\n", kMoreMemory);
    return kExitDiffers;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "freeflex: error: %s\n", error.what());
    return kExitDiffers;
  }
}

}  // namespace freeflex::tools
