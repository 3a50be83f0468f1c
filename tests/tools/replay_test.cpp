// `freeflex replay` reports whether the step reproduces a recording, and the cause if it does not.
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <nlohmann/json.hpp>

#include "freeflex_msgs/status_t.hpp"
#include "service/io/wire/codec.hpp"
#include "service/io/wire/decode.hpp"
#include "tests/tools/log_events.hpp"
#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

using freeflex_msgs::applied_t;
using freeflex_msgs::state_t;
using Json = nlohmann::json;

/// Holds the plan of the frame and a recording that this build made with the commands of the golden
/// recording. The tests below change this recording, so it must be undamaged. Like the golden recordings this
/// recording has no SCENE.
struct SoundRecording {
  SoundRecording() {
    const Outcome compiled = run(kFreeflex + " compile " + kGolden + "frame.yaml -o " + plan);
    EXPECT_EQ(compiled.exit_code, 0) << compiled.err;
    const Outcome fed =
        run(kFreeflex + " run " + plan + " --log " + kGolden + "frame.log --out " + folder / "sound.log");
    EXPECT_EQ(fed.exit_code, 0) << fed.err;
    events = read_events(folder / "sound.log");
    std::erase_if(events, [](const io::LogEvent& event) { return event.channel == "FREEFLEX_SCENE"; });
  }
  TemporaryFolder folder;
  std::string plan = folder / "frame.plan";
  std::vector<io::LogEvent> events;
};
const SoundRecording& sound() {
  static const SoundRecording recording;
  return recording;
}

/// Replays the undamaged recording after a change of its events.
Outcome replay_changed(const std::function<void(std::vector<io::LogEvent>&)>& change) {
  const TemporaryFolder folder;
  std::vector<io::LogEvent> events = sound().events;
  change(events);
  write_events(folder / "changed.log", events);
  return run(kFreeflex + " replay " + folder / "changed.log --plan " + sound().plan);
}

/// Returns the indices of the events of a channel.
std::vector<std::size_t> find_all(const std::vector<io::LogEvent>& events, const std::string& channel) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < events.size(); ++i) {
    if (events[i].channel == channel) found.push_back(i);
  }
  return found;
}

template <class Message>
void edit(io::LogEvent& event, const std::function<void(Message&)>& change) {
  Message message;
  ASSERT_TRUE(io::decode_message(event.bytes, message));
  change(message);
  event.bytes = io::encode(message);
}

double next_up(double value) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  bits ^= 1;
  std::memcpy(&value, &bits, sizeof bits);
  return value;
}

class GoldenRecording : public ::testing::TestWithParam<const char*> {};

TEST_P(GoldenRecording, IsReproducedToTheBit) {
  const std::string name = GetParam();
  const Outcome outcome =
      run(kFreeflex + " replay --json " + kGolden + name + ".log --plan " + kGolden + name + ".plan");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  const Json json = Json::parse(outcome.out);
  EXPECT_EQ(json["result"], "identical");
  // the recordings contain commands of every kind and a reset, and are several seconds long
  EXPECT_GE(json["commands"], 5);
  EXPECT_GE(json["states"], 50);
  EXPECT_GE(json["ticks"], 2000);
}
INSTANTIATE_TEST_SUITE_P(Scenes, GoldenRecording, ::testing::Values("chain", "frame", "truss"),
                         [](const auto& scene) { return std::string(scene.param); });

TEST(Replay, AStateThatDiffersInOneBitIsReported) {
  std::int64_t tick = 0;
  const Outcome outcome = replay_changed([&](auto& events) {
    const auto states = find_all(events, "FREEFLEX_STATE");
    edit<state_t>(events[states[states.size() / 2]], [&](state_t& state) {
      state.q[3] = next_up(state.q[3]);
      tick = state.tick;
    });
  });
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_TRUE(contains(outcome.out, "differs at tick " + std::to_string(tick) + ": q[3] is recorded as "))
      << outcome.out;
}

