// Command lines of freeflexd and freeflex: what an option may be, and what to say when it is something else.
#pragma once

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <string>
#include <vector>

#include "service/io/scene/input.hpp"

namespace freeflex::service {

/// "found 'text', must be allowed"
std::string found(const std::string& text, const std::string& allowed);

/// Takes what reads as a number, as scenes take it, and is right. \param allowed  continues "must be "
CLI::Validator must_be(const char* allowed, bool (*is_right)(double));
/// Takes one of the names.
CLI::Validator one_of(const std::vector<std::string>& names);
CLI::Validator rate_in_hertz();  // 0.001 to 1e6
CLI::Validator channel_prefix();

/// Adds --set PATH=VALUE, which may be repeated and sets values in a scene before it is read.
/// \param settings  lives as long as the command
void add_settings(CLI::App& command, io::Settings& settings);

/// What is wrong with a command line, with the nearest command or option where there is one, and how to get
/// the help.
std::string explain(const CLI::App& app, const CLI::ParseError& error);

}  // namespace freeflex::service
