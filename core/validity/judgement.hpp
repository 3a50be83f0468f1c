// One word on a motion: from what its rung neglects, over every point and every tick.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/step/budget.hpp"
#include "core/validity/modal_errors.hpp"
#include "core/validity/responsible.hpp"

namespace freeflex {

/// How far a motion can be trusted, and what the word goes by   (THEORY X144).
struct Verdict {
  enum class Word : std::int32_t { kGood = 0, kWatch = 1, kOutside = 2 };
  /// What is most in the way of a better word.
  enum class Cause : std::int32_t {
    kNone,
    kStiffness,    // stiffness by internal forces and spin, and Coriolis forces, that the rung neglects
    kBuckling,     // they take the stiffness of a mode away
    kSpinLoad,     // the centrifugal load
    kDeformation,  // second order of the displacements
    kSize,         // displacements beside the size of the body
    kLost,         // the reference solution diverged
    kIntegration,  // by the reference solution
    kStep,         // ticks are long for the turn of the body, for its orbit or for what vibrates
    kUnresolved,   // the reference solution does not resolve what vibrates
    kTruncation,   // modes that are left out
    kModel,        // by the reference solution
    kPosition,     // of points in space, by the reference solution
    kUnseen,       // what no table tells: the inside of links, wheels, what small modes carried
    kNotKept,      // the other modes of a structure of which the lowest alone were found
    kFastLoad,
    kAttractor,
    kRigid,
    kUnknown,
  };
  Word word = Word::kGood;
  Cause cause = Cause::kNone;
  std::int64_t tick = 0;
  // [m] sizes over all points, weighted with their masses
  double error = 0.0;             // estimate of the elastic displacement's error
  double unseen = 0.0;            // and what may come to it, by order of magnitude
  double displacement_now = 0.0;  // of the moment
  double scale = 0.0;       // what the error is judged against: the tolerance or the fading peak, if larger
  double position = 0.0;    // [m] error of points in space by the reference solution, rms; 0: none
  double rate = 0.0;        // [Hz] that would resolve how the body turns; 0: not what is wrong
  Responsible responsible;  // what the cause names; nothing where the word is good
};

/// "good", "watch", "outside".
const char* name_of(Verdict::Word word);
/// Returns the cause in words, with what is responsible by its name and what to do; empty when the word is
/// good.
std::string text_of(const Plan& plan, const Verdict& verdict);
/// Returns "good", or the word and its cause.
std::string describe(const Plan& plan, const Verdict& verdict);
/// Returns the estimated error of the displacements in plain words, such as "0.12 % of the tolerance, 1e-05
/// m".
std::string error_text(const Plan& plan, const Verdict& verdict);
/// Returns how much of `scale` an error is, both [m]: "0.12 % of", "more than 10 times".
std::string share_text(double error, double scale);

/// The word on a steady answer (X69): nothing rings, and loads of the scene take no part.  \pre quasi_static
/// gave the state
Verdict judge_steady(const Plan& plan, const State& state);

/// Judges one motion from its first tick on. Allocates nothing after construction.
class Judgement {
 public:
  explicit Judgement(const Plan& plan);

  /// The state at the start of an epoch, and after every tick.
  void take(const State& state, Budget& budget) noexcept;
  /// A state that is held for ever.
  void take_steady(const State& state) noexcept;
  const Verdict& now() const noexcept { return now_; }
  /// The worst since the epoch began: the first of the worst word; tick -1: every word was good.
  const Verdict& worst() const noexcept { return worst_; }
  double size() const noexcept { return size_; }  // [m] max |r|

 private:
  struct Beside {
    double elastic = 0.0, position = 0.0;  // [m] of horizons that are over, and of the one that runs
  };
  void begin(const State& state) noexcept;
  void read_beside(const State& state, Budget& budget) noexcept;
  void fall(const State& state) noexcept;
  void turn(const State& state) noexcept;
  void turn_coupled(const State& state) noexcept;
  void swing(const Vec3& w) noexcept;
  void bend_loads(const State& state, double turn) noexcept;
  void take_pushes(const State& state) noexcept;
  void judge(const State& state) noexcept;
  void name_responsible(const State& state, double by_pushes) noexcept;

  const Plan& plan_;
  std::vector<ModalErrors> errors_;  // of the plan, of its wide one
  bool is_wide_ = false, is_steady_ = false;
  // commands ring modes that are left out   (X124)
  double error_per_push_ = 0.0;  // [m/N]
  double push_fade_ = 1.0;       // [-] over a tick
  double pushed_ = 0.0;          // [N] largest sum of forces so far, faded
  std::int64_t epoch_ = -1, look_every_ = 1;
  double size_ = 0.0;
  double extent_ = 0.0;                    // [m] the same of the mass, where a point has moments
  double uneven_inertia_ = 0.0;            // [kg m^2] largest less least moment
  double room_ = 1.0;                      // for displacements beside the size
  double peak_ = 0.0;                      // [m] of the displacement, fading
  double fade_ = 1.0, beside_fade_ = 1.0;  // over a round, over a horizon
  Beside over_, running_;
  BudgetReading reading_;
  double fall_rate_ = 0.0,
         fall_ = 0.0;             // [m/s], [m] place by what an attractor's field has beyond its gradient
  double attractor_share_ = 0.0;  // [-] size over distance
  double turn_error_ = 0.0;       // [rad] of the attitude, by steps that are long for it
  // [-] largest share so far that a tick's turn had of what the most substeps resolve, [Hz] rate for the
  // whole
  double turn_share_ = 0.0, rate_for_turn_ = 0.0;
  struct Swing {
    std::array<Vec3, 2> before{};    // [rad/s] spin of the last two ticks
    std::array<double, 3> second{};  // [-] of the spin, second differences of the last three
    int num_ticks = 0;
    double angle = 0.0;  // [rad] of a tick, fading
  };
  Swing swing_;
  double bent_ = 0.0;  // [m] displacement by loads that turn within a tick, which modes take as straight
  // [m] what vibrates faster than steps resolve, [rad] how far the body has turned with such
  double unresolved_ = 0.0, unresolved_turn_ = 0.0;
  std::int32_t unresolved_mode_ = -1;  // the largest of those
  ResponsibleFinder responsible_;
  Verdict now_, worst_;
};

}  // namespace freeflex