TEST(Replay, EachFieldOfAStateIsComparedToTheBit) {
  const std::vector<std::pair<std::string, std::function<double*(state_t&)>>> coordinates{
      {"time", [](state_t& s) { return &s.time; }},
      {"position[1]", [](state_t& s) { return &s.position[1]; }},
      {"attitude[2]", [](state_t& s) { return &s.attitude[2]; }},
      {"velocity[0]", [](state_t& s) { return &s.velocity[0]; }},
      {"angular_velocity[2]", [](state_t& s) { return &s.angular_velocity[2]; }},
      {"angular_momentum[0]", [](state_t& s) { return &s.angular_momentum[0]; }},
      {"q_dot[5]", [](state_t& s) { return &s.q_dot[5]; }}};
  for (const auto& [name, coordinate] : coordinates) {
    const Outcome outcome = replay_changed([&](auto& events) {
      edit<state_t>(events[find_all(events, "FREEFLEX_STATE").back()],
                    [&](state_t& state) { *coordinate(state) = next_up(*coordinate(state)); });
    });
    EXPECT_EQ(outcome.exit_code, 1) << name << outcome.err;
    EXPECT_TRUE(contains(outcome.out, ": " + name + " is recorded as ")) << outcome.out;
  }
}

TEST(Replay, AChangedCommandChangesTheStates) {
  const Outcome outcome = replay_changed([](auto& events) {
    edit<applied_t>(events[find_all(events, "FREEFLEX_APPLIED").front()],
                    [](applied_t& applied) { applied.command.forces.at(0).force[1] *= 2.0; });
  });
  EXPECT_EQ(outcome.exit_code, 1) << outcome.out << outcome.err;
}

TEST(Replay, AChangedEndOfASlotIsReportedAtItsTick) {
  const Outcome outcome = replay_changed([](auto& events) {
    for (const std::size_t i : find_all(events, "FREEFLEX_APPLIED")) {
      edit<applied_t>(events[i], [](applied_t& applied) {
        if (applied.kind == applied_t::LEASE_LOST) applied.kind = applied_t::EXPIRED;
      });
    }
  });
  EXPECT_EQ(outcome.exit_code, 1) << outcome.out << outcome.err;
  EXPECT_TRUE(contains(outcome.out, "slots that ended")) << outcome.out;
}

TEST(Replay, ARecordingThatLacksACommandIsIncomplete) {
  const auto num_applied = find_all(sound().events, "FREEFLEX_APPLIED").size();
  for (std::size_t dropped = 0; dropped < num_applied; ++dropped) {
    const Outcome outcome = replay_changed([&](auto& events) {
      const auto applied = find_all(events, "FREEFLEX_APPLIED");
      events.erase(events.begin() + static_cast<std::ptrdiff_t>(applied[dropped]));
    });
    EXPECT_EQ(outcome.exit_code, 3) << dropped << outcome.out;
    EXPECT_TRUE(contains(outcome.err, "the log is incomplete: the APPLIED event with sequence " +
                                          std::to_string(dropped) + " is missing"))
        << outcome.err;
    // no state before the missing command depends on the command
    EXPECT_TRUE(contains(outcome.out, "the states up to tick ") &&
                contains(outcome.out, " are as recorded, to the bit ("))
        << outcome.out;
    EXPECT_FALSE(contains(outcome.out, "identical")) << outcome.out;
  }
}

TEST(Replay, ARecordingThatStartsAfterACommandIsIncomplete) {
  const Outcome outcome = replay_changed([](auto& events) {
    const auto applied = find_all(events, "FREEFLEX_APPLIED");
    events.erase(events.begin(), events.begin() + static_cast<std::ptrdiff_t>(applied[1]) + 1);
  });
  EXPECT_EQ(outcome.exit_code, 3) << outcome.out;
  EXPECT_TRUE(contains(outcome.err, "the APPLIED event with sequence 0 is missing")) << outcome.err;
}

TEST(Replay, ARecordingThatStartsLateButBeforeTheFirstCommandIsComplete) {
  const Outcome outcome = replay_changed([](auto& events) {
    const auto states = find_all(events, "FREEFLEX_STATE");
    events.erase(events.begin() + static_cast<std::ptrdiff_t>(states.front()));
  });
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
}

TEST(Replay, RepeatedAndReorderedMessagesChangeNothing) {
  const Outcome outcome = replay_changed([](auto& events) {
    const auto applied = find_all(events, "FREEFLEX_APPLIED");
    const auto states = find_all(events, "FREEFLEX_STATE");
    std::swap(events[applied[1]], events[applied[2]]);
    std::swap(events[states[4]], events[states[9]]);
    const io::LogEvent copy = events[applied[0]];
    events.push_back(copy);
  });
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
}

