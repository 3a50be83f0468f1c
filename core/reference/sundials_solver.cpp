#include "core/reference/sundials_solver.hpp"

#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace freeflex {

struct SundialsSolver::Members {
  const CartesianSystem* system = nullptr;
  ReferenceOptions options;
  double piece_time = 0.0;  // [s]
  double time = 0.0;        // [s]
  long num_evaluations = 0;
  std::string error;    // the first failure
  std::string message;  // what SUNDIALS said last
  SUNContext context = nullptr;
  N_Vector y = nullptr;
  N_Vector tolerance = nullptr;
  SUNNonlinearSolver fixed_point = nullptr;
  void* erk = nullptr;
  void* cvode = nullptr;

  ~Members();
  /// Notes the first failing call by name; true when flag reports success.
  bool check(int flag, const char* call, char* (*flag_name)(long));
  bool check_created(const void* object, const char* call);
  void set_tolerances(const ElasticScale& scale);
  void start_erk();
  void start_adams();
};

namespace {

// slope of (e, de/dt); both halves are contiguous
int slope(realtype t, N_Vector y, N_Vector y_dot, void* user) {
  auto& members = *static_cast<SundialsSolver::Members*>(user);
  const auto half = static_cast<std::size_t>(N_VGetLength(y)) / 2;
  const double* state = N_VGetArrayPointer(y);
  double* out = N_VGetArrayPointer(y_dot);
  std::copy(state + half, state + 2 * half, out);
  accelerations(*members.system, t, members.piece_time, {state, half}, {state + half, half},
                {out + half, half});
  ++members.num_evaluations;
  // a value that is not finite is unrecoverable: no smaller step repairs it
  return std::all_of(out, out + 2 * half, [](double value) { return std::isfinite(value); }) ? 0 : -1;
}

void keep_message(int, const char*, const char* function, char* text, void* user) {
  static_cast<SundialsSolver::Members*>(user)->message = std::string(function) + ": " + text;
}

/// The method's table with one more stage, of weight zero at the start of the step. SUNDIALS before 6.6 takes
/// every explicit method whose last abscissa is 1 for one whose last stage is the next step's first, and
/// starts the next step from a wrong slope (llnl/sundials issue 311); with this stage last it does not. Costs
/// one evaluation a step.
ARKodeButcherTable with_idle_stage(int stages, int order, int embedded_order, const double* c,
                                   const double* A, const double* b, const double* d) {
  const auto s = static_cast<std::size_t>(stages);
  std::vector<double> c_more(s + 1, 0.0), A_more((s + 1) * (s + 1), 0.0), b_more(s + 1, 0.0),
      d_more(s + 1, 0.0);
  for (std::size_t i = 0; i < s; ++i) {
    c_more[i] = c[i];
    b_more[i] = b[i];
    if (d != nullptr) d_more[i] = d[i];
    for (std::size_t j = 0; j < s; ++j) A_more[i * (s + 1) + j] = A[i * s + j];
  }
  return ARKodeButcherTable_Create(stages + 1, order, embedded_order, c_more.data(), A_more.data(),
                                   b_more.data(), d != nullptr ? d_more.data() : nullptr);
}

/// The classical method of order 4 (Kutta 1901), which SUNDIALS does not list; no embedded method.
ARKodeButcherTable classical_table() {
  constexpr double c[] = {0.0, 0.5, 0.5, 1.0};
  constexpr double A[] = {0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0};
  constexpr double b[] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
  return with_idle_stage(4, 4, 0, c, A, b, nullptr);
}

/// Fehlberg's method of order 8 with an embedded one of order 7 (NASA TR R-287, 1968), from SUNDIALS' own
/// table.
ARKodeButcherTable fehlberg_table() {
  ARKodeButcherTable table = ARKodeButcherTable_LoadERK(ARKODE_FEHLBERG_13_7_8);
  if (table == nullptr) return nullptr;
  const auto s = static_cast<std::size_t>(table->stages);
  std::vector<double> A(s * s);
  for (std::size_t i = 0; i < s; ++i)
    std::copy_n(table->A[i], s, A.begin() + static_cast<std::ptrdiff_t>(i * s));
  ARKodeButcherTable extended =
      with_idle_stage(table->stages, table->q, table->p, table->c, A.data(), table->b, table->d);
  ARKodeButcherTable_Free(table);
  return extended;
}

char* name_of_nothing(long) { return nullptr; }

}  // namespace

