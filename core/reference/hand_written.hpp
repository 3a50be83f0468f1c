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
  void start_piece(double start, double h);
  /// One step, and what is read within it by Hermite's cubic.
  void step_and_read(double t, double h, std::span<const double> times, std::size_t& next,
                     const RivalSink& sink);
  void read_velocity(double h, std::vector<double>& v) const;

  Rival rival_;
  SpringNetwork network_;
  std::vector<double> x_, v_;     // Verlet keeps v half a step ahead
  std::vector<double> f_, x_at_;  // forces, and the positions of a stage
  std::vector<double> a1_, a2_, a3_;
  std::vector<double> x0_, v0_, v1_, x_read_,
      v_read_;  // ends of a step that is read within, and what is read
  CartesianState state_;
};

}  // namespace freeflex
