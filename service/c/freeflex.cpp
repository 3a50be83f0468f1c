// The C interface: handles and error codes. No exception leaves it.
#include "service/c/freeflex.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/plan/explain.hpp"
#include "core/plan/file/plan_bytes.hpp"
#include "core/plan/make_plan.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/readout.hpp"
#include "service/c/handles.hpp"
#include "service/command_queue.hpp"
#include "service/io/scene/input.hpp"
#include "service/io/scene/machine.hpp"
#include "service/io/wire/codec.hpp"

namespace {

using namespace freeflex;
using c_interface::fail;
using c_interface::guarded;
using c_interface::PlanData;

std::string quantity(std::size_t found, std::size_t least) {
  return "the array has room for " + std::to_string(found) + " numbers, but must have room for " +
         std::to_string(least);
}

int out_of_range(const char* kind, std::int64_t index, std::size_t count) {
  const std::string found = std::string(kind) + " " + std::to_string(index);
  if (count == 0) return fail(FREEFLEX_BAD_ARGUMENT, found + " does not exist, because the plan has none");
  return fail(FREEFLEX_BAD_ARGUMENT, found + " does not exist; the number must be 0 to " +
                                         std::to_string(static_cast<std::int64_t>(count) - 1));
}

bool is_index(std::int64_t index, std::size_t count) {
  return index >= 0 && index < static_cast<std::int64_t>(count);
}

/// Returns true if the fault reports too little memory, which is not an error of the scene. Only such a fault
/// contains the text "(ulimit -v)", which names the limit that can be raised.
bool is_of_memory(const Fault& fault) { return fault.message.find("(ulimit -v)") != std::string::npos; }

const std::string* name_of(const Plan& plan, int kind, std::size_t k) {
  switch (kind) {
    case FREEFLEX_POINT:
      return &plan.points[k].name;
    case FREEFLEX_LINK:
      return &plan.links[k].name;
    case FREEFLEX_GROUP:
      return &plan.groups[k].name;
    case FREEFLEX_WHEEL:
      return &plan.wheels[k].name;
    default:
      return nullptr;
  }
}

std::size_t count_of(const Plan& plan, int kind) {
  switch (kind) {
    case FREEFLEX_POINT:
      return plan.points.size();
    case FREEFLEX_LINK:
      return plan.links.size();
    case FREEFLEX_GROUP:
      return plan.groups.size();
    case FREEFLEX_WHEEL:
      return plan.wheels.size();
    case FREEFLEX_MODE:
      return static_cast<std::size_t>(plan_of_all_modes(plan).num_elastic);
    default:
      return 0;
  }
}

/// Returns FREEFLEX_OK if the plan stores the mode shapes at the point.
int check_rows(const StepPlan& plan, std::int32_t point) {
  if (!is_index(point, plan.points.size())) return out_of_range("point", point, plan.points.size());
  if (plan.points[static_cast<std::size_t>(point)].row >= 0) return FREEFLEX_OK;
  return fail(FREEFLEX_BAD_ARGUMENT,
              "the plan stores no mode shapes at point '" +
                  plan.points[static_cast<std::size_t>(point)].name +
                  "'; name it in the scene, in 'publish: points: of' or 'commands: points'");
}

template <std::size_t N>
void copy(const std::array<double, N>& from, double (&to)[N]) {
  std::copy(from.begin(), from.end(), to);
}

std::array<double, 3> vector_of(const double (&v)[3]) { return {v[0], v[1], v[2]}; }

bool is_zero(const double (&v)[3]) { return v[0] == 0.0 && v[1] == 0.0 && v[2] == 0.0; }

/// Adds one load to a command. Returns an empty string, or the error.
std::string add_load(const freeflex_load& load, ForceCommand& command) {
  const auto full = [](std::int32_t count, int most, const char* what) {
    return count < most
               ? std::string()
               : "one slot has room for at most " + std::to_string(most) + " " + what + "; use several slots";
  };
  std::string error;
  if (load.kind == FREEFLEX_POINT) {
    if (!is_zero(load.force) || is_zero(load.torque)) {
      error = full(command.num_points, kMaxCommandPoints, "forces");
      if (!error.empty()) return error;
      command.points[static_cast<std::size_t>(command.num_points++)] = {load.index, 0, vector_of(load.force)};
    }
    if (is_zero(load.torque)) return {};
    error = full(command.num_torques, kMaxCommandTorques, "torques on points");
    if (error.empty())
      command.torques[static_cast<std::size_t>(command.num_torques++)] = {load.index, 0,
                                                                          vector_of(load.torque)};
    return error;
  }
  if (load.kind == FREEFLEX_GROUP) {
    error = full(command.num_wrenches, kMaxCommandWrenches, "loads on groups");
    if (error.empty())
      command.wrenches[static_cast<std::size_t>(command.num_wrenches++)] = {
          load.index, 0, vector_of(load.force), vector_of(load.torque)};
    return error;
  }
  if (load.kind != FREEFLEX_WHEEL)
    return "the kind of a load is " + std::to_string(load.kind) +
           ", but must be FREEFLEX_POINT, _GROUP or _WHEEL";
  if (!is_zero(load.force) || load.torque[1] != 0.0 || load.torque[2] != 0.0)
    return "a wheel takes only torque[0], so all other numbers must be zero";
  error = full(command.num_wheels, kMaxWheels, "torques of motors");
  if (error.empty())
    command.wheels[static_cast<std::size_t>(command.num_wheels++)] = {load.index, 0, load.torque[0]};
  return error;
}

/// Reserves a motion for one call. The constructor never waits. If another call is active, has() returns
/// false.
class Entry {
 public:
  explicit Entry(const freeflex_motion& motion)
      : motion_(motion), has_(!motion.is_entered.test_and_set(std::memory_order_acquire)) {}
  ~Entry() {
    if (!has_) return;
    motion_.is_entered.clear(std::memory_order_release);
    motion_.is_entered.notify_one();
  }
  Entry(const Entry&) = delete;
  Entry& operator=(const Entry&) = delete;

