#include "core/structure/mumps.hpp"

#include <dmumps_c.h>

#include <algorithm>

#include "core/scene/faults.hpp"
#include "core/structure/solver_library.hpp"

namespace freeflex {
namespace {

// jobs and the communicator of the sequential library (users' guide, section 5)
constexpr int kStart = -1, kEnd = -2, kAnalyse = 1, kFactor = 2, kSolve = 3;
constexpr int kUseWorld = -987654;
void solve_by(DMUMPS_STRUC_C* id) { reinterpret_cast<decltype(&dmumps_c)>(solver_library().mumps)(id); }

// error: the workspace was too small
constexpr int kShort = -9, kShortIntegers = -8, kNoMemory = -13;

}  // namespace

struct Mumps::Instance {
  DMUMPS_STRUC_C id{};
  // parameters by the numbers of the users' guide
  MUMPS_INT& control(int k) { return id.icntl[k - 1]; }
  double& real_control(int k) { return id.cntl[k - 1]; }
  MUMPS_INT info(int k) const { return id.infog[k - 1]; }
};

bool Mumps::call(int job) {
  instance_->id.job = job;
  solve_by(&instance_->id);
  if (instance_->info(1) >= 0) return true;
  problem_ = instance_->info(1) == kNoMemory
                 ? std::string("there is not enough memory")
                 : join_text("MUMPS stopped with ", instance_->info(1), ", ", instance_->info(2));
  return false;
}

Mumps::Mumps(SymmetricEntries entries, const std::vector<int>& order)
    : instance_(std::make_unique<Instance>()), entries_(std::move(entries)), given_order_(order) {
  if (problem_ = solver_library().problem; !problem_.empty()) return;
  DMUMPS_STRUC_C& id = instance_->id;
  id.par = 1;
  id.sym = 2;  // symmetric, indefinite
  id.comm_fortran = kUseWorld;
  if (!call(kStart)) return;
  for (const int stream : {1, 2, 3}) instance_->control(stream) = 0;  // prints nothing
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
  call(kAnalyse);
}

std::vector<int> Mumps::order() const {
  if (!problem_.empty()) return {};
  return {instance_->id.sym_perm, instance_->id.sym_perm + entries_.size};
}

Mumps::~Mumps() {
  if (!solver_library().problem.empty()) return;
  instance_->id.job = kEnd;
  solve_by(&instance_->id);
}

double Mumps::expected_MB() const { return static_cast<double>(instance_->info(16)); }

bool Mumps::factor(double null_threshold) {
  if (!problem_.empty()) return false;
  if (null_threshold > 0.0) {
    instance_->control(24) = 1;
    instance_->real_control(3) = null_threshold;
  }
  // delayed pivots need more than the ordering foresees: twice the room each time, at most 16 times
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
  instance_->control(27) = -32;  // right sides at once
  return call(kSolve);
}

int Mumps::num_negative() const { return instance_->info(12); }

int Mumps::num_null() const { return instance_->info(28); }

}  // namespace freeflex
