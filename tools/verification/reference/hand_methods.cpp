// Steps of the hand-written methods   (THEORY 13.2 to 13.6, 13.20).
#include <algorithm>
#include <array>
#include <cassert>
#include <iterator>
#include <utility>

#include "tools/verification/reference/hand_written.hpp"

namespace freeflex {
namespace {

// Passes over arrays of n numbers. Each pass is a function of its own, because the compiler honours
// __restrict on parameters only, and without __restrict it does not vectorise loops over so many arrays.

/// x += s v
void drift(std::size_t n, double s, const double* __restrict v, double* __restrict x) {
  for (std::size_t i = 0; i < n; ++i) x[i] += s * v[i];
}

/// v += s M^-1 f
void accelerate(std::size_t n, double s, const double* __restrict inverse_mass, const double* __restrict f,
                double* __restrict v) {
  for (std::size_t i = 0; i < n; ++i) v[i] += s * (inverse_mass[i] * f[i]);
}

/// Computes the acceleration a = M^-1 f of a stage and the positions at the next stage:
///   at = x + s v + s2 a_before, without the last term if a_before is null   (THEORY 13.3)
void stage(std::size_t n, double s, double s2, const double* __restrict inverse_mass,
           const double* __restrict f, const double* __restrict x, const double* __restrict v,
           const double* __restrict a_before, double* __restrict a, double* __restrict at) {
  if (a_before == nullptr) {
    for (std::size_t i = 0; i < n; ++i) a[i] = inverse_mass[i] * f[i], at[i] = x[i] + s * v[i];
    return;
  }
  for (std::size_t i = 0; i < n; ++i) {
    a[i] = inverse_mass[i] * f[i];
    at[i] = x[i] + s * v[i] + s2 * a_before[i];
  }
}

/// Velocity Verlet, composed over the fractions gamma_k of the step, which are given as `weights` and
/// determine the order of the method. With the single weight 1 the composition is the Verlet method itself. v
/// is ahead of x by half a fraction, so that one pass makes the half updates of v at the end of a fraction
/// and at the start of the next   (THEORY 13.2, 13.6):
///   x += gamma_k h v,   v += (gamma_k + gamma_{k+1}) (h / 2) M^-1 F(x)
class Composition : public HandWritten {
 public:
  Composition(std::vector<double> weights, bool reads_by_quintic, std::unique_ptr<SecondOrderSystem> system)
      : HandWritten({static_cast<long>(weights.size()), 3, 0.5 * weights.front(), true, reads_by_quintic},
                    std::move(system)),
        weights_(std::move(weights)) {}

 private:
  void step(double t, double h) override {
    const std::size_t n = x_.size();
    double fraction = 0.0;
    for (std::size_t k = 0; k < weights_.size(); ++k) {
      const double next = weights_[k + 1 < weights_.size() ? k + 1 : 0];
      fraction += weights_[k];
      drift(n, h * weights_[k], v_.data(), x_.data());
      system_->forces(t + h * fraction, x_.data(), v_.data(), f_.data());
      accelerate(n, h * (0.5 * (weights_[k] + next)), system_->inverse_mass().data(), f_.data(), v_.data());
    }
  }

  std::vector<double> weights_;
};

/// Returns the 17 weights gamma_k = gamma_{18-k} of the composition of order 8 (Kahan and Li 1997;
/// THEORY 13.6).
std::vector<double> kahan_li_weights() {
  std::vector<double> weights{0.13020248308889008, 0.56116298177510838,  -0.38947496264484729,
                              0.15884190655515560, -0.39590389413323758, 0.18453964097831571,
                              0.25837438768632205, 0.29501172360931030};
  double middle = 1.0;
  for (const double weight : weights) middle -= 2.0 * weight;
  const std::vector<double> mirrored(weights.rbegin(), weights.rend());
  weights.push_back(middle);
  weights.insert(weights.end(), mirrored.begin(), mirrored.end());
  return weights;
}

/// Makes the last pass of the classical Runge-Kutta method   (THEORY 13.3):
///   x += h v + h^2 (a1 + a2 + a3) / 6,   v += h (a1 + 2 a2 + 2 a3 + a4) / 6,   a4 = M^-1 f
void finish(std::size_t n, double h, const double* __restrict inverse_mass, const double* __restrict f,
            const double* __restrict a1, const double* __restrict a2, const double* __restrict a3,
            double* __restrict x, double* __restrict v) {
  const double sixth = h / 6.0;
  for (std::size_t i = 0; i < n; ++i) {
    const double sum = a2[i] + a3[i];
    x[i] += h * (v[i] + sixth * (a1[i] + sum));
    v[i] += sixth * (a1[i] + 2.0 * sum + inverse_mass[i] * f[i]);
  }
}

/// The classical Runge-Kutta method   (THEORY 13.3). Forces do not depend on v, so the stages of v are
/// eliminated. a1, a2, a3 and a4 are the accelerations at the positions x, x + h v / 2,
/// x + h v / 2 + h^2 a1 / 4 and x + h v + h^2 a2 / 2.
class RungeKutta : public HandWritten {
 public:
  explicit RungeKutta(std::unique_ptr<SecondOrderSystem> system)
      : HandWritten({4, 7, 0.0, false, false}, std::move(system)) {
    for (auto* values : {&x_at_, &a1_, &a2_, &a3_}) values->resize(x_.size());
  }

