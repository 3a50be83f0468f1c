// CPU time of this thread, and errors of a motion against the reference's.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "core/reference/cartesian.hpp"
#include "core/structure/structure.hpp"

namespace freeflex::tools {

/// [s] CPU time of the calling thread.
double thread_cpu();

struct Timing {
  double seconds = 0.0;  // median CPU time of one call
  int repeats = 0;       // calls
};
/// Calls `work` at least `repeats` times and for at least 15 ms each on the whole; once when one call takes
/// more than 0.3 s.
Timing time_work(const std::function<void()>& work, int repeats);

/// What one run leaves for the errors: the end, and the motion each 10 ms.
struct Motion {
  CartesianState end;
  std::vector<Eigen::Matrix3Xd> frames;            // [m] positions at k * 10 ms, k from 1
  std::optional<double> energy_start, energy_end;  // [J] when the loads end, and at the end
};

/// Errors of motions of one scene against the reference's.
class ErrorMeter {
 public:
  ErrorMeter(const CartesianSystem& system, const Structure& structure, double free_from, Motion reference);

  Eigen::Matrix3Xd displacements(const Eigen::Matrix3Xd& p_W) const;
  double elastic(const Eigen::Matrix3Xd& p_W) const;               // [-]
  double position(const Eigen::Matrix3Xd& p_W) const;              // [m]
  double attitude(const Eigen::Matrix3Xd& p_W) const;              // [rad]
  std::optional<double> frequency(const Motion& motion) const;     // [-] (THEORY X118)
  std::optional<double> energy_drift(const Motion& motion) const;  // [-] (THEORY X119)

 private:
  std::vector<double> coordinate(const Motion& motion, const Eigen::Matrix3Xd& weights) const;
  std::optional<double> frequency_of(const std::vector<double>& samples) const;  // [rad/s]
  void choose_mode(const Structure& structure);

  const CartesianSystem& system_;
  Motion reference_;
  Eigen::Matrix3Xd u_;           // [m] of the reference at the end
  Eigen::Matrix3d rotation_;     // of the reference at the end
  std::size_t first_frame_ = 0;  // after the loads
  Eigen::Matrix3Xd weights_;     // coordinate of the mode that moves most; empty: none to be seen
  double omega_ = 0.0;           // [rad/s] of that mode
  std::optional<double> reference_frequency_;
  double elastic_energy_ = 0.0;  // [J] of the reference when the loads end
};

inline constexpr double kFramePeriod = 0.01;  // [s]

/// Kinetic and strain energy of the full system [J].
double total_energy(const CartesianSystem& system, const CartesianState& state);

}  // namespace freeflex::tools
