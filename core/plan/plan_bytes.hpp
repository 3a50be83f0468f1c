// Plan <-> bytes, and what must hold in a plan. No Eigen.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/step/plan.hpp"

namespace freeflex {

/// What every plan file starts with, and no YAML scene does.
inline constexpr std::string_view kPlanMark = "FFPLAN";

/// The plan as bytes: magic, version, length, XXH3 checksum, little-endian content. Bit-exact round trip.
std::vector<std::byte> plan_to_bytes(const Plan& plan);

/// Reads plan_to_bytes output. On failure returns nullopt and says why in error (bad magic, version,
/// truncated, trailing bytes, checksum, inconsistent sizes). Never trusts a count.
std::optional<Plan> plan_from_bytes(std::span<const std::byte> bytes, std::string& error);

/// What is wrong with a plan: sizes that disagree, indices out of range, values that are not finite. Empty
/// when nothing. A plan that passes can be stepped and read without any access out of bounds.
std::string find_inconsistency(const Plan& plan);

/// XXH3-64 of plan_to_bytes content: two plans with one fingerprint give one set of bits.
std::uint64_t plan_fingerprint(const Plan& plan);

}  // namespace freeflex