 private:
  void step(double t, double h) override {
    const std::size_t n = x_.size();
    double *x = x_.data(), *v = v_.data(), *at = x_at_.data(), *f = f_.data();
    const double* inverse_mass = system_->inverse_mass().data();
    const double half = 0.5 * h;
    system_->forces(t, x, v, f);
    stage(n, half, 0.0, inverse_mass, f, x, v, nullptr, a1_.data(), at);
    system_->forces(t + half, at, v, f);
    stage(n, half, half * half, inverse_mass, f, x, v, a1_.data(), a2_.data(), at);
    system_->forces(t + half, at, v, f);
    stage(n, h, h * half, inverse_mass, f, x, v, a2_.data(), a3_.data(), at);
    system_->forces(t + h, at, v, f);
    finish(n, h, inverse_mass, f, a1_.data(), a2_.data(), a3_.data(), x, v);
  }

  std::vector<double> x_at_;  // positions of a stage
  std::vector<double> a1_, a2_, a3_;
};

/// Returns the weight of a column, w_j = prod_{i != j} j^2 / (j^2 - i^2). The results of the columns are
/// taken as a polynomial in the square of the length of a substep, and w_j is Lagrange's weight of column j
/// at length 0   (THEORY 13.5)
double extrapolation_weight(int j, int columns) {
  double weight = 1.0;
  for (int i = 1; i <= columns; ++i)
    if (i != j) weight *= static_cast<double>(j * j) / static_cast<double>(j * j - i * i);
  return weight;
}

/// Evaluates the forces in two columns of Stoermer's method at the same time, and says what each column does
/// next. A column advances over the whole step in substeps of equal length. All lengths are fractions of the
/// step. After an evaluation a column either continues or ends. If it ends, another column may begin in its
/// place.
struct Evaluation {
  Pair fraction;            // fraction of the step at which the forces are evaluated
  bool ends_column = true;  // true: a column ends or begins after the evaluation; false: both continue
  Pair substep;             // length of a substep in the columns that are evaluated
  Pair weight;              // w_j of a column that ends; 0: the column continues
  Pair continues;           // 1: the column continues; 0: the column ends
  Pair next_substep;        // length of a substep after the evaluation; 0: no column follows
};

/// Advances both columns by one substep   (THEORY 13.4):
///   u += h_j M^-1 f,   d += h_j u,   at = x + d
/// with u [m/s] the velocity at the middle of a substep and d [m] the displacement since the start of the
/// step.
void continue_columns(std::size_t n, Pair substep, const double* __restrict inverse_mass,
                      const Pair* __restrict f, const double* __restrict x, Pair* __restrict u,
                      Pair* __restrict d, Pair* __restrict at) {
  for (std::size_t i = 0; i < n; ++i) {
    u[i] += substep * (inverse_mass[i] * f[i]);
    d[i] += substep * u[i];
    at[i] = x[i] + d[i];
  }
}

/// The arrays of a step. x, v and f are the values at the start of the step, and the arrays of Pair belong to
/// the two columns.
struct Columns {
  const double *inverse_mass, *x, *v, *f;
  Pair *f_at, *u, *d, *at, *sum_u, *sum_d;
};

/// Adds the results of the columns that end to the sums, and begins new columns at the start of the step
/// (THEORY 13.4, 13.5):
///   a column ends:    sum_u += w_j (u + h_j M^-1 f_at / 2),   sum_d += w_j d
///   a column begins:  u = v + h_j M^-1 f / 2,   d = h_j u
/// A column that continues advances as in `continue_columns`.
void end_and_begin_columns(std::size_t n, double h, const Evaluation& evaluation, const Columns& columns) {
  const double* __restrict inverse_mass = columns.inverse_mass, * __restrict x = columns.x;
  const double* __restrict v = columns.v, * __restrict f = columns.f;
  const Pair* __restrict f_at = columns.f_at;
  Pair* __restrict u = columns.u, * __restrict d = columns.d, * __restrict at = columns.at;
  Pair* __restrict sum_u = columns.sum_u, * __restrict sum_d = columns.sum_d;
  const Pair substep = h * evaluation.substep, half = 0.5 * substep;
  const Pair next_substep = h * evaluation.next_substep, next_half = 0.5 * next_substep;
  const Pair weight = evaluation.weight, old = evaluation.continues, fresh = 1.0 - old;
  for (std::size_t i = 0; i < n; ++i) {
    const Pair a = inverse_mass[i] * f_at[i];
    sum_u[i] += weight * (u[i] + half * a);
    sum_d[i] += weight * d[i];
    u[i] = old * (u[i] + substep * a) + fresh * (v[i] + next_half * (inverse_mass[i] * f[i]));
    d[i] = old * d[i] + next_substep * u[i];
    at[i] = x[i] + d[i];
  }
}

/// Stoermer's method with extrapolation. Column j advances over the step in j substeps, and the results of
/// columns 1, 2, .. are extrapolated to substeps of zero length (THEORY 13.4, 13.5). Two columns advance at
/// the same time, because columns do not depend on each other, and evaluating the forces of a pair costs
/// little more than evaluating the forces of one column.
class Stoermer : public HandWritten {
 public:
  Stoermer(int columns, std::unique_ptr<SecondOrderSystem> system)
      : HandWritten({columns * (columns + 1) / 2 + 1, 15, 0.0, true, true}, std::move(system)) {
    for (auto* values : {&f_at_, &u_, &d_, &at_, &sum_u_, &sum_d_}) values->resize(x_.size());
    schedule(columns);
  }

