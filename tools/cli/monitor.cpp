// freeflex monitor shows the messages on the bus.
#include <unistd.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/bus/bus.hpp"
#include "tools/bus/live_view.hpp"
#include "tools/bus/message_json.hpp"
#include "tools/cli/commands.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

using Clock = std::chrono::steady_clock;

struct MonitorOptions {
  BusOptions bus;
  std::string channel;
  std::optional<std::int64_t> count;
  std::optional<double> duration;  // [s]
  double interval = 1.0;           // [s]
  bool live = false;
  std::string note;
  bool json = false;
};

constexpr const char* kMonitorFooter = R"(Examples:
  freeflex monitor
  freeflex monitor --live
  freeflex monitor --channel STATE --json --count 10
Messages above 65,499 bytes are not shown; freeflex sends none.
Gaps are the messages missing between two received ones, for channels whose messages are numbered.
JSON fields of a table:
  utime        [us] since 1970, when the table was made
  channels     by name: rate [Hz] and bytes_per_second (null: interval too short for a rate), count, bytes, smallest,
               largest [bytes], gaps, last (fields of the last message)
JSON fields of a message:
  channel      its name;  received [us] since 1970;  bytes: its size
  message      the fields of its .lcm file, in the units there; fingerprints and hashes in 16 hexadecimal digits
Exit codes: 0 ended as requested or by Ctrl-C, 1 nothing heard, fewer than --count messages in --duration, or no
message bus, 2 wrong arguments.)";

// NOLINTNEXTLINE(bugprone-exception-escape): moving a Json never throws
struct Channel {
  std::int64_t count = 0;
  std::int64_t bytes = 0;
  std::int64_t recent_count = 0;  // messages since the last table
  std::int64_t recent_bytes = 0;
  std::size_t smallest = 0, largest = 0;  // [bytes]
  std::int64_t gaps = 0;                  // messages missing between received messages
  std::string stream;
  std::int64_t last_number = 0;
  std::int64_t step = 0;
  std::string summary;
  Json fields;
};

/// Counts the messages that are missing before a numbered message.
void count_gaps(Channel& channel, const DecodedMessage& message) {
  if (message.stream.empty()) return;
  if (message.stream == channel.stream && message.number > channel.last_number) {
    const std::int64_t distance = message.number - channel.last_number;
    if (message.step > 0) channel.step = message.step;
    if (channel.step == 0 || distance < channel.step) channel.step = distance;
    channel.gaps += (distance + channel.step / 2) / channel.step - 1;
  }
  channel.stream = message.stream;
  channel.last_number = message.number;
}

std::string suffix_of(const std::string& prefix, std::string_view channel) {
  return std::string(channel.starts_with(prefix) ? channel.substr(prefix.size()) : std::string_view{});
}

class Overview {
 public:
  explicit Overview(std::string prefix) : prefix_(std::move(prefix)) {}

  void take(const BusMessage& message) {
    const std::string name(message.channel);
    if (channels_.size() >= kMostChannels && !channels_.contains(name)) {
      ++num_unlisted_;
      return;
    }
    Channel& channel = channels_[name];
    const std::size_t size = message.bytes.size();
    channel.smallest = channel.count == 0 ? size : std::min(channel.smallest, size);
    channel.largest = std::max(channel.largest, size);
    ++channel.count;
    ++channel.recent_count;
    channel.bytes += static_cast<std::int64_t>(size);
    channel.recent_bytes += static_cast<std::int64_t>(size);
    DecodedMessage decoded = decode_by_suffix(suffix_of(prefix_, message.channel), message.bytes);
    count_gaps(channel, decoded);
    channel.summary = std::move(decoded.summary);
    channel.fields = std::move(decoded.fields);
  }

  /// Returns the table of channels.  \param seconds  [s] since the last table; nullopt: too short for a rate
  std::string table(std::optional<double> seconds) {
    std::string out = format_text("%-20s %9s %10s %8s %15s %6s  %s\n", "channel", "rate [Hz]", "[kB/s]",
                                  "count", "size [B]", "gaps", "last message");
    for (auto& [name_as_sent, channel] : channels_) {
      const std::string name = printable(name_as_sent);
      const std::string sizes = channel.smallest == channel.largest ? std::to_string(channel.largest)
                                                                    : std::to_string(channel.smallest) + "-" +
                                                                          std::to_string(channel.largest);
      const std::string rate =
          seconds ? format_text("%.1f", static_cast<double>(channel.recent_count) / *seconds) : "-";
      const std::string kilobytes =
          seconds ? format_text("%.2f", static_cast<double>(channel.recent_bytes) * 1e-3 / *seconds) : "-";
      const std::string gaps = channel.stream.empty() ? "-" : std::to_string(channel.gaps);
      out += format_text("%-20s %9s %10s %8lld %15s %6s  %s\n", name.c_str(), rate.c_str(), kilobytes.c_str(),
                         static_cast<long long>(channel.count), sizes.c_str(), gaps.c_str(),
                         channel.summary.c_str());
      channel.recent_count = channel.recent_bytes = 0;
    }
    if (num_unlisted_ > 0)
      out += counted(num_unlisted_, "message") + " came on channels beyond the " +
             std::to_string(kMostChannels) + " that are shown\n";
    return out;
  }