TEST(Replay, ATruncatedOrDamagedFileIsReportedAsIncompleteWithTheOffset) {
  const TemporaryFolder folder;
  const std::string whole = read_text(kGolden + "frame.log");
  const std::string replay = kFreeflex + " replay --plan " + kGolden + "frame.plan ";
  for (const std::size_t length : {whole.size() - 1, whole.size() / 2, std::size_t{10}}) {
    write_text(folder / "cut.log", std::string_view(whole).substr(0, length));
    const Outcome outcome = run(replay + folder / "cut.log");
    EXPECT_EQ(outcome.exit_code, 3) << length << outcome.out;
    const std::string words = "damaged at byte ";
    const std::size_t position = outcome.err.find(words);
    ASSERT_NE(position, std::string::npos) << outcome.err;
    EXPECT_FALSE(contains(outcome.out, "identical")) << outcome.out;
    if (length == 10) continue;
    // the file up to the reported byte contains exactly the records that were compared
    const std::size_t at = std::stoul(outcome.err.substr(position + words.size()));
    write_text(folder / "whole.log", std::string_view(whole).substr(0, at));
    const Json part = Json::parse(run(replay + "--json " + folder / "cut.log").out);
    const Json named = Json::parse(run(replay + "--json " + folder / "whole.log").out);
    EXPECT_EQ(part["result"], "incomplete");
    EXPECT_EQ(named["result"], "identical");
    for (const char* field : {"ticks", "states", "commands"}) EXPECT_EQ(part[field], named[field]) << field;
    EXPECT_GT(part["states"], 10);
  }
}

TEST(Replay, AShortTextIsNotALog) {
  const TemporaryFolder folder;
  for (const char* text :
       {"a", "abc", "nine byte", "some text that is longer than the header of a record\n"}) {
    write_text(folder / "text.log", text);
    const Outcome outcome =
        run(kFreeflex + " replay " + folder / "text.log --plan " + kGolden + "frame.plan");
    EXPECT_EQ(outcome.exit_code, 2) << text;
    EXPECT_TRUE(contains(outcome.err, " is not an LCM event log")) << outcome.err;
  }
}

TEST(Replay, ACommandOfAnotherPlanContradictsTheLog) {
  const Outcome one = replay_changed([](auto& events) {
    edit<applied_t>(events[find_all(events, "FREEFLEX_APPLIED").at(2)],
                    [](applied_t& applied) { applied.plan_fingerprint ^= 1; });
  });
  EXPECT_EQ(one.exit_code, 3) << one.out;
  EXPECT_TRUE(contains(one.err, "the log is incomplete: the message on FREEFLEX_APPLIED at byte "))
      << one.err;
  EXPECT_TRUE(contains(one.err, "names the plan ")) << one.err;
  // all commands name one plan, but SCENE names another
  const TemporaryFolder folder;
  std::vector<io::LogEvent> events = read_events(sound().folder / "sound.log");
  for (const std::size_t i : find_all(events, "FREEFLEX_APPLIED"))
    edit<applied_t>(events[i], [](applied_t& applied) { applied.plan_fingerprint ^= 1; });
  write_events(folder / "changed.log", events);
  const Outcome all = run(kFreeflex + " replay " + folder / "changed.log");
  EXPECT_EQ(all.exit_code, 3) << all.out;
  EXPECT_TRUE(contains(all.err, "a session must have one plan")) << all.err;
}

TEST(Replay, ARecordingWithADamagedMessageIsIncomplete) {
  const Outcome outcome = replay_changed([](auto& events) {
    io::LogEvent& state = events[find_all(events, "FREEFLEX_STATE")[3]];
    state.bytes.erase(state.bytes.end() - 8, state.bytes.end());
  });
  EXPECT_EQ(outcome.exit_code, 3) << outcome.out;
  EXPECT_TRUE(contains(outcome.err, "FREEFLEX_STATE at byte ")) << outcome.err;
}