SundialsSolver::Members::~Members() {
  if (erk != nullptr) ERKStepFree(&erk);
  if (cvode != nullptr) CVodeFree(&cvode);
  if (fixed_point != nullptr) SUNNonlinSolFree(fixed_point);
  if (tolerance != nullptr) N_VDestroy(tolerance);
  if (y != nullptr) N_VDestroy(y);
  if (context != nullptr) SUNContext_Free(&context);
}

bool SundialsSolver::Members::check(int flag, const char* call, char* (*flag_name)(long)) {
  if (flag >= 0) return true;  // positive flags: stop time reached, warnings
  if (error.empty()) {
    char* name = flag_name(flag);  // allocated by SUNDIALS for the caller
    error =
        std::string(call) + " failed at t = " + std::to_string(time) + " s with flag " + std::to_string(flag);
    if (name != nullptr) error += std::string(" (") + name + ")";
    if (!message.empty()) error += "; " + message;
    std::free(name);
  }
  return false;
}

bool SundialsSolver::Members::check_created(const void* object, const char* call) {
  return check(object != nullptr ? 0 : -1, call, name_of_nothing);
}

void SundialsSolver::Members::set_tolerances(const ElasticScale& scale) {
  double* values = N_VGetArrayPointer(tolerance);
  const auto half = N_VGetLength(y) / 2;
  std::fill(values, values + half, options.tolerance * scale.displacement);
  std::fill(values + half, values + 2 * half, options.tolerance * scale.velocity);
}

// what rounding leaves of large rigid displacements; below this no step is small enough
constexpr double kRelativeTolerance = 1e-15;
constexpr long kNoStepLimit = -1;

void SundialsSolver::Members::start_erk() {
  erk = ERKStepCreate(slope, time, y, context);
  if (!check_created(erk, "ERKStepCreate")) return;
  const auto ok = [this](int flag, const char* call) { return check(flag, call, ERKStepGetReturnFlagName); };
  if (!ok(ERKStepSetErrHandlerFn(erk, keep_message, this), "ERKStepSetErrHandlerFn")) return;
  if (!ok(ERKStepSetUserData(erk, this), "ERKStepSetUserData")) return;
  if (!ok(ERKStepSVtolerances(erk, kRelativeTolerance, tolerance), "ERKStepSVtolerances")) return;
  if (!ok(ERKStepSetMaxNumSteps(erk, kNoStepLimit), "ERKStepSetMaxNumSteps")) return;
  const bool is_fixed = options.fixed_step > 0.0;
  // a method without an embedded one is taken only once the step is fixed
  if (is_fixed && !ok(ERKStepSetFixedStep(erk, options.fixed_step), "ERKStepSetFixedStep")) return;
  ARKodeButcherTable table =
      options.method == ReferenceMethod::kRungeKutta4 ? classical_table() : fehlberg_table();
  if (!check_created(table, "ARKodeButcherTable_Create")) return;
  ok(ERKStepSetTable(erk, table), "ERKStepSetTable");
  ARKodeButcherTable_Free(table);
}

void SundialsSolver::Members::start_adams() {
  cvode = CVodeCreate(CV_ADAMS, context);
  if (!check_created(cvode, "CVodeCreate")) return;
  const auto ok = [this](int flag, const char* call) { return check(flag, call, CVodeGetReturnFlagName); };
  if (!ok(CVodeSetErrHandlerFn(cvode, keep_message, this), "CVodeSetErrHandlerFn")) return;
  if (!ok(CVodeInit(cvode, slope, time, y), "CVodeInit")) return;
  if (!ok(CVodeSetUserData(cvode, this), "CVodeSetUserData")) return;
  if (!ok(CVodeSVtolerances(cvode, kRelativeTolerance, tolerance), "CVodeSVtolerances")) return;
  if (!ok(CVodeSetMaxNumSteps(cvode, kNoStepLimit), "CVodeSetMaxNumSteps")) return;
  fixed_point = SUNNonlinSol_FixedPoint(y, 0, context);
  if (!check_created(fixed_point, "SUNNonlinSol_FixedPoint")) return;
  ok(CVodeSetNonlinearSolver(cvode, fixed_point), "CVodeSetNonlinearSolver");
}

