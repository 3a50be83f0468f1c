// Steps of the methods by hand   (THEORY X111, X112, X130, X131).
#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "core/reference/hand_written.hpp"

namespace freeflex {
namespace {

// Passes over the arrays, n numbers each. As functions of their own, because the compiler believes __restrict
// of parameters only, and would not vectorise loops over so many arrays without.

/// x += s v
void drift(std::size_t n, double s, const double* __restrict v, double* __restrict x) {
  for (std::size_t i = 0; i < n; ++i) x[i] += s * v[i];
}

/// v += s M^-1 f
void kick(std::size_t n, double s, const double* __restrict inverse_mass, const double* __restrict f,
          double* __restrict v) {
  for (std::size_t i = 0; i < n; ++i) v[i] += s * (inverse_mass[i] * f[i]);
}

/// a = M^-1 f of a stage, and the positions of the next: at = x + s v, + s2 times a_before when there is one
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

/// Velocity Verlet repeated over shares `weights` of the step, which make its order; one share is Verlet's
/// own method. v stands half a share ahead of x, so that the kicks of two shares are one.
class Composition : public HandWritten {
 public:
  Composition(std::vector<double> weights, bool reads_by_quintic, SpringNetwork network)
      : HandWritten({static_cast<long>(weights.size()), 3, 0.5 * weights.front(), true, reads_by_quintic},
                    std::move(network)),
        weights_(std::move(weights)) {}

 private:
  void step(double t, double h) override {
    const std::size_t n = x_.size();
    double share = 0.0;
    for (std::size_t k = 0; k < weights_.size(); ++k) {
      const double next = weights_[k + 1 < weights_.size() ? k + 1 : 0];
      share += weights_[k];
      drift(n, h * weights_[k], v_.data(), x_.data());
      network_.forces(t + h * share, x_.data(), f_.data());
      kick(n, h * (0.5 * (weights_[k] + next)), network_.inverse_mass().data(), f_.data(), v_.data());
    }
  }

  std::vector<double> weights_;
};

/// Seventeen shares, the same from either end, for order 8 (Kahan and Li 1997).
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

/// The last pass of the classical Runge-Kutta method.
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

class RungeKutta : public HandWritten {
 public:
  explicit RungeKutta(SpringNetwork network) : HandWritten({4, 7, 0.0, false, false}, std::move(network)) {
    for (auto* values : {&x_at_, &a1_, &a2_, &a3_}) values->resize(x_.size());
  }

 private:
  // forces do not depend on v, so the stages of v need not be kept
  void step(double t, double h) override {
    const std::size_t n = x_.size();
    double *x = x_.data(), *v = v_.data(), *at = x_at_.data(), *f = f_.data();
    const double* inverse_mass = network_.inverse_mass().data();
    const double half = 0.5 * h;
    network_.forces(t, x, f);
    stage(n, half, 0.0, inverse_mass, f, x, v, nullptr, a1_.data(), at);
    network_.forces(t + half, at, f);
    stage(n, half, half * half, inverse_mass, f, x, v, a1_.data(), a2_.data(), at);
    network_.forces(t + half, at, f);
    stage(n, h, h * half, inverse_mass, f, x, v, a2_.data(), a3_.data(), at);
    network_.forces(t + h, at, f);
    finish(n, h, inverse_mass, f, a1_.data(), a2_.data(), a3_.data(), x, v);
  }

  std::vector<double> x_at_;  // positions of a stage
  std::vector<double> a1_, a2_, a3_;
};

/// What follows an evaluation of the forces in each of two columns of Stoermer's method that run side by
/// side; lengths are shares of the step. A column either goes on, or ends and gives way to another.
struct Turn {
  Pair share;          // where in the step the forces are evaluated
  bool is_one = true;  // a column ends or begins; else both go on
  Pair part;           // of the columns that were evaluated
  Pair weight;         // of those that end, in the extrapolated sum; 0: goes on
  Pair goes_on;        // 1, or 0 for those that end
  Pair next_part;      // of the columns from here on; 0: there is none
};

/// Both columns go on: velocity u at the middle of a part, way d since the step's start, place `at`.
void go_on(std::size_t n, Pair part, const double* __restrict inverse_mass, const Pair* __restrict f,
           const double* __restrict x, Pair* __restrict u, Pair* __restrict d, Pair* __restrict at) {
  for (std::size_t i = 0; i < n; ++i) {
    u[i] += part * (inverse_mass[i] * f[i]);
    d[i] += part * u[i];
    at[i] = x[i] + d[i];
  }
}

/// Arrays of a step: at its start, and of the columns.
struct Columns {
  const double *inverse_mass, *x, *v, *f;
  Pair *f_at, *u, *d, *at, *sum_u, *sum_d;
};

/// Columns that end go into the sums, others begin with the forces f at the step's start.
void take_turn(std::size_t n, double h, const Turn& turn, const Columns& columns) {
  const double* __restrict inverse_mass = columns.inverse_mass, * __restrict x = columns.x;
  const double* __restrict v = columns.v, * __restrict f = columns.f;
  const Pair* __restrict f_at = columns.f_at;
  Pair* __restrict u = columns.u, * __restrict d = columns.d, * __restrict at = columns.at;
  Pair* __restrict sum_u = columns.sum_u, * __restrict sum_d = columns.sum_d;
  const Pair part = h * turn.part, half = 0.5 * part, next_part = h * turn.next_part;
  const Pair weight = turn.weight, old = turn.goes_on, fresh = 1.0 - old, next_half = 0.5 * next_part;
  for (std::size_t i = 0; i < n; ++i) {
    const Pair a = inverse_mass[i] * f_at[i];
    sum_u[i] += weight * (u[i] + half * a);
    sum_d[i] += weight * d[i];
    u[i] = old * (u[i] + part * a) + fresh * (v[i] + next_half * (inverse_mass[i] * f[i]));
    d[i] = old * d[i] + next_part * u[i];
    at[i] = x[i] + d[i];
  }
}

/// Stoermer's method over the step in 1, 2, .. parts, each a column, extrapolated to parts of no length.
/// Columns do not depend on each other, so two run side by side, for one evaluation of a pair of forces costs
/// little more than one of a single.
class Stoermer : public HandWritten {
 public:
  Stoermer(int columns, SpringNetwork network)
      : HandWritten({columns * (columns + 1) / 2 + 1, 15, 0.0, true, true}, std::move(network)) {
    for (auto* values : {&f_at_, &u_, &d_, &at_, &sum_u_, &sum_d_}) values->resize(x_.size());
    plan(columns);
  }

