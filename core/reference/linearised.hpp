// The linearised system as a sparse one: the rigid body as it moves by itself, and beside it springs along
// their rest directions, with the load in body axes. What it solves is the spin-loaded rung's motion without
// modes, so it has that rung's model error   (THEORY X114-X116).
#pragma once

#include <memory>
#include <vector>

#include "core/reference/lanczos.hpp"
#include "core/reference/rivals.hpp"

namespace freeflex {

class Linearised : public RivalMethod {
 public:
  /// \pre rival is kLeapfrog or kKrylov. nullptr and `error` for attractors, dissipation and collinear
  /// shapes.
  static std::unique_ptr<RivalMethod> make(Rival rival, const CartesianSystem& system, std::string& error);
  RivalRun run(std::span<const double> times, const RivalOptions& options, const RivalSink& sink) override;

 private:
  /// The rigid body: centre of mass less its free fall, momentum and attitude.
  struct Frame {
    Eigen::Vector3d p, v, H_W;  // [m], [m/s], [kg m^2/s]
    Eigen::Quaterniond q_WB;
  };
  struct FrameRate {
    Eigen::Vector3d v, a, moment_W;
    Eigen::Vector4d q;  // x y z w
  };
  using Read = std::function<void(double t)>;  // with y_, y_dot_ as they are at t [s] from the step's start

  Linearised(Rival rival, const CartesianSystem& system);
  void set_initial();
  void add_forces(const Frame& frame, double t, Eigen::Matrix3Xd& force_B) const;
  bool is_loaded() const;
  FrameRate rate(const Frame& frame, double t) const;
  Frame advance(const Frame& frame, double t, double h) const;
  Eigen::Vector3d spin(const Frame& frame) const;
  void elastic_load(const Frame& frame, double t, Eigen::VectorXd& g) const;
  void apply(const double* y, double* out) const;  // out = A y
  void leapfrog(double span, double step, std::span<const double> reads, const Read& read);
  std::string krylov(double span, const RivalOptions& options, std::span<const double> reads,
                     const Read& read);
  /// One step of `span` [s] from t, its end frame in frame_end_, and what is read within it.
  std::string step(const Frame& frame, double t, double span, const RivalOptions& options,
                   std::span<const double> times, std::size_t& next, const RivalSink& sink);
  double load_step(const RivalOptions& options) const;  // [s] over which the load is linear
  std::size_t memory() const;                           // [bytes]
  void write_state(const Frame& frame, double t, CartesianState& state) const;

  struct Row {
    std::int32_t first, second;                 // index of the x component
    std::array<double, 3> at_first, at_second;  // [1/s] sqrt(k / m) u at each end
  };
  Rival rival_;
  const CartesianSystem& system_;
  Eigen::Matrix3d inertia_, inverse_inertia_;
  Eigen::VectorXd root_mass_;  // [sqrt kg] (3N)
  Eigen::MatrixXd rigid_;      // (3N x 6) orthonormal rigid motions in y = sqrt(m) V
  std::vector<Row> rows_;
  double piece_time_ = 0.0;  // [s]
  Frame start_, frame_end_;
  CartesianState state_;
  Eigen::VectorXd y_, y_dot_;  // [m sqrt kg], [m sqrt kg / s] elastic
  Eigen::VectorXd g_, dg_;     // [N / sqrt kg] load at the step's start, and its change over the step
  Eigen::VectorXd w_, acceleration_, y_ahead_;
  LanczosSpace from_force_, from_velocity_, from_change_;
  long num_applied_ = 0;
  mutable Eigen::Matrix3Xd force_B_;
};

}  // namespace freeflex
