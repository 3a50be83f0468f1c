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

/// Points of a structure of which all modes are found: 3 N - 6 elastic freedoms. Those that rigid links take
/// are not deducted, for that set-up is dense in all 3 N: 60 s and 1 GB at 1000 points.
inline constexpr int kMaxDensePoints = (kMaxElastic + 6) / 3;
static_assert(kMaxDensePoints == 1235);

/// Freedoms up to which all modes are found where only some are asked for, three of a point and three where
/// it turns, with mass or not: the dense set-up of 300 points on springs takes 1.5 s, and knows what the
/// others would carry.
inline constexpr int kMostDenseOfPart = 900;

/// Modes of a larger scene that does not say which: those below half the rate, at most so many.
inline constexpr int kModesByDefault = 300;

/// Points of a structure: 1.4 GB of numbers in modes for 300 of them, and room in every index.
inline constexpr int kMaxPoints = 200000;

/// Points up to which everything is published, pushable and sent by default.
inline constexpr int kMostByDefault = 1000;

/// Elastic freedoms of a plan: those of a structure up to the next full lane, so that every index product of
/// a plan file stays far inside 32 bits.
inline constexpr std::int32_t kMaxPlanElastic = (kMaxElastic + 7) / 8 * 8;
static_assert(kMaxPlanElastic == 3704);

/// Points that the reader takes in before the structure is refused for its size, so that one fault names the
/// whole count.
inline constexpr int kMaxNamedPoints = 262144;
static_assert(kMaxNamedPoints > kMaxPoints);

/// Points that commands may push: places of the table in which they are looked up.
inline constexpr int kMaxTablePoints = 8192;

/// [-] of the memory that there is that a set-up may take.
inline constexpr double kMemoryShare = 0.8;

/// [B] that an OpenBLAS takes, mostly untouched, when it is first called.
inline constexpr std::size_t kBlasBuffer = std::size_t{128} << 20;

/// Motions that rigid links which share points may forbid together in the sparse set-up, where a dense QR
/// tells which of them are independent: some 2 s and 70 MB.
inline constexpr int kMostJoinedRows = 1500;

/// Groups: slots of the table that commands index.
inline constexpr int kMaxGroups = 1024;

/// [Hz] of ticks: from one each 1000 s to one a microsecond, about what the smallest step takes.
inline constexpr double kLeastRate = 1e-3, kMostRate = 1e6;

/// Wheels of a scene: what one command may turn.
inline constexpr int kMaxWheels = 16;

}  // namespace freeflex
