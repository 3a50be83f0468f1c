// What a link is made of, in YAML and in tables alike.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "core/scene/scene.hpp"
#include "service/io/scene/text.hpp"

namespace freeflex::io::reader {

inline constexpr double kMaxInner = 2000.0;  // coordinates of one superelement
inline constexpr Quantity kStiffness{"N/m", Bound::kPositive};
inline constexpr Quantity kForce{"N", Bound::kPositive};
inline constexpr Quantity kRigidity{"N m^2", Bound::kPositive};
inline constexpr Quantity kAngleStiffness{"N m/rad", Bound::kPositive};
inline constexpr Quantity kModulus{"Pa", Bound::kPositive};
inline constexpr Quantity kPoissonRatio{"-", Bound::kPoissonRatio};
inline constexpr Quantity kThickness{"m", Bound::kPositive};
inline constexpr Quantity kCount{"-", Bound::kNonNegative};
inline constexpr Quantity kMassPerLength{"kg/m", Bound::kNonNegative};
inline constexpr Quantity kDensity{"kg/m^3", Bound::kNonNegative};
inline constexpr Quantity kDamping{"N s/m", Bound::kPositive};
inline constexpr Quantity kViscous{"s", Bound::kNonNegative};
inline constexpr Quantity kLossFactor{"-", Bound::kNonNegative};

/// Why a kind of link does not take viscous or loss_factor; empty: it does.
struct LossRefusal {
  std::string_view viscous, loss_factor;
};
inline constexpr LossRefusal kElasticLosses{};
inline constexpr LossRefusal kRotationLosses{
    "is not for beams and plates: rotations carry no mass, and a moment that depends on their rate would "
    "make "
    "them states of their own; use loss_factor, or damping: rayleigh",
    {}};
inline constexpr LossRefusal kRigidLosses{"is not for rigid links: they do not deform; remove it",
                                          "is not for rigid links: they do not deform; remove it"};
inline constexpr LossRefusal kDashpotLosses{
    "is not for dashpots: they have no stiffness; use damping, or add a spring",
    "is not for dashpots: they have no stiffness; use damping, or add a spring"};

/// The first point that a link names twice, or nullopt.
std::optional<int> find_repeated(const std::vector<int>& points);

}  // namespace freeflex::io::reader
