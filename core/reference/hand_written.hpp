// Velocity Verlet and the classical Runge-Kutta method by hand on the full system   (THEORY X111, X112).
#pragma once

#include <vector>

#include "core/reference/rivals.hpp"
#include "core/reference/spring_network.hpp"

namespace freeflex {

class HandWritten : public RivalMethod {
 public:
  /// \pre rival is kVerlet or kRungeKutta4
  HandWritten(Rival rival, SpringNetwork network);
  RivalRun run(std::span<const double> times, const RivalOptions& options, const RivalSink& sink) override;

 private:
  void step(double t, double h);
  void verlet_step(double t, double h);
  void runge_kutta_step(double t, double h);
  void read_velocity(double h, std::vector<double>& v) const;

  Rival rival_;
  SpringNetwork network_;
  std::vector<double> x_, v_;     // Verlet keeps v half a step ahead
  std::vector<double> f_, x_at_;  // forces, and the positions of a stage
  std::vector<double> a1_, a2_, a3_;
};

}  // namespace freeflex