// the test changes the last bit of one number in each field of a state, one field at a time
TEST(Replay, EachFieldOfAStateWithWheelsIsComparedToTheBit) {
  const TemporaryFolder folder;
  const Outcome made =
      run(kFreeflex + " run " + kScenes + "satellite.yaml --until 0.1 --out " + folder / "a.log");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::vector<io::LogEvent> sound_events = read_events(folder / "a.log");
  const std::size_t last = find_all(sound_events, "FREEFLEX_STATE").back();
  state_t state;
  ASSERT_TRUE(io::decode_message(sound_events[last].bytes, state));
  ASSERT_GT(state.num_wheels, 0);
  ASSERT_GT(state.num_elastic, 0);
  const auto differs = [&](const std::string& what, const std::function<double&(state_t&)>& value) {
    std::vector<io::LogEvent> events = sound_events;
    edit<state_t>(events[last], [&](state_t& changed) { value(changed) = next_up(value(changed)); });
    write_events(folder / "b.log", events);
    const Outcome outcome = run(kFreeflex + " replay " + folder / "b.log");
    EXPECT_EQ(outcome.exit_code, 1) << what << outcome.out << outcome.err;
    EXPECT_TRUE(contains(outcome.out + outcome.err, what)) << outcome.out << outcome.err;
  };
  differs("time", [](state_t& s) -> double& { return s.time; });
  differs("position[2]", [](state_t& s) -> double& { return s.position[2]; });
  differs("attitude[3]", [](state_t& s) -> double& { return s.attitude[3]; });
  differs("velocity[2]", [](state_t& s) -> double& { return s.velocity[2]; });
  differs("angular_velocity[2]", [](state_t& s) -> double& { return s.angular_velocity[2]; });
  differs("angular_momentum[2]", [](state_t& s) -> double& { return s.angular_momentum[2]; });
  differs("q[", [](state_t& s) -> double& { return s.q.back(); });
  differs("q_dot[", [](state_t& s) -> double& { return s.q_dot.back(); });
  differs("wheel_momentum[", [](state_t& s) -> double& { return s.wheel_momentum.back(); });
}

TEST(Replay, ARecordingOfVersion03IsRefusedWithItsVersion) {
  // a state_t of version 0.3 has another fingerprint and no wheels at its end
  const Outcome outcome = replay_changed([](auto& events) {
    for (const std::size_t i : find_all(events, "FREEFLEX_STATE")) {
      std::vector<std::byte>& bytes = events[i].bytes;
      const std::uint64_t fingerprint = 0x61063d95b061afa7;
      for (std::size_t k = 0; k < 8; ++k)
        bytes[k] = static_cast<std::byte>(fingerprint >> (56 - 8 * k) & 0xFFu);
      bytes.resize(bytes.size() - 4);
    }
  });
  EXPECT_EQ(outcome.exit_code, 2) << outcome.out;
  EXPECT_TRUE(contains(outcome.err, "the message on FREEFLEX_STATE at byte ")) << outcome.err;
  EXPECT_TRUE(
      contains(outcome.err,
               " is of version 0.3 of the messages, but this program reads version 0.5; replay it with the "
               "release that recorded it"))
      << outcome.err;
}

TEST(Replay, DistinguishesUnsentMessagesFromLostMessages) {
  // the daemon's status reports that 3 of the 5 missing states were not sent
  const TemporaryFolder folder;
  std::vector<io::LogEvent> events = read_events(kGolden + "frame.log");
  int which = 0;
  std::erase_if(events, [&](const io::LogEvent& event) {
    return event.channel == "FREEFLEX_STATE" && ++which > 20 && which <= 25;
  });
  edit<freeflex_msgs::status_t>(events[find_all(events, "FREEFLEX_STATUS").back()],
                                [](auto& status) { status.states_dropped = 3; });
  write_events(folder / "gaps.log", events);
  const std::string replay = kFreeflex + " replay " + folder / "gaps.log --plan " + kGolden + "frame.plan";
  const Outcome text = run(replay);
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_TRUE(contains(text.err, "3 were not sent, by the counts of the status; 2 were lost in transit"))
      << text.err;
  const Json missing = Json::parse(run(replay + " --json").out)["missing"];
  EXPECT_EQ(missing["STATE"]["ticks"], 5) << missing;
  EXPECT_EQ(missing["STATE"]["unsent"], 3) << missing;
  EXPECT_EQ(missing["STATE"]["lost_in_transit"], 2) << missing;
  EXPECT_FALSE(missing.contains("POINTS")) << "the log has no POINTS";
}

TEST(Replay, AnUnreadableStatusIsReportedAndDoesNotStopTheReplay) {
  const TemporaryFolder folder;
  std::vector<io::LogEvent> events = read_events(kGolden + "frame.log");
  for (const std::size_t i : {1u, 2u, 3u}) events[find_all(events, "FREEFLEX_STATUS")[i]].bytes.resize(9);
  write_events(folder / "status.log", events);
  const Outcome outcome =
      run(kFreeflex + " replay " + folder / "status.log --plan " + kGolden + "frame.plan");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(contains(outcome.err, "the message on FREEFLEX_STATUS at byte ")) << outcome.err;
  EXPECT_TRUE(contains(outcome.err, ", and so are 2 others")) << outcome.err;
}

