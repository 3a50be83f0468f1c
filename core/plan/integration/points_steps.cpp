// The steps of a plan that integrates its points   (THEORY 12.129 to 12.135).
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/plan/integration/choose_method.hpp"
#include "core/step/points/multistep.hpp"

namespace freeflex {
namespace {

// [rad] Phase of the fastest vibration after which its error is `accuracy`.
constexpr double kJudgedPhase = 1000.0;
// [rad] Longest phase in a step, three quarters of the unstable one: tension, spin and large strains make
// vibrations faster.
constexpr double kLongestStep = 0.75 * kUnstablePhase;

double top_frequency(const StepPlan& plan) {
  double top = *std::max_element(plan.omega.begin(), plan.omega.end());
  for (const PlanHistory& history : plan.histories)
    if (history.kind == PlanHistory::Kind::kSine) top = std::max(top, 2.0 * M_PI * history.frequency);
  const Vec3& w = plan.initial.w_B;
  return top + std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
}

// Returns the longest phase in a step with which a vibration is off by `accuracy` after kJudgedPhase, at most
// kLongestStep   (THEORY 12.129).
double longest_phase(double accuracy) {
  double phase = kLongestStep;
  const auto error = [](double x) {
    return kJudgedPhase * kPhaseError * std::pow(x, 12.0) * std::exp(kPhaseGrowth * x * x);
  };
  while (error(phase) > accuracy) phase *= 0.999;
  return phase;
}

// Returns the error of a vibration of unit amplitude over one extrapolated step of phase x.
double extrapolation_error(int columns, double x) {
  double worst = 0.0;
  for (const std::array<double, 2> start : {std::array{1.0, 0.0}, std::array{0.0, 1.0}}) {
    double sum_d = 0.0, sum_u = 0.0;
    for (int j = 1; j <= columns; ++j) {
      const double step = x / j;
      double u = start[1] - 0.5 * step * start[0], d = step * u;
      for (int k = 1; k < j; ++k) {
        u -= step * (start[0] + d);
        d += step * u;
      }
      const double weight = extrapolation_weight(j, columns);
      sum_d += weight * d;
      sum_u += weight * (u - 0.5 * step * (start[0] + d));
    }
    const double c = std::cos(x), s = std::sin(x);
    worst = std::max(worst, std::hypot(start[0] + sum_d - (start[0] * c + start[1] * s),
                                       sum_u - (start[1] * c - start[0] * s)));
  }
  return worst;
}

// Returns (y, z) after one step by the extrapolated midpoint rule, for y' = x z, z' = -x y - c z in a time
// of 1.
std::array<double, 2> midpoint_step(int columns, double x, double c, std::array<double, 2> start) {
  std::array<double, 2> end = start;
  for (int j = 1; j <= columns; ++j) {
    std::array<double, 2> before = start, now = start;
    for (int k = 0; k < 2 * j; ++k) {
      const double step = (k == 0 ? 0.5 : 1.0) / j;
      const std::array<double, 2> next{before[0] + step * x * now[1],
                                       before[1] - step * (x * now[0] + c * now[1])};
      before = std::exchange(now, next);
    }
    for (std::size_t a = 0; a < 2; ++a) end[a] += extrapolation_weight(j, columns) * (now[a] - start[a]);
  }
  return end;
}

double midpoint_error(int columns, double x) {
  double worst = 0.0;
  for (const std::array<double, 2> start : {std::array{1.0, 0.0}, std::array{0.0, 1.0}}) {
    const auto end = midpoint_step(columns, x, 0.0, start);
    worst = std::max(worst, std::hypot(end[0] - (start[0] * std::cos(x) + start[1] * std::sin(x)),
                                       end[1] - (start[1] * std::cos(x) - start[0] * std::sin(x))));
  }
  return worst;
}

// Sets the extrapolated steps of a tick of a damped structure: those with the fewest evaluations that have
// the accuracy and at which the fastest damping does not grow   (THEORY 12.137).
// \param phase  [rad] of the fastest mode in a tick
// \param decay  [-] rate of the fastest damping times the tick
void set_midpoint_steps(double phase, double decay, PlanPoints& method) {
  method.steps = method.ticks = 1;
  method.pieces = kMostStepsPerTick + 1;
  long least = std::numeric_limits<long>::max();
  for (int columns = 2; columns <= kMostColumns; ++columns)
    for (int pieces = 1; pieces <= kMostStepsPerTick; pieces += std::max(1, pieces / 16)) {
      const long evaluations = long{pieces} * columns * columns;
      if (evaluations >= least) break;
      const double x = phase / pieces;
      if (midpoint_error(columns, x) * kJudgedPhase / x > method.accuracy ||
          std::abs(midpoint_step(columns, 0.0, decay / pieces, {0.0, 1.0})[1]) > 1.0)
        continue;
      least = evaluations;
      method.columns = columns;
      method.pieces = pieces;
      break;
    }
}

// Returns a bound of the rates at which dampers slow their points [1/s]: the largest sum of
// c (1 / m_i + (m_i m_j)^(-1/2)) over the dampers of a point.
double damping_rate(const PlanPoints& method) {
  std::vector<double> sums(method.inverse_mass.size());
  for (std::size_t k = 0; k < method.damping.size(); ++k) {
    const std::size_t i = index(method.first[k]), j = index(method.second[k]);
    const double both = std::sqrt(method.inverse_mass[i] * method.inverse_mass[j]);
    sums[i] += method.damping[k] * (method.inverse_mass[i] + both);
    sums[j] += method.damping[k] * (method.inverse_mass[j] + both);
  }
  return *std::max_element(sums.begin(), sums.end());
}

// Returns the coefficients of the polynomial over `nodes` that is 1 at node k and 0 at the others.
std::vector<double> lagrange(const std::vector<double>& nodes, std::size_t k) {
  std::vector<double> c{1.0};
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (i == k) continue;
    const double scale = 1.0 / (nodes[k] - nodes[i]);
    std::vector<double> next(c.size() + 1);
    for (std::size_t m = 0; m < c.size(); ++m) {
      next[m + 1] += scale * c[m];
      next[m] -= scale * nodes[i] * c[m];
    }
    c = std::move(next);
  }
  return c;
}

// Sets the weights of accelerations in position, velocity and acceleration at the ticks of the last step
// (THEORY 12.132). Time is in steps, from the end of the last one.
void set_weights(PlanPoints& method) {
  std::vector<double> nodes;
  for (std::size_t k = 0; k < kPastSteps; ++k) nodes.push_back(-static_cast<double>(k));
  method.weights.assign(3 * index(method.ticks) * kPastSteps, 0.0);
  for (std::size_t k = 0; k < kPastSteps; ++k) {
    const std::vector<double> c = lagrange(nodes, k);
    // first and second integral from 0, and the second one at the start of the step, t = -1
    const auto integrals = [&](double t) {
      std::array<double, 3> sums{};
      double power = 1.0;
      for (std::size_t m = 0; m < c.size(); ++m) {
        const auto n = static_cast<double>(m + 1);
        sums[2] += c[m] * power;
        sums[1] += c[m] * power * t / n;
        sums[0] += c[m] * power * t * t / (n * (n + 1.0));
        power *= t;
      }
      return sums;
    };
    const double at_start = integrals(-1.0)[0];
    for (std::int32_t tick = 1; tick <= method.ticks; ++tick) {
      const double t = static_cast<double>(tick - method.ticks) / method.ticks;
      const auto sums = integrals(t);
      double* const to = method.weights.data() + 3 * kPastSteps * index(tick - 1) + k;
      to[0] = sums[0] + t * at_start;  // x = x_end + t e + h^2 sum, which is x_end - e at t = -1
      to[kPastSteps] = sums[1] + at_start;
      to[2 * kPastSteps] = sums[2];
    }
  }
}

// Returns the weights of position, velocity and acceleration at the nodes 0, 1, 2, 3 in the polynomial of
// degree 11 with these values, at t   (THEORY 12.131).
std::array<double, 12> hermite(double t, double spacing) {
  std::array<double, 12> weights{};
  for (int i = 0; i < 4; ++i) {
    // l(t) = prod (t - j) / (i - j); its first and second derivative at i
    double l = 1.0, first = 0.0, second = 0.0;
    for (int j = 0; j < 4; ++j) {
      if (j == i) continue;
      l *= (t - j) / (i - j);
      const double slope = 1.0 / (i - j);
      second += 2.0 * first * slope;
      first += slope;
    }
    // l^3 times the polynomial whose product with l^3 has the derivative of order m alone at i: with 1 / l^3
    // = 1 - 3 l' s + (6 l'^2 - 1.5 l'') s^2 + ..., s = t - i
    const double s = t - i, cube = l * l * l, a = -3.0 * first, b = 6.0 * first * first - 1.5 * second;
    weights[3 * index(i)] = cube * (1.0 + a * s + b * s * s);
    weights[3 * index(i) + 1] = cube * s * (1.0 + a * s) * spacing;
    weights[3 * index(i) + 2] = cube * 0.5 * s * s * spacing * spacing;
  }
  return weights;
}

// Sets the positions that start the multistep method. Nodes are `spacing` steps of the method apart.
void set_starts(double spacing, double seconds, PlanPoints& method) {
  constexpr double kAtNode = 1e-9;
  const double span = static_cast<double>(kPastSteps) / spacing;  // of the positions, in nodes
  method.num_nodes = static_cast<std::int32_t>(std::ceil(span - kAtNode)) + 1;
  method.starts.clear();
  for (std::size_t j = 0; j <= kPastSteps; ++j) {
    const double node = (method.num_nodes - 1) - static_cast<double>(kPastSteps - j) / spacing;
    PlanStartValue& start = method.starts.emplace_back();
    const double nearest = std::round(node);
    if (std::abs(node - nearest) < kAtNode) start.node = static_cast<std::int32_t>(nearest);
    start.first_node =
        std::clamp(static_cast<std::int32_t>(std::floor(node)) - 1, 0, std::max(0, method.num_nodes - 4));
    start.weights = hermite(node - start.first_node, seconds);
  }
}

}  // namespace

