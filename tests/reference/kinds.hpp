// Random structures of every kind of link, body and load in motions with large rotations, and the error of
// the rung `corotational` on them.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "core/scene/scene.hpp"
#include "tests/reference/random.hpp"
#include "tools/verification/reference/cartesian.hpp"

namespace freeflex::testing {

/// The motion with which that of the rung is compared.
enum class Truth {
  kCartesian,  // Cartesian points, integrated by CVODE
  kCopy,       // the same, where point masses on rigid links replace bodies with inertia
  kForces,     // the same, with forces that the test adds to those of the reference
  kFine,       // the rung itself with a tick of 1/32 ms
};

/// A scene with its motion, and the system of Cartesian points that must move in the same way.
struct Specimen {
  Scene scene;
  Truth truth = Truth::kCartesian;
  // the scene of the reference, if it is another one; its first points are those of `scene`
  std::optional<Scene> points = {};
  // changes the system of the reference; may be empty
  std::function<void(CartesianSystem&)> complete = {};
  // a structure without superelements that the scene condenses, with the same points
  std::optional<Scene> whole = {};
};

/// A kind of link, body or load.
struct Kind {
  const char* name;
  Specimen (*make)(Random&);
  // bounds of the error at 1 ms [-] and of the order between 1 and 0.5 ms, see `true_kinds_test.cpp`
  double error, order;
};
const std::vector<Kind>& all_kinds();

inline constexpr double kEnd = 0.4;                                 // [s]
inline constexpr std::array<double, 4> kTicks{4.0, 2.0, 1.0, 0.5};  // [ms]

/// The errors of a specimen at kEnd.
struct KindErrors {
  Truth truth = Truth::kCartesian;
  double deflection = 0.0;  // [-] largest displacement over the largest distance from the centre of mass
  double rotation = 0.0;    // [rad] largest rotation rate times kEnd
  double phase = 0.0;       // [rad] advance of the fastest mode in 1 ms
  std::array<double, 4> error{};  // [-] largest distance of a point over the largest displacement, at kTicks
  double attitude = 0.0;          // [rad] rotation between the points of both motions at 1 ms
  double accuracy = 0.0;          // [-] error of a reference with 30 times the tolerance; 0 for Truth::kFine
  double whole = 0.0;             // [-] distance from the motion of `whole`, in the same measure as `error`
  double order = 0.0;             // [-] between 1 and 0.5 ms
};

/// Computes the errors of the structure of a kind that belongs to a seed.
KindErrors errors_of(const Kind& kind, unsigned seed);

/// Prints a row of the table: medians over the structures, and the largest error at 1 ms.
void print_row(const Kind& kind, const std::vector<KindErrors>& all);

/// Checks the bounds of a kind.
void check(const Kind& kind, const KindErrors& errors);

}  // namespace freeflex::testing