 private:
  void plan(int columns);

  void step(double t, double h) override {
    const std::size_t n = x_.size();
    const Columns columns{network_.inverse_mass().data(),
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
    take_turn(n, h, start_, columns);
    for (const Turn& turn : turns_) {
      network_.forces(t + h * turn.share, at_.data(), f_at_.data());
      if (turn.is_one)
        take_turn(n, h, turn, columns);
      else
        go_on(n, h * turn.part, columns.inverse_mass, columns.f_at, columns.x, columns.u, columns.d,
              columns.at);
    }
    for (std::size_t i = 0; i < n; ++i) {
      x_[i] += sum_d_[i][0] + sum_d_[i][1];
      v_[i] = sum_u_[i][0] + sum_u_[i][1];
    }
    network_.forces(t + h, x_.data(), f_.data());
  }

  Turn start_;               // both sides begin
  std::vector<Turn> turns_;  // one an evaluation
  std::vector<Pair> f_at_, u_, d_, at_, sum_u_, sum_d_;
};

void Stoermer::plan(int columns) {
  // from the longest, each to the side with less to do
  std::array<std::vector<int>, 2> sides;
  std::array<int, 2> parts{};
  for (int j = columns; j > 0; --j) {
    const std::size_t side = parts[0] <= parts[1] ? 0 : 1;
    sides[side].push_back(j);
    parts[side] += j;
  }
  turns_.resize(static_cast<std::size_t>(std::max(parts[0], parts[1])));
  for (std::size_t side = 0; side < 2; ++side) {
    start_.part[side] = start_.weight[side] = start_.goes_on[side] = 0.0;
    start_.next_part[side] = 1.0 / sides[side].front();
    auto turn = turns_.begin();
    for (std::size_t c = 0; c < sides[side].size(); ++c) {
      const int j = sides[side][c];
      // Lagrange's weight of a polynomial in the square of a part's length, at length 0
      double weight = 1.0;
      for (int i = 1; i <= columns; ++i)
        if (i != j) weight *= static_cast<double>(j * j) / static_cast<double>(j * j - i * i);
      for (int k = 1; k <= j; ++k, ++turn) {
        turn->share[side] = static_cast<double>(k) / j;
        turn->part[side] = turn->next_part[side] = 1.0 / j;
        turn->goes_on[side] = 1.0;
      }
      Turn& last = *std::prev(turn);
      last.weight[side] = weight;
      last.goes_on[side] = 0.0;
      last.next_part[side] = c + 1 < sides[side].size() ? 1.0 / sides[side][c + 1] : 0.0;
    }
  }
  for (Turn& turn : turns_) turn.is_one = turn.weight[0] != 0.0 || turn.weight[1] != 0.0;
}

}  // namespace

std::unique_ptr<HandWritten> make_hand_written(Rival rival, SpringNetwork network) {
  switch (rival) {
    case Rival::kRungeKutta4:
      return std::make_unique<RungeKutta>(std::move(network));
    case Rival::kKahanLi8:
      return std::make_unique<Composition>(kahan_li_weights(), true, std::move(network));
    case Rival::kStoermer8:
      return std::make_unique<Stoermer>(4, std::move(network));
    case Rival::kStoermer12:
      return std::make_unique<Stoermer>(6, std::move(network));
    case Rival::kStoermer16:
      return std::make_unique<Stoermer>(8, std::move(network));
    default:
      return std::make_unique<Composition>(std::vector<double>{1.0}, false, std::move(network));
  }
}

}  // namespace freeflex
