// Checks of options and texts of errors for the command lines of freeflexd and freeflex.
#pragma once

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <string>
#include <vector>

#include "service/io/scene/input.hpp"

namespace freeflex::service {

/// Returns "the value is 'TEXT', but must be ALLOWED".
std::string found(const std::string& text, const std::string& allowed);

/// Returns a validator that accepts a number, written as in scenes, if is_right returns true for it.
/// \param allowed  text that continues "must be "
CLI::Validator must_be(const char* allowed, bool (*is_right)(double));
/// Returns a validator that accepts one of the names.
CLI::Validator one_of(const std::vector<std::string>& names);
CLI::Validator rate_in_hertz();  // 0.001 to 1e6
CLI::Validator channel_prefix();

/// Adds --set PATH=VALUE, which may be repeated and sets values in a scene before it is read.
/// \param settings  must exist as long as the command
void add_settings(CLI::App& command, io::Settings& settings);

/// Returns the error of a command line, with the nearest command or option if there is one, and a hint how to
/// get the help.
std::string explain(const CLI::App& app, const CLI::ParseError& error);

}  // namespace freeflex::service