TEST(Replay, MissingFilesAndWrongPlansAreUsageErrors) {
  const TemporaryFolder folder;
  write_events(folder / "frame.log", sound().events);
  const std::string replay = kFreeflex + " replay " + folder / "frame.log ";
  EXPECT_EQ(run(kFreeflex + " replay /nonexistent.log").exit_code, 2);
  EXPECT_EQ(run(replay + "--plan /nonexistent.plan").exit_code, 2);
  const Outcome other = run(replay + "--plan " + kScenes + "boom.yaml");
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_TRUE(contains(other.err, "fingerprint")) << other.err;
  const Outcome unnamed = run(replay);
  EXPECT_EQ(unnamed.exit_code, 2);
  EXPECT_TRUE(contains(unnamed.err, "--plan")) << unnamed.err;
  EXPECT_EQ(run(replay + "--session 7 --plan " + sound().plan).exit_code, 2);
  const Outcome no_log = run(kFreeflex + " replay " + sound().plan + " --plan " + sound().plan);
  EXPECT_EQ(no_log.exit_code, 2);
  EXPECT_TRUE(contains(no_log.err, " is not an LCM event log")) << no_log.err;
}

TEST(Replay, OneOfSeveralSessionsMustBeChosen) {
  const auto both = [](auto& events) {
    for (const io::LogEvent& event : read_events(kGolden + "chain.log")) events.push_back(event);
  };
  const Outcome open = replay_changed(both);
  EXPECT_EQ(open.exit_code, 2);
  EXPECT_TRUE(contains(open.err, "several sessions")) << open.err;
  // if several sessions are recorded, the chosen session is replayed
  state_t state;
  const auto& frame = sound().events;
  ASSERT_TRUE(io::decode_message(frame[find_all(frame, "FREEFLEX_STATE")[0]].bytes, state));
  const TemporaryFolder folder;
  std::vector<io::LogEvent> events = frame;
  both(events);
  write_events(folder / "both.log", events);
  const Outcome chosen = run(kFreeflex + " replay " + folder / "both.log --session " +
                             std::to_string(state.session) + " --plan " + sound().plan);
  EXPECT_EQ(chosen.exit_code, 0) << chosen.err << chosen.out;
}

TEST(Replay, ARunWithTheCommandsOfARecordingGivesTheRecordedStates) {
  const TemporaryFolder folder;
  const std::string plan = kGolden + "truss.plan";
  const Outcome rerun =
      run(kFreeflex + " run " + plan + " --log " + kGolden + "truss.log --out " + folder / "again.log");
  ASSERT_EQ(rerun.exit_code, 0) << rerun.err;
  // the SCENE of the run contains the path of its plan, so replay does not need --plan
  const Outcome replayed = run(kFreeflex + " replay " + folder / "again.log");
  EXPECT_EQ(replayed.exit_code, 0) << replayed.out << replayed.err;
  EXPECT_TRUE(contains(replayed.out, "commands applied")) << replayed.out;
  // the states that the daemon published occur in the run with the same bits
  std::vector<state_t> again;
  for (const io::LogEvent& event : read_events(folder / "again.log")) {
    state_t state;
    if (event.channel == "FREEFLEX_STATE" && io::decode_message(event.bytes, state)) again.push_back(state);
  }
  int compared = 0;
  for (const io::LogEvent& event : read_events(kGolden + "truss.log")) {
    state_t state;
    if (event.channel != "FREEFLEX_STATE" || !io::decode_message(event.bytes, state)) continue;
    for (const state_t& other : again) {
      if (other.tick != state.tick || other.epoch != state.epoch) continue;
      EXPECT_EQ(std::memcmp(other.q.data(), state.q.data(), state.q.size() * sizeof(double)), 0)
          << state.tick;
      EXPECT_EQ(std::memcmp(other.attitude, state.attitude, sizeof state.attitude), 0) << state.tick;
      EXPECT_EQ(other.applied_count, state.applied_count);
      ++compared;
    }
  }
  EXPECT_GE(compared, 50);
}

}  // namespace
}  // namespace freeflex::testing
