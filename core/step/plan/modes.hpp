// The part of a plan that advances the elastic coordinates.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/step/array.hpp"
#include "core/step/plan/coupled.hpp"

namespace freeflex {

/// Holds the exact step of each mode over one period, y = (q, q'), for Q linear within the step:
///   y^1 = (C + L) y^0 + w_0 Q^0 + w_1 (Q^1 - Q^0)   (THEORY 6.1, 6.5)
/// C + L is the exact propagator. C holds the leading 26 bits of each entry of this propagator, so that the
/// product of C with the leading 26 bits of y is exact. L holds the rest of each entry, rounded to double.
/// The coefficients of kLanes modes are stored side by side, in the order in which the step reads them, so
/// that the step reads one stream of memory instead of twelve. Padding is zero.
struct Propagator {
  struct alignas(64) Lanes {
    using Lane = std::array<double, kLanes>;
    Lane c_qq{}, c_qv{}, l_qq{}, l_qv{};  // [-], [s]; parts C, then parts L
    Lane w_q0{}, w_q1{};                  // [m/N] weights of Q at the start, and of its change over the step
    Lane c_vq{}, c_vv{}, l_vq{}, l_vv{};  // [1/s], [-]; parts C, then parts L
    Lane w_v0{}, w_v1{};                  // [m/(s N)]
  };
  std::vector<Lanes> lanes;  // (num_moving / kLanes); empty if damping is omitted

  /// Holds the step of modes without decay. For these modes c_vv and l_vv equal c_qq and l_qq to the bit.
  struct alignas(64) UndampedLanes {
    using Lane = std::array<double, kLanes>;
    Lane c_qq{}, c_qv{}, l_qq{}, l_qv{};
    Lane w_q0{}, w_q1{};
    Lane c_vq{}, l_vq{};
    Lane w_v0{}, w_v1{};
  };
  std::vector<UndampedLanes> undamped;  // (num_moving / kLanes) if damping is omitted, else empty
};

/// Holds the data of modes that dashpots and feedback couple   (THEORY 8.30 to 8.41).
struct PlanModalCoupling {
  enum class Path : std::int32_t {
    kNone = 0,
    kExact = 1,  // the coupled modes are advanced by their matrix exponential   (THEORY 8.34)
    kSplit = 2,  // a splitting impulse is applied, the modes are advanced without coupling, and a second
                 // splitting impulse is applied; order 2   (THEORY 8.38)
  };
  Path path = Path::kNone;
  Array damping_rows;  // [sqrt(N s/m)] (num_damping x num_padded) R: the generalized forces of the dashpots
                       // are -R^T R q'
  std::int32_t num_damping = 0;     // number of rows of damping_rows
  std::vector<std::int32_t> modes;  // kExact: coupled modes, ascending
  // kExact: (q, q') of the coupled modes at the end of the step is the sum of these columns times the entries
  // of (q^0, q'^0, Q^0, Q^1 - Q^0)
  // [-], [s], [1/s], [m/N], [m/(s N)] (4 num_modes columns of pad(2 num_modes)) column-major
  Array columns;
  static constexpr int kLoadRows = 16;  // twelve, padded to kLanes
  // kExact: these columns give the force and torque of feedback on the body at the start of the step, then at
  // the end of the step. Between the two times the load is linear in time, and its impulse and the first
  // moment of the impulse are exact (THEORY 8.37). The array is empty without feedback.
  Array load_columns;  // [N], [N m] per (m, m/s, N, N) (4 num_modes columns of kLoadRows) column-major
  // kSplit: the splitting impulse is q' += impulse_out^T (impulse_q_rows q + impulse_q_dot_rows q')
  // (THEORY 8.40)
  std::int32_t num_impulses = 0;
  Array impulse_q_rows, impulse_q_dot_rows, impulse_out;  // (num_impulses x num_padded)
};

/// Holds the elastic modes and the coefficients of their step.
struct PlanModes {
  std::int32_t num_elastic = 0;
  std::int32_t num_moving = 0;  // number of modes that the step advances: num_elastic padded to a multiple of
                                // kLanes
  // num_moving plus the constraint shapes, padded. The coordinates of constraint shapes stay zero, but their
  // Q is the load on the rigid links   (THEORY 5.6, 5.7)
  std::int32_t num_padded = 0;
  Array omega;              // [rad/s] (num_padded), padding 0
  Array decay;              // [1/s] (num_padded) minus the real part of the damped root   (THEORY 4.23)
  bool has_damping = true;  // false: omitted   (THEORY section 14)
  Propagator propagator;
  PlanModalCoupling modal_coupling;
  PlanCoupled coupled;
  std::vector<std::int32_t> mode_numbers;  // (num_elastic) numbers in the scene, from 1; empty: all
  std::vector<std::vector<std::int32_t>> mechanisms;  // the points that each mechanism moves
};

}  // namespace freeflex
