#include "tools/verification/reference/sundials_solver.hpp"

#include <arkode/arkode_arkstep.h>
#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_klu.h>
#include <sunmatrix/sunmatrix_sparse.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace freeflex {

struct SundialsSolver::Members {
  const SmoothProblem* problem = nullptr;
  ReferenceOptions options;
  double time = 0.0;  // [s]
  long num_evaluations = 0;
  std::string error;    // the first failure
  std::string message;  // the last message of SUNDIALS
  SUNContext context = nullptr;
  N_Vector y = nullptr;
  N_Vector tolerance = nullptr;
  SUNNonlinearSolver fixed_point = nullptr;
  SUNMatrix matrix = nullptr;
  SUNLinearSolver klu = nullptr;
  void* erk = nullptr;  // one of these three is in use
  void* dirk = nullptr;
  void* cvode = nullptr;

  ~Members();
  /// Stores the name of the first call that fails. Returns whether `flag` reports success.
  bool check(int flag, const char* call, char* (*flag_name)(long));
  bool check_created(const void* object, const char* call);
  void set_tolerances(const ElasticScale& scale);
  bool make_linear_solver();
  void start_erk();
  void start_dirk();
  void start_cvode();
  bool set_stop(double stop);
  /// Integrates until y at `target` is known. Interpolates if a step passes `target`.
  bool evolve(double target);
};

