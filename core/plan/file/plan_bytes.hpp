// Conversion of a plan to bytes and back, and the consistency check of a plan. This file uses no Eigen.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/plan.hpp"

namespace freeflex {

/// Every plan file starts with these bytes, but no YAML scene does.
inline constexpr std::string_view kPlanMark = "FFPLAN";

/// Returns the plan as bytes, in the order magic, version, length, XXH3 checksum and little-endian content.
/// The plan that plan_from_bytes reads from them equals `plan` bit for bit.
std::vector<std::byte> plan_to_bytes(const Plan& plan);

/// Reads the output of plan_to_bytes. If this fails, returns nullopt and sets `error` (wrong magic, wrong
/// version, truncated, trailing bytes, wrong checksum, inconsistent sizes). Checks every count before using
/// it.
std::optional<Plan> plan_from_bytes(std::span<const std::byte> bytes, std::string& error);

/// Returns what is wrong with a plan. Faults are sizes that disagree, indices out of range, and values that
/// are not finite. Returns an empty text if the plan is consistent. A consistent plan can be stepped and read
/// without any access out of bounds.
std::string find_inconsistency(const Plan& plan);

/// Returns the XXH3-64 hash of the content of plan_to_bytes, without the tables for the verdict and the
/// limits of commands, which do not change the motion. Plans with the same fingerprint give motions with the
/// same bits.
std::uint64_t plan_fingerprint(const Plan& plan);

}  // namespace freeflex