  bool has() const { return has_; }
  /// Waits until no other call uses the motion. For functions that return no code and therefore cannot return
  /// FREEFLEX_BUSY.
  Entry& wait() {
    for (; !has_; has_ = !motion_.is_entered.test_and_set(std::memory_order_acquire))
      motion_.is_entered.wait(true, std::memory_order_relaxed);
    return *this;
  }

 private:
  const freeflex_motion& motion_;
  bool has_;
};

/// Reserves the motion and runs the call as guarded() does. Returns FREEFLEX_BUSY if the motion is in use.
template <typename Call>
int entered(const freeflex_motion& motion, const Call& call) noexcept {
  const Entry entry(motion);
  if (entry.has()) return guarded(call);
  return guarded([] {
    return fail(FREEFLEX_BUSY,
                "another thread uses this motion; give each thread its own motion "
                "(freeflex_motion_copy), or let only one call at a time");
  });
}

void write_frame(const freeflex_motion& motion, freeflex_frame& frame) {
  const State& state = motion.motion.state();
  copy(state.p_WB, frame.position);
  copy(state.q_WB, frame.attitude);
  copy(state.v_WB, frame.velocity);
  copy(angular_velocity(motion.plan(), state), frame.angular_velocity);
  copy(state.H_W, frame.angular_momentum);
}

double time_of(const freeflex_motion& motion) { return motion.motion.time(); }

/// Writes the elastic coordinates, or their rates, of all modes that the motion can have. A mode that the
/// present plan omits gets 0.
void write_elastic(const freeflex_motion& motion, std::span<const double> from, double* to) {
  if (to == nullptr) return;
  const Plan& plan = motion.plan();
  const StepPlan& active = active_plan(plan, motion.motion.state());
  const auto n = static_cast<std::size_t>(plan_of_all_modes(plan).num_elastic);
  const bool is_reduced = active.num_elastic != plan_of_all_modes(plan).num_elastic;
  std::fill_n(to, n, 0.0);
  for (std::size_t l = 0; l < static_cast<std::size_t>(active.num_elastic); ++l)
    to[is_reduced ? static_cast<std::size_t>(plan.fallback_modes[l]) : l] = from[l];
}

// Fails if a motion whose plan can be judged was made without a verdict.
int refuse_without_verdict(const freeflex_motion& motion) {
  if (motion.motion.has_verdict() || motion.plan().verdict.shadows.empty()) return FREEFLEX_OK;
  return fail(FREEFLEX_BAD_ARGUMENT, "this motion has no verdict; make it with FREEFLEX_WITH_VERDICT");
}

int write_verdict(const freeflex_motion& motion, bool is_worst, freeflex_verdict& into) {
  if (const int code = refuse_without_verdict(motion); code != FREEFLEX_OK) return code;
  const Verdict& verdict = is_worst ? motion.motion.worst() : motion.motion.verdict();
  const std::string cause =
      motion.motion.verdict().tick < 0 ? not_judged_text(motion.plan()) : text_of(motion.plan(), verdict);
  into = {};
  into.tick = verdict.tick;
  const bool is_judged = motion.motion.verdict().tick >= 0;
  into.level = is_judged ? static_cast<std::int32_t>(verdict.level) : FREEFLEX_NOT_JUDGED;
  into.error = verdict.error.deformation;
  into.scale = verdict.scale;
  std::copy_n(cause.begin(), std::min(cause.size(), sizeof into.cause - 1), into.cause);
  return FREEFLEX_OK;
}

io::Settings settings_of(const freeflex_setting* settings, std::size_t count) {
  io::Settings all;
  for (std::size_t k = 0; k < count; ++k)
    all.push_back(
        {settings[k].path, settings[k].value, std::string(settings[k].path) + " = " + settings[k].value});
  return all;
}

/// Makes a plan from the result of `load`. Returns FREEFLEX_OK or the code of the error.
template <typename Load>
int set_up(freeflex_progress progress, void* user, freeflex_plan*& plan, const Load& load) {
  bool is_ended = false;
  SetupProgress asked;
  asked.memory_MB = io::machine_memory_MB();
  asked.share = io::share_on_two_threads;
  if (progress != nullptr)
    asked.report = [&](const std::string& what, double done) {
      is_ended = is_ended || progress(user, what.c_str(), done) != 0;
      return !is_ended;
    };
  io::PlanResult result = load(asked);
  std::string errors, warnings;
  bool lacks_memory = false;
  for (const Fault& fault : result.faults) {
    (fault.severity == Fault::Severity::kError ? errors : warnings) +=
        io::format_fault(fault, result.sources, false) + "\n";
    lacks_memory = lacks_memory || is_of_memory(fault);
  }
  if (is_ended) return fail(FREEFLEX_ENDED, "the set-up was ended by its progress function");
  if (!result.plan) return fail(lacks_memory ? FREEFLEX_NO_MEMORY : FREEFLEX_BAD_SCENE, errors);
  auto data = std::make_shared<PlanData>();
  data->plan = std::move(*result.plan);
  io::fill_name_table(data->plan, data->table);
  auto made = std::make_unique<freeflex_plan>();
  made->data = std::move(data);
  made->warnings = std::move(warnings);
  plan = made.release();
  return FREEFLEX_OK;
}

}  // namespace

