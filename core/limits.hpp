// Limits on structures and commands, each with the reason for it.
#pragma once

#include <cstddef>
#include <cstdint>

namespace freeflex {

/// Largest message [B]. LCM splits a larger message into fragments, and the loss of one fragment loses the
/// whole message.
inline constexpr int kMaxMessageBytes = 60000;

/// Largest number of elastic freedoms for which a state_t fits in one message. In a state_t, q and q_dot
/// together take 16 B per mode, and the other fields take up to 800 B.
inline constexpr int kMaxElastic = (kMaxMessageBytes - 800) / 16;
static_assert(kMaxElastic == 3700);

/// Largest number N of points of a structure whose modes are all computed. N points have 3 N - 6 elastic
/// freedoms. Freedoms that rigid links remove are not deducted, because the set-up uses dense matrices over
/// all 3 N freedoms. The set-up of 1000 points takes 60 s and 1 GB.
inline constexpr int kMaxDensePoints = (kMaxElastic + 6) / 3;
static_assert(kMaxDensePoints == 1235);

/// Largest number of freedoms for which all modes are computed even if the scene asks for fewer modes. Each
/// point has three freedoms, and three more if it rotates, whether or not it has mass. The dense set-up of
/// 300 points on springs takes 1.5 s. If all modes are computed, the motion of the modes that the plan omits
/// is known.
inline constexpr int kMostDenseForSomeModes = 900;

/// Largest number of modes that are kept of a scene that has more than kMaxDensePoints points and does not
/// choose its modes. The modes below half the tick rate are kept, up to this number.
inline constexpr int kModesByDefault = 300;

/// Largest number of points of a structure. The shapes of 300 modes of so many points take 1.4 GB, and no
/// index overflows.
inline constexpr int kMaxPoints = 200000;

/// A scene with at most this many points publishes every point by default, and its commands may push every
/// point.
inline constexpr int kMostByDefault = 1000;

/// Largest number of elastic freedoms of a plan, which is kMaxElastic padded to a multiple of 8. With this
/// limit, every product of indices of a plan file is far below the largest integer of 32 bits.
inline constexpr std::int32_t kMaxPlanElastic = (kMaxElastic + 7) / 8 * 8;
static_assert(kMaxPlanElastic == 3704);

/// Number of points above which the reader stops reading. A structure of more than kMaxPoints points is
/// refused. The reader reads more points than that, so that the message can state their number.
inline constexpr int kMaxNamedPoints = 262144;
static_assert(kMaxNamedPoints > kMaxPoints);

/// Largest number of points that commands may push. It is the size of the table in which the points are
/// looked up.
inline constexpr int kMaxTablePoints = 8192;

/// Largest fraction of the available memory that a set-up may use [-].
inline constexpr double kMemoryShare = 0.8;

/// Memory that OpenBLAS reserves at its first call [B]. Most of this memory stays unused.
inline constexpr std::size_t kBlasBuffer = std::size_t{128} << 20;

/// Largest number of constraints in one set of rigid links that share points, in the sparse set-up. A dense
/// QR factorization selects the independent constraints of the set. The factorization takes some 2 s and
/// 70 MB for this number of constraints.
inline constexpr int kMostJoinedConstraints = 1500;

/// Largest number of groups: the size of the table that commands index.
inline constexpr int kMaxGroups = 1024;

/// Lowest and highest rate of ticks [Hz]: one tick in 1000 s, and one tick per microsecond. A step takes at
/// least about one microsecond to compute.
inline constexpr double kLeastRate = 1e-3, kMostRate = 1e6;

/// Largest number of wheels of a scene, and of torques on wheels in one command.
inline constexpr int kMaxWheels = 16;

}  // namespace freeflex
