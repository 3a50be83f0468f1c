// The common part of the hand-written methods of fixed step on the full system   (THEORY 13.2 to 13.6,
// 13.20).
#pragma once

#include <memory>
#include <vector>

#include "tools/verification/reference/rivals.hpp"
#include "tools/verification/reference/second_order_system.hpp"

namespace freeflex {

/// The properties of a hand-written method, which the loop over its steps uses.
struct HandTraits {
  long evaluations;    // number of evaluations of the forces in one step
  std::size_t arrays;  // number of arrays of 3N numbers that a step uses
  double lead;         // [-] time by which v is ahead of x, as a fraction of the step
  bool keeps_forces;   // true: between steps f holds the forces at x; so each piece needs one more evaluation
  bool reads_by_quintic;  // true: interpolates from x, v and a at both ends of a step; false: from x and v
};

/// Steps through the smooth pieces of a motion, and computes the motion within a step by Hermite's
/// interpolation.
class HandWritten : public RivalMethod {
 public:
  RivalRun run(std::span<const double> times, const RivalOptions& options, const RivalSink& sink) override;

 protected:
  HandWritten(const HandTraits& traits, std::unique_ptr<SecondOrderSystem> system);
  /// Advances x_, v_ and f_ from t to t + h [s].
  virtual void step(double t, double h) = 0;

  HandTraits traits_;
  std::unique_ptr<SecondOrderSystem> system_;
  std::vector<double> x_, v_, f_;  // [m], [m/s], [N] (3N each)

 private:
  /// Holds x, v and a at one end of a step.
  struct End {
    std::vector<double> x, v, a;
  };
  void start_piece(double start, double h);
  void read_end(double h, End& end) const;
  /// Takes one step and interpolates the motion at the requested times within the step.
  void step_and_read(double t, double h, std::span<const double> times, std::size_t& next,
                     const RivalSink& sink);

  End start_, end_;  // ends of a step within which the motion is interpolated
  std::vector<double> x_read_, v_read_;
  CartesianState state_;
};

/// Makes a hand-written method.  \pre is_by_hand(rival)
std::unique_ptr<HandWritten> make_hand_written(Rival rival, std::unique_ptr<SecondOrderSystem> system);

}  // namespace freeflex
