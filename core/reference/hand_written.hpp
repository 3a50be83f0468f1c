// Methods of fixed step by hand on the full system: what they share   (THEORY X111, X112, X130, X131).
#pragma once

#include <memory>
#include <vector>

#include "core/reference/rivals.hpp"
#include "core/reference/spring_network.hpp"

namespace freeflex {

/// What a method by hand is to the loop over its steps.
struct HandTraits {
  long evaluations;       // of the forces in a step
  std::size_t arrays;     // of 3N numbers that its steps use
  double lead;            // [-] of a step: how far v runs ahead of x
  bool keeps_forces;      // f holds the forces at x between steps, so a piece begins with one evaluation
  bool reads_by_quintic;  // between steps: x, v and a at both ends; else x and v
};

/// Steps through the smooth pieces and reads within a step by Hermite's interpolation.
class HandWritten : public RivalMethod {
 public:
  RivalRun run(std::span<const double> times, const RivalOptions& options, const RivalSink& sink) override;

 protected:
  HandWritten(const HandTraits& traits, SpringNetwork network);
  /// x_, v_ and f_ from t to t + h [s].
  virtual void step(double t, double h) = 0;

  HandTraits traits_;
  SpringNetwork network_;
  std::vector<double> x_, v_, f_;  // [m], [m/s], [N] (3N each)

 private:
  /// v and a of x_ itself, from v_ and f_.
  struct End {
    std::vector<double> x, v, a;
  };
  void start_piece(double start, double h);
  void read_end(double h, End& end) const;
  /// One step, and what is read within it.
  void step_and_read(double t, double h, std::span<const double> times, std::size_t& next,
                     const RivalSink& sink);

  End start_, end_;  // of a step that is read within
  std::vector<double> x_read_, v_read_;
  CartesianState state_;
};

/// \pre rival is one of those by hand
std::unique_ptr<HandWritten> make_hand_written(Rival rival, SpringNetwork network);

}  // namespace freeflex