namespace freeflex::c_interface {

thread_local std::string last_error;

int fail(int code, const std::string& text) noexcept {
  try {
    last_error = text;
  } catch (const std::exception&) {
    last_error.clear();
  }
  return code;
}

}  // namespace freeflex::c_interface

const char* freeflex_version(void) noexcept { return FREEFLEX_VERSION; }
const char* freeflex_last_error(void) noexcept { return c_interface::last_error.c_str(); }

int freeflex_plan_open(const char* path, freeflex_progress progress, void* user,
                       freeflex_plan** plan) noexcept {
  return freeflex_plan_open_with(path, nullptr, 0, progress, user, plan);
}

int freeflex_plan_open_with(const char* path, const freeflex_setting* settings, std::size_t count,
                            freeflex_progress progress, void* user, freeflex_plan** plan) noexcept {
  return guarded([&] {
    if (path == nullptr || plan == nullptr)
      return fail(FREEFLEX_BAD_ARGUMENT, "path or plan is NULL, but both must be given");
    return set_up(progress, user, *plan, [&](const SetupProgress& asked) {
      return io::load_plan(path, 0.0, asked, settings_of(settings, count));
    });
  });
}

int freeflex_plan_open_text(const char* text, const char* name, const char* folder,
                            const freeflex_setting* settings, std::size_t count, freeflex_progress progress,
                            void* user, freeflex_plan** plan) noexcept {
  return guarded([&] {
    if (text == nullptr || plan == nullptr)
      return fail(FREEFLEX_BAD_ARGUMENT, "text or plan is NULL, but both must be given");
    io::SceneText scene{.text = text};
    if (folder != nullptr) scene.folder = folder;
    if (name != nullptr) scene.name = name;
    return set_up(progress, user, *plan, [&](const SetupProgress& asked) {
      return io::load_plan_text(scene, 0.0, asked, settings_of(settings, count));
    });
  });
}

