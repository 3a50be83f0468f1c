#include "tools/cli/run_output.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <vector>

#include "core/plan/file/plan_bytes.hpp"
#include "core/step/readout.hpp"
#include "freeflex_msgs/status_t.hpp"
#include "messages/channels.hpp"
#include "service/io/wire/codec.hpp"
#include "service/io/wire/log.hpp"
#include "service/io/wire/outbound.hpp"
#include "service/motion_status.hpp"
#include "tools/bus/motion_columns.hpp"
#include "tools/cli/points_batch.hpp"

namespace freeflex::tools {
namespace {

constexpr double kLeastStatusRate = 1.0;  // [Hz] of simulated time

bool is_due(std::int64_t every, std::int64_t tick, bool is_edge) {
  return every > 0 && (is_edge || tick % every == 0);
}

/// Returns true if a path has the ending, in capitals or not.
bool has_ending(const std::string& path, const char* ending) {
  std::string found = std::filesystem::path(path).extension().string();
  for (char& c : found) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return found == ending;
}

class LogOutput : public RunOutput {
 public:
  LogOutput(const Plan& plan, const std::string& input, const std::string& prefix, const std::string& path)
      : plan_(plan),
        prefix_(prefix),
        writer_(path),
        batch_(plan),
        scene_every_(io::ticks_between(1.0, plan.period)),
        status_every_(io::ticks_between(std::max(plan.status_rate, kLeastStatusRate), plan.period)),
        motion_status_(plan) {
    for (std::size_t i = 0; i < every_.size(); ++i) every_[i] = io::ticks_between(plan.rates[i], plan.period);
    std::error_code ignored;
    input_ = std::filesystem::absolute(input, ignored).lexically_normal().string();
    stamp_.session = 1;
    stamp_.plan_fingerprint = plan_fingerprint(plan);
  }

  void publish(const Motion& motion, bool is_edge) override {
    const std::int64_t tick = motion.tick();
    stamp_.utime = utime(tick);
    if (is_due(scene_every_, tick, false))
      for (const auto& page : io::make_scene_messages(plan_, motion.uses_fallback(), input_, stamp_))
        put(channels::kScene, page);
    for (std::size_t i = 0; i < every_.size(); ++i) {
      if (!is_due(every_[i], tick, is_edge)) continue;
      if (i == kPointsChannel) {
        add_points(motion.state_of_points());
        continue;
      }
      const io::ChannelEncoder& channel = io::kEncoders[i];
      for (auto& message : channel.encode(plan_, motion.state(), stamp_))
        write(channel.suffix, std::move(message));
    }
  }
  void judge(Motion& motion, bool is_edge) override {
    free_.take(motion);
    take_verdict(motion);
    if (!is_due(status_every_, motion.tick(), is_edge)) return;
    stamp_.utime = utime(motion.tick());
    put(channels::kStatus, status_of(motion));
  }
  void set_effect(const std::string& text) override { effect_ = text; }
  void applied_reset(std::int64_t tick) override {
    stamp_.utime = utime(tick);
    put(channels::kApplied, io::make_applied_reset(tick, stamp_.applied_count++, stamp_));
  }
  void applied_step(std::int64_t tick, const StepReport& report,
                    std::span<const ForceCommand> commands) override {
    stamp_.utime = utime(tick);
    for (std::int32_t i = 0; i < report.num_expiries; ++i) {
      const Expiry& expiry = report.expiries[index(i)];
      put(channels::kApplied, io::make_applied_expiry(expiry, tick, stamp_.applied_count++, stamp_));
    }
    for (const ForceCommand& command : commands) {
      put(channels::kApplied, io::make_applied_force(command, tick, stamp_.applied_count++, stamp_));
    }
  }
  bool has_error() const override { return writer_.has_error(); }
  std::string close(bool is_partial) override {
    write_records();
    return is_partial ? writer_.close_partial() : writer_.close();
  }
  std::optional<std::int64_t> kept_tick() const override {
    const std::optional<std::int64_t> utime = writer_.kept_utime();
    if (!utime) return std::nullopt;
    return std::llround(static_cast<double>(*utime) * 1e-6 / plan_.period);
  }
  const std::string& working_path() const override { return writer_.working_path(); }

 private:
  std::int64_t utime(std::int64_t tick) const {
    return std::llround(static_cast<double>(tick) * plan_.period * 1e6);
  }

