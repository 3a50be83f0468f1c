// hash_steps PLAN TICKS [--flip] steps a plan under random commands and prints one hash over all bits of
// every state, of every distance from the shadow, and of the read-outs at every 64th tick. The option --flip
// changes the last bit of one force in one command.
#include <xxhash.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <random>
#include <vector>

#include "core/error/shadow.hpp"
#include "core/plan/file/plan_bytes.hpp"
#include "core/step/readout.hpp"
#include "core/step/step.hpp"

namespace {

using namespace freeflex;

class Hash {
 public:
  Hash() : state_(XXH3_createState()) { XXH3_64bits_reset(state_); }
  Hash(const Hash&) = delete;
  Hash& operator=(const Hash&) = delete;
  ~Hash() { XXH3_freeState(state_); }
  template <class Numbers>
  void add(const Numbers& numbers) {
    XXH3_64bits_update(state_, numbers.data(), numbers.size() * sizeof(numbers[0]));
  }
  unsigned long long value() const { return XXH3_64bits_digest(state_); }

 private:
  XXH3_state_t* state_;
};

/// Makes a seeded sequence of commands from the raw numbers of the engine. The C++ standard defines these
/// numbers, so the sequence is the same on every machine.
class Commands {
 public:
  explicit Commands(const Plan& plan) : plan_(plan) {}

  ForceCommand next() {
    ForceCommand command{};
    command.sender[0] = static_cast<char>('a' + below(3));
    command.sequence = ++sequence_;
    command.slot = static_cast<std::int32_t>(below(4));
    command.axes = static_cast<std::int32_t>(below(2));
    const bool is_lease = below(2) == 1;
    (is_lease ? command.lease_ticks : command.duration_ticks) = static_cast<std::int64_t>(1 + below(200));
    command.num_points =
        static_cast<std::int32_t>(below(6));  // 0: no force on a point; without any load, clears the slot
    for (std::int32_t k = 0; k < command.num_points; ++k) {
      auto& each = command.points[static_cast<std::size_t>(k)];
      each.point = static_cast<std::int32_t>((below(2) + 2 * static_cast<unsigned>(k)) % plan_.points.size());
      each.force = vector(1.0);
    }
    command.num_wrenches = static_cast<std::int32_t>(below(3));
    for (std::int32_t k = 0; k < command.num_wrenches; ++k) {
      auto& each = command.wrenches[static_cast<std::size_t>(k)];
      each.group = static_cast<std::int32_t>((below(2) + 2 * static_cast<unsigned>(k)) % plan_.groups.size());
      each.force = vector(1.0);
      each.torque = vector(0.1);
    }
    add_torques(command);
    return command;
  }
  unsigned below(unsigned limit) { return static_cast<unsigned>(engine_() % limit); }