void freeflex_plan_free(freeflex_plan* plan) noexcept { delete plan; }
const char* freeflex_plan_warnings(const freeflex_plan* plan) noexcept { return plan->warnings.c_str(); }
const char* freeflex_plan_name(const freeflex_plan* plan) noexcept { return plan->data->plan.name.c_str(); }
std::uint64_t freeflex_plan_fingerprint(const freeflex_plan* plan) noexcept {
  std::uint64_t fingerprint = 0;
  guarded([&] { return fingerprint = plan_fingerprint(plan->data->plan), FREEFLEX_OK; });
  return fingerprint;
}
double freeflex_plan_rate(const freeflex_plan* plan) noexcept { return 1.0 / plan->data->plan.period; }
double freeflex_plan_mass(const freeflex_plan* plan) noexcept { return plan->data->plan.mass; }

std::int32_t freeflex_plan_count(const freeflex_plan* plan, int kind) noexcept {
  return static_cast<std::int32_t>(count_of(plan->data->plan, kind));
}

const char* freeflex_plan_name_of(const freeflex_plan* plan, int kind, std::int32_t index) noexcept {
  const Plan& of = plan->data->plan;
  if (kind == FREEFLEX_MODE || !is_index(index, count_of(of, kind))) return nullptr;
  return name_of(of, kind, static_cast<std::size_t>(index))->c_str();
}

std::int32_t freeflex_plan_find(const freeflex_plan* plan, int kind, const char* name) noexcept {
  const Plan& of = plan->data->plan;
  if (kind == FREEFLEX_MODE || name == nullptr) return -1;
  for (std::size_t k = 0; k < count_of(of, kind); ++k)
    if (*name_of(of, kind, k) == name) return static_cast<std::int32_t>(k);
  return -1;
}

int freeflex_plan_frequencies(const freeflex_plan* plan, double* frequencies, std::size_t size) noexcept {
  return guarded([&] {
    const StepPlan& of = plan_of_all_modes(plan->data->plan);
    const auto count = static_cast<std::size_t>(of.num_elastic);
    if (size < count) return fail(FREEFLEX_BAD_ARGUMENT, quantity(size, count));
    for (std::size_t l = 0; l < count; ++l) frequencies[l] = of.omega[l] / (2.0 * std::numbers::pi);
    return FREEFLEX_OK;
  });
}

int freeflex_plan_rest(const freeflex_plan* plan, double* rest, std::size_t size) noexcept {
  return guarded([&] {
    const Plan& of = plan->data->plan;
    if (size < 3 * of.points.size()) return fail(FREEFLEX_BAD_ARGUMENT, quantity(size, 3 * of.points.size()));
    for (const PlanPoint& point : of.points) rest = std::copy(point.r.begin(), point.r.end(), rest);
    return FREEFLEX_OK;
  });
}

int freeflex_plan_shape(const freeflex_plan* plan, std::int32_t point, double* shape,
                        std::size_t size) noexcept {
  return guarded([&] {
    const StepPlan& of = plan_of_all_modes(plan->data->plan);
    const auto count = static_cast<std::size_t>(of.num_elastic),
               padded = static_cast<std::size_t>(of.num_padded);
    if (const int code = check_rows(of, point); code != FREEFLEX_OK) return code;
    if (size < 3 * count) return fail(FREEFLEX_BAD_ARGUMENT, quantity(size, 3 * count));
    const double* const rows = point_rows(of, of.points[static_cast<std::size_t>(point)].row);
    for (std::size_t l = 0; l < count; ++l)
      for (std::size_t axis = 0; axis < 3; ++axis) *shape++ = rows[axis * padded + l];
    return FREEFLEX_OK;
  });
}

int freeflex_motion_new(const freeflex_plan* plan, unsigned flags, freeflex_motion** motion) noexcept {
  return guarded([&] {
    if ((flags & ~FREEFLEX_WITH_VERDICT) != 0)
      return fail(FREEFLEX_BAD_ARGUMENT,
                  "flags is " + std::to_string(flags) + ", but must be 0 or FREEFLEX_WITH_VERDICT");
    const Watch watch = (flags & FREEFLEX_WITH_VERDICT) != 0 ? Watch{} : kMotionAlone;
    *motion = std::make_unique<freeflex_motion>(plan->data, watch).release();
    return FREEFLEX_OK;
  });
}