  /// Takes the verdict that a daemon publishes at this tick, PlanShadow::delay_ticks after the tick it is on.
  void take_verdict(const Motion& motion) {
    if (plan_.verdict.shadows.empty()) return;
    if (motion.epoch() != epoch_) judged_ = {}, waiting_.clear(), epoch_ = motion.epoch();
    const std::int64_t newest = waiting_.empty() ? judged_.now.tick : waiting_.back().now.tick;
    if (motion.verdict().tick > newest) waiting_.push_back({motion.verdict(), motion.worst()});
    const std::int64_t delay = plan_.verdict.shadows.front().delay_ticks;
    while (!waiting_.empty() && waiting_.front().now.tick + delay <= motion.tick()) {
      judged_ = waiting_.front();
      waiting_.pop_front();
    }
  }

  /// Returns a status message with the motion and its verdict. Fields that need a clock or a bus are zero.
  freeflex_msgs::status_t status_of(Motion& motion) {
    freeflex_msgs::status_t status{};
    status.utime = stamp_.utime;
    status.session = stamp_.session;
    status.plan_fingerprint = static_cast<std::int64_t>(stamp_.plan_fingerprint);
    status.mode = freeflex_msgs::status_t::RUNNING;
    status.time_mode = "asap";
    status.applied_count = stamp_.applied_count;
    status.num_slots = motion.num_slots();
    motion_status_.fill({.motion = motion.state(), .now = judged_.now, .worst = judged_.worst, .free = free_},
                        status);
    return status;
  }
  template <class Message>
  void put(const char* channel, const Message& message) {
    write(channel, io::encode(message));
  }

  /// A message that waits for points before it, or the points of a state of the batch.
  struct Record {
    const char* channel;
    io::Stamp stamp;
    std::vector<std::byte> message;
    std::optional<std::size_t> state;
  };
  static constexpr std::size_t kMostRecords = 256;
  void write(const char* channel, std::vector<std::byte> message) {
    if (batch_.is_empty()) return writer_.write(prefix_ + channel, stamp_.utime, message);
    records_.push_back({channel, stamp_, std::move(message), {}});
    if (records_.size() >= kMostRecords) write_records();
  }
  void add_points(const MotionState& state) {
    if (!batch_.has_room_for(state)) write_records();
    records_.push_back({channels::kPoints, stamp_, {}, batch_.add(state)});
    if (!batch_.has_room_for(state)) write_records();
  }
  void write_records() {
    batch_.read();
    for (const Record& record : records_) {
      const auto put = [&](std::span<const std::byte> message) {
        writer_.write(prefix_ + record.channel, record.stamp.utime, message);
      };
      if (!record.state) {
        put(record.message);
        continue;
      }
      const MotionState& state = batch_.state(*record.state);
      for (const auto& page :
           io::make_pages_of_points(plan_, state, batch_.points(*record.state), record.stamp))
        put(io::encode(page));
    }
    records_.clear();
    batch_.clear();
  }

  const Plan& plan_;
  std::string prefix_;
  std::string input_;
  io::LogWriter writer_;
  io::Stamp stamp_;
  PointsBatch batch_;
  std::vector<Record> records_;
  std::array<std::int64_t, kNumMotionChannels> every_{};  // [ticks]
  std::int64_t scene_every_, status_every_;               // [ticks]
  service::FreeMotion free_;
  service::MotionStatus motion_status_;
  struct Judged {
    Verdict now, worst;
  };
  Judged judged_;               // the verdict that is due
  std::deque<Judged> waiting_;  // those that are not due yet
  std::int64_t epoch_ = 0;
  std::string effect_;  // what the motion lacks most
};

class CsvOutput : public RunOutput {
 public:
  CsvOutput(const Plan& plan, const std::string& path)
      : plan_(plan),
        writer_(is_standard_output(path) ? io::CsvWriter(stdout, "standard output") : io::CsvWriter(path)),
        batch_(plan),
        every_(io::ticks_between(plan.rates[kStateChannel], plan.period)) {
    Columns names{"tick"};
    std::vector<std::string> wheels;
    for (const PlanWheel& wheel : plan.wheels) wheels.push_back(wheel.name);
    const Columns state = state_columns(plan_of_all_modes(plan).num_elastic, wheels);
    names.insert(names.end(), state.begin(), state.end());
    for (const std::int32_t point : plan.published_points)
      append_point_columns(plan.points[index(point)].name, attitude_index_of(plan, point) >= 0, names);
    for (const std::int32_t group : plan.published_groups)
      append_group_columns(plan.groups[index(group)].name, names);
    for (const PlanLinkOutput& output : plan.link_outputs) {
      const PlanLink& of = plan.links[index(output.link)];
      append_link_columns(of.name, traits_of(of.type).name, output.num_rows, names);
    }
    writer_.header(names);
  }

