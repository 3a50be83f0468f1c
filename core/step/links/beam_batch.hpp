// Beams side by side, so that one loop computes the gradients of several at a time in vector registers.
#pragma once

#include "core/step/plan/links.hpp"

namespace freeflex {

/// Holds the constants of all beams, the present axes of their ends and the results, in blocks of kLanes
/// beams. The arrays are allocated when the workspace is made; the step allocates nothing.
struct BeamBatch {
  Array constants;  // (14 x kLanes in each block) rest vector, then the members of BeamConstants
  Array ends;       // (15 x kLanes in each block) d [m], then n and y of both ends [-]
  Array results;    // (11 x kLanes in each block) force [N], moments [N m], BeamAngles [-]
};

BeamBatch make_beam_batch(const std::vector<PlanTrueBeam>& beams);
/// Sets the change of a beam's span and the axes of its ends.
void set_beam(std::size_t beam, const Vec3& d, const BeamEnd& first, const BeamEnd& second,
              BeamBatch& batch) noexcept;
/// Computes the gradients of all beams   (THEORY 12.60 to 12.64).
void set_gradients(const std::vector<PlanTrueBeam>& beams, BeamBatch& batch) noexcept;
/// Returns the force and the moments of a gradient; the other members are zero.
BeamGradient gradient_in(const BeamBatch& batch, std::size_t beam) noexcept;

}  // namespace freeflex