double radius_of(const StepPlan& plan) {
  double radius = 0.0;
  for (const PlanPoint& point : plan.points) radius = std::max(radius, length(point.r));
  return radius;
}

void set_points_period(StepPlan& plan) {
  PlanPoints& method = plan.points_method;
  if (method.steps == 0) return;
  const double top = top_frequency(plan), phase = top * plan.period;
  if (!method.damping.empty()) return set_midpoint_steps(phase, damping_rate(method) * plan.period, method);
  const double longest = longest_phase(method.accuracy);
  const bool has_table = std::ranges::any_of(
      plan.histories, [](const PlanHistory& each) { return each.kind == PlanHistory::Kind::kTable; });
  method.ticks = has_table ? 1 : std::clamp(static_cast<int>(longest / phase), 1, kMostTicksPerStep);
  method.steps =
      method.ticks > 1 ? 1 : std::max(1, static_cast<int>(std::ceil(phase / longest * (1.0 - 1e-9))));
  // three steps to each extrapolated one, so that both end at the same times; two of four, and all of three
  if (method.steps > 4) method.steps = (method.steps + 2) / 3 * 3;
  method.pieces = method.steps == 4 ? 2 : std::max(1, method.steps / 3);
  const double piece = phase / method.pieces, step = phase * method.ticks / method.steps;
  method.columns = 2;
  while (method.columns < kMostColumns &&
         extrapolation_error(method.columns, piece) * kJudgedPhase / piece > method.accuracy)
    ++method.columns;
  method.spacing = method.ticks > 1 ? method.ticks : 1;
  set_starts(piece * method.spacing / step, plan.period * method.spacing / method.pieces, method);
  set_weights(method);
  // ten differences of a vibration multiply it by (2 sin(x / 2))^10
  method.resolved = 8.0 * std::pow(2.0 * std::sin(0.5 * step), 10.0);
  constexpr double kAmplified = 2000.0;  // differences of order 10 multiply noise by 430
  method.noise = kAmplified * std::numeric_limits<double>::epsilon() * top * top * radius_of(plan);
}

}  // namespace freeflex