 private:
  void schedule(int columns);

  void step(double t, double h) override {
    const std::size_t n = x_.size();
    const Columns columns{system_->inverse_mass().data(),
                          x_.data(),
                          v_.data(),
                          f_.data(),
                          f_at_.data(),
                          u_.data(),
                          d_.data(),
                          at_.data(),
                          sum_u_.data(),
                          sum_d_.data()};
    std::fill(sum_u_.begin(), sum_u_.end(), Pair{});
    std::fill(sum_d_.begin(), sum_d_.end(), Pair{});
    end_and_begin_columns(n, h, start_, columns);
    for (const Evaluation& evaluation : evaluations_) {
      system_->forces(t + h * evaluation.fraction, at_.data(), f_at_.data());
      if (evaluation.ends_column)
        end_and_begin_columns(n, h, evaluation, columns);
      else
        continue_columns(n, h * evaluation.substep, columns.inverse_mass, columns.f_at, columns.x, columns.u,
                         columns.d, columns.at);
    }
    for (std::size_t i = 0; i < n; ++i) {
      x_[i] += sum_d_[i][0] + sum_d_[i][1];
      v_[i] = sum_u_[i][0] + sum_u_[i][1];
    }
    system_->forces(t + h, x_.data(), v_.data(), f_.data());
  }

  Evaluation start_;                     // begins the first column of each side of the pairs
  std::vector<Evaluation> evaluations_;  // evaluations in the order of the step
  std::vector<Pair> f_at_, u_, d_, at_, sum_u_, sum_d_;
};

void Stoermer::schedule(int columns) {
  // each column is assigned to the side of the pairs that has fewer substeps so far, beginning with the
  // column of most substeps
  std::array<std::vector<int>, 2> sides;
  std::array<int, 2> num_substeps{};
  for (int j = columns; j > 0; --j) {
    const std::size_t side = num_substeps[0] <= num_substeps[1] ? 0 : 1;
    sides[side].push_back(j);
    num_substeps[side] += j;
  }
  evaluations_.resize(index(std::max(num_substeps[0], num_substeps[1])));
  for (std::size_t side = 0; side < 2; ++side) {
    start_.substep[side] = start_.weight[side] = start_.continues[side] = 0.0;
    start_.next_substep[side] = 1.0 / sides[side].front();
    auto evaluation = evaluations_.begin();
    for (std::size_t c = 0; c < sides[side].size(); ++c) {
      const int j = sides[side][c];
      for (int k = 1; k <= j; ++k, ++evaluation) {
        evaluation->fraction[side] = static_cast<double>(k) / j;
        evaluation->substep[side] = evaluation->next_substep[side] = 1.0 / j;
        evaluation->continues[side] = 1.0;
      }
      Evaluation& last = *std::prev(evaluation);
      last.weight[side] = extrapolation_weight(j, columns);
      last.continues[side] = 0.0;
      last.next_substep[side] = c + 1 < sides[side].size() ? 1.0 / sides[side][c + 1] : 0.0;
    }
  }
  for (Evaluation& evaluation : evaluations_)
    evaluation.ends_column = evaluation.weight[0] != 0.0 || evaluation.weight[1] != 0.0;
}

/// Makes a substep of the midpoint rule and the positions and velocities of the next evaluation
/// (THEORY 13.20):
///   D_- += 2 h_j (v + W),   W_- += 2 h_j M^-1 f;   D_- and W_- are then the newer values
///   x_at = x + D,   v_at = v + W
void midpoint_substep(std::size_t n, double twice, const double* __restrict inverse_mass,
                      const double* __restrict f, const double* __restrict x, const double* __restrict v,
                      const double* __restrict W, double* __restrict D_before, double* __restrict W_before,
                      double* __restrict x_at, double* __restrict v_at) {
  for (std::size_t i = 0; i < n; ++i) {
    D_before[i] += twice * (v[i] + W[i]);
    W_before[i] += twice * (inverse_mass[i] * f[i]);
    x_at[i] = x[i] + D_before[i];
    v_at[i] = v[i] + W_before[i];
  }
}

/// The midpoint rule with extrapolation, for forces that depend on velocities. Column j advances over the
/// step in 2 j substeps, and the columns are extrapolated with the weights of Stoermer's method. The step is
/// not smoothed, because an even number of substeps gives errors in even powers without it   (THEORY 13.20).
class Midpoint : public HandWritten {
 public:
  Midpoint(int columns, std::unique_ptr<SecondOrderSystem> system)
      : HandWritten({columns * columns + 1, 11, 0.0, true, true}, std::move(system)) {
    for (auto* values : {&f_at_, &x_at_, &v_at_, &D_, &W_, &D_before_, &W_before_, &sum_D_, &sum_W_})
      values->resize(x_.size());
    for (int j = 1; j <= columns; ++j) weights_.push_back(extrapolation_weight(j, columns));
  }