 private:
  // adds torques on bodies and wheels if the plan has wheels
  void add_torques(ForceCommand& command) {
    const auto num_wheels = static_cast<unsigned>(plan_.wheels.size());
    if (num_wheels == 0) return;
    const auto num_turning = static_cast<unsigned>(plan_.particles.attitude_points.size());
    command.num_torques = static_cast<std::int32_t>(below(2));
    command.torques[0] = {plan_.particles.attitude_points[below(num_turning)], 0, vector(0.1)};
    command.num_wheels = static_cast<std::int32_t>(below(2));
    command.wheels[0] = {static_cast<std::int32_t>(below(num_wheels)), 0, vector(0.01)[0]};
  }
  Vec3 vector(double size) {
    Vec3 v{};
    for (double& x : v) x = size * (static_cast<double>(engine_() >> 11) * 0x1p-52 - 1.0);
    return v;
  }
  const Plan& plan_;
  std::mt19937_64 engine_{20260101};
  std::int64_t sequence_ = 0;
};

void add_motion(const State& s, Hash& hash) {
  for (const Vec3* v :
       {&s.p_WB, &s.p_WB_low, &s.v_WB, &s.v_WB_low, &s.H_W, &s.H_W_low, &s.force_W, &s.moment_B})
    hash.add(*v);
  hash.add(s.q_WB);
  hash.add(s.q_WB_low);
  for (const Array* a : {&s.q, &s.q_low, &s.q_dot, &s.q_dot_low, &s.Q, &s.coupled.momentum, &s.coupled.rate_q,
                         &s.coupled.rate_p})
    hash.add(*a);
  hash.add(s.coupled.w_B);
  hash.add(s.coupled.moment_B);
  for (const Quat& rotation : s.coupled.joints.rotation) hash.add(rotation);
  hash.add(s.coupled.joints.angle);
  hash.add(s.wheel_momentum);
  hash.add(s.wheel_momentum_low);
}

void add_distance(const Shadow& shadow, Hash& hash) {
  const MotionError& error = shadow.error();
  hash.add(Vec3{error.position, error.attitude, error.deformation});
  hash.add(Vec3{shadow.own_error(), shadow.displacement_of_state(), shadow.displacement()});
  hash.add(Vec3{shadow.load_size(), 0.0, 0.0});
}

void add_readout(const Plan& plan, const State& state, Hash& hash) {
  for (int i = 0; i < static_cast<int>(plan.points.size()); ++i) {
    const PointState p = read_point(plan, state, i);
    for (const Vec3* v : {&p.p_W, &p.v_W, &p.a_W, &p.V_B}) hash.add(*v);
  }
  for (const std::int32_t body :
       plan.wheels.empty() ? std::vector<std::int32_t>{} : plan.particles.attitude_points) {
    const BodyState b = read_body(plan, state, body);
    hash.add(b.q_WP);
    hash.add(b.w_P);
  }
  for (int k = 0; k < static_cast<int>(plan.groups.size()); ++k) {
    const GroupPose g = read_group(plan, state, k);
    for (const Vec3* v : {&g.p_W, &g.v_W, &g.w_B}) hash.add(*v);
    hash.add(g.q_WG);
  }
  for (int k = 0; k < static_cast<int>(plan.link_outputs.size()); ++k) {
    std::vector<double> forces(
        static_cast<std::size_t>(plan.link_outputs[static_cast<std::size_t>(k)].num_rows));
    read_link(plan, state, k, forces);
    hash.add(forces);
  }
  const Invariants i = read_invariants(plan, state);
  hash.add(Vec3{i.kinetic_rigid, i.kinetic_elastic, i.potential});
  for (const Vec3* v :
       {&i.linear_momentum_W, &i.angular_momentum_W, &i.eckart_translation, &i.eckart_rotation})
    hash.add(*v);
  hash.add(Vec3{i.quaternion_norm_error, 0.0, 0.0});
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return std::fprintf(stderr, "usage: hash_steps PLAN TICKS [--flip]\n"), 2;
  std::ifstream file(argv[1], std::ios::binary);
  std::vector<char> text{std::istreambuf_iterator<char>(file), {}};
  std::string error;
  const auto plan = plan_from_bytes(std::as_bytes(std::span(text)), error);
  if (!plan) return std::fprintf(stderr, "%s: %s\n", argv[1], error.c_str()), 1;
  const std::int64_t num_ticks = std::atoll(argv[2]);
  bool flips = argc > 3 && std::strcmp(argv[3], "--flip") == 0;

  State state = make_state(*plan);
  Workspace workspace = make_workspace(*plan);
  std::optional<Shadow> shadow;
  if (!plan->verdict.shadows.empty())
    shadow.emplace(*plan, plan->verdict.shadows.front(), takes_scene_loads(plan->verdict.shadows.front()));
  if (shadow) shadow->take(state);
  StepReport report;
  Commands commands(*plan);
  Hash hash;
  std::vector<ForceCommand> now;
  for (std::int64_t tick = 0; tick < num_ticks; ++tick) {
    if (tick % 200'000 == 199'999) {
      reset_state(*plan, state);
      if (shadow) shadow->take(state);
    }
    now.clear();
    for (unsigned k = commands.below(64); k < 3; ++k) {
      ForceCommand command = commands.next();
      if (flips && tick > num_ticks / 2 && command.num_points > 0) {
        flips = false;
        std::uint64_t bits;
        std::memcpy(&bits, &command.points[0].force[0], sizeof bits);
        bits ^= 1;
        std::memcpy(&command.points[0].force[0], &bits, sizeof bits);
      }
      if (has_slot_for(state, command)) now.push_back(command);
    }
    step(*plan, state, {now}, workspace, report);
    if (report.status != StepStatus::kOk)
      return std::fprintf(stderr, "not finite at tick %lld\n", static_cast<long long>(tick)), 1;
    add_motion(state, hash);
    if (shadow) {
      shadow->command(tick, now);
      if (shadow->take(state)) add_distance(*shadow, hash);
    }
    if (tick % 64 != 0) continue;
    add_readout(*plan, state, hash);
  }
  std::printf("%016llx\n", hash.value());
}
