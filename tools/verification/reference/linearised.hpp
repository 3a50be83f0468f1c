// The linearised system in sparse form. The rigid body moves independently of the deformation, and the
// springs act along their rest directions in body axes. These are the equations of the `spin-loaded` rung,
// but without modes, so the linearised system has the model error of that rung (THEORY 13.8 to 13.14).
#pragma once

#include <memory>
#include <vector>

#include "tools/verification/reference/lanczos.hpp"
#include "tools/verification/reference/rivals.hpp"

namespace freeflex {

class Linearised : public RivalMethod {
 public:
  /// Makes the method. Returns nullptr and sets `error` for attractors, dissipation and collinear shapes.
  /// \pre rival is kLeapfrog or kKrylov
  static std::unique_ptr<RivalMethod> make(Rival rival, const CartesianSystem& system, std::string& error);
  RivalRun run(std::span<const double> times, const RivalOptions& options, const RivalSink& sink) override;

 private:
  /// The state of the rigid body: the motion of the centre of mass relative to its free fall, the angular
  /// momentum and the attitude.
  struct Frame {
    Eigen::Vector3d p_WB, v_WB, H_W;  // [m], [m/s], [kg m^2/s]
    Eigen::Quaterniond q_WB;
  };
  struct FrameRate {
    Eigen::Vector3d v_WB, a_WB, moment_W;  // [m/s], [m/s^2], [N m]
    Eigen::Vector4d q_WB_dot;              // [1/s] x y z w
  };
  // Is called when y_ and y_dot_ hold the motion at t [s] after the start of the step
  using Read = std::function<void(double t)>;

  Linearised(Rival rival, const CartesianSystem& system);
  void set_initial();
  void add_forces(const Frame& frame, double t, Eigen::Matrix3Xd& force_B) const;
  bool is_loaded() const;
  FrameRate rate(const Frame& frame, double t) const;
  Frame advance(const Frame& frame, double t, double h) const;
  Eigen::Vector3d spin(const Frame& frame) const;
  /// Computes the load g [N/sqrt(kg)]   (THEORY 13.8).
  void elastic_load(const Frame& frame, double t, Eigen::VectorXd& g) const;
  void apply(const double* y, double* out) const;  // out = A y   (THEORY 13.10)
  void leapfrog(double span, double step, std::span<const double> reads, const Read& read);
  std::string krylov(double span, const RivalOptions& options, std::span<const double> reads,
                     const Read& read);
  /// Takes one step of `span` [s] from t to frame_end_, and reports the motion at the requested times within
  /// the step.
  std::string step(const Frame& frame, double t, double span, const RivalOptions& options,
                   std::span<const double> times, std::size_t& next, const RivalSink& sink);
  double load_step(const RivalOptions& options) const;  // [s] time over which the load is taken as linear
  std::size_t memory() const;                           // [bytes]
  void write_state(const Frame& frame, double t, CartesianState& state) const;

  struct Row {
    std::int32_t first, second;                 // index of the x component
    std::array<double, 3> at_first, at_second;  // [1/s] sqrt(D / m) u at each end
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
  Eigen::VectorXd y_, y_dot_;  // [m sqrt(kg)], [m sqrt(kg)/s] sqrt(m) V and its rate
  Eigen::VectorXd g_, dg_;     // [N/sqrt(kg)] load at the start of the step, and its change over the step
  // w_: in `leapfrog`, y_dot half a step ahead of y; in `krylov`, the acceleration at the start of the step.
  // y_ahead_: y at the end of a leapfrog step, while y_ is y at a requested time
  Eigen::VectorXd w_, acceleration_, y_ahead_;
  LanczosSpace from_force_, from_velocity_, from_change_;
  long num_applied_ = 0;
  mutable Eigen::Matrix3Xd force_B_;
};

}  // namespace freeflex