SundialsSolver::SundialsSolver(const CartesianSystem& system, const ReferenceOptions& options,
                               const ElasticScale& scale, double t, double piece_time,
                               const std::vector<double>& y)
    : members_(std::make_unique<Members>()) {
  Members& m = *members_;
  m.system = &system;
  m.options = options;
  m.piece_time = piece_time;
  m.time = t;
  const bool is_adaptive = options.fixed_step <= 0.0;
  if (is_adaptive && options.method == ReferenceMethod::kRungeKutta4)
    m.error = "the classical method needs a fixed step";
  if (!is_adaptive && options.method == ReferenceMethod::kAdams)
    m.error = "the Adams method has no fixed step";
  if (is_adaptive && !(options.tolerance > 0.0)) m.error = "the tolerance must be > 0";
  if (!m.error.empty()) return;
  if (!m.check(SUNContext_Create(nullptr, &m.context), "SUNContext_Create", name_of_nothing)) return;
  const auto size = static_cast<sunindextype>(y.size());
  m.y = N_VNew_Serial(size, m.context);
  m.tolerance = N_VNew_Serial(size, m.context);
  if (!m.check_created(m.y, "N_VNew_Serial") || !m.check_created(m.tolerance, "N_VNew_Serial")) return;
  std::copy(y.begin(), y.end(), N_VGetArrayPointer(m.y));
  // a fixed step uses no tolerance, but SUNDIALS wants weights that are finite
  m.set_tolerances(is_adaptive ? scale : ElasticScale{1.0, 1.0});
  options.method == ReferenceMethod::kAdams ? m.start_adams() : m.start_erk();
}

SundialsSolver::~SundialsSolver() = default;

std::string SundialsSolver::advance(double stop, std::vector<double>& y) {
  Members& m = *members_;
  if (!m.error.empty()) return m.error;
  realtype reached = m.time;
  if (m.cvode != nullptr) {
    const auto ok = [&m](int flag, const char* call) { return m.check(flag, call, CVodeGetReturnFlagName); };
    if (!ok(CVodeSetStopTime(m.cvode, stop), "CVodeSetStopTime")) return m.error;
    if (!ok(CVode(m.cvode, stop, m.y, &reached, CV_NORMAL), "CVode")) return m.error;
  } else {
    const auto ok = [&m](int flag, const char* call) {
      return m.check(flag, call, ERKStepGetReturnFlagName);
    };
    if (m.options.fixed_step > 0.0) {
      // whole steps to the stop; the slack keeps rounding from adding one
      const double span = stop - m.time;
      const double steps = std::ceil(span / m.options.fixed_step * (1.0 - 1e-9));
      if (!ok(ERKStepSetFixedStep(m.erk, span / steps), "ERKStepSetFixedStep")) return m.error;
    }
    if (!ok(ERKStepSetStopTime(m.erk, stop), "ERKStepSetStopTime")) return m.error;
    if (!ok(ERKStepEvolve(m.erk, stop, m.y, &reached, ARK_NORMAL), "ERKStepEvolve")) return m.error;
  }
  m.time = stop;
  if (std::abs(reached - stop) > 1e-12 * std::max(1.0, std::abs(stop))) {
    m.error = "stopped at t = " + std::to_string(reached) + " s before " + std::to_string(stop) + " s";
    return m.error;
  }
  std::copy_n(N_VGetArrayPointer(m.y), y.size(), y.begin());
  return {};
}

long SundialsSolver::num_evaluations() const { return members_->num_evaluations; }

}  // namespace freeflex
