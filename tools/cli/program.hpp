// This code is common to freeflex and freeflex-study. It parses a command line of subcommands, runs one and
// ends the program.
#pragma once

#include <CLI/App.hpp>

namespace freeflex::tools {

/// Adds the subcommands of a program. The callbacks of the subcommands store the exit code in exit_code.
using AddCommands = void (*)(CLI::App& app, int& exit_code);

/// Parses and runs one subcommand. Returns the exit code of the program.
int run_program(int argc, char** argv, AddCommands add_commands);

}  // namespace freeflex::tools
