// The largest structures and commands that are taken, each with what it follows from.
#pragma once

#include <cstddef>
#include <cstdint>

namespace freeflex {

/// [B] of a message: LCM sends what is larger in fragments, of which one lost loses all.
inline constexpr int kMaxMessageBytes = 60000;

/// Elastic freedoms: q and q_dot of a state_t are 16 B a mode, and 800 B are left for the rest of it.
inline constexpr int kMaxElastic = (kMaxMessageBytes - 800) / 16;
static_assert(kMaxElastic == 3700);

/// Points of a structure: 3 N - 6 elastic freedoms. Those that rigid links take are not deducted, for the
/// set-up is dense in all 3 N.
inline constexpr int kMaxPoints = (kMaxElastic + 6) / 3;
static_assert(kMaxPoints == 1235);

/// Elastic freedoms of a plan: those of a structure up to the next full lane, so that every index product of
/// a plan file stays far inside 32 bits.
inline constexpr std::int32_t kMaxPlanElastic = (kMaxElastic + 7) / 8 * 8;
static_assert(kMaxPlanElastic == 3704);

/// Points that the reader takes in before the structure is refused for its size, so that one fault names the
/// whole count; and slots of the table that commands index, a power of two above kMaxPoints.
inline constexpr int kMaxNamedPoints = 8192;
static_assert(kMaxNamedPoints > kMaxPoints);

/// Groups: slots of the table that commands index.
inline constexpr int kMaxGroups = 1024;

/// [Hz] of ticks: from one each 1000 s to one a microsecond, about what the smallest step takes.
inline constexpr double kLeastRate = 1e-3, kMostRate = 1e6;

}  // namespace freeflex
