#include "tests/support/mixed_structures.hpp"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <random>
#include <string>

namespace freeflex::testing {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;

class Builder {
 public:
  Builder(std::uint64_t seed, int num_points, const Mixture& mixture) : engine_(seed) {
    scene_.name = "random mixture " + std::to_string(seed);
    place_points(num_points);
    // the first links form a tree of beams, in which a beam joins each point to the nearest earlier point
    for (int i = 1; i < num_points; ++i) add({nearest_before(i), i}, beam(mixture.releases && i % 5 == 0));
    for (int k = 0; k < num_points / 2; ++k) {
      const std::vector<int> two = pick(2);
      if (k % 3 == 0)
        add(two, Bar{uniform(3e3, 3e4)});
      else
        add(two, Spring{uniform(1e3, 1e4)});
    }
    if (mixture.plates)
      for (int k = 0; k < 2; ++k) add(pick_spread(3), Plate{uniform(3e6, 2e7), uniform(0.0, 0.4), 0.03});
    if (mixture.angles) {
      add(pick_spread(3), BendingSpring{uniform(100.0, 1e3)});
      add(pick_spread(4), TorsionSpring{uniform(100.0, 1e3)});
    }
    if (mixture.matrices)
      for (const bool is_flexibility : {false, true}) add_matrix(is_flexibility);
    if (mixture.rigid) add(pick_spread(engine_() % 2 == 0 ? 2 : 3), Rigid{});
  }
  Scene take() { return std::move(scene_); }

 private:
  // the C++ standard defines the numbers of the engine, but not those of the library's distributions
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  const Vector3d& at(int point) const { return scene_.points[static_cast<std::size_t>(point)].position; }

  void place_points(int num_points) {
    while (static_cast<int>(scene_.points.size()) < num_points) {
      PointMass point;
      point.name = std::string("p").append(std::to_string(scene_.points.size()));
      point.mass = uniform(0.3, 3.0);
      point.position = {uniform(-1.5, 1.5), uniform(-1.0, 1.0), uniform(-0.7, 0.7)};
      const bool is_free =
          std::all_of(scene_.points.begin(), scene_.points.end(),
                      [&](const PointMass& other) { return (other.position - point.position).norm() > 0.5; });
      if (is_free) scene_.points.push_back(point);
    }
  }

  int nearest_before(int i) const {
    int nearest = 0;
    for (int j = 1; j < i; ++j)
      if ((at(j) - at(i)).norm() < (at(nearest) - at(i)).norm()) nearest = j;
    return nearest;
  }

  std::vector<int> pick(int count) {
    std::vector<int> all(scene_.points.size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<int>(i);
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
      std::swap(all[i], all[i + engine_() % (all.size() - i)]);
    all.resize(static_cast<std::size_t>(count));
    return all;
  }

  // Returns random points of which no three successive points are nearly collinear.
  std::vector<int> pick_spread(int count) {
    for (;;) {
      const std::vector<int> points = pick(count);
      bool is_spread = true;
      for (std::size_t k = 2; k < points.size(); ++k) {
        const Vector3d a = (at(points[k - 2]) - at(points[k - 1])).normalized();
        const Vector3d b = (at(points[k]) - at(points[k - 1])).normalized();
        is_spread = is_spread && a.cross(b).norm() > 0.5;
      }
      if (is_spread) return points;
    }
  }

  Beam beam(bool is_released) {
    Beam beam{uniform(1e4, 1e5), uniform(100.0, 500.0), uniform(100.0, 1e3), uniform(100.0, 1e3)};
    if (engine_() % 3 == 0) beam.GA_y = uniform(1e3, 1e4);
    // a hinge at one end about a transverse axis
    if (is_released) beam.released[engine_() % 2][1 + engine_() % 2] = true;
    return beam;
  }

  // Adds a matrix link between four points. The matrix is the linear stiffness of springs between all pairs
  // of the points, or the flexibility of these springs under balanced loads.
  void add_matrix(bool is_flexibility) {
    const std::vector<int> points = pick_spread(4);
    MatrixXd K = MatrixXd::Zero(12, 12);
    for (Eigen::Index i = 0; i < 4; ++i)
      for (Eigen::Index j = 0; j < i; ++j) {
        const Vector3d u =
            (at(points[static_cast<std::size_t>(i)]) - at(points[static_cast<std::size_t>(j)])).normalized();
        const Eigen::Matrix3d k = uniform(1e3, 5e3) * u * u.transpose();
        K.block<3, 3>(3 * i, 3 * i) += k;
        K.block<3, 3>(3 * j, 3 * j) += k;
        K.block<3, 3>(3 * i, 3 * j) -= k;
        K.block<3, 3>(3 * j, 3 * i) -= k;
      }
    if (is_flexibility) K = K.completeOrthogonalDecomposition().pseudoInverse().eval();
    MatrixLink matrix;
    matrix.matrix = (0.5 * (K + K.transpose())).sparseView(0.0, 0.0);
    matrix.is_flexibility = is_flexibility;
    add(points, matrix);
  }

  void add(const std::vector<int>& points, const LinkKind& kind) {
    Link link;
    link.name = std::string("l").append(std::to_string(scene_.links.size()));
    link.points = points;
    link.kind = kind;
    scene_.links.push_back(link);
  }

  std::mt19937_64 engine_;
  Scene scene_;
};

}  // namespace

Scene random_mixture(std::uint64_t seed, int num_points, const Mixture& mixture) {
  return Builder(seed, num_points, mixture).take();
}

}  // namespace freeflex::testing