  Json json(std::optional<double> seconds) {
    const auto a_second = [&](std::int64_t count) {
      return seconds ? Json(static_cast<double>(count) / *seconds) : Json();
    };
    Json out{{"utime", wall_clock_us()}};
    out["channels"] = Json::object();
    for (auto& [name, channel] : channels_) {
      Json item{{"rate", a_second(channel.recent_count)},
                {"bytes_per_second", a_second(channel.recent_bytes)},
                {"count", channel.count},
                {"bytes", channel.bytes},
                {"smallest", channel.smallest},
                {"largest", channel.largest}};
      if (!channel.stream.empty()) item["gaps"] = channel.gaps;
      item["last"] = channel.fields;
      out["channels"][name] = item;
      channel.recent_count = channel.recent_bytes = 0;
    }
    return out;
  }

 private:
  static constexpr std::size_t kMostChannels = 256;

  std::string prefix_;
  std::map<std::string, Channel> channels_;
  std::int64_t num_unlisted_ = 0;  // messages on channels after the first kMostChannels
};

Clock::duration seconds(double value) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(value));
}

/// Calls show() after every interval, and at the end if half an interval has passed since the last call, or
/// if there was no call. The argument is the time since the last call [s], or nullopt if half an interval has
/// not passed, because this time is too short for a rate. Ends after the duration, after `count` messages or
/// at Ctrl-C.
void watch(Bus& bus, const MonitorOptions& options, const std::int64_t& num_messages,
           const std::function<void(std::optional<double>)>& show) {
  constexpr double kForever = 1e9;  // [s]
  const Clock::time_point start = Clock::now();
  const Clock::time_point end = start + seconds(options.duration.value_or(kForever));
  const auto is_over = [&] {
    return is_interrupted() || std::ferror(stdout) != 0 || Clock::now() >= end ||
           (options.count && num_messages >= *options.count);
  };
  Clock::time_point shown = start;
  while (!is_over()) {
    const Clock::time_point next = std::min(end, shown + seconds(options.interval));
    bus.wait(std::chrono::ceil<std::chrono::milliseconds>(next - Clock::now()), is_over);
    const double elapsed = std::chrono::duration<double>(Clock::now() - shown).count();
    const bool is_short = elapsed < 0.5 * options.interval;
    if (is_short && shown != start) break;
    show(is_short ? std::nullopt : std::optional(elapsed));
    shown = Clock::now();
  }
}

/// Warns once if no message has come.
class SilenceNote {
 public:
  explicit SilenceNote(std::string text) : text_(std::move(text)) {}
  /// Returns true if no message has come. Must be called after each interval.
  bool take(std::int64_t num_messages) {
    if (num_messages > 0) return false;
    if (!is_printed_) print_warning(text_);
    is_printed_ = true;
    return true;
  }

 private:
  std::string text_;
  bool is_printed_ = false;
};

std::int64_t monitor_channel(Bus& bus, const MonitorOptions& options) {
  // adds the prefix to a name that lacks it
  const bool is_short = options.channel.find(options.bus.prefix) != 0;
  const std::string name = is_short ? options.bus.prefix + "_" + options.channel : options.channel;
  std::int64_t num_messages = 0;
  bus.subscribe(name, [&](const BusMessage& message) {
    if (options.count && num_messages >= *options.count) return;
    ++num_messages;
    const DecodedMessage decoded =
        decode_by_suffix(suffix_of(options.bus.prefix, message.channel), message.bytes);
    if (options.json) {
      print_json({{"channel", message.channel},
                  {"received", message.utime},
                  {"bytes", message.bytes.size()},
                  {"message", decoded.fields}},
                 -1);
      return;
    }
    std::printf("%s %zu bytes: %s\n", printable(message.channel).c_str(), message.bytes.size(),
                decoded.summary.c_str());
    if (decoded.fields.is_object()) {
      for (const auto& [key, value] : decoded.fields.items()) {
        std::printf("  %-18s %s\n", key.c_str(), json_text(value).c_str());
      }
    }
    std::fflush(stdout);
  });
  SilenceNote note("no message has come on " + name + " so far (" + bus.describe() +
                   "); 'freeflex monitor' shows which channels there are");
  watch(bus, options, num_messages, [&](std::optional<double>) { note.take(num_messages); });
  return num_messages;
}

