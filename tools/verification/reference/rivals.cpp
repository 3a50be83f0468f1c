#include "tools/verification/reference/rivals.hpp"

#include <utility>

#include "tools/verification/reference/body_system.hpp"
#include "tools/verification/reference/hand_written.hpp"
#include "tools/verification/reference/linearised.hpp"
#include "tools/verification/reference/packaged.hpp"
#include "tools/verification/reference/spring_network.hpp"
#include "tools/verification/reference/true_system.hpp"

namespace freeflex {

namespace {

/// Returns whether the method has a form for bodies, in which forces and free rotation take turns.
bool is_split(Rival rival) {
  return rival == Rival::kVerlet || (rival >= Rival::kStoermer8 && rival <= Rival::kStoermer16);
}

std::unique_ptr<SecondOrderSystem> make_system(Rival rival, const CartesianSystem& system,
                                               std::string& error) {
  if (!system.true_geometry) return SpringNetwork::make(system, error);
  if (BodySystem::fits(system)) {
    auto bodies = std::make_unique<BodySystem>(system);
    if (is_by_hand(rival) && !is_midpoint(rival))
      error = "the forces depend on velocities, for which the method is not made";
    return error.empty() ? std::move(bodies) : nullptr;
  }
  auto made = std::make_unique<TrueSystem>(system);
  if (is_midpoint(rival) && !made->depends_on_velocities())
    error = "the forces depend on positions alone, for which Stoermer's method is faster";
  else if (is_by_hand(rival) && !is_midpoint(rival) && made->depends_on_velocities())
    error = "the forces depend on velocities, for which the method is not made";
  return error.empty() ? std::move(made) : nullptr;
}

}  // namespace

std::unique_ptr<RivalMethod> make_rival(Rival rival, const CartesianSystem& system, std::string& error) {
  error.clear();
  if (is_linearised(rival) && system.true_geometry)
    error = "the method multiplies spring by spring, and is made for springs and bars only";
  else if (is_linearised(rival))
    return Linearised::make(rival, system, error);
  else if (is_midpoint(rival) && !system.true_geometry)
    error = "Stoermer's method is faster on springs and bars";
  if (!error.empty()) return nullptr;
  if (is_split(rival) && BodySystem::fits(system)) {
    auto bodies = std::make_unique<BodySystem>(system);
    if (!bodies->is_damped()) return make_body_method(rival, std::move(bodies));
  }
  std::unique_ptr<SecondOrderSystem> made = make_system(rival, system, error);
  if (!made) return nullptr;
  if (is_by_hand(rival)) return make_hand_written(rival, std::move(made));
  return std::make_unique<Packaged>(rival, std::move(made));
}

}  // namespace freeflex
