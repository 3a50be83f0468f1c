// The kinds of files behind open_motion.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "tools/bus/motion_rows.hpp"

namespace freeflex::tools {

/// nullptr, with the reason: see open_motion.
std::unique_ptr<MotionFile> open_table(const std::string& path, std::string& error);
std::unique_ptr<MotionFile> open_recording(const std::string& path, const std::string& prefix,
                                           std::optional<std::int64_t> session, std::string& error);

}  // namespace freeflex::tools
