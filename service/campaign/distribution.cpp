#include "service/campaign/distribution.hpp"

#include <algorithm>
#include <cmath>

#include "service/campaign/numbers.hpp"

namespace freeflex::campaign {
namespace {

/// Returns the quantile of a standard normal number that lies between two limits.
double truncated_quantile(double min, double max, double u) noexcept {
  if (std::isinf(min) && std::isinf(max)) return normal_quantile(u);
  // above the mean, probabilities are counted from above, where they keep their digits
  if (min > 0.0) return -truncated_quantile(-max, -min, 1.0 - u);
  const double low = normal_probability(min), high = normal_probability(max);
  return std::clamp(normal_quantile(low + u * (high - low)), min, max);
}

template <typename D>
std::string fault_of_limits(const D& d, double share) {
  if (!(d.truncation.min < d.truncation.max)) return "min must be below max";
  if (!(share > 1e-12))
    return "less than 1e-12 of the values lie between min and max; use limits that are nearer to the middle";
  return {};
}

double standard(const Normal& d, double x) noexcept { return (x - d.mean) / d.sd; }
double standard(const LogNormal& d, double x) noexcept {
  if (!(x > 0.0)) return -std::numeric_limits<double>::infinity();
  if (std::isinf(x)) return x;
  return (natural_log(x) - natural_log(d.median)) / d.log_sd;
}
template <typename D>
double share_inside(const D& d) noexcept {
  const double min = standard(d, d.truncation.min), max = standard(d, d.truncation.max);
  return min > 0.0 ? normal_probability(-min) - normal_probability(-max)
                   : normal_probability(max) - normal_probability(min);
}

struct FaultOf {
  std::string operator()(const Normal& d) const {
    if (!std::isfinite(d.mean)) return "mean must be finite";
    if (!(d.sd > 0.0) || !std::isfinite(d.sd)) return "sd must be > 0";
    return fault_of_limits(d, share_inside(d));
  }
  std::string operator()(const LogNormal& d) const {
    if (!(d.median > 0.0) || !std::isfinite(d.median)) return "median must be > 0";
    if (!(d.log_sd > 0.0) || !std::isfinite(d.log_sd)) return "log_sd must be > 0";
    return fault_of_limits(d, share_inside(d));
  }
  std::string operator()(const Uniform& d) const {
    return std::isfinite(d.max - d.min) && d.min < d.max ? "" : "min must be below max, and both finite";
  }
  std::string operator()(const Choice& d) const { return d.values.empty() ? "a choice needs a value" : ""; }
};

struct QuantileOf {
  double u;
  double operator()(const Normal& d) const {
    const double z = truncated_quantile(standard(d, d.truncation.min), standard(d, d.truncation.max), u);
    return std::clamp(d.mean + d.sd * z, d.truncation.min, d.truncation.max);
  }
  double operator()(const LogNormal& d) const {
    const double z = truncated_quantile(standard(d, d.truncation.min), standard(d, d.truncation.max), u);
    return std::clamp(d.median * exponential(d.log_sd * z), d.truncation.min, d.truncation.max);
  }
  double operator()(const Uniform& d) const {
    return std::clamp((1.0 - u) * d.min + u * d.max, d.min, d.max);
  }
  double operator()(const Choice& d) const {
    const auto count = static_cast<double>(d.values.size());
    return std::min(std::floor(u * count), count - 1.0);
  }
};

}  // namespace

std::string find_fault(const Distribution& distribution) { return std::visit(FaultOf{}, distribution); }
double quantile(const Distribution& distribution, double u) {
  return std::visit(QuantileOf{u}, distribution);
}

}  // namespace freeflex::campaign