std::int64_t monitor_all(Bus& bus, const MonitorOptions& options) {
  Overview overview(options.bus.prefix);
  std::int64_t num_messages = 0;
  bus.subscribe({}, [&](const BusMessage& message) {
    ++num_messages;
    overview.take(message);
  });
  Screen screen(isatty(STDOUT_FILENO) == 1 && !options.json);
  SilenceNote note("no message has come so far (" + bus.describe() +
                   "); check that a freeflexd is running and uses this bus");
  watch(bus, options, num_messages, [&](std::optional<double> seconds) {
    const bool is_silent = note.take(num_messages);
    if (options.json) {
      print_json(overview.json(seconds), -1);
    } else if (!is_silent) {
      screen.show(overview.table(seconds));
    }
  });
  return num_messages;
}

std::int64_t monitor_live(Bus& bus, const MonitorOptions& options) {
  LiveView view;
  std::int64_t num_messages = 0;
  bus.subscribe({}, [&](const BusMessage& message) {
    if (!message.channel.starts_with(options.bus.prefix + "_")) return;
    ++num_messages;
    view.take(suffix_of(options.bus.prefix, message.channel), message);
  });
  MonitorOptions pace = options;
  const bool is_terminal = isatty(STDOUT_FILENO) == 1;
  if (is_terminal) pace.interval = std::min(0.2, options.interval);
  Screen screen(is_terminal);
  std::string line;
  watch(bus, pace, num_messages, [&](std::optional<double>) {
    const std::string note = options.note.empty() ? std::string() : options.note + "\n";
    // while no message comes, the line is not printed again
    if (!is_terminal && num_messages == 0 && line == view.line()) return;
    line = view.line();
    screen.show(is_terminal ? note + view.page(bus.describe(), screen.num_rows() - (note.empty() ? 0 : 1))
                            : line + "\n");
  });
  return num_messages;
}

int monitor(const MonitorOptions& options) {
  if (options.live && (options.json || !options.channel.empty()))
    return print_error("--live cannot be used with --json or --channel"), kExitUsage;
  if (options.live && options.count)
    return print_error("--live cannot be used with --count, which counts messages; end it with --duration S"),
           kExitUsage;
  if (!options.live && !options.note.empty())
    return print_error("--note needs --live, because it is a line above the live view"), kExitUsage;
  if (is_interrupted()) return kExitOk;  // from now on Ctrl-C is the normal end
  Bus bus(options.bus);
  if (!bus.error().empty()) return print_error(bus.error()), bus.is_usage_error() ? kExitUsage : kExitDiffers;
  const std::int64_t num_messages = options.live              ? monitor_live(bus, options)
                                    : options.channel.empty() ? monitor_all(bus, options)
                                                              : monitor_channel(bus, options);
  return num_messages < options.count.value_or(1) && !is_interrupted() ? kExitDiffers : kExitOk;
}

}  // namespace

void add_monitor(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<MonitorOptions>();
  CLI::App* command =
      app.add_subcommand("monitor", "messages on the bus: all channels, one channel, or the live state");
  command
      ->add_option("--channel", options->channel,
                   "print the messages of one channel as they come: STATE, or a full name")
      ->type_name("NAME");
  command->add_flag("--live", options->live, "the live state of the structure");
  command->add_option("--note", options->note, "a line above --live on a terminal")->type_name("TEXT");
  command->add_option("--count", options->count, "end after this many messages")
      ->check(whole_number(1, kMost<std::int64_t>))
      ->type_name("N");
  command->add_option("--duration", options->duration, "end after this time [s]")
      ->check(positive_time())
      ->type_name("S");
  command->add_option("--interval", options->interval, "time between tables, or lines of --live [s]")
      ->check(positive_time())
      ->type_name("S")
      ->capture_default_str();
  command->add_flag("--json", options->json,
                    "one JSON object a line: a table each interval, or a message of --channel");
  add_bus_options(*command, options->bus);
  command->footer(kMonitorFooter);
  command->callback([options, &exit_code] { exit_code = monitor(*options); });
}

}  // namespace freeflex::tools
