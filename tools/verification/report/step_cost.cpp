#include "tools/verification/report/step_cost.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

#include "core/motion.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/linear/modal_coupling.hpp"
#include "core/step/readout.hpp"

namespace freeflex::tools {
namespace {

// returns the smallest time of a call [ns] among several short batches, because disturbances only lengthen a
// batch
template <typename Work>
double ns_per_call(const Work& work) {
  using Clock = std::chrono::steady_clock;
  constexpr int kBatches = 9;
  constexpr double kBatchNs = 4e5;
  int calls = 8;
  double least = std::numeric_limits<double>::infinity();
  for (int batch = 0; batch < kBatches; ++batch) {
    const auto start = Clock::now();
    for (int k = 0; k < calls; ++k) work();
    const double taken = std::chrono::duration<double, std::nano>(Clock::now() - start).count();
    least = std::min(least, taken / calls);
    calls = static_cast<int>(std::clamp(kBatchNs / std::max(least, 1.0), 4.0, 1e6));
  }
  return least;
}

// returns the plan without its elastic coordinates
Plan rigid_part(const Plan& plan) {
  Plan rigid = plan;
  rigid.fallback.clear();
  rigid.verdict = {};
  rigid.num_elastic = rigid.num_moving = rigid.num_padded = 0;
  rigid.propagator = {};
  rigid.modal_coupling = {};
  rigid.feedbacks.clear();
  for (Array* array : {&rigid.omega, &rigid.decay, &rigid.rows, &rigid.eckart_rows, &rigid.link_rows,
                       &rigid.field_rows, &rigid.initial.q, &rigid.initial.q_dot})
    array->clear();
  for (PlanHistory& history : rigid.histories) {
    history.followers.clear();
    history.torques.clear();
    history.stiffening = {};
    history.pattern.num_direct = 0;
    history.pattern.uses_table = false;
    history.pattern.table.clear();
    history.pattern.Q_B.clear();
  }
  return rigid;
}

// costs of one pass over the modes [ns]
struct Constants {
  double modes = 0.0;                           // advance of all modes
  double direct = 0.0, table = 0.0, row = 0.0;  // projection of a point, of a table, of one row
  double dot = 0.0;                             // sum over one row
};

Constants measure(const Plan& plan) {
  Constants constants;
  const std::size_t n = index(plan.num_padded);
  if (n == 0) return constants;
  State state = make_state(plan);
  Array next_q(n), next_q_low(n), next_q_dot(n), next_q_dot_low(n), rows(9 * n, 1e-3), Q(n);
  const ModalState from{state.q.data(), state.q_low.data(), state.q_dot.data(), state.q_dot_low.data()};
  const ModalResult to{next_q.data(), next_q_low.data(), next_q_dot.data(), next_q_dot_low.data()};
  const Mat3 weights{1.0, 0.5, 0.25, 0.5, 1.0, 0.5, 0.25, 0.5, 1.0};
  bool is_finite = true;
  double sum = 0.0;
  constants.modes = ns_per_call([&] {
    is_finite &= advance_modes(plan.propagator, index(plan.num_moving), from, Q.data(), Q.data(), to);
  });
  constants.direct = ns_per_call([&] { combine_rows(rows.data(), {0.48, 0.6, 0.64}, false, n, Q.data()); });
  constants.table = ns_per_call([&] { combine_table(rows.data(), weights, false, n, Q.data()); });
  constants.row = ns_per_call([&] { combine_one(rows.data(), 0.5, false, n, Q.data()); });
  constants.dot = ns_per_call([&] { sum += dot_lanes(rows.data(), Q.data(), n); });
  // uses the results, so that the compiler does not remove the calls
  if (!is_finite && sum == 0.0) constants.modes = 0.0;
  return constants;
}

double pattern_cost(const LoadPattern& pattern, const Constants& constants) {
  return (pattern.uses_table ? constants.table : 0.0) + pattern.num_direct * constants.direct +
         (pattern.has_body ? constants.row : 0.0);
}

double coupling_cost(const Plan& plan, const Constants& constants) {
  const PlanModalCoupling& modal_coupling = plan.modal_coupling;
  const double num_modes = std::max(1.0, static_cast<double>(plan.num_padded));
  double cost = 0.0;
  for (const PlanHistory& history : plan.histories)
    cost += 4.0 * static_cast<double>(history.followers.size()) * (3.0 * constants.dot + constants.direct);
  if (modal_coupling.path == PlanModalCoupling::Path::kNone) return cost;
  const auto coupled = static_cast<double>(modal_coupling.modes.size());
  if (modal_coupling.path == PlanModalCoupling::Path::kExact)
    cost += 4.0 * coupled * constants.row * (2.0 * coupled / num_modes);
  else
    cost += 2.0 * modal_coupling.num_impulses * (2.0 * constants.dot + constants.row);
  cost += modal_coupling.num_damping * (constants.dot + constants.row);
  cost += 3.0 * static_cast<double>(plan.feedbacks.size()) * (6.0 * constants.dot + constants.direct);
  return cost;
}

double measured_step(const StepPlan& stepped) {
  constexpr double kLong = 2e6;  // [ns] a measurement that takes longer is not repeated
  Plan plan;
  static_cast<StepPlan&>(plan) = stepped;
  Motion motion(plan, kMotionAlone);
  const auto once = [&] { motion.advance(); };
  const auto start = std::chrono::steady_clock::now();
  once();
  const double first =
      std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count();
  return first > kLong ? first : ns_per_call(once);
}

double reading_cost(const Plan& plan) {
  const auto with_rows = std::find_if(plan.points.begin(), plan.points.end(),
                                      [](const PlanPoint& point) { return point.row >= 0; });
  if (with_rows == plan.points.end()) return 0.0;
  const State initial = make_state(plan);
  double sum = 0.0;
  const int point = static_cast<int>(with_rows - plan.points.begin());
  const double cost = ns_per_call([&] { sum += read_point(plan, initial, point).p_W[0]; });
  // uses the results, so that the compiler does not remove the calls
  return sum == sum ? cost : 0.0;
}

}  // namespace

StepCost predict_step(const Plan& plan) {
  StepCost cost;
  for (const PlanShadow& shadow : plan.verdict.shadows)
    cost.shadow =
        measured_step(shadow.plan) * shadow.substeps / static_cast<double>(shadow.ticks * shadow.every);
  if (is_coupled(plan)) {
    cost.stages = measured_step(plan);
    cost.point = reading_cost(plan);
    return cost;
  }
  const Plan bare = rigid_part(plan);
  Motion motion(bare, kMotionAlone);
  cost.rigid = ns_per_call([&] { motion.advance(); });
  if (plan.num_padded == 0) return cost;

  const Constants constants = measure(plan);
  const bool has_dependent = has_dependent_loads(plan);
  cost.modes = constants.modes;
  for (const PlanHistory& history : plan.histories) cost.loads += pattern_cost(history.pattern, constants);
  if (plan.histories.empty()) cost.loads = constants.row;  // the loads are cleared at each tick
  if (plan.has_spin_load || plan.attractor_mu > 0.0) cost.fields = 6.0 * constants.row;
  // normally the loads at the start of a step are reused from the end of the step before. Modal coupling
  // evaluates the loads at both ends of the step. If loads depend on the result of the step, the step is also
  // executed twice, and the loads are evaluated three times
  if (has_dependent || plan.modal_coupling.path != PlanModalCoupling::Path::kNone) {
    cost.loads *= has_dependent ? 3.0 : 2.0;
    cost.fields *= has_dependent ? 3.0 : 2.0;
    if (has_dependent) cost.modes *= 2.0;
  }
  cost.coupling = coupling_cost(plan, constants);
  cost.push = plan.has_rotation ? constants.direct : constants.row;
  cost.point = reading_cost(plan);
  return cost;
}

}  // namespace freeflex::tools
