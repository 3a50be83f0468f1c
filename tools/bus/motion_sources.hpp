// Opens the two kinds of files that open_motion accepts.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "tools/bus/motion_rows.hpp"

namespace freeflex::tools {

/// Each function opens a file of one kind. If the file cannot be opened, returns nullptr and sets `error` to
/// the reason, as open_motion does.
std::unique_ptr<MotionFile> open_table(const std::string& path, std::string& error);
std::unique_ptr<MotionFile> open_recording(const std::string& path, const std::string& prefix,
                                           std::optional<std::int64_t> session, std::string& error);

}  // namespace freeflex::tools
