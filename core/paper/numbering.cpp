// Numberings of points for which an explicit recipe is complete   (THEORY 11.10).
#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <numeric>
#include <random>

#include "core/paper/force_groups.hpp"

namespace freeflex {
namespace {

constexpr int kRandomTries = 8;

// [-] a numbering is taken without further tries if the spread of its flattest window is at least this value
constexpr double kWellSpread = 1e-3;

// visits every window of `size` points that contains one of the indices first..last of the numbering
template <typename Visit>
void for_windows(const std::vector<int>& numbering, int size, int first, int last, const Visit& visit) {
  const int end = static_cast<int>(numbering.size()) - size;
  for (int start = std::max(0, first - size + 1); start <= std::min(last, end); ++start)
    visit(std::vector<int>(numbering.begin() + start, numbering.begin() + start + size));
}

// Holds the quality of a numbering: the number of its flat windows and its smallest spread. A numbering is
// better than another if it has fewer flat windows or, with equally many, if its smallest spread is larger.
struct Quality {
  int num_flat = 0;
  double least_spread = 1.0;  // [-]
  bool operator<(const Quality& other) const {
    return num_flat != other.num_flat ? num_flat > other.num_flat : least_spread < other.least_spread;
  }
};

Quality quality_of(const MassProperties& properties, const std::vector<int>& numbering, int size, int first,
                   int last) {
  Quality quality;
  for_windows(numbering, size, first, last, [&](const std::vector<int>& window) {
    const double spread = window_spread(properties, window);
    quality.num_flat += spread < kFlatWindow ? 1 : 0;
    quality.least_spread = std::min(quality.least_spread, spread);
  });
  return quality;
}

Quality quality_of(const MassProperties& properties, const std::vector<int>& numbering, int size) {
  return quality_of(properties, numbering, size, 0, static_cast<int>(numbering.size()) - 1);
}

// Inserts the points into a numbering in the given order, each where the windows near it are least flat. Of
// several equally good indices, the last is used
std::vector<int> insert_one_by_one(const MassProperties& properties, const std::vector<int>& order,
                                   int size) {
  std::vector<int> numbering;
  for (const int point : order) {
    const int count = static_cast<int>(numbering.size());
    int best = count;
    Quality best_quality{std::numeric_limits<int>::max(), 0.0};
    for (int index = count; index >= 0; --index) {
      std::vector<int> near;
      const int from = std::max(0, index - size + 1), to = std::min(count, index + size - 1);
      near.insert(near.end(), numbering.begin() + from, numbering.begin() + index);
      near.push_back(point);
      near.insert(near.end(), numbering.begin() + index, numbering.begin() + to);
      const Quality quality = quality_of(properties, near, size);
      if (best_quality < quality) {
        best = index;
        best_quality = quality;
      }
    }
    numbering.insert(numbering.begin() + best, point);
  }
  return numbering;
}

}  // namespace

int window_size(Recipe recipe) {
  return recipe == Recipe::kCollinear ? 2 : recipe == Recipe::kPlanar ? 3 : 4;
}

double window_spread(const MassProperties& properties, const std::vector<int>& window) {
  Eigen::Matrix3Xd steps(3, static_cast<Eigen::Index>(window.size()) - 1);
  for (Eigen::Index k = 0; k < steps.cols(); ++k) {
    const auto from = static_cast<std::size_t>(k);
    const Eigen::Vector3d step = properties.r.col(window[from + 1]) - properties.r.col(window[from]);
    const double length = step.stableNorm();
    if (length == 0.0) return 0.0;
    steps.col(k) = step / length;
  }
  if (steps.cols() == 1) return 1.0;
  const Eigen::Vector3d normal = steps.col(0).cross(steps.col(1));
  return steps.cols() == 2 ? normal.norm() : std::abs(normal.dot(steps.col(2)));
}

std::vector<int> flattest_window(Recipe recipe, const MassProperties& properties,
                                 const std::vector<int>& numbering) {
  std::vector<int> flattest;
  double least = std::numeric_limits<double>::infinity();
  for_windows(numbering, window_size(recipe), 0, static_cast<int>(numbering.size()) - 1,
              [&](const std::vector<int>& window) {
                const double spread = window_spread(properties, window);
                if (spread >= least) return;
                least = spread;
                flattest = window;
              });
  return flattest;
}

std::vector<int> find_numbering(Recipe recipe, const MassProperties& properties) {
  const int size = window_size(recipe);
  std::vector<int> order(static_cast<std::size_t>(properties.r.cols()));
  std::iota(order.begin(), order.end(), 0);
  std::vector<int> best;
  Quality best_quality{std::numeric_limits<int>::max(), 0.0};
  // returns true if no better numbering is needed
  const auto take = [&](const std::vector<int>& numbering) {
    const Quality quality = quality_of(properties, numbering, size);
    if (best_quality < quality) {
      best = numbering;
      best_quality = quality;
    }
    return best_quality.num_flat == 0 && best_quality.least_spread >= kWellSpread;
  };

  if (take(insert_one_by_one(properties, order, size))) return best;
  // the last direction is oblique, so that few points of a lattice have the same coordinate along it
  Eigen::Matrix<double, 3, 4> directions;
  directions << Eigen::Matrix3d::Identity(), Eigen::Vector3d(1.0, 0.618, 0.382);
  for (int k = 0; k < 4; ++k) {
    const Eigen::VectorXd along = properties.r.transpose() * directions.col(k);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return along[a] < along[b]; });
    if (take(order) || take(insert_one_by_one(properties, order, size))) return best;
  }
  std::mt19937 engine(1);
  for (int k = 0; k < kRandomTries; ++k) {
    // std::shuffle gives different results in different libraries
    for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[engine() % i]);
    if (take(insert_one_by_one(properties, order, size))) return best;
  }
  return best;
}

}  // namespace freeflex