namespace {

int slope(realtype t, N_Vector y, N_Vector y_dot, void* user) {
  constexpr long kLookEvery = 256;  // number of evaluations between two checks of is_stopped
  auto& members = *static_cast<SundialsSolver::Members*>(user);
  const auto size = index(N_VGetLength(y));
  double* out = N_VGetArrayPointer(y_dot);
  // after a failure an implicit method tries again with a shorter step, so every evaluation after a stop must
  // fail
  if (members.message == "stopped") return -1;
  members.problem->slope(t, {N_VGetArrayPointer(y), size}, {out, size});
  if (++members.num_evaluations % kLookEvery == 0 && members.problem->is_stopped &&
      members.problem->is_stopped()) {
    members.message = "stopped";
    return -1;
  }
  // if a trial step is too long, joints may find no equilibrium; a positive value asks for a shorter step
  return std::all_of(out, out + size, [](double value) { return std::isfinite(value); }) ? 0 : 1;
}

int jacobian(realtype, N_Vector y, N_Vector, SUNMatrix J, void* user, N_Vector, N_Vector, N_Vector) {
  const SmoothProblem& problem = *static_cast<SundialsSolver::Members*>(user)->problem;
  std::copy(problem.column_starts.begin(), problem.column_starts.end(), SUNSparseMatrix_IndexPointers(J));
  std::copy(problem.rows.begin(), problem.rows.end(), SUNSparseMatrix_IndexValues(J));
  problem.jacobian({N_VGetArrayPointer(y), index(N_VGetLength(y))},
                   {SUNSparseMatrix_Data(J), problem.rows.size()});
  return 0;
}

void keep_message(int, const char*, const char* function, char* text, void* user) {
  std::string& message = static_cast<SundialsSolver::Members*>(user)->message;
  if (message != "stopped") message = std::string(function) + ": " + text;
}

/// Returns the table of a method with one additional, idle stage, which has weight zero and is at the start
/// of the step. If the last abscissa of an explicit method is 1, SUNDIALS before 6.6 takes the last stage of
/// a step as the first stage of the next step, and so starts the next step from a wrong slope (llnl/sundials
/// issue 311). With the idle stage the last abscissa is 0. The idle stage costs one evaluation in each step.
ARKodeButcherTable with_idle_stage(int stages, int order, int embedded_order, const double* c,
                                   const double* A, const double* b, const double* d) {
  const auto s = index(stages);
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

/// Returns the table of the classical method of order 4 (Kutta 1901), because SUNDIALS does not contain this
/// method. The table has no embedded method.
ARKodeButcherTable classical_table() {
  constexpr double c[] = {0.0, 0.5, 0.5, 1.0};
  constexpr double A[] = {0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0};
  constexpr double b[] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
  return with_idle_stage(4, 4, 0, c, A, b, nullptr);
}

/// Returns the table of Fehlberg's method of order 8 with an embedded method of order 7 (NASA TR R-287,
/// 1968), from SUNDIALS' own table.
ARKodeButcherTable fehlberg_table() {
  ARKodeButcherTable table = ARKodeButcherTable_LoadERK(ARKODE_FEHLBERG_13_7_8);
  if (table == nullptr) return nullptr;
  const auto s = index(table->stages);
  std::vector<double> A(s * s);
  for (std::size_t i = 0; i < s; ++i)
    std::copy_n(table->A[i], s, A.begin() + static_cast<std::ptrdiff_t>(i * s));
  ARKodeButcherTable extended =
      with_idle_stage(table->stages, table->q, table->p, table->c, A.data(), table->b, table->d);
  ARKodeButcherTable_Free(table);
  return extended;
}

char* no_name(long) { return nullptr; }

}  // namespace

SundialsSolver::Members::~Members() {
  if (erk != nullptr) ERKStepFree(&erk);
  if (dirk != nullptr) ARKStepFree(&dirk);
  if (cvode != nullptr) CVodeFree(&cvode);
  if (klu != nullptr) SUNLinSolFree(klu);
  if (matrix != nullptr) SUNMatDestroy(matrix);
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
  return check(object != nullptr ? 0 : -1, call, no_name);
}

void SundialsSolver::Members::set_tolerances(const ElasticScale& scale) {
  double* values = N_VGetArrayPointer(tolerance);
  const auto half = N_VGetLength(y) / 2;
  std::fill(values, values + half, options.tolerance * scale.displacement);
  std::fill(values + half, values + 2 * half, options.tolerance * scale.velocity);
}

// [-] relative rounding error of large rigid displacements. If the tolerance were smaller, no step would be
// small enough
constexpr double kRelativeTolerance = 1e-15;

bool SundialsSolver::Members::make_linear_solver() {
  if (!problem->jacobian) {
    error = "an implicit method needs a Jacobian";
    return false;
  }
  const auto size = N_VGetLength(y);
  matrix = SUNSparseMatrix(size, size, static_cast<sunindextype>(problem->rows.size()), CSC_MAT, context);
  if (!check_created(matrix, "SUNSparseMatrix")) return false;
  klu = SUNLinSol_KLU(y, matrix, context);
  return check_created(klu, "SUNLinSol_KLU");
}

void SundialsSolver::Members::start_erk() {
  erk = ERKStepCreate(slope, time, y, context);
  if (!check_created(erk, "ERKStepCreate")) return;
  const auto ok = [this](int flag, const char* call) { return check(flag, call, ERKStepGetReturnFlagName); };
  if (!ok(ERKStepSetErrHandlerFn(erk, keep_message, this), "ERKStepSetErrHandlerFn")) return;
  if (!ok(ERKStepSetUserData(erk, this), "ERKStepSetUserData")) return;
  if (!ok(ERKStepSVtolerances(erk, kRelativeTolerance, tolerance), "ERKStepSVtolerances")) return;
  if (!ok(ERKStepSetMaxNumSteps(erk, options.max_steps), "ERKStepSetMaxNumSteps")) return;
  const bool is_fixed = options.fixed_step > 0.0;
  // SUNDIALS accepts a table without an embedded method only if the step is fixed before
  if (is_fixed && !ok(ERKStepSetFixedStep(erk, options.fixed_step), "ERKStepSetFixedStep")) return;
  if (options.method == ReferenceMethod::kZonneveld43) {
    ok(ERKStepSetTableNum(erk, ARKODE_ZONNEVELD_5_3_4), "ERKStepSetTableNum");
    return;
  }
  ARKodeButcherTable table =
      options.method == ReferenceMethod::kRungeKutta4 ? classical_table() : fehlberg_table();
  if (!check_created(table, "ARKodeButcherTable_Create")) return;
  ok(ERKStepSetTable(erk, table), "ERKStepSetTable");
  ARKodeButcherTable_Free(table);
}

void SundialsSolver::Members::start_dirk() {
  dirk = ARKStepCreate(nullptr, slope, time, y, context);
  if (!check_created(dirk, "ARKStepCreate")) return;
  const auto ok = [this](int flag, const char* call) { return check(flag, call, ARKStepGetReturnFlagName); };
  if (!ok(ARKStepSetErrHandlerFn(dirk, keep_message, this), "ARKStepSetErrHandlerFn")) return;
  if (!ok(ARKStepSetUserData(dirk, this), "ARKStepSetUserData")) return;
  if (!ok(ARKStepSVtolerances(dirk, kRelativeTolerance, tolerance), "ARKStepSVtolerances")) return;
  if (!ok(ARKStepSetMaxNumSteps(dirk, options.max_steps), "ARKStepSetMaxNumSteps")) return;
  if (!ok(ARKStepSetTableNum(dirk, ARKODE_ARK548L2SA_DIRK_8_4_5, ARKODE_ERK_NONE), "ARKStepSetTableNum"))
    return;
  if (!make_linear_solver()) return;
  if (!ok(ARKStepSetLinearSolver(dirk, klu, matrix), "ARKStepSetLinearSolver")) return;
  ok(ARKStepSetJacFn(dirk, jacobian), "ARKStepSetJacFn");
}

void SundialsSolver::Members::start_cvode() {
  const bool is_adams = options.method == ReferenceMethod::kAdams;
  cvode = CVodeCreate(is_adams ? CV_ADAMS : CV_BDF, context);
  if (!check_created(cvode, "CVodeCreate")) return;
  const auto ok = [this](int flag, const char* call) { return check(flag, call, CVodeGetReturnFlagName); };
  if (!ok(CVodeSetErrHandlerFn(cvode, keep_message, this), "CVodeSetErrHandlerFn")) return;
  if (!ok(CVodeInit(cvode, slope, time, y), "CVodeInit")) return;
  if (!ok(CVodeSetUserData(cvode, this), "CVodeSetUserData")) return;
  if (!ok(CVodeSVtolerances(cvode, kRelativeTolerance, tolerance), "CVodeSVtolerances")) return;
  if (!ok(CVodeSetMaxNumSteps(cvode, options.max_steps), "CVodeSetMaxNumSteps")) return;
  if (is_adams) {
    fixed_point = SUNNonlinSol_FixedPoint(y, 0, context);
    if (!check_created(fixed_point, "SUNNonlinSol_FixedPoint")) return;
    ok(CVodeSetNonlinearSolver(cvode, fixed_point), "CVodeSetNonlinearSolver");
    return;
  }
  if (!make_linear_solver()) return;
  if (!ok(CVodeSetLinearSolver(cvode, klu, matrix), "CVodeSetLinearSolver")) return;
  ok(CVodeSetJacFn(cvode, jacobian), "CVodeSetJacFn");
}

SundialsSolver::SundialsSolver(const SmoothProblem& problem, const ReferenceOptions& options,
                               const ElasticScale& scale, double t, const std::vector<double>& y)
    : members_(std::make_unique<Members>()) {
  Members& m = *members_;
  m.problem = &problem;
  m.options = options;
  m.time = t;
  const bool is_adaptive = options.fixed_step <= 0.0;
  const bool is_explicit =
      options.method == ReferenceMethod::kRungeKutta4 || options.method == ReferenceMethod::kFehlberg78;
  if (is_adaptive && options.method == ReferenceMethod::kRungeKutta4)
    m.error = "the classical method needs a fixed step";
  if (!is_adaptive && !is_explicit) m.error = "this method has no fixed step";
  if (is_adaptive && !(options.tolerance > 0.0)) m.error = "the tolerance must be > 0";
  if (!m.error.empty()) return;
  if (!m.check(SUNContext_Create(nullptr, &m.context), "SUNContext_Create", no_name)) return;
  const auto size = static_cast<sunindextype>(y.size());
  m.y = N_VNew_Serial(size, m.context);
  m.tolerance = N_VNew_Serial(size, m.context);
  if (!m.check_created(m.y, "N_VNew_Serial") || !m.check_created(m.tolerance, "N_VNew_Serial")) return;
  std::copy(y.begin(), y.end(), N_VGetArrayPointer(m.y));
  // a fixed step uses no tolerance, but SUNDIALS needs finite weights
  m.set_tolerances(is_adaptive ? scale : ElasticScale{1.0, 1.0});
  if (options.method == ReferenceMethod::kAdams || options.method == ReferenceMethod::kBdf)
    m.start_cvode();
  else
    options.method == ReferenceMethod::kDirk5 ? m.start_dirk() : m.start_erk();
}

SundialsSolver::~SundialsSolver() = default;

bool SundialsSolver::Members::set_stop(double stop) {
  if (cvode != nullptr)
    return check(CVodeSetStopTime(cvode, stop), "CVodeSetStopTime", CVodeGetReturnFlagName);
  if (dirk != nullptr)
    return check(ARKStepSetStopTime(dirk, stop), "ARKStepSetStopTime", ARKStepGetReturnFlagName);
  return check(ERKStepSetStopTime(erk, stop), "ERKStepSetStopTime", ERKStepGetReturnFlagName);
}

bool SundialsSolver::Members::evolve(double target) {
  realtype reached = time;
  const bool ok = cvode != nullptr
                      ? check(CVode(cvode, target, y, &reached, CV_NORMAL), "CVode", CVodeGetReturnFlagName)
                  : dirk != nullptr ? check(ARKStepEvolve(dirk, target, y, &reached, ARK_NORMAL),
                                            "ARKStepEvolve", ARKStepGetReturnFlagName)
                                    : check(ERKStepEvolve(erk, target, y, &reached, ARK_NORMAL),
                                            "ERKStepEvolve", ERKStepGetReturnFlagName);
  if (!ok) return false;
  time = target;
  if (std::abs(reached - target) <= 1e-12 * std::max(1.0, std::abs(target))) return true;
  error = "the solver stopped at t = " + std::to_string(reached) + " s, but had to reach " +
          std::to_string(target) + " s";
  return false;
}

std::string SundialsSolver::advance(double stop, std::vector<double>& y) {
  Members& m = *members_;
  if (!m.error.empty()) return m.error;
  if (m.options.fixed_step > 0.0) {
    // The number of whole steps up to `stop`. The slack of 1e-9 prevents a rounding error from adding a step
    const double span = stop - m.time;
    const double steps = std::ceil(span / m.options.fixed_step * (1.0 - 1e-9));
    if (!m.check(ERKStepSetFixedStep(m.erk, span / steps), "ERKStepSetFixedStep", ERKStepGetReturnFlagName))
      return m.error;
  }
  return interpolate(stop, stop, y);
}

std::string SundialsSolver::interpolate(double time, double end, std::vector<double>& y) {
  Members& m = *members_;
  if (!m.error.empty()) return m.error;
  if (!m.set_stop(end) || !m.evolve(time)) return m.error;
  std::copy_n(N_VGetArrayPointer(m.y), y.size(), y.begin());
  return {};
}

long SundialsSolver::num_evaluations() const { return members_->num_evaluations; }

long SundialsSolver::num_steps() const {
  long steps = 0;
  const Members& m = *members_;
  // these calls only read a counter of an object that exists
  if (m.cvode != nullptr) static_cast<void>(CVodeGetNumSteps(m.cvode, &steps));
  if (m.dirk != nullptr) static_cast<void>(ARKStepGetNumSteps(m.dirk, &steps));
  if (m.erk != nullptr) static_cast<void>(ERKStepGetNumSteps(m.erk, &steps));
  return steps;
}

std::size_t SundialsSolver::memory() const {
  long reals = 0, integers = 0, solver_reals = 0, solver_integers = 0;
  const Members& m = *members_;
  if (m.cvode != nullptr) static_cast<void>(CVodeGetWorkSpace(m.cvode, &reals, &integers));
  if (m.dirk != nullptr) static_cast<void>(ARKStepGetWorkSpace(m.dirk, &reals, &integers));
  if (m.erk != nullptr) static_cast<void>(ERKStepGetWorkSpace(m.erk, &reals, &integers));
  if (m.klu != nullptr) static_cast<void>(SUNLinSolSpace(m.klu, &solver_reals, &solver_integers));
  // the matrix and its saved copy
  const std::size_t matrices =
      m.matrix != nullptr ? 2 * (sizeof(double) + sizeof(sunindextype)) * index(SUNSparseMatrix_NNZ(m.matrix))
                          : 0;
  return matrices + sizeof(double) * index(reals + solver_reals) +
         sizeof(sunindextype) * index(integers + solver_integers);
}

}  // namespace freeflex