int freeflex_motion_copy(const freeflex_motion* motion, freeflex_motion** copy) noexcept {
  return entered(*motion, [&] {
    *copy = std::make_unique<freeflex_motion>(*motion).release();
    return FREEFLEX_OK;
  });
}

void freeflex_motion_free(freeflex_motion* motion) noexcept { delete motion; }

void freeflex_motion_reset(freeflex_motion* motion) noexcept {
  Entry entry(*motion);
  entry.wait();
  motion->pending.clear();
  motion->motion.reset();
}

int freeflex_motion_step(freeflex_motion* motion, std::int64_t ticks) noexcept {
  return entered(*motion, [&] {
    if (ticks < 0)
      return fail(FREEFLEX_BAD_ARGUMENT,
                  "the number of ticks is " + std::to_string(ticks) + ", but must be 0 or more");
    for (std::int64_t k = 0; k < ticks; ++k) {
      const StepReport& report = motion->motion.advance(motion->pending);
      if (report.status != StepStatus::kOk && report.status != StepStatus::kNotFinite)
        return fail(FREEFLEX_NOT_FINITE,
                    lost_shape_text(motion->motion.plan(), report, motion->motion.tick()));
      if (report.status != StepStatus::kOk)
        return fail(FREEFLEX_NOT_FINITE,
                    "the state after tick " + std::to_string(motion->motion.tick()) +
                        " would not be finite, because loads or spin are far too large for "
                        "this structure; use smaller ones, or check their units");
      motion->pending.clear();
    }
    return FREEFLEX_OK;
  });
}

int freeflex_motion_push(freeflex_motion* motion, int slot, int axes, const freeflex_load* loads,
                         std::size_t count, std::int64_t ticks) noexcept {
  return entered(*motion, [&] {
    if (ticks < 0)
      return fail(FREEFLEX_BAD_ARGUMENT,
                  "the number of ticks is " + std::to_string(ticks) + ", but must be 0 or more");
    if (motion->pending.size() >= service::CommandQueue::kMaxPending)
      return fail(FREEFLEX_BAD_ARGUMENT,
                  std::to_string(service::CommandQueue::kMaxPending) +
                      " pushes wait for the next step, which is the largest number allowed; step first");
    if (const std::int64_t most = io::max_hold_ticks(motion->data->plan); count > 0 && ticks > most)
      return fail(FREEFLEX_BAD_ARGUMENT,
                  "the push lasts " + std::to_string(ticks) + " ticks, but may last at most " +
                      std::to_string(most) +
                      " ('commands: max_hold' of the scene); push again before it ends");
    auto command = std::make_unique<ForceCommand>();
    *command = {};
    std::copy_n("c", 1, command->sender.begin());
    command->slot = slot;
    command->axes = axes;
    command->start_tick = -1;
    command->duration_ticks = count == 0 ? 0 : ticks == 0 ? io::kMaxDurationTicks : ticks;
    for (std::size_t k = 0; k < count; ++k)
      if (const std::string error = add_load(loads[k], *command); !error.empty())
        return fail(FREEFLEX_BAD_ARGUMENT, error);
    std::array<char, 256> text{};
    if (io::check_command(*command, motion->data->table, text) != io::Reason::kAccepted)
      return fail(FREEFLEX_BAD_ARGUMENT, text.data());
    command->sequence = motion->sequence + 1;
    motion->pending.push_back(*command);
    ++motion->sequence;
    return FREEFLEX_OK;
  });
}

std::int64_t freeflex_motion_tick(const freeflex_motion* motion) noexcept {
  Entry entry(*motion);
  entry.wait();
  return motion->motion.tick();
}
double freeflex_motion_time(const freeflex_motion* motion) noexcept {
  Entry entry(*motion);
  entry.wait();
  return time_of(*motion);
}

