// One step of modes that are advanced by splitting, as a linear map.
#pragma once

#include <Eigen/Core>

#include "core/step/plan.hpp"

namespace freeflex {

/// The split step of a plan without loads   (THEORY X76): dashpots and feedback act for half a tick, each
/// mode moves freely for a tick, and they act for the other half. It works on columns (q, q'), with the
/// tables of the plan that the simulation steps by.  \pre the path of the plan is kSplit
class SplitStep {
 public:
  explicit SplitStep(const Plan& plan);

  /// \param from  (2 num_modes x columns)
  Eigen::MatrixXd operator()(const Eigen::MatrixXd& from) const;

  Eigen::Index num_modes() const { return size_.size(); }
  /// Returns the scale of each coordinate [1/s]: its frequency, at least one over the period.
  const Eigen::VectorXd& size() const { return size_; }
  /// Returns what one column costs [flop].
  double cost() const {
    return 16.0 * static_cast<double>(size_.size()) * static_cast<double>(out_.rows() + 1);
  }

 private:
  Eigen::MatrixXd kicked(const Eigen::MatrixXd& q, const Eigen::MatrixXd& v) const;

  Eigen::VectorXd size_;
  Eigen::MatrixXd by_q_, by_q_dot_, out_;
  Eigen::VectorXd qq_, qv_, vq_, vv_;
};

}  // namespace freeflex