 private:
  void step(double t, double h) override {
    const std::size_t n = x_.size();
    std::fill(sum_D_.begin(), sum_D_.end(), 0.0);
    std::fill(sum_W_.begin(), sum_W_.end(), 0.0);
    for (std::size_t j = 1; j <= weights_.size(); ++j) {
      column(t, h / static_cast<double>(2 * j), 2 * j);
      for (std::size_t i = 0; i < n; ++i) {
        sum_D_[i] += weights_[j - 1] * D_[i];
        sum_W_[i] += weights_[j - 1] * W_[i];
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      x_[i] += sum_D_[i];
      v_[i] += sum_W_[i];
    }
    system_->forces(t + h, x_.data(), v_.data(), f_.data());
  }

  /// Computes the displacement D_ and the change of velocity W_ over `count` substeps of h_j [s].
  void column(double t, double h_j, std::size_t count) {
    const std::size_t n = x_.size();
    const double *inverse_mass = system_->inverse_mass().data(), *x = x_.data(), *v = v_.data();
    std::fill(D_before_.begin(), D_before_.end(), 0.0);
    std::fill(W_before_.begin(), W_before_.end(), 0.0);
    for (std::size_t i = 0; i < n; ++i) {  // the first substep is Euler's
      D_[i] = h_j * v[i];
      W_[i] = h_j * (inverse_mass[i] * f_[i]);
      x_at_[i] = x[i] + D_[i];
      v_at_[i] = v[i] + W_[i];
    }
    for (std::size_t m = 1; m < count; ++m) {
      system_->forces(t + static_cast<double>(m) * h_j, x_at_.data(), v_at_.data(), f_at_.data());
      midpoint_substep(n, 2.0 * h_j, inverse_mass, f_at_.data(), x, v, W_.data(), D_before_.data(),
                       W_before_.data(), x_at_.data(), v_at_.data());
      D_.swap(D_before_);
      W_.swap(W_before_);
    }
  }

  std::vector<double> weights_;
  std::vector<double> f_at_, x_at_, v_at_, D_, W_, D_before_, W_before_, sum_D_, sum_W_;
};

}  // namespace

std::unique_ptr<HandWritten> make_hand_written(Rival rival, std::unique_ptr<SecondOrderSystem> system) {
  assert(is_by_hand(rival));
  switch (rival) {
    case Rival::kRungeKutta4:
      return std::make_unique<RungeKutta>(std::move(system));
    case Rival::kKahanLi8:
      return std::make_unique<Composition>(kahan_li_weights(), true, std::move(system));
    case Rival::kStoermer8:
      return std::make_unique<Stoermer>(4, std::move(system));
    case Rival::kStoermer12:
      return std::make_unique<Stoermer>(6, std::move(system));
    case Rival::kStoermer16:
      return std::make_unique<Stoermer>(8, std::move(system));
    case Rival::kMidpoint8:
      return std::make_unique<Midpoint>(4, std::move(system));
    case Rival::kMidpoint12:
      return std::make_unique<Midpoint>(6, std::move(system));
    case Rival::kMidpoint16:
      return std::make_unique<Midpoint>(8, std::move(system));
    default:
      return std::make_unique<Composition>(std::vector<double>{1.0}, false, std::move(system));
  }
}

}  // namespace freeflex
