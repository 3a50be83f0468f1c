#include "core/plan/modes/split_step.hpp"

#include <cassert>

namespace freeflex {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace

SplitStep::SplitStep(const StepPlan& plan) {
  assert(plan.modal_coupling.path == PlanModalCoupling::Path::kSplit);
  const Eigen::Index n = plan.num_elastic;
  const auto modal = [&](const Array& rows) -> Eigen::MatrixXd {
    return Eigen::Map<const RowMatrix>(rows.data(), plan.modal_coupling.num_impulses, plan.num_padded)
        .leftCols(n);
  };
  size_ = Eigen::Map<const Eigen::VectorXd>(plan.omega.data(), n).cwiseMax(1.0 / plan.period);
  by_q_ = modal(plan.modal_coupling.impulse_q_rows) * size_.cwiseInverse().asDiagonal();
  by_q_dot_ = modal(plan.modal_coupling.impulse_q_dot_rows);
  out_ = modal(plan.modal_coupling.impulse_out);
  for (auto* each : {&qq_, &qv_, &vq_, &vv_}) each->resize(n);
  const auto take = [&](Eigen::Index l, std::size_t k, const auto& p) {
    qq_[l] = p.c_qq[k] + p.l_qq[k];
    qv_[l] = (p.c_qv[k] + p.l_qv[k]) * size_[l];
    vq_[l] = (p.c_vq[k] + p.l_vq[k]) / size_[l];
  };
  for (Eigen::Index l = 0; l < n; ++l) {
    const auto lane = index(l) / kLanes, k = index(l) % kLanes;
    if (plan.propagator.lanes.empty()) {
      take(l, k, plan.propagator.undamped[lane]);
      vv_[l] = qq_[l];
    } else {
      const Propagator::Lanes& p = plan.propagator.lanes[lane];
      take(l, k, p);
      vv_[l] = p.c_vv[k] + p.l_vv[k];
    }
  }
}

Eigen::MatrixXd SplitStep::operator()(const Eigen::MatrixXd& from) const {
  const Eigen::Index n = size_.size();
  const Eigen::MatrixXd q = from.topRows(n), v = with_impulse(q, from.bottomRows(n));
  Eigen::MatrixXd to(2 * n, from.cols());
  to.topRows(n) = qq_.asDiagonal() * q + qv_.asDiagonal() * v;
  to.bottomRows(n) = with_impulse(to.topRows(n), vq_.asDiagonal() * q + vv_.asDiagonal() * v);
  return to;
}

Eigen::MatrixXd SplitStep::with_impulse(const Eigen::MatrixXd& q, const Eigen::MatrixXd& v) const {
  return v + out_.transpose() * (by_q_ * q + by_q_dot_ * v);
}

}  // namespace freeflex
