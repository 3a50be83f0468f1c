// Curvilinear coordinates of stiff modes, most of them axial, and their filter. A bending deflection shortens
// the chord of a link by an amount of second order. In linear coordinates the stiff axial modes follow this
// shortening one stage late, and steps of more than a fraction of their period fail. So these modes are
// measured from the shortening   (THEORY 12.77 to 12.83, 12.96).
#pragma once

#include <array>
#include <span>

#include "core/step/links/true_links.hpp"
#include "core/step/plan.hpp"

namespace freeflex {

/// Holds the linear deformation of the soft modes that shortens links, per link and plate.
struct CurveShape {
  struct Slope {
    Vec3 x{}, y{};  // [-] gradients of the displacement along the local axes of a plate
  };
  // (9 x kLanes in each block of links) [m] displacement of the second point across the link, [rad]
  // difference and sum of the rotations of its ends relative to the chord
  Array bends;
  std::vector<Slope> slopes;
};

struct CurveWorkspace {
  CurveShape of_q, of_p, of_rate, of_acceleration;
  std::vector<Vec3> V, W;    // [m], [m/s] (num_points)
  Array soft, other;         // (num_padded) coordinates without those of the curvilinear modes
  Array theta, other_theta;  // (3 num_joints + 3 num_bodies) rotations at these
  Array links;  // (6 x kLanes in each block of links) direction, then 1 / L, L / 12, 2 L skew_bow; no bow of
                // bars
  // [m] of links, then [-] three of each plate (num strains)   (THEORY 12.78)
  std::array<Array, 2> strain;
  std::array<Array, 2> share;  // [m] (num modes) of these strains in the foreshortening
  Array s, s_dot;              // [m], [m/s] (num modes) foreshortening and its rate
  Array q, p;                  // (num_padded) linear coordinates of a stage
  // [m], [m/s] (num modes) slow motion of the curvilinear modes, from which the filter measures, and what was
  // tried before: the last two slow motions and how far their images are from them
  Array slow_q, slow_p;
  std::array<Array, 2> tried, missed;
  Array miss;
  int num_tried = 0;  // number of trials made in this stage; 0: its iteration has not begun
};

CurveWorkspace make_curve_workspace(const StepPlan& plan);
inline bool is_curved(const StepPlan& plan) noexcept { return !plan.coupled.curve.stiff.empty(); }

/// Sets w.s, w.s_dot and the shapes of q and p, and with them the linear coordinates w.q, w.p:
///   q_f = y_f + s_f(q_S),   p_f = v_f + s_f'(q_S) p_S   (THEORY 12.79)
/// \param y, v  (num_padded) the curvilinear coordinates of stiff modes, the linear ones of all others
void to_linear(const StepPlan& plan, const double* y, const double* v, CurveWorkspace& w) noexcept;
/// Sets y and v from linear coordinates, which it copies to w.q and w.p.
void to_curved(const StepPlan& plan, const double* q, const double* p, double* y, double* v,
               CurveWorkspace& w) noexcept;

/// Sets q and p to y and v with those of curvilinear modes filtered towards the slow motion w.slow_q,
/// w.slow_p:
///   y_hat + sigma (y - y_hat),   sigma = (sin(omega h) / (omega h))^2, 0 beyond pi   (THEORY 12.82)
void filter(const StepPlan& plan, const double* y, const double* v, Array& q, Array& p,
            const CurveWorkspace& w) noexcept;

/// Improves the slow motion from the rates at a stage, which are those at the present one. Its image is
///   y_hat = (n_y - 2 decay v_hat + n_q') / omega^2,   v_hat = -n_q   (THEORY 12.83)
/// and the next one extrapolates from the images of the last three   (THEORY 12.96).
/// \return  [m/s^2] distance of the image, (sum_f omega_f^4 (image - y_hat)^2)^(1/2)
double improve_slow_motion(const StepPlan& plan, const double* rate_q, const double* rate_p,
                           const double* rate_q_dot, CurveWorkspace& w) noexcept;
/// Returns the same norm of the slow motion minus a share of `other` (num modes).
double distance_of_slow_motion(const StepPlan& plan, const CurveWorkspace& w, const Array& other,
                               double share) noexcept;

/// Changes the rates of the linear coordinates, without the linear motion of each mode, into those of the
/// curvilinear ones   (THEORY 12.80):
///   y' = v + n_q,F - s' n_q,S,   v' = -omega^2 y + n_p,F - omega^2 s - s'(q_S) p_S' - s'(q_S') p_S
/// \pre w has the shapes of the same q and p
void curve_rates(const StepPlan& plan, double* rate_q, double* rate_p, CurveWorkspace& w) noexcept;

/// Adds to the generalized forces Q [N] and to the accelerations, if there are any, what damping of y' in
/// place of q' changes: 2 decay s'(q_S) q_S'   (THEORY 12.80).  \pre curve_rates() was called at the same q
/// and p
void undamp_foreshortening(const StepPlan& plan, const CurveWorkspace& w, Array& Q, Array& q_ddot) noexcept;

}  // namespace freeflex
