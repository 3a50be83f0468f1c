// Step of modes that are advanced by splitting, as a linear map.
#pragma once

#include <Eigen/Core>

#include "core/plan.hpp"

namespace freeflex {

/// Makes the split step of a plan without loads, S = S_c(h/2) S_m(h) S_c(h/2)   (THEORY 8.38): dashpots and
/// feedback act for half a tick (S_c, THEORY 8.40), each mode moves freely for a tick (S_m, THEORY 6.1), and
/// dashpots and feedback act for another half tick. The map acts on columns (q, q') and uses the tables of
/// the plan, as the simulation does. The error of the split step (THEORY 8.45) is computed with this map.
/// \pre the path of the plan is kSplit
class SplitStep {
 public:
  explicit SplitStep(const StepPlan& plan);

  /// Returns the states after one tick.
  /// \param from  (2 num_modes x columns) states (q, q') before the tick, one in each column
  Eigen::MatrixXd operator()(const Eigen::MatrixXd& from) const;

  Eigen::Index num_modes() const { return size_.size(); }
  /// Returns the scale of each coordinate [1/s]. The scale is the frequency of the coordinate's mode, but at
  /// least 1 / period.
  const Eigen::VectorXd& size() const { return size_; }
  /// Returns the number of operations for one column [flop].
  double cost() const {
    return 16.0 * static_cast<double>(size_.size()) * static_cast<double>(out_.rows() + 1);
  }

 private:
  Eigen::MatrixXd with_impulse(const Eigen::MatrixXd& q, const Eigen::MatrixXd& v) const;

  Eigen::VectorXd size_;
  Eigen::MatrixXd by_q_, by_q_dot_, out_;
  Eigen::VectorXd qq_, qv_, vq_, vv_;
};

}  // namespace freeflex