int freeflex_motion_state(const freeflex_motion* motion, freeflex_state* state, double* q, double* q_dot,
                          std::size_t num_modes, double* momenta, std::size_t num_wheels) noexcept {
  return entered(*motion, [&] {
    const auto modes = static_cast<std::size_t>(plan_of_all_modes(motion->plan()).num_elastic);
    const std::vector<double>& wheels = motion->motion.state().wheel_momentum;
    if ((q != nullptr || q_dot != nullptr) && num_modes < modes)
      return fail(FREEFLEX_BAD_ARGUMENT, "modes: " + quantity(num_modes, modes));
    if (momenta != nullptr && num_wheels < wheels.size())
      return fail(FREEFLEX_BAD_ARGUMENT, "wheels: " + quantity(num_wheels, wheels.size()));
    state->tick = motion->motion.tick();
    state->time = time_of(*motion);
    write_frame(*motion, state->frame);
    write_elastic(*motion, motion->motion.state().q, q);
    write_elastic(*motion, motion->motion.state().q_dot, q_dot);
    if (momenta != nullptr) std::copy(wheels.begin(), wheels.end(), momenta);
    return FREEFLEX_OK;
  });
}

void freeflex_motion_frame(const freeflex_motion* motion, freeflex_frame* frame) noexcept {
  Entry entry(*motion);
  entry.wait();
  write_frame(*motion, *frame);
}

int freeflex_motion_elastic(const freeflex_motion* motion, double* q, double* q_dot, std::size_t size,
                            std::size_t* count) noexcept {
  return entered(*motion, [&] {
    const auto n = static_cast<std::size_t>(plan_of_all_modes(motion->plan()).num_elastic);
    if (count != nullptr) *count = n;
    if (size < n) return fail(FREEFLEX_BAD_ARGUMENT, quantity(size, n));
    write_elastic(*motion, motion->motion.state().q, q);
    write_elastic(*motion, motion->motion.state().q_dot, q_dot);
    return FREEFLEX_OK;
  });
}

int freeflex_motion_point(const freeflex_motion* motion, std::int32_t point, freeflex_point* state) noexcept {
  return entered(*motion, [&] {
    const Plan& plan = motion->plan();
    if (const int code = check_rows(plan, point); code != FREEFLEX_OK) return code;
    const PointState read = read_point(plan, motion->motion.state_of_points(), point);
    copy(read.p_W, state->position);
    copy(read.v_W, state->velocity);
    copy(read.a_W, state->acceleration);
    copy(read.V_B, state->displacement);
    return FREEFLEX_OK;
  });
}

int freeflex_motion_body(const freeflex_motion* motion, std::int32_t point, freeflex_body* state) noexcept {
  return entered(*motion, [&] {
    const Plan& plan = motion->plan();
    if (const int code = check_rows(plan, point); code != FREEFLEX_OK) return code;
    if (attitude_index_of(plan, point) < 0)
      return fail(FREEFLEX_BAD_ARGUMENT, "point " + std::to_string(point) +
                                             " has no attitude; give it inertia or an offset in the scene");
    const BodyState read = read_body(plan, motion->motion.state(), point);
    copy(read.q_WP, state->attitude);
    copy(read.w_P, state->angular_velocity);
    return FREEFLEX_OK;
  });
}

int freeflex_motion_group(const freeflex_motion* motion, std::int32_t group, freeflex_pose* pose) noexcept {
  return entered(*motion, [&] {
    const Plan& plan = motion->plan();
    if (!is_index(group, plan.groups.size())) return out_of_range("group", group, plan.groups.size());
    for (const std::int32_t point : plan.groups[static_cast<std::size_t>(group)].points)
      if (const int code = check_rows(plan, point); code != FREEFLEX_OK) return code;
    const GroupPose read = read_group(plan, motion->motion.state(), group);
    copy(read.p_W, pose->position);
    copy(read.q_WG, pose->attitude);
    copy(read.v_W, pose->velocity);
    copy(read.w_B, pose->angular_velocity);
    return FREEFLEX_OK;
  });
}

int freeflex_motion_link(const freeflex_motion* motion, std::int32_t link, double* values, std::size_t size,
                         std::size_t* count) noexcept {
  return entered(*motion, [&] {
    const Plan& plan = motion->plan();
    if (!is_index(link, plan.links.size())) return out_of_range("link", link, plan.links.size());
    const auto output = std::find_if(plan.link_outputs.begin(), plan.link_outputs.end(),
                                     [link](const PlanLinkOutput& each) { return each.link == link; });
    if (output == plan.link_outputs.end())
      return fail(FREEFLEX_BAD_ARGUMENT, "the forces of link '" +
                                             plan.links[static_cast<std::size_t>(link)].name +
                                             "' are not published; list it under publish: loads: of");
    const auto n = static_cast<std::size_t>(output->num_rows);
    if (count != nullptr) *count = n;
    if (size < n) return fail(FREEFLEX_BAD_ARGUMENT, quantity(size, n));
    read_link(plan, motion->motion.state(), static_cast<int>(output - plan.link_outputs.begin()),
              {values, n});
    return FREEFLEX_OK;
  });
}

