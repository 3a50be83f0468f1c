#include "core/structure/modes/sparse/mumps.hpp"

#include <dmumps_c.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <new>

#include "core/faults.hpp"
#include "core/limits.hpp"
#include "core/structure/modes/sparse/solver_library.hpp"

namespace freeflex {
namespace {

// jobs and the communicator of the sequential library (users' guide, section 5)
constexpr int kStart = -1, kEnd = -2, kAnalyse = 1, kFactor = 2, kSolve = 3;
constexpr int kUseWorld = -987654;
void solve_by(DMUMPS_STRUC_C* id) { reinterpret_cast<decltype(&dmumps_c)>(solver_library().mumps)(id); }

// error codes: the workspace was too small
constexpr int kShort = -9, kShortIntegers = -8;
// error codes: allocation failed for reals or integers of the analysis, or for the factorization
constexpr int kNoReals = -5, kNoIntegers = -7, kNoMemory = -13;

// [B] memory that the ordering may need for each entry of the matrix
constexpr std::size_t kOrdering = 256;

bool has_room(std::size_t bytes) {
  void* const room = ::operator new(bytes, std::nothrow);
  ::operator delete(room);
  return room != nullptr;
}

// Makes OpenBLAS allocate its buffer. OpenBLAS keeps this buffer. OpenBLAS would repeat a failing allocation
// without end, so free memory is checked first. Returns false if there is not enough memory.
bool has_blas_its_buffer() {
  static bool has_it = false;
  if (has_it) return true;
  if (!has_room(kBlasBuffer + kBlasBuffer / 8)) return false;
  const int two = 2;
  const double one = 1.0, matrix[] = {1.0, 0.0, 0.0, 1.0};
  double sides[] = {1.0, 0.0, 0.0, 1.0};
  solver_library().dtrsm("L", "L", "N", "N", &two, &two, &one, matrix, &two, sides, &two);
  return has_it = true;
}

}  // namespace

struct Mumps::Instance {
  DMUMPS_STRUC_C id{};
  // parameters, numbered as in the users' guide
  MUMPS_INT& control(int k) { return id.icntl[k - 1]; }
  double& real_control(int k) { return id.cntl[k - 1]; }
  MUMPS_INT info(int k) const { return id.infog[k - 1]; }
};

bool Mumps::call(int job) {
  instance_->id.job = job;
  solve_by(&instance_->id);
  if (instance_->info(1) >= 0) return true;
  const int fault = instance_->info(1);
  if (fault == kNoMemory || fault == kNoReals || fault == kNoIntegers)
    report_lack_of_memory(job == kAnalyse ? "the ordering" : job == kFactor ? "the factor" : "a solution");
  else
    problem_ = join_text("MUMPS stopped with the error code ", fault, ", INFOG(2) = ", instance_->info(2));
  return false;
}

// Sets problem_ for a failed allocation. info(2) is the number of requested entries. If it is negative, its
// magnitude is in millions (users' guide, section 8).
void Mumps::report_lack_of_memory(const char* what) {
  const double asked = instance_->info(2), entries = asked < 0.0 ? -1e6 * asked : asked;
  problem_ = join_text("memory ran out when ", what, " asked for ", std::ceil(8e-6 * entries), " MB");
  if (expected_MB() > 0.0) problem_ += join_text(" of some ", expected_MB(), " MB in all");
  problem_ += kMoreMemory;
}

Mumps::Mumps(SymmetricEntries entries, const std::vector<int>& order)
    : instance_(std::make_unique<Instance>()), entries_(std::move(entries)), given_order_(order) {
  if (problem_ = solver_library().problem; !problem_.empty()) return;
  DMUMPS_STRUC_C& id = instance_->id;
  id.par = 1;
  id.sym = 2;  // symmetric, indefinite
  id.comm_fortran = kUseWorld;
  if (!has_blas_its_buffer()) {
    problem_ =
        join_text("memory ran out, because the BLAS asks for ", kBlasBuffer / 1000000, " MB", kMoreMemory);
    return;
  }
  if (!call(kStart)) return;
  is_started_ = true;
  for (const int stream : {1, 2, 3}) instance_->control(stream) = 0;  // no output
  instance_->control(4) = 0;
  id.n = entries_.size;
  id.nnz = static_cast<MUMPS_INT8>(entries_.values.size());
  id.irn = entries_.rows.data();
  id.jcn = entries_.columns.data();
  id.a = entries_.values.data();
  if (!given_order_.empty()) {
    instance_->control(7) = 1;
    id.perm_in = given_order_.data();
  }
  if (solver_library().reset_random != nullptr) solver_library().reset_random();
  // SCOTCH crashes if memory runs out, so free memory is checked first
  const std::size_t ordering = given_order_.empty() ? kOrdering * entries_.values.size() : 0;
  if (has_room(ordering))
    call(kAnalyse);
  else
    problem_ =
        join_text("memory ran out, because the ordering asks for ", ordering / 1000000, " MB", kMoreMemory);
}

std::vector<int> Mumps::order() const {
  if (!problem_.empty()) return {};
  return {instance_->id.sym_perm, instance_->id.sym_perm + entries_.size};
}

Mumps::~Mumps() {
  if (!is_started_) return;
  instance_->id.job = kEnd;
  solve_by(&instance_->id);
}

double Mumps::expected_MB() const { return static_cast<double>(instance_->info(16)); }

void Mumps::change_values(const std::vector<double>& values) {
  assert(values.size() == entries_.values.size());
  std::copy(values.begin(), values.end(), entries_.values.begin());
}

bool Mumps::factor(double null_threshold) {
  if (!problem_.empty()) return false;
  if (null_threshold > 0.0) {
    instance_->control(24) = 1;
    instance_->real_control(3) = null_threshold;
  }
  // Delayed pivots need more memory than the ordering predicts, so the extra memory [%] is doubled after each
  // failure, up to 16 times the prediction
  for (instance_->control(14) = 50; instance_->control(14) <= 1600; instance_->control(14) *= 2) {
    problem_.clear();
    if (call(kFactor)) return true;
    if (instance_->info(1) != kShort && instance_->info(1) != kShortIntegers) return false;
  }
  return false;
}

bool Mumps::solve(Eigen::Ref<Eigen::MatrixXd> sides) {
  DMUMPS_STRUC_C& id = instance_->id;
  id.nrhs = static_cast<MUMPS_INT>(sides.cols());
  id.lrhs = static_cast<MUMPS_INT>(sides.outerStride());
  id.rhs = sides.data();
  instance_->control(25) = 0;
  instance_->control(27) = -32;  // right-hand sides solved at once
  return call(kSolve);
}

int Mumps::num_negative() const { return instance_->info(12); }

int Mumps::num_null() const { return instance_->info(28); }

}  // namespace freeflex
