// Free points and rigid bodies as the equations on which the methods run with which freeflex is compared
// (THEORY 13.22). A body has a centre of mass and a unit quaternion in place of many points with constraints.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "tools/verification/reference/second_order_system.hpp"

namespace freeflex {

/// The coordinates x are the displacement e [m] of each free point in a carrier that does not rotate, then
/// for each body the displacement of its centre of mass and its quaternion (w, x, y, z) from rest axes to the
/// carrier. v are their rates, and forces() returns accelerations, because inverse_mass() is one.
class BodySystem : public SecondOrderSystem {
 public:
  /// Returns whether every rigid link has points off a line, and no point is on two rigid links.
  static bool fits(const CartesianSystem& system);
  /// \pre fits(system)
  explicit BodySystem(const CartesianSystem& system);

  void begin_piece(double start, double end) override { piece_time_ = 0.5 * (start + end); }
  void set_accuracy(double displacement) override;
  /// Returns true, because the equation of a quaternion contains its rate.
  bool depends_on_velocities() const override { return true; }
  /// Returns whether the forces of links depend on velocities.
  bool is_damped() const { return is_damped_; }
  void forces(double t, const double* x, const double* v, double* f) override;
  void forces(Pair t, const Pair* x, Pair* f) override;
  SparsePattern make_pattern() override;
  void jacobian(const double* x, const double* v, std::span<double> values) override;
  void initial(std::span<double> x, std::span<double> v) const override;
  void to_world(double t, std::span<const double> x, std::span<const double> v,
                CartesianState& state) const override;
  const CartesianSystem& system() const override { return system_; }
  std::size_t memory() const override;

  // The same equations in momenta, for a splitting of rotation and forces. u holds velocities, and for the
  // rotation of a body its angular momentum in its own axes, J w + h, in the first three of four numbers.
  void to_momenta(double t, const double* x, const double* v, double* u) const;
  void from_momenta(double t, const double* x, const double* u, double* v) const;
  /// Computes u' of the forces alone.  \pre !is_damped()
  void kicks(double t, const double* x, double* u_dot);
  /// Returns the kicks of the last forces().
  const std::vector<double>& last_kicks() const { return kick_; }
  /// Completes the kicks to accelerations, as forces() returns them.
  void accelerate(double t, const double* x, const double* v, const double* u_dot, double* f) const;
  /// Moves all points and bodies without forces over h [s], with the wheels of time t. Rotations are made
  /// about the principal axes in turns, forwards and backwards, which is symmetric and has order 2
  /// (THEORY 13.23).
  void drift(double t, double h, double* x, double* u) const;

 private:
  struct Body {
    double mass = 0.0;                                 // [kg]
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // [m] at rest
    Eigen::Matrix3d J, inverse;                        // [kg m^2], [1/(kg m^2)] about the centre
    Eigen::Matrix3d axes;                              // principal axes
    Eigen::Vector3d moments;                           // [kg m^2] principal moments
    std::vector<int> points;
    std::vector<Eigen::Vector3d> arms;  // [m] from the centre at rest
  };
  BodyMoments moments_of(int body, double t, const Eigen::Matrix3d& R, const Eigen::Matrix3d& R_CB) const;
  void place(const double* x, const double* v);
  std::size_t at(std::size_t body) const { return 3 * free_.size() + 7 * body; }

  CartesianSystem system_;  // without spin of the carrier
  std::vector<int> free_;   // points off bodies
  std::vector<Body> bodies_;
  bool is_damped_ = false, has_moments_ = false;
  double piece_time_ = 0.0, size_ = 0.0, rate_ = 0.0;
  Eigen::Matrix3Xd e_, e_dot_, force_;      // of all points
  std::vector<Eigen::Matrix3d> rotations_;  // of bodies
  std::vector<double> kick_, x_one_, v_one_, f_one_, f_before_;
};

class HandWritten;
enum class Rival;
/// Makes Verlet's or Stoermer's method for bodies, by the splitting (13.23).
/// \pre !system->is_damped(); the rival is one of these methods
std::unique_ptr<HandWritten> make_body_method(Rival rival, std::unique_ptr<BodySystem> system);

}  // namespace freeflex
