// The yardstick: the plain modal update with a force linear in the step, and nothing else.
#pragma once

#include <cstddef>

#include "core/step/array.hpp"

struct BareModes {
  freeflex::Array q, v;                    // state
  freeflex::Array p_qq, p_qv, p_vq, p_vv;  // propagator
  freeflex::Array w_q0, w_q1, w_v0, w_v1;  // load weights at the start and the end
  freeflex::Array f0, f1;                  // generalized forces at the start and the end
};

/// q1 = p q + w f, per mode: ten loads, two stores, eight products.
void bare_update(BareModes& modes, std::size_t n);

/// The same at the width that core/step chooses at run time: AVX2 where the processor has it.
void bare_update_wide(BareModes& modes, std::size_t n);
