#include "tools/bus/message_json.hpp"

#include <cinttypes>
#include <vector>

#include "messages/channels.hpp"
#include "service/io/wire/decode.hpp"
#include "service/io/wire/reason.hpp"
#include "service/io/wire/versions.hpp"
#include "tools/bus/bus.hpp"

namespace freeflex::tools {
namespace {

using namespace freeflex_msgs;

template <std::size_t N>
Json array_of(const double (&values)[N]) {
  Json out = Json::array();
  for (const double value : values) out.push_back(value);
  return out;
}

/// Returns a fingerprint as text. A fingerprint is unsigned, but integers on the wire are signed.
std::string hex(std::int64_t fingerprint) {
  return fingerprint_text(static_cast<std::uint64_t>(fingerprint));
}

const char* reason_text(std::int32_t reason) {
  return reason >= 0 && reason < io::kNumReasons ? io::reason_name(static_cast<io::Reason>(reason))
                                                 : "unknown";
}

const char* applied_kind(std::int32_t kind) {
  switch (kind) {
    case applied_t::FORCE:
      return "force";
    case applied_t::EXPIRED:
      return "expired";
    case applied_t::LEASE_LOST:
      return "lease_lost";
    case applied_t::RESET:
      return "reset";
    case applied_t::CLEARED:
      return "cleared";
    default:
      return "unknown";
  }
}

const char* control_name(std::int32_t command) {
  switch (command) {
    case control_t::RUN:
      return "run";
    case control_t::HOLD:
      return "hold";
    case control_t::STEP:
      return "step";
    case control_t::RESET:
      return "reset";
    case control_t::STOP:
      return "stop";
    case control_t::SHAPES:
      return "shapes";
    case control_t::SCENE:
      return "scene";
    default:
      return "unknown";
  }
}

Json fields_of(const force_t& m) {
  Json out{{"utime", m.utime},
           {"session", m.session},
           {"sender", m.sender},
           {"sequence", m.sequence},
           {"slot", m.slot},
           {"axes", m.axes == 1 ? "body" : "world"},
           {"start_tick", m.start_tick},
           {"late_policy", m.late_policy},
           {"duration_ticks", m.duration_ticks},
           {"lease_ticks", m.lease_ticks}};
  out["forces"] = Json::array();
  for (const point_force_t& f : m.forces)
    out["forces"].push_back({{"point", f.point}, {"force", array_of(f.force)}});
  out["wrenches"] = Json::array();
  for (const wrench_t& w : m.wrenches) {
    out["wrenches"].push_back(
        {{"group", w.group}, {"force", array_of(w.force)}, {"torque", array_of(w.torque)}});
  }
  out["torques"] = Json::array();
  for (const point_torque_t& t : m.torques)
    out["torques"].push_back({{"point", t.point}, {"torque", array_of(t.torque)}});
  out["wheels"] = Json::array();
  for (const wheel_torque_t& w : m.wheels)
    out["wheels"].push_back({{"wheel", w.wheel}, {"torque", w.torque}});
  return out;
}

Json fields_of(const control_t& m) {
  return {{"utime", m.utime},
          {"session", m.session},
          {"sender", m.sender},
          {"sequence", m.sequence},
          {"command", control_name(m.command)},
          {"count", m.count},
          {"target", m.target}};
}

Json fields_of(const ack_t& m) {
  return {{"utime", m.utime},       {"session", m.session}, {"sender", m.sender},
          {"sequence", m.sequence}, {"reason", m.reason},   {"reason_name", reason_text(m.reason)},
          {"tick", m.tick},         {"text", m.text}};
}

Json fields_of(const applied_t& m) {
  Json out{{"utime", m.utime}, {"session", m.session},         {"applied_sequence", m.applied_sequence},
           {"tick", m.tick},   {"kind", applied_kind(m.kind)}, {"plan_fingerprint", hex(m.plan_fingerprint)}};
  if (m.kind != applied_t::RESET) out["command"] = fields_of(m.command);
  return out;
}

Json fields_of(const state_t& m) {
  return {{"utime", m.utime},
          {"session", m.session},
          {"epoch", m.epoch},
          {"tick", m.tick},
          {"time", m.time},
          {"applied_count", m.applied_count},
          {"position", array_of(m.position)},
          {"attitude", array_of(m.attitude)},
          {"velocity", array_of(m.velocity)},
          {"angular_velocity", array_of(m.angular_velocity)},
          {"angular_momentum", array_of(m.angular_momentum)},
          {"q", m.q},
          {"q_dot", m.q_dot},
          {"wheel_momentum", m.wheel_momentum}};
}

Json fields_of(const points_t& m) {
  Json out{{"utime", m.utime}, {"session", m.session}, {"epoch", m.epoch},
           {"tick", m.tick},   {"page", m.page},       {"num_pages", m.num_pages}};
  out["points"] = Json::array();
  for (const point_state_t& p : m.points) {
    out["points"].push_back({{"point", p.point},
                             {"position", array_of(p.position)},
                             {"velocity", array_of(p.velocity)},
                             {"acceleration", array_of(p.acceleration)},
                             {"displacement", array_of(p.displacement)}});
  }
  out["groups"] = Json::array();
  for (const group_pose_t& g : m.groups) {
    out["groups"].push_back({{"group", g.group},
                             {"position", array_of(g.position)},
                             {"attitude", array_of(g.attitude)},
                             {"velocity", array_of(g.velocity)},
                             {"angular_velocity", array_of(g.angular_velocity)}});
  }
  out["bodies"] = Json::array();
  for (const body_state_t& b : m.bodies) {
    out["bodies"].push_back({{"point", b.point},
                             {"attitude", array_of(b.attitude)},
                             {"angular_velocity", array_of(b.angular_velocity)}});
  }
  return out;
}

Json fields_of(const loads_t& m) {
  Json out{{"utime", m.utime}, {"session", m.session}, {"epoch", m.epoch},
           {"tick", m.tick},   {"page", m.page},       {"num_pages", m.num_pages}};
  out["links"] = Json::array();
  for (const link_load_t& l : m.links) out["links"].push_back({{"link", l.link}, {"values", l.values}});
  return out;
}

Json fields_of(const shapes_t& m) {
  Json out{
      {"utime", m.utime},         {"session", m.session},     {"plan_fingerprint", hex(m.plan_fingerprint)},
      {"mode", m.mode},           {"frequency", m.frequency}, {"page", m.page},
      {"num_pages", m.num_pages}, {"point", m.point}};
  out["shape"] = Json::array();
  for (const auto& row : m.shape) out["shape"].push_back(row);
  return out;
}

Json fields_of(const scene_t& m) {
  Json out{{"utime", m.utime},
           {"session", m.session},
           {"plan_fingerprint", hex(m.plan_fingerprint)},
           {"scene_hash", hex(m.scene_hash)},
           {"name", m.name},
           {"plan_file", m.plan_file},
           {"rate", m.rate},
           {"mass", m.mass}};
  out["inertia"] = Json::array();
  for (const auto& row : m.inertia) out["inertia"].push_back(array_of(row));
  out.update({{"rigid_freedoms", m.rigid_freedoms},
              {"page", m.page},
              {"num_pages", m.num_pages},
              {"total_points", m.total_points},
              {"total_links", m.total_links},
              {"total_groups", m.total_groups},
              {"total_elastic", m.total_elastic},
              {"first_point", m.first_point},
              {"first_link", m.first_link},
              {"first_group", m.first_group},
              {"first_elastic", m.first_elastic}});
  out["points"] = Json::array();
  for (const scene_point_t& p : m.points) {
    out["points"].push_back({{"name", p.name},
                             {"mass", p.mass},
                             {"rest", array_of(p.rest)},
                             {"is_pushable", p.is_pushable != 0},
                             {"is_published", p.is_published != 0}});
  }
  out["links"] = Json::array();
  for (const scene_link_t& l : m.links) {
    out["links"].push_back(
        {{"name", l.name}, {"kind", l.kind}, {"points", l.points}, {"is_published", l.is_published != 0}});
  }
  out["groups"] = Json::array();
  for (const scene_group_t& g : m.groups) out["groups"].push_back({{"name", g.name}, {"points", g.points}});
  out["frequencies"] = m.frequencies;
  out["wheels"] = Json::array();
  for (const scene_wheel_t& w : m.wheels)
    out["wheels"].push_back({{"name", w.name}, {"point", w.point}, {"axis", array_of(w.axis)}});
  return out;
}

Json fields_of(const status_t& m) {
  const auto percentiles = [](const double(&v)[4]) {
    return Json{{"p50", v[0]}, {"p99", v[1]}, {"p99_9", v[2]}, {"max", v[3]}};
  };
  Json out{{"utime", m.utime},
           {"session", m.session},
           {"plan_fingerprint", hex(m.plan_fingerprint)},
           {"scene_hash", hex(m.scene_hash)},
           {"mode", mode_name(m.mode)},
           {"fault", m.fault},
           {"time_mode", m.time_mode},
           {"rate", m.rate},
           {"epoch", m.epoch},
           {"tick", m.tick},
           {"applied_count", m.applied_count},
           {"overruns", m.overruns},
           {"slips", m.slips},
           {"window_ticks", m.window_ticks},
           {"lateness_us", percentiles(m.lateness_us)},
           {"compute_us", percentiles(m.compute_us)},
           {"command_latency_us", percentiles(m.command_latency_us)},
           {"commands_received", m.commands_received},
           {"commands_accepted", m.commands_accepted}};
  Json rejections = Json::object();
  for (const rejection_count_t& r : m.rejections) rejections[reason_text(r.reason)] = r.count;
  out["rejections"] = rejections;
  out.update({{"ingress_restarts", m.ingress_restarts},
              {"ingress_hangs", m.ingress_hangs},
              {"states_dropped", m.states_dropped},
              {"points_dropped", m.points_dropped},
              {"loads_dropped", m.loads_dropped},
              {"answers_dropped", m.answers_dropped},
              {"sends_failed", m.sends_failed},
              {"num_slots", m.num_slots},
              {"replan_tick", m.replan_tick},
              {"replan", m.replan},
              {"kinetic_rigid", m.kinetic_rigid},
              {"kinetic_elastic", m.kinetic_elastic},
              {"potential", m.potential},
              {"energy_drift", m.energy_drift},
              {"momentum_drift", m.momentum_drift},
              {"eckart_residual", m.eckart_residual},
              {"max_displacement", m.max_displacement},
              {"displacement_ratio", m.displacement_ratio},
              {"spin_ratio", m.spin_ratio},
              {"validity", m.validity},
              {"validity_cause", m.validity_cause},
              {"worst_validity", m.worst_validity},
              {"worst_validity_tick", m.worst_validity_tick},
              {"worst_validity_cause", m.worst_validity_cause},
              {"judged_tick", m.judged_tick},
              {"judged_every", m.judged_every},
              {"judgements_late", m.judgements_late},
              {"position_error", m.position_error},
              {"attitude_error", m.attitude_error},
              {"deformation_error", m.deformation_error},
              {"shadow_error", m.shadow_error},
              {"displacement_now", m.displacement_now},
              {"error_scale", m.error_scale},
              {"truncation_bound", m.truncation_bound}});
  return out;
}

std::string summary_of(const force_t& m) {
  return m.sender + " slot " + std::to_string(m.slot) + ", " + counted(m.num_forces, "force") + ", " +
         std::to_string(m.num_wrenches) + (m.num_wrenches == 1 ? " wrench" : " wrenches");
}
std::string summary_of(const control_t& m) {
  return m.sender + ": " + control_name(m.command) + (m.count > 0 ? " " + std::to_string(m.count) : "") +
         (m.target.empty() ? "" : " " + m.target);
}
std::string summary_of(const ack_t& m) {
  return m.sender + ": " + (m.reason == 0 ? "accepted" : std::string("rejected: ") + reason_text(m.reason)) +
         " at tick " + std::to_string(m.tick);
}
std::string summary_of(const applied_t& m) {
  std::string text = std::string(applied_kind(m.kind)) + " at tick " + std::to_string(m.tick);
  if (m.kind != applied_t::RESET) text += ", " + m.command.sender + " slot " + std::to_string(m.command.slot);
  return text;
}
template <class Message>
std::string tick_summary(const Message& m) {
  return "tick " + std::to_string(m.tick) + ", epoch " + std::to_string(m.epoch);
}
std::string page_summary(std::int32_t page, std::int32_t num_pages) {
  return num_pages > 1 ? ", page " + std::to_string(page + 1) + " of " + std::to_string(num_pages) : "";
}
std::string summary_of(const state_t& m) { return tick_summary(m) + ", " + counted(m.num_elastic, "mode"); }
std::string summary_of(const points_t& m) {
  return tick_summary(m) + ", " + counted(m.num_points, "point") + page_summary(m.page, m.num_pages);
}
std::string summary_of(const loads_t& m) {
  return tick_summary(m) + ", " + counted(m.num_links, "link") + page_summary(m.page, m.num_pages);
}
std::string summary_of(const shapes_t& m) {
  return "mode " + std::to_string(m.mode) + page_summary(m.page, m.num_pages);
}
std::string summary_of(const scene_t& m) {
  return m.name + ", " + counted(m.total_points, "point") + page_summary(m.page, m.num_pages);
}
std::string summary_of(const status_t& m) {
  return std::string(mode_name(m.mode)) + ", tick " + std::to_string(m.tick) + ", " +
         counted(m.overruns, "overrun") + ", " + counted(m.slips, "slip") + ", " + validity_name(m.validity) +
         (m.validity_cause.empty() ? "" : ": " + m.validity_cause);
}

/// Sets stream and number of a message. Messages of types without an overload are not numbered.
template <class Message>
void number_message(const Message&, DecodedMessage&) {}
void number_message(const applied_t& m, DecodedMessage& out) {
  out.stream = std::to_string(m.session);
  out.number = m.applied_sequence;
  out.step = 1;
}
template <class Message>
void number_by_tick(const Message& m, DecodedMessage& out) {
  out.stream = std::to_string(m.session) + "/" + std::to_string(m.epoch);
  out.number = m.tick;
}
void number_message(const state_t& m, DecodedMessage& out) { number_by_tick(m, out); }
void number_message(const points_t& m, DecodedMessage& out) {
  if (m.page == 0) number_by_tick(m, out);
}
void number_message(const loads_t& m, DecodedMessage& out) {
  if (m.page == 0) number_by_tick(m, out);
}

template <class Message>
DecodedMessage decode_as(std::span<const std::byte> bytes) {
  DecodedMessage out;
  Message message;
  if (!io::decode_message(bytes, message)) {
    out.summary = io::explain_unread(bytes);
    return out;
  }
  out.fields = fields_of(message);
  out.summary = printable(summary_of(message));
  number_message(message, out);
  return out;
}

/// Decodes a command, or an envelope and the command in it.
template <class Command>
DecodedMessage decode_command(std::span<const std::byte> bytes) {
  envelope_t envelope;
  if (!io::decode_message(bytes, envelope)) return decode_as<Command>(bytes);
  DecodedMessage out = decode_as<Command>(std::as_bytes(std::span(envelope.body)));
  std::string tag;
  for (const std::uint8_t byte : envelope.tag) tag += format_text("%02x", byte);
  out.fields = {
      {"key_id", envelope.key_id},           {"session", envelope.session}, {"sequence", envelope.sequence},
      {"valid_until", envelope.valid_until}, {"body", out.fields},          {"tag", tag}};
  out.summary = "sealed with key " + printable(envelope.key_id) + ": " + out.summary;
  return out;
}

}  // namespace

DecodedMessage decode_by_suffix(std::string_view suffix, std::span<const std::byte> bytes) {
  if (suffix == channels::kState) return decode_as<state_t>(bytes);
  if (suffix == channels::kStatus) return decode_as<status_t>(bytes);
  if (suffix == channels::kPoints) return decode_as<points_t>(bytes);
  if (suffix == channels::kLoads) return decode_as<loads_t>(bytes);
  if (suffix == channels::kScene) return decode_as<scene_t>(bytes);
  if (suffix == channels::kShapes) return decode_as<shapes_t>(bytes);
  if (suffix == channels::kForce) return decode_command<force_t>(bytes);
  if (suffix == channels::kControl) return decode_command<control_t>(bytes);
  if (suffix == channels::kAck) return decode_as<ack_t>(bytes);
  if (suffix == channels::kApplied) return decode_as<applied_t>(bytes);
  return {};
}

}  // namespace freeflex::tools
