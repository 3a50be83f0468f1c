// Measures CPU time of a thread, and errors of a motion against the reference.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "core/structure/structure.hpp"
#include "tools/verification/reference/cartesian.hpp"

namespace freeflex::tools {

/// Returns the CPU time [s] of the calling thread.
double thread_cpu();

struct Timing {
  double seconds = 0.0;  // median CPU time of one call
  int repeats = 0;       // number of calls
};
/// Calls `work` at least `repeats` times and for at least `repeats` times 15 ms in total, but only once if
/// one call takes more than 0.3 s.
Timing time_work(const std::function<void()>& work, int repeats);

/// The motion of one run, with the state at the end and positions every 10 ms.
struct Trajectory {
  CartesianState end;
  std::vector<Eigen::Matrix3Xd> frames;  // [m] positions at the times k * 10 ms, k from 1
  // [J] energy at the time when the loads end, and at the end of the run
  std::optional<double> energy_start, energy_end;
};

/// Computes the errors of motions of one scene relative to the reference.
class ErrorMeter {
 public:
  ErrorMeter(const CartesianSystem& system, const Structure& structure, double free_from,
             Trajectory reference);

  Eigen::Matrix3Xd displacements(const Eigen::Matrix3Xd& p_W) const;
  double elastic(const Eigen::Matrix3Xd& p_W) const;                   // [-]
  double position(const Eigen::Matrix3Xd& p_W) const;                  // [m]
  double attitude(const Eigen::Matrix3Xd& p_W) const;                  // [rad]
  std::optional<double> frequency(const Trajectory& motion) const;     // [-] (THEORY 13.16)
  std::optional<double> energy_drift(const Trajectory& motion) const;  // [-] (THEORY 13.17)

 private:
  std::vector<double> coordinate(const Trajectory& motion, const Eigen::Matrix3Xd& weights) const;
  std::optional<double> frequency_of(const std::vector<double>& samples) const;  // [rad/s]
  void choose_mode(const Structure& structure);

  const CartesianSystem& system_;
  Trajectory reference_;
  Eigen::Matrix3Xd u_;           // [m] displacements of the reference at the end
  Eigen::Matrix3d rotation_;     // rotation of the reference at the end
  std::size_t first_frame_ = 0;  // first frame after the loads end
  // weights of the points in the coordinate of the mode that moves most; empty if there is no such mode
  Eigen::Matrix3Xd weights_;
  double omega_ = 0.0;  // [rad/s] frequency of the mode that moves most
  std::optional<double> reference_frequency_;
  double elastic_energy_ = 0.0;  // [J] elastic energy of the reference at the end of the run
};

inline constexpr double kFramePeriod = 0.01;  // [s]

/// Returns the kinetic and strain energy of the full system [J].
double total_energy(const CartesianSystem& system, const CartesianState& state);

}  // namespace freeflex::tools
