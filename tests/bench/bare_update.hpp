// The reference for the cost of a step is the plain modal update under a force that is linear over the step.
#pragma once

#include <cstddef>

#include "core/step/array.hpp"

struct BareModes {
  freeflex::Array q, v;                    // state
  freeflex::Array p_qq, p_qv, p_vq, p_vv;  // propagator
  freeflex::Array w_q0, w_q1, w_v0, w_v1;  // load weights at the start and the end
  freeflex::Array f0, f1;                  // generalized forces at the start and the end
};

/// Computes q1 = p q + w f for each mode, with ten loads, two stores and eight products.
void bare_update(BareModes& modes, std::size_t n);

/// Computes the same update at the register width that core/step chooses at run time. The width is that of
/// AVX2 if the processor has AVX2.
void bare_update_wide(BareModes& modes, std::size_t n);
