// The change of energy over a motion without loads.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/motion.hpp"
#include "core/step/readout.hpp"

namespace freeflex::testing {

struct EnergyDrift {
  double start = 0.0;   // [J] energy after the first tick
  double most = 0.0;    // [J] largest change since then
  double strain = 0.0;  // [J] largest strain energy
};
inline EnergyDrift energy_drift(const Plan& plan, int num_ticks) {
  Motion motion(plan, kMotionAlone);
  const auto energy = [&] {
    const Invariants all = read_invariants(plan, motion.state());
    return all.kinetic_rigid + all.kinetic_elastic + all.potential;
  };
  motion.advance();
  EnergyDrift drift{energy()};
  for (int k = 0; k < num_ticks; ++k) {
    EXPECT_EQ(motion.advance().status, StepStatus::kOk);
    drift.most = std::max(drift.most, std::abs(energy() - drift.start));
    drift.strain = std::max(drift.strain, read_invariants(plan, motion.state()).potential);
  }
  return drift;
}

}  // namespace freeflex::testing
