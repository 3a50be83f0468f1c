// The plain modal update under a force that is linear over the step, with whose cost the cost of the complete
// step is compared.
#pragma once

#include <cstddef>

#include "core/step/array.hpp"

struct BareModes {
  freeflex::Array q, v;                    // state
  freeflex::Array p_qq, p_qv, p_vq, p_vv;  // propagator
  freeflex::Array w_q0, w_q1, w_v0, w_v1;  // load weights at the start and the end
  freeflex::Array f0, f1;                  // generalized forces at the start and the end
};

/// Computes the next (q, v) of each mode as p (q, v) + w f. Each mode takes twelve loads from memory, two
/// stores and eight products.
void bare_update(BareModes& modes, std::size_t n);

/// Computes the same update at the widest register width that the processor supports: AVX-512, AVX2 or that
/// of the build. core/step chooses its width in the same way.
void bare_update_wide(BareModes& modes, std::size_t n);
