// Command lines: what an option may be, and what to say when it is something else.
#pragma once

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <string>

namespace freeflex::tools {

/// Takes what reads as a number and is right. \param allowed  continues "must be "
CLI::Validator must_be(const char* allowed, bool (*is_right)(double));

// what several options are
CLI::Validator rate_in_hertz();          // 0.001 to 1e6, as freeflexd
CLI::Validator positive_time();          // [s] > 0
CLI::Validator whole_number(int least);  // to 2^31 - 1
CLI::Validator file_name();              // not empty
CLI::Validator channel_prefix();         // as freeflexd takes it

/// What is wrong with a command line, with the nearest command or option where there is one.
std::string explain(const CLI::App& app, const CLI::ParseError& error);

}  // namespace freeflex::tools
