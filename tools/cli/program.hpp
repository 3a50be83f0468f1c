// What freeflex and freeflex-study share: a command line of subcommands and how it ends.
#pragma once

#include <CLI/App.hpp>

namespace freeflex::tools {

/// Adds the subcommands of a program; their callbacks leave the exit code in exit_code.
using AddCommands = void (*)(CLI::App& app, int& exit_code);

/// Parses and runs one subcommand. Returns the exit code of the program.
int run_program(int argc, char** argv, AddCommands add_commands);

}  // namespace freeflex::tools