int freeflex_motion_wheels(const freeflex_motion* motion, double* momenta, std::size_t size) noexcept {
  return entered(*motion, [&] {
    const std::vector<double>& all = motion->motion.state().wheel_momentum;
    if (size < all.size()) return fail(FREEFLEX_BAD_ARGUMENT, quantity(size, all.size()));
    std::copy(all.begin(), all.end(), momenta);
    return FREEFLEX_OK;
  });
}

void freeflex_motion_energy(const freeflex_motion* motion, freeflex_energy* energy) noexcept {
  Entry entry(*motion);
  entry.wait();
  const Invariants read = read_invariants(motion->plan(), motion->motion.state());
  *energy = {read.kinetic_rigid, read.kinetic_elastic, read.potential};
}

int freeflex_motion_verdict(const freeflex_motion* motion, freeflex_verdict* verdict) noexcept {
  return entered(*motion, [&] { return write_verdict(*motion, false, *verdict); });
}
int freeflex_motion_worst_verdict(const freeflex_motion* motion, freeflex_verdict* verdict) noexcept {
  return entered(*motion, [&] { return write_verdict(*motion, true, *verdict); });
}

int freeflex_motion_errors(const freeflex_motion* motion, freeflex_errors* errors) noexcept {
  return guarded([&] {
    if (const int code = refuse_without_verdict(*motion); code != FREEFLEX_OK) return code;
    const Verdict& verdict = motion->motion.verdict();
    *errors = {verdict.tick, verdict.error.position, verdict.error.attitude, verdict.error.deformation,
               verdict.own_error};
    return FREEFLEX_OK;
  });
}

int freeflex_explain(const char* path, const char* text, const char* folder, const freeflex_setting* settings,
                     std::size_t count, double seconds, freeflex_effect* effects, std::size_t size,
                     std::size_t* num_effects) noexcept {
  return guarded([&] {
    if ((path == nullptr && text == nullptr) || (effects == nullptr && size > 0) || num_effects == nullptr)
      return fail(FREEFLEX_BAD_ARGUMENT, "path or text, effects and num_effects must be given");
    *num_effects = 0;
    if (!(seconds > 0.0 && seconds <= 1e9))
      return fail(FREEFLEX_BAD_ARGUMENT,
                  "seconds is " + std::to_string(seconds) + ", but must be above 0 and at most 1e9");
    io::SceneText scene;
    if (path == nullptr) scene.text = text;
    if (folder != nullptr) scene.folder = folder;
    const io::Settings set = settings_of(settings, count);
    io::SceneResult read = path != nullptr ? io::read_scene(path, set) : io::read_scene_text(scene, set);
    std::optional<Structure> structure;
    std::optional<Plan> plan;
    if (read.scene) structure = build_structure(*read.scene, read.faults);
    if (structure) plan = make_plan(*read.scene, *structure, read.faults);
    if (!plan) {
      std::string errors;
      for (const Fault& fault : read.faults)
        if (fault.severity == Fault::Severity::kError)
          errors += io::format_fault(fault, read.sources, false) + "\n";
      return fail(FREEFLEX_BAD_SCENE, errors);
    }
    if (plan->verdict.shadows.empty()) return fail(FREEFLEX_BAD_ARGUMENT, not_judged_text(*plan));
    const std::optional<std::vector<EffectSize>> found =
        explain_motion(*read.scene, *structure, *plan, seconds);
    if (!found) return fail(FREEFLEX_NOT_FINITE, "the motion stops before the end");
    *num_effects = std::min(size, found->size());
    for (std::size_t k = 0; k < *num_effects; ++k) {
      freeflex_effect& to = effects[k] = {};
      const EffectSize& each = (*found)[k];
      std::strncpy(to.name, name_of(each.effect), sizeof to.name - 1);
      std::strncpy(to.remedy, remedy_of(each.effect, *plan).c_str(), sizeof to.remedy - 1);
      to.deformation = each.most.deformation;
      to.attitude = each.most.attitude;
      to.position = each.most.position;
    }
    return FREEFLEX_OK;
  });
}
