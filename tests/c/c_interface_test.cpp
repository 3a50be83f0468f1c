// The C interface and the core give the same bits of a motion. A refused call returns a code, sets the error
// text and changes nothing.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "core/error/judgement.hpp"
#include "core/step/readout.hpp"
#include "service/c/freeflex.h"
#include "service/io/scene/input.hpp"
#include "tests/support/large_scenes.hpp"

namespace freeflex::testing {
namespace {

const std::string kScenes = FREEFLEX_SOURCE_DIR "/service/scenes/";

struct Handles {
  explicit Handles(const std::string& scene, unsigned flags = 0) {
    EXPECT_EQ(freeflex_plan_open(scene.c_str(), nullptr, nullptr, &plan), FREEFLEX_OK)
        << freeflex_last_error();
    if (plan == nullptr) return;
    EXPECT_EQ(freeflex_motion_new(plan, flags, &motion), FREEFLEX_OK);
  }
  ~Handles() {
    freeflex_motion_free(motion);
    freeflex_plan_free(plan);
  }
  Handles(const Handles&) = delete;
  Handles& operator=(const Handles&) = delete;

  freeflex_plan* plan = nullptr;
  freeflex_motion* motion = nullptr;
};

std::vector<double> elastic_of(const freeflex_motion* motion) {
  std::size_t count = 0;
  freeflex_motion_elastic(motion, nullptr, nullptr, 0, &count);
  std::vector<double> q(count);
  EXPECT_EQ(freeflex_motion_elastic(motion, q.data(), nullptr, q.size(), nullptr), FREEFLEX_OK);
  return q;
}

TEST(CInterface, ReturnsTheVersionOfTheProject) {
  EXPECT_STREQ(freeflex_version(), FREEFLEX_PROJECT_VERSION);
}

TEST(CInterface, StepsToTheSameBitsAsTheCore) {
  for (const std::string name : {"boom.yaml", "satellite.yaml", "rotor.yaml"}) {
    Handles c(kScenes + name, FREEFLEX_WITH_VERDICT);
    const io::PlanResult loaded = io::load_plan(kScenes + name);
    ASSERT_TRUE(loaded.plan);
    const Plan& plan = *loaded.plan;
    State state = make_state(plan);
    Workspace workspace = make_workspace(plan);
    StepReport report;
    Judgement judgement(plan);
    judgement.take(state);
    for (int tick = 0; tick < 500; ++tick) {
      step(plan, state, {}, workspace, report);
      judgement.take(state);
    }
    ASSERT_EQ(freeflex_motion_step(c.motion, 500), FREEFLEX_OK);
    EXPECT_EQ(freeflex_motion_tick(c.motion), 500);
    EXPECT_EQ(elastic_of(c.motion), std::vector<double>(state.q.begin(), state.q.begin() + plan.num_elastic));
    freeflex_frame frame;
    freeflex_motion_frame(c.motion, &frame);
    EXPECT_TRUE(std::equal(state.q_WB.begin(), state.q_WB.end(), frame.attitude));
    freeflex_verdict verdict;
    ASSERT_EQ(freeflex_motion_verdict(c.motion, &verdict), FREEFLEX_OK);
    EXPECT_EQ(verdict.level, static_cast<int>(judgement.now().level));
    EXPECT_GT(verdict.tick, 0);
    EXPECT_EQ(verdict.tick, judgement.now().tick);
    EXPECT_EQ(verdict.error, judgement.now().error.deformation);
    freeflex_errors errors;
    ASSERT_EQ(freeflex_motion_errors(c.motion, &errors), FREEFLEX_OK);
    EXPECT_EQ(errors.tick, verdict.tick);
    EXPECT_EQ(errors.position, judgement.now().error.position);
    EXPECT_EQ(errors.attitude, judgement.now().error.attitude);
    EXPECT_EQ(errors.deformation, judgement.now().error.deformation);
    EXPECT_EQ(errors.shadow, judgement.now().own_error);
  }
}

TEST(CInterface, AMotionWhoseVerdictIsOffIsNotJudged) {
  freeflex_plan* plan = nullptr;
  freeflex_motion* motion = nullptr;
  const freeflex_setting setting{"verdict", "off"};
  ASSERT_EQ(freeflex_plan_open_with((kScenes + "boom.yaml").c_str(), &setting, 1, nullptr, nullptr, &plan),
            FREEFLEX_OK)
      << freeflex_last_error();
  ASSERT_EQ(freeflex_motion_new(plan, FREEFLEX_WITH_VERDICT, &motion), FREEFLEX_OK) << freeflex_last_error();
  freeflex_motion_step(motion, 10);
  freeflex_verdict verdict;
  ASSERT_EQ(freeflex_motion_verdict(motion, &verdict), FREEFLEX_OK) << freeflex_last_error();
  EXPECT_EQ(verdict.level, FREEFLEX_NOT_JUDGED);
  EXPECT_EQ(verdict.tick, -1);
  EXPECT_STREQ(verdict.cause, "the scene has verdict: off");
  ASSERT_EQ(freeflex_motion_worst_verdict(motion, &verdict), FREEFLEX_OK);
  EXPECT_EQ(verdict.level, FREEFLEX_NOT_JUDGED);
  freeflex_motion_free(motion);
  freeflex_plan_free(plan);
}

TEST(CInterface, ReadsTheSameValuesAsTheCore) {
  Handles c(kScenes + "satellite.yaml");
  freeflex_motion_step(c.motion, 1500);
  const io::PlanResult loaded = io::load_plan(kScenes + "satellite.yaml");
  const Plan& plan = *loaded.plan;
  State state = make_state(plan);
  Workspace workspace = make_workspace(plan);
  StepReport report;
  for (int tick = 0; tick < 1500; ++tick) step(plan, state, {}, workspace, report);

  const std::int32_t hub = freeflex_plan_find(c.plan, FREEFLEX_POINT, "hub");
  ASSERT_GE(hub, 0);
  freeflex_point point;
  ASSERT_EQ(freeflex_motion_point(c.motion, hub, &point), FREEFLEX_OK) << freeflex_last_error();
  const PointState expected = read_point(plan, state, hub);
  EXPECT_TRUE(std::equal(expected.p_W.begin(), expected.p_W.end(), point.position));
  EXPECT_TRUE(std::equal(expected.a_W.begin(), expected.a_W.end(), point.acceleration));
  freeflex_body body;
  ASSERT_EQ(freeflex_motion_body(c.motion, hub, &body), FREEFLEX_OK);
  const BodyState turned = read_body(plan, state, hub);
  EXPECT_TRUE(std::equal(turned.q_WP.begin(), turned.q_WP.end(), body.attitude));
  freeflex_pose pose;
  ASSERT_EQ(freeflex_motion_group(c.motion, 0, &pose), FREEFLEX_OK) << freeflex_last_error();
  EXPECT_EQ(pose.position[1], read_group(plan, state, 0).p_W[1]);
  std::array<double, 8> momenta{};
  ASSERT_EQ(freeflex_motion_wheels(c.motion, momenta.data(), momenta.size()), FREEFLEX_OK);
  EXPECT_EQ(momenta[0], state.wheel_momentum[0]);
  freeflex_energy energy;
  freeflex_motion_energy(c.motion, &energy);
  EXPECT_EQ(energy.potential, read_invariants(plan, state).potential);
  std::vector<double> frequencies(static_cast<std::size_t>(freeflex_plan_count(c.plan, FREEFLEX_MODE)));
  ASSERT_EQ(freeflex_plan_frequencies(c.plan, frequencies.data(), frequencies.size()), FREEFLEX_OK);
  EXPECT_NEAR(frequencies[0], 0.3195, 1e-4);  // service/scenes/README.md
  // the sum of mode shapes times coordinates is the displacement of the point
  std::vector<double> shape(3 * frequencies.size());
  ASSERT_EQ(freeflex_plan_shape(c.plan, hub, shape.data(), shape.size()), FREEFLEX_OK);
  double displacement = 0.0;
  for (std::size_t l = 0; l < frequencies.size(); ++l) displacement += shape[3 * l] * state.q[l];
  EXPECT_NEAR(displacement, point.displacement[0], 1e-15);
}

TEST(CInterface, PushesInTwoSlotsAddUpUntilEachEnds) {
  Handles c(kScenes + "boom.yaml");
  const std::int32_t tip = freeflex_plan_find(c.plan, FREEFLEX_POINT, "tip");
  const double mass = freeflex_plan_mass(c.plan), period = 1.0 / freeflex_plan_rate(c.plan);
  const freeflex_load load{FREEFLEX_POINT, tip, {0.0, 0.0, 10.0}, {}};
  ASSERT_EQ(freeflex_motion_push(c.motion, 0, FREEFLEX_WORLD, &load, 1, 20), FREEFLEX_OK);
  ASSERT_EQ(freeflex_motion_push(c.motion, 1, FREEFLEX_WORLD, &load, 1, 0), FREEFLEX_OK);
  freeflex_motion_step(c.motion, 50);
  ASSERT_EQ(freeflex_motion_push(c.motion, 1, FREEFLEX_WORLD, nullptr, 0, 0), FREEFLEX_OK);
  freeflex_motion_step(c.motion, 50);
  freeflex_frame frame;
  freeflex_motion_frame(c.motion, &frame);
  EXPECT_NEAR(frame.velocity[2], 10.0 * (20 + 50) * period / mass, 1e-15);
  // a push on the copy does not move the original
  freeflex_motion* copy = nullptr;
  ASSERT_EQ(freeflex_motion_copy(c.motion, &copy), FREEFLEX_OK);
  ASSERT_EQ(freeflex_motion_push(copy, 0, FREEFLEX_WORLD, &load, 1, 0), FREEFLEX_OK);
  freeflex_motion_step(copy, 10);
  freeflex_motion_step(c.motion, 10);
  EXPECT_NE(elastic_of(copy), elastic_of(c.motion));
  freeflex_motion_reset(copy);
  freeflex_motion_frame(copy, &frame);
  EXPECT_EQ(frame.velocity[2], 0.0);
  EXPECT_EQ(freeflex_motion_time(copy), 0.0);
  freeflex_motion_free(copy);
}

TEST(CInterface, ARefusedCallIsReportedAndChangesNothing) {
  freeflex_plan* none = nullptr;
  EXPECT_EQ(freeflex_plan_open("/nowhere.yaml", nullptr, nullptr, &none), FREEFLEX_BAD_SCENE);
  EXPECT_NE(std::string(freeflex_last_error()).find("/nowhere.yaml"), std::string::npos);
  EXPECT_EQ(none, nullptr);
  EXPECT_EQ(freeflex_plan_open(nullptr, nullptr, nullptr, &none), FREEFLEX_BAD_ARGUMENT);

  Handles c(kScenes + "boom.yaml");
  const auto refuses = [](int code, const char* text) {
    EXPECT_EQ(code, FREEFLEX_BAD_ARGUMENT);
    EXPECT_NE(std::string(freeflex_last_error()).find(text), std::string::npos) << freeflex_last_error();
  };
  freeflex_motion* motion = nullptr;
  refuses(freeflex_motion_new(c.plan, 64U, &motion), "flags is 64");
  double value = 0.0;
  refuses(freeflex_plan_frequencies(c.plan, &value, 1),
          "the array has room for 1 numbers, but must have room for ");
  refuses(freeflex_motion_elastic(c.motion, &value, nullptr, 1, nullptr),
          "the array has room for 1 numbers, but must have room for ");
  freeflex_point point;
  refuses(freeflex_motion_point(c.motion, 4, &point), "point 4 does not exist; the number must be 0 to 3");
  refuses(freeflex_motion_point(c.motion, -1, &point), "point -1 does not exist");
  freeflex_pose group;
  refuses(freeflex_motion_group(c.motion, 0, &group), "group 0 does not exist, because the plan has none");
  freeflex_body body;
  refuses(freeflex_motion_body(c.motion, 0, &body), "has no attitude");
  freeflex_verdict verdict;
  refuses(freeflex_motion_verdict(c.motion, &verdict), "FREEFLEX_WITH_VERDICT");
  refuses(freeflex_motion_step(c.motion, -1), "the number of ticks is -1");

  freeflex_load load{FREEFLEX_POINT, 9, {0.0, 0.0, 1.0}, {}};
  const auto push = [&](int slot, std::size_t count = 1) {
    return freeflex_motion_push(c.motion, slot, FREEFLEX_WORLD, &load, count, 1);
  };
  refuses(push(0), "point 9 does not exist; the scene has points 0 to 3");
  load.index = 3;
  refuses(push(64), "slot is 64, but must be 0 to 63");
  load.force[0] = std::nan("");
  refuses(push(0), "which must be finite");
  load = {FREEFLEX_WHEEL, 0, {1.0, 0.0, 0.0}, {}};
  refuses(push(0), "only torque[0]");
  load = {FREEFLEX_LINK, 0, {1.0, 0.0, 0.0}, {}};
  refuses(push(0), "the kind of a load is 1");
  const std::vector<freeflex_load> many(257, freeflex_load{FREEFLEX_POINT, 3, {0.0, 0.0, 1.0}, {}});
  refuses(freeflex_motion_push(c.motion, 0, FREEFLEX_WORLD, many.data(), many.size(), 1),
          "one slot has room for at most 256 forces");
  freeflex_motion_step(c.motion, 10);
  freeflex_frame frame;
  freeflex_motion_frame(c.motion, &frame);
  EXPECT_EQ(frame.velocity[2], 0.0);

  EXPECT_EQ(freeflex_plan_find(c.plan, FREEFLEX_POINT, "nobody"), -1);
  EXPECT_EQ(freeflex_plan_name_of(c.plan, FREEFLEX_POINT, 4), nullptr);
  EXPECT_EQ(freeflex_plan_name_of(c.plan, FREEFLEX_MODE, 0), nullptr);
  EXPECT_EQ(freeflex_plan_count(c.plan, 77), 0);
}

TEST(CInterface, ARunningSetUpEndsOnRequest) {
  const std::string path = ::testing::TempDir() + "/chain.yaml";
  {
    std::ofstream file(path);
    file << "points:\n";
    for (int k = 0; k < 400; ++k)
      file << "  - {mass: 1, at: [" << k << ", " << (k % 2) << ", " << (k % 3) << "]}\n";
    file << "links:\n";
    for (int k = 0; k < 399; ++k)
      file << "  - {beam: [" << k + 1 << ", " << k + 2 << "], EA: 1e6, GJ: 100, EIy: 100, EIz: 100}\n";
    file << "modes: {count: 10}\n";
  }
  freeflex_plan* plan = nullptr;
  int asked = 0;
  const auto end = [](void* user, const char*, double) { return ++*static_cast<int*>(user), 1; };
  EXPECT_EQ(freeflex_plan_open(path.c_str(), end, &asked, &plan), FREEFLEX_ENDED);
  EXPECT_EQ(plan, nullptr);
  EXPECT_EQ(asked, 1);
}

TEST(CInterface, ThreadsShareOnePlanAndEachHasItsOwnErrorText) {
  Handles c(kScenes + "boom.yaml");
  freeflex_motion_step(c.motion, 2000);
  const std::vector<double> expected = elastic_of(c.motion);
  std::vector<std::thread> threads;
  for (int k = 0; k < 4; ++k)
    threads.emplace_back([&] {
      EXPECT_STREQ(freeflex_last_error(), "");
      freeflex_motion* motion = nullptr;
      ASSERT_EQ(freeflex_motion_new(c.plan, 0, &motion), FREEFLEX_OK);
      freeflex_motion_step(motion, 2000);
      EXPECT_EQ(elastic_of(motion), expected);
      freeflex_motion_free(motion);
    });
  for (std::thread& thread : threads) thread.join();
}

/// Opens a plan. Returns the code, the mass and the error text.
template <typename Open>
std::tuple<int, double, std::string> opened(const Open& open) {
  freeflex_plan* plan = nullptr;
  const int code = open(&plan);
  const double mass = plan == nullptr ? 0.0 : freeflex_plan_mass(plan);
  freeflex_plan_free(plan);
  return {code, mass, code == FREEFLEX_OK ? "" : freeflex_last_error()};
}

TEST(CInterface, SetsValuesByPathInAFileAndInText) {
  const std::string path = kScenes + "boom.yaml";
  std::ifstream file(path);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  const std::array<freeflex_setting, 3> settings{
      {{"points.hub.mass", "100"}, {"points.tip.mass", "12"}, {"points.hub.mass", "50"}}};
  const auto from_file = [&](const std::vector<freeflex_setting>& set) {
    return opened([&](freeflex_plan** plan) {
      return freeflex_plan_open_with(path.c_str(), set.data(), set.size(), nullptr, nullptr, plan);
    });
  };
  const auto from_text = [&](const std::vector<freeflex_setting>& set, const char* name) {
    return opened([&](freeflex_plan** plan) {
      return freeflex_plan_open_text(text.c_str(), name, nullptr, set.data(), set.size(), nullptr, nullptr,
                                     plan);
    });
  };
  const std::vector<freeflex_setting> none, all(settings.begin(), settings.end()),
      bad{{"points.hub.mass", "-1"}};
  EXPECT_EQ(std::get<double>(from_file(none)), 44.0);
  EXPECT_EQ(std::get<double>(from_text(none, nullptr)), 44.0);
  // the hub has 50 kg instead of 40 kg, because the last of two settings of a path applies, and the tip has
  // 12 kg instead of 2 kg
  EXPECT_EQ(std::get<double>(from_file(all)), 64.0);
  EXPECT_EQ(std::get<double>(from_text(all, nullptr)), 64.0);
  for (const auto& [code, mass, error] : {from_file(bad), from_text(bad, nullptr)}) {
    EXPECT_EQ(code, FREEFLEX_BAD_SCENE);
    EXPECT_NE(error.find("points.hub.mass = -1: error: point 'hub': mass is -1 kg"), std::string::npos)
        << error;
  }
  const auto [code, mass, error] = opened([](freeflex_plan** plan) {
    return freeflex_plan_open_text("points: 3", "mine", nullptr, nullptr, 0, nullptr, nullptr, plan);
  });
  EXPECT_EQ(code, FREEFLEX_BAD_SCENE);
  EXPECT_EQ(error.find("mine:1:"), 0u) << error;
}

TEST(CInterface, OneCallReadsTheWholeState) {
  Handles c(kScenes + "satellite.yaml");
  freeflex_motion_step(c.motion, 1500);
  const auto modes = static_cast<std::size_t>(freeflex_plan_count(c.plan, FREEFLEX_MODE)),
             wheels = static_cast<std::size_t>(freeflex_plan_count(c.plan, FREEFLEX_WHEEL));
  freeflex_state state;
  std::vector<double> q(modes), q_dot(modes), momenta(wheels), expected(modes), expected_momenta(wheels);
  ASSERT_EQ(freeflex_motion_state(c.motion, &state, q.data(), q_dot.data(), modes, momenta.data(), wheels),
            FREEFLEX_OK);
  EXPECT_EQ(state.tick, 1500);
  EXPECT_EQ(state.time, freeflex_motion_time(c.motion));
  freeflex_frame frame;
  freeflex_motion_frame(c.motion, &frame);
  EXPECT_EQ(std::memcmp(&frame, &state.frame, sizeof frame), 0);
  EXPECT_EQ(q, elastic_of(c.motion));
  ASSERT_EQ(freeflex_motion_elastic(c.motion, nullptr, expected.data(), modes, nullptr), FREEFLEX_OK);
  EXPECT_EQ(q_dot, expected);
  ASSERT_EQ(freeflex_motion_wheels(c.motion, expected_momenta.data(), wheels), FREEFLEX_OK);
  EXPECT_EQ(momenta, expected_momenta);

  EXPECT_EQ(freeflex_motion_state(c.motion, &state, nullptr, nullptr, 0, nullptr, 0), FREEFLEX_OK);
  EXPECT_EQ(freeflex_motion_state(c.motion, &state, q.data(), nullptr, modes - 1, nullptr, 0),
            FREEFLEX_BAD_ARGUMENT);
  EXPECT_EQ(freeflex_motion_state(c.motion, &state, nullptr, nullptr, 0, momenta.data(), wheels - 1),
            FREEFLEX_BAD_ARGUMENT);
}

// While a call uses a motion, a second call of a function that returns a code is refused, and a second call
// of any other function waits.
TEST(CInterface, AMotionAcceptsOnlyOneCallAtATime) {
  Handles c(kScenes + "boom.yaml");
  const freeflex_load load{FREEFLEX_POINT, 3, {0.0, 0.0, 1e-9}, {}};
  constexpr std::int64_t kTicks = 50'000;
  std::atomic<bool> is_over = false;
  std::atomic<int> steps = 0, refused = 0, resets = 0;
  const auto note = [&](int code) {
    if (code == FREEFLEX_BUSY) {
      ++refused;
      EXPECT_NE(std::string(freeflex_last_error()).find("freeflex_motion_copy"), std::string::npos);
    } else {
      EXPECT_EQ(code, FREEFLEX_OK) << freeflex_last_error();
    }
  };
  std::thread stepping([&] {
    for (; refused < 20 && steps < 1000; ++steps)
      while (freeflex_motion_step(c.motion, kTicks) != FREEFLEX_OK) {
      }
    is_over = true;
  });
  std::thread reading([&] {
    freeflex_state state;
    freeflex_frame frame;
    freeflex_point point;
    while (!is_over) {
      note(freeflex_motion_state(c.motion, &state, nullptr, nullptr, 0, nullptr, 0));
      note(freeflex_motion_point(c.motion, 3, &point));
      freeflex_motion_frame(c.motion, &frame);
      EXPECT_EQ(freeflex_motion_tick(c.motion) % kTicks, 0);
    }
  });
  std::thread pushing([&] {
    while (!is_over) {
      note(freeflex_motion_push(c.motion, 0, FREEFLEX_WORLD, &load, 1, 1));
      freeflex_motion_reset(c.motion);
      ++resets;
      freeflex_motion* copy = nullptr;
      const int code = freeflex_motion_copy(c.motion, &copy);
      note(code);
      if (code == FREEFLEX_OK) freeflex_motion_free(copy);
    }
  });
  for (std::thread* const each : {&stepping, &reading, &pushing}) each->join();
  EXPECT_EQ(freeflex_motion_tick(c.motion), steps * kTicks);
  EXPECT_GE(refused, 20);
  EXPECT_GT(resets, 0);
}

TEST(CInterface, APushLongerThanMaxHoldIsRefused) {
  Handles c(kScenes + "boom.yaml");
  const freeflex_load load{FREEFLEX_POINT, 3, {0.0, 0.0, 1.0}, {}};
  const auto push = [&](std::int64_t ticks) {
    return freeflex_motion_push(c.motion, 0, FREEFLEX_WORLD, &load, 1, ticks);
  };
  EXPECT_EQ(push(60'000), FREEFLEX_OK) << freeflex_last_error();
  EXPECT_EQ(push(60'001), FREEFLEX_BAD_ARGUMENT);
  EXPECT_STREQ(freeflex_last_error(),
               "the push lasts 60001 ticks, but may last at most 60000 ('commands: max_hold' of the scene); "
               "push again before it ends");
  EXPECT_EQ(push(0), FREEFLEX_OK) << "0 ticks: the push lasts until another push in the slot replaces it";
}

TEST(CInterface, TooManyPushesWithoutAStepAreRefused) {
  Handles c(kScenes + "boom.yaml");
  const freeflex_load load{FREEFLEX_POINT, 3, {0.0, 0.0, 1.0}, {}};
  const auto push = [&] { return freeflex_motion_push(c.motion, 0, FREEFLEX_WORLD, &load, 1, 1); };
  for (int k = 0; k < 256; ++k) ASSERT_EQ(push(), FREEFLEX_OK) << freeflex_last_error();
  EXPECT_EQ(push(), FREEFLEX_BAD_ARGUMENT);
  EXPECT_STREQ(freeflex_last_error(),
               "256 pushes wait for the next step, which is the largest number allowed; step first");
  freeflex_motion_step(c.motion, 1);
  EXPECT_EQ(push(), FREEFLEX_OK);
}

/// Sets up a scene in a child process that may use `megabytes` more address space than at its start, and
/// returns the code.
int code_within(std::size_t megabytes, const std::string& scene) {
  const pid_t child = fork();
  if (child == 0) {
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    rlimit limit{};
    limit.rlim_cur = limit.rlim_max =
        pages * static_cast<std::size_t>(sysconf(_SC_PAGE_SIZE)) + (megabytes << 20);
    if (setrlimit(RLIMIT_AS, &limit) != 0) _exit(100);
    freeflex_plan* plan = nullptr;
    const int code = freeflex_plan_open(scene.c_str(), nullptr, nullptr, &plan);
    std::fprintf(stderr, "%zu MB: code %d, %s\n", megabytes, code, freeflex_last_error());
    _exit(code == FREEFLEX_NO_MEMORY &&
                  std::string(freeflex_last_error()).find("ulimit -v") == std::string::npos
              ? 101
              : code);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 102;
}

TEST(CInterface, ASetUpThatRunsOutOfMemoryHasItsOwnErrorCode) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a program with a sanitizer takes far more address space";
#endif
  const std::string folder = ::testing::TempDir() + "/memory";
  std::filesystem::create_directories(folder);
  // a dense set-up, which finds all modes
  write_two_layer_plate(folder, 12, 60);
  std::ofstream(folder + "/scene.yaml") << "points: [{csv: points.csv}]\nlinks: [{csv: links.csv}]\n";
  for (const std::size_t megabytes : {1, 2, 10, 30})
    EXPECT_EQ(code_within(megabytes, folder + "/scene.yaml"), FREEFLEX_NO_MEMORY);
  // a sparse set-up, which finds some modes
  write_two_layer_plate(folder, 25, 60);
  for (const std::size_t megabytes : {4, 30, 90})
    EXPECT_EQ(code_within(megabytes, folder + "/scene.yaml"), FREEFLEX_NO_MEMORY);
  // the set-up is refused before it starts, because the estimate of its memory exceeds the limit
  write_two_layer_plate(folder, 40, 1500);
  EXPECT_EQ(code_within(300, folder + "/scene.yaml"), FREEFLEX_NO_MEMORY);
  EXPECT_EQ(code_within(10, folder + "/none.yaml"), FREEFLEX_BAD_SCENE);
}

TEST(CInterface, AProgramInCReadsTheSameMotion) {
  const std::string command = std::string(FREEFLEX_PLAIN_C) + " " + kScenes + "boom.yaml tip 200";
  std::FILE* pipe = popen(command.c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  long long tick = 0;
  std::array<double, 4> read{};
  EXPECT_EQ(std::fscanf(pipe, "%lld %lf %lf %lf %lf", &tick, &read[0], &read[1], &read[2], &read[3]), 5);
  EXPECT_EQ(pclose(pipe), 0);

  Handles c(kScenes + "boom.yaml");
  const std::int32_t tip = freeflex_plan_find(c.plan, FREEFLEX_POINT, "tip");
  const freeflex_load load{FREEFLEX_POINT, tip, {0.0, 0.0, 10.0}, {}};
  freeflex_motion_push(c.motion, 0, FREEFLEX_WORLD, &load, 1, 50);
  freeflex_motion_step(c.motion, 200);
  freeflex_frame frame;
  freeflex_motion_frame(c.motion, &frame);
  freeflex_point point;
  freeflex_motion_point(c.motion, tip, &point);
  EXPECT_EQ(tick, 200);
  EXPECT_EQ(read, (std::array<double, 4>{frame.position[2], frame.attitude[0], point.position[2],
                                         point.velocity[2]}));
}

}  // namespace
}  // namespace freeflex::testing