  void publish(const Motion& motion, bool is_edge) override {
    if (!is_due(every_, motion.tick(), is_edge)) return;
    const MotionState& state = motion.state();
    if (!batch_.has_room_for(state)) write_rows();
    batch_.add(state);
    if (!batch_.has_room_for(state)) write_rows();
  }
  void judge(Motion&, bool) override {}
  void applied_reset(std::int64_t) override {}
  void applied_step(std::int64_t, const StepReport&, std::span<const ForceCommand>) override {}
  bool has_error() const override { return writer_.has_error(); }
  std::string close(bool is_partial) override {
    write_rows();
    return is_partial ? writer_.close_partial() : writer_.close();
  }
  std::optional<std::int64_t> kept_tick() const override { return writer_.kept_tick(); }
  const std::string& working_path() const override { return writer_.working_path(); }

 private:
  // if the plan has a fallback plan, a table has the columns of the fallback plan, and omitted modes are zero
  // until a command needs them
  void append(const double* first, std::size_t size) { values_.insert(values_.end(), first, first + size); }
  void append_point(const MotionState& state, std::int32_t point, const PointState& read) {
    for (const Vec3* vector : {&read.p_W, &read.v_W, &read.a_W}) append(vector->data(), 3);
    if (attitude_index_of(plan_, point) < 0) return;
    const BodyState body = read_body(plan_, state, point);
    append(body.q_WP.data(), 4);
    append(body.w_P.data(), 3);
  }
  void append_group(const MotionState& state, std::int32_t group) {
    const GroupPose pose = read_group(plan_, state, group);
    append(pose.p_W.data(), 3);
    append(pose.q_WG.data(), 4);
    append(pose.v_W.data(), 3);
    append(pose.w_B.data(), 3);
  }
  void append_modes(const MotionState& state, const std::vector<double>& modes) {
    const std::size_t first = values_.size();
    values_.resize(first + index(plan_of_all_modes(plan_).num_elastic), 0.0);
    const bool is_spread = !plan_.fallback.empty() && !state.uses_fallback;
    for (std::size_t l = 0; l < modes.size(); ++l)
      values_[first + (is_spread ? index(plan_.fallback_modes[l]) : l)] = modes[l];
  }

  void write_rows() {
    batch_.read();
    for (std::size_t k = 0; k < batch_.size(); ++k) write_row(batch_.state(k), batch_.points(k));
    batch_.clear();
  }
  void write_row(const MotionState& state, std::span<const PointState> points) {
    const freeflex_msgs::state_t message = io::make_state_message(plan_, state, io::Stamp{});
    values_.assign(1, message.time);
    append(message.position, 3);
    append(message.attitude, 4);
    append(message.velocity, 3);
    append(message.angular_velocity, 3);
    append(message.angular_momentum, 3);
    append_modes(state, message.q);
    append_modes(state, message.q_dot);
    append(message.wheel_momentum.data(), message.wheel_momentum.size());
    for (std::size_t i = 0; i < points.size(); ++i) append_point(state, plan_.published_points[i], points[i]);
    for (const std::int32_t group : plan_.published_groups) append_group(state, group);
    for (std::size_t i = 0; i < plan_.link_outputs.size(); ++i) {
      const std::size_t before = values_.size(), rows = index(plan_.link_outputs[i].num_rows);
      values_.resize(before + rows);
      read_link(plan_, state, static_cast<int>(i), std::span(values_).last(rows));
    }
    writer_.row(state.tick, values_);
  }

  const Plan& plan_;
  io::CsvWriter writer_;
  PointsBatch batch_;
  std::int64_t every_;  // [ticks]
  std::vector<double> values_;
};

/// Writes nothing. Used for a run with only a summary or a picture.
class NoOutput : public RunOutput {
 public:
  void publish(const Motion&, bool) override {}
  void judge(Motion&, bool) override {}
  void applied_reset(std::int64_t) override {}
  void applied_step(std::int64_t, const StepReport&, std::span<const ForceCommand>) override {}
  bool has_error() const override { return false; }
  std::string close(bool) override { return {}; }
  std::optional<std::int64_t> kept_tick() const override { return std::nullopt; }
  const std::string& working_path() const override { return path_; }

 private:
  std::string path_;
};

}  // namespace

bool is_output(const std::string& path) {
  if (is_table(path) || has_ending(path, ".log")) return true;
  std::error_code ignored;
  return std::filesystem::is_other(std::filesystem::status(path, ignored));
}

bool is_table(const std::string& path) { return is_standard_output(path) || has_ending(path, ".csv"); }

bool is_standard_output(const std::string& path) { return path == "-"; }

std::unique_ptr<RunOutput> make_run_output(const Plan& plan, const std::string& input,
                                           const std::string& prefix, const std::string& path) {
  if (path.empty()) return std::make_unique<NoOutput>();
  if (is_table(path)) return std::make_unique<CsvOutput>(plan, path);
  return std::make_unique<LogOutput>(plan, input, prefix, path);
}

}  // namespace freeflex::tools
