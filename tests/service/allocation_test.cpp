// These tests check that the simulation thread allocates no memory after it has started. They are a separate
// program because they replace operator new.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <new>
#include <thread>

#include "tests/service/rig.hpp"
#include "tests/support/omissions.hpp"

namespace {
std::atomic<bool> is_counting{false};
std::atomic<int> num_allocations{0};
}  // namespace

// not inlined, because GCC 12 warns of a mismatch of malloc and delete if the pair is inlined
__attribute__((noinline)) void* operator new(std::size_t size) {
  if (is_counting) ++num_allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  if (is_counting) ++num_allocations;
  return std::malloc(size);
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  if (is_counting) ++num_allocations;
  const auto step = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(step, (size + step - 1) / step * step)) return memory;
  throw std::bad_alloc();
}
__attribute__((noinline)) void operator delete(void* memory) noexcept { std::free(memory); }
__attribute__((noinline)) void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace freeflex::testing {
namespace {

TEST(Loop, AllocatesNothingUnderCommandsAndAReset) {
  const Plan plan = octahedron_plan();
  Rig rig(plan, {.until_tick = 2000, .limits = {.sender_share = 1.0}});
  for (int i = 0; i < 300; ++i) {
    ForceCommand command = make_push(i + 1, i % 40, 5 * i);
    command.duration_ticks = 100;
    rig.push(command);
  }
  rig.control(freeflex_msgs::control_t::SHAPES, 1);
  rig.control(freeflex_msgs::control_t::RESET);
  rig.push(make_push(301, 1));
  is_counting = true;
  ::operator delete(::operator new(1));  // the counter must notice this allocation
  rig.simulation.run();
  is_counting = false;
  EXPECT_EQ(num_allocations.exchange(0), 1);
  EXPECT_EQ(rig.simulation.state().tick, 2000);
  rig.collect();
  EXPECT_EQ(rig.acks.size(), 303u + service::CommandQueue::kBusPending)
      << "every command is answered, and commands that wait at the reset are answered again";
}

TEST(Loop, AllocatesNothingOnTheFullRungWithAVerdict) {
  Scene scene = octahedron();
  publish_everything(scene);
  scene.fidelity = Fidelity::kFull;
  scene.verdict.horizon = 0.1;
  const Plan plan = reduced_plan_of(scene);
  ASSERT_GT(plan.coupled.num_substeps, 1);
  service::VerdictThread verdicts(plan);
  FakeClock clock;
  clock.on_sleep = [] { std::this_thread::sleep_for(std::chrono::microseconds(20)); };
  Rig rig(plan, {.until_tick = 400}, clock, 1, &verdicts);
  std::thread thread([&] { verdicts.run(); });
  rig.push(make_push(1, 0, 100));
  rig.control(freeflex_msgs::control_t::RESET);
  is_counting = true;
  ::operator delete(::operator new(1));  // the counter must notice this allocation
  rig.simulation.run();
  is_counting = false;
  verdicts.request_stop();
  thread.join();
  EXPECT_EQ(num_allocations.exchange(0), 1);
  EXPECT_EQ(rig.simulation.state().tick, 400);
  EXPECT_GE(verdicts.judged().tick, 0);
}

TEST(Loop, AllocatesNothingOnTheCoupledRungWithRigidLinksOrBodies) {
  for (const bool has_bodies : {false, true}) {
    Scene scene = octahedron();
    Link link;
    link.name = "more";
    link.points = {0, 1};
    link.kind = has_bodies ? LinkKind(Beam{1e4, 100.0, 100.0, 100.0, {0.1, 0.2, 1.0}}) : LinkKind(Rigid{});
    if (has_bodies) scene.points[0].inertia = Eigen::Vector3d(0.1, 0.15, 0.2).asDiagonal();
    scene.links.push_back(link);
    Group group;
    group.name = "first";
    group.points = {0, 2};
    scene.groups.push_back(group);
    publish_everything(scene);
    scene.fidelity = Fidelity::kCoupled;
    scene.verdict.horizon = 0.1;
    const Plan plan = reduced_plan_of(scene);
    ASSERT_NE(plan.coupled.kinetics.form, PlanKinetics::Form::kComplete);
    Rig rig(plan, {.until_tick = 400});
    rig.push(make_push(1, 0, 100));
    rig.control(freeflex_msgs::control_t::RESET);
    is_counting = true;
    ::operator delete(::operator new(1));  // the counter must notice this allocation
    rig.simulation.run();
    is_counting = false;
    EXPECT_EQ(num_allocations.exchange(0), 1);
    EXPECT_EQ(rig.simulation.state().tick, 400);
  }
}

// Returns the octahedron with two bodies with wheels and three beams with mass. A load of the scene drives
// one wheel and applies a torque to one body.
Scene with_wheels(Fidelity fidelity) {
  Scene scene = octahedron();
  for (int i = 0; i < 2; ++i) {
    scene.points[static_cast<std::size_t>(i)].inertia = Eigen::Vector3d(0.1, 0.15, 0.2).asDiagonal();
    scene.wheels.push_back({"wheel" + std::to_string(i), i, Eigen::Vector3d::UnitZ(), 0.3, {}});
  }
  for (int i = 0; i < 3; ++i) {
    Link link;
    link.name = "beam" + std::to_string(i);
    link.points = {i, i + 2};
    Beam beam{1e4, 100.0, 100.0, 100.0, {0.1, 0.2, 1.0}};
    beam.mass_per_length = 0.2;
    link.kind = beam;
    scene.links.push_back(link);
  }
  Load load;
  load.torques = {{1, {0.01, 0.02, 0.03}}};
  load.wheels = {{0, 0.01}};
  scene.loads.push_back(load);
  publish_everything(scene);
  scene.fidelity = fidelity;
  return scene;
}

TEST(Loop, AllocatesNothingWithWheelsTorquesAndDistributedMass) {
  for (const Fidelity fidelity : {Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled}) {
    const Plan plan = reduced_plan_of(with_wheels(fidelity));
    ASSERT_EQ(plan.wheels.size(), 2u);
    Rig rig(plan, {.until_tick = 400, .limits = {.sender_share = 1.0}});
    for (int i = 0; i < 3; ++i) {
      ForceCommand command = make_push(i + 1, i, 100 * i);
      command.duration_ticks = 50;
      command.num_wheels = 1;
      command.wheels[0] = {i % 2, 0, 0.02};
      command.num_torques = 1;
      command.torques[0] = {i % 2, 0, {0.1, 0.0, 0.2}};
      rig.push(command);
    }
    is_counting = true;
    ::operator delete(::operator new(1));  // the counter must notice this allocation
    rig.simulation.run();
    is_counting = false;
    EXPECT_EQ(num_allocations.exchange(0), 1);
    EXPECT_EQ(rig.simulation.state().tick, 400);
    EXPECT_NEAR(rig.simulation.state().wheel_momentum[0] - 0.3, plan.period * (400 * 0.01 + 100 * 0.02),
                1e-12)
        << "the angular impulse is that of the load and of two commands";
    EXPECT_EQ(rig.output->num_accepted.load(), 3);
  }
}

TEST(Loop, AllocatesNothingWhenItReplans) {
  // a plane ring of beams has separate modes out of its plane
  Scene scene = octahedron();
  for (PointMass& point : scene.points) point.position.z() = 0.0;
  scene.points[4].position = {1.0, 1.0, 0.0};
  scene.points[5].position = {-1.0, 1.0, 0.0};
  scene.links.clear();
  for (int i = 0; i < 6; ++i) {
    Link link;
    link.name = std::to_string(i);
    link.points = {i, (i + 1) % 6};
    link.kind = Beam{.EA = 1e5, .GJ = 30.0, .EI_y = 40.0, .EI_z = 50.0, .y_axis = Eigen::Vector3d::UnitZ()};
    scene.links.push_back(link);
  }
  publish_everything(scene);
  scene.leave_out.on_need = OnNeed::kReplan;
  const Plan plan = reduced_plan_of(scene);
  ASSERT_EQ(plan.fallback.size(), 1u);
  Rig rig(plan, {.until_tick = 600});
  rig.push(make_push(1, 0, 100));  // this push along (1, 2, 3) is out of the plane and has a moment
  rig.push(make_push(2, 1, 300));
  is_counting = true;
  ::operator delete(::operator new(1));  // the counter must notice this allocation
  rig.simulation.run();
  is_counting = false;
  EXPECT_EQ(num_allocations.exchange(0), 1);
  EXPECT_TRUE(rig.simulation.state().uses_fallback);
  EXPECT_EQ(rig.simulation.state().fallback_tick, 100);
}

}  // namespace
}  // namespace freeflex::testing
