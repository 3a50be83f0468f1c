// These tests build other programs against the installed tree and run them.
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>
#include <utility>

#include "tests/support/network_tests.hpp"
#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

// a program that uses the installed libraries is built with these flags, because a library with a sanitizer
// needs the sanitizer in the program too
const std::string kFlags =
    std::string(FREEFLEX_CXX_FLAGS).empty() ? "" : " -DCMAKE_CXX_FLAGS='" FREEFLEX_CXX_FLAGS "'";

/// Installs the tree and builds the example controller against the installed tree. CMake finds neither Eigen
/// nor Boost.
struct Example {
  explicit Example(std::string in) : folder(std::move(in)) {}
  void make() {
    install = run("cmake --install " FREEFLEX_BUILD_DIR " --prefix " + folder + "/prefix");
    // this script records the packages for which CMake calls pkg-config
    write_text(folder + "/pkg-config",
               "#!/bin/sh\necho \"$@\" >>" + folder + "/asked\nexec pkg-config \"$@\"\n");
    std::filesystem::permissions(folder + "/pkg-config", std::filesystem::perms::owner_all);
    build = run("cmake -G Ninja -S " + folder + "/prefix/share/freeflex/examples/controller -B " + folder +
                "/build -DCMAKE_PREFIX_PATH=" + folder + "/prefix -DPKG_CONFIG_EXECUTABLE=" + folder +
                "/pkg-config -DCMAKE_DISABLE_FIND_PACKAGE_Eigen3=ON -DCMAKE_DISABLE_FIND_PACKAGE_Boost=ON" +
                kFlags + " && cmake --build " + folder + "/build");
  }
  /// Runs a script, then stops the process whose id the script has put in $daemon. $C is the command of the
  /// controller, and $D is the command of the daemon with the scene of the example.
  Outcome fly(const std::string& script) const {
    return run("C='timeout 100 " + folder + "/build/controller'; D='" + folder + "/prefix/bin/freeflexd " +
               folder + "/prefix/share/freeflex/examples/controller/swing.yaml --log-level error'; " +
               script + "; code=$?; kill $daemon; wait $daemon; exit $code");
  }
  std::string folder;
  Outcome install, build;  // outcomes of make()
};

/// Under ctest, returns the folder in which the first test leaves the example for the other tests. Otherwise
/// returns null, and each process makes its own example.
const char* shared_folder() { return std::getenv("FREEFLEX_EXAMPLE"); }

const Example& example() {
  static const TemporaryFolder own;
  static const Example made = [] {
    Example example(shared_folder() != nullptr ? shared_folder() : own.path());
    if (shared_folder() == nullptr) example.make();
    return example;
  }();
  return made;
}

TEST(Install, TheExampleBuildsAgainstTheInstalledTreeWithoutEigenAndBoost) {
  const TemporaryFolder own;
  if (shared_folder() != nullptr) {
    std::filesystem::remove_all(shared_folder());
    std::filesystem::create_directories(shared_folder());
  }
  Example example(shared_folder() != nullptr ? shared_folder() : own.path());
  example.make();
  EXPECT_EQ(example.install.exit_code, 0) << example.install.out << example.install.err;
  EXPECT_EQ(example.build.exit_code, 0) << example.build.out << example.build.err;
}

TEST(Install, AControllerBuiltAgainstTheInstalledTreeDampsTheVibration) {
  if (!refusal.empty()) GTEST_SKIP() << refusal;
  const std::string& folder = example().folder;
  for (const char* file :
       {"bin/freeflex", "bin/freeflex-study", "bin/freeflexd", "share/freeflex/lcm/state_t.lcm",
        "share/freeflex/lcm/README.md", "share/doc/freeflex/LICENSE", "share/freeflex/scenes/boom.yaml",
        "share/freeflex/scene.schema.json", "share/man/man1/freeflex.1.gz",
        "share/doc/freeflex/html/index.html", "share/bash-completion/completions/freeflex",
        "share/freeflex/examples/controller/controller.cpp", "include/freeflex/core/step/step.hpp",
        "include/freeflex/core/plan/compile.hpp", "include/freeflex/service/io/scene/input.hpp",
        "include/freeflex/freeflex_msgs/state_t.hpp", "include/freeflex/service/client/client.hpp"}) {
    EXPECT_TRUE(std::filesystem::exists(folder + "/prefix/" + file)) << file;
  }

  // Two masses of 2 kg on a spring oscillate at 1 Hz without damping, and drift. With the reduced mass of 1
  // kg, the strut of 4 N s/m gives a damping ratio of 4 / (2 * 2 pi) = 0.32, so the amplitude falls to 1 %
  // within ln(100) / (0.32 * 2 pi) = 2.3 s.
  const Outcome controlled =
      example().fly("$D & daemon=$!; $C a b 4; code=$?; " + folder + "/prefix/bin/freeflex" +
                    " monitor --channel STATE --json --count 1; (exit $code)");
  EXPECT_EQ(controlled.exit_code, 0) << controlled.out << controlled.err;
  EXPECT_TRUE(contains(controlled.out, "speed along the line: ")) << controlled.out;
  // the two forces of the strut cancel, so they do not change the drift
  const std::size_t start = controlled.out.find('{');
  ASSERT_NE(start, std::string::npos) << controlled.out << controlled.err;
  const auto state = nlohmann::json::parse(controlled.out.substr(start))["message"];
  const double drift[3] = {0.5, -0.2, 0.1};
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(state["velocity"][k].get<double>(), drift[k], 1e-12) << controlled.out;
}

TEST(Install, TheControllerCanRunRepeatedlyOnOneDaemon) {
  if (!refusal.empty()) GTEST_SKIP() << refusal;
  const Outcome twice = example().fly("$D & daemon=$!; $C a b 4 && $C a b 4");
  EXPECT_EQ(twice.exit_code, 0) << twice.out << twice.err;
}

TEST(Install, TheControllerContinuesAfterARestartOfTheDaemon) {
  if (!refusal.empty()) GTEST_SKIP() << refusal;
  const Outcome outlived = example().fly(
      "$C a b 4 & controller=$!; $D --until 1.5; kill -0 $controller || exit 9; $D & daemon=$!; "
      "wait $controller");
  EXPECT_EQ(outlived.exit_code, 0) << outlived.out << outlived.err;
}

TEST(Install, TheControllerSealsItsCommandsWhenItIsGivenAKey) {
  if (!refusal.empty()) GTEST_SKIP() << refusal;
  const TemporaryFolder folder;
  const std::string file = folder / "strut.key";
  ASSERT_EQ(run(example().folder + "/prefix/bin/freeflex keygen strut --out " + file).exit_code, 0);
  const Outcome sealed = example().fly("$D --keys " + file + " & daemon=$!; $C a b 4 " + file);
  EXPECT_EQ(sealed.exit_code, 0) << sealed.out << sealed.err;
  const Outcome plain = example().fly("$D --keys " + file + " & daemon=$!; $C a b 4");
  EXPECT_EQ(plain.exit_code, 1) << plain.out;
  EXPECT_TRUE(contains(plain.err, "rejected: key_required: this daemon accepts only commands with a key"))
      << plain.err;
}

TEST(Install, TheControllerReportsAnUnknownPoint) {
  if (!refusal.empty()) GTEST_SKIP() << refusal;
  const Outcome unknown = example().fly("$D & daemon=$!; $C a nose 4");
  EXPECT_EQ(unknown.exit_code, 2) << unknown.out;
  EXPECT_TRUE(contains(unknown.err, "controller: there is no point 'nose'; the scene has a, b"))
      << unknown.err;
}

TEST(Install, EachInstalledComponentNeedsOnlyItsOwnLibraries) {
  const std::string asked = read_text(example().folder + "/asked");
  EXPECT_TRUE(contains(asked, "lcm")) << asked;
  for (const char* library : {"libfyaml", "libxxhash"}) EXPECT_FALSE(contains(asked, library)) << asked;
  const auto configure = [](const std::string& components) {
    const TemporaryFolder folder;
    write_text(folder / "CMakeLists.txt",
               "cmake_minimum_required(VERSION 3.25)\nproject(asks CXX)\n"
               "find_package(freeflex REQUIRED COMPONENTS " +
                   components + ")\n");
    return run("cd " + folder.path() + " && cmake -G Ninja -S . -B build -DCMAKE_PREFIX_PATH=" +
               example().folder + "/prefix -DCMAKE_DISABLE_FIND_PACKAGE_Eigen3=ON");
  };
  const Outcome core = configure("core"), other = configure("engine");
  EXPECT_NE(core.exit_code, 0);
  EXPECT_TRUE(contains(core.err, "Eigen3")) << core.err;
  EXPECT_NE(other.exit_code, 0);
  EXPECT_TRUE(contains(other.err, "freeflex has no component 'engine'")) << other.err;
}

// The C program finds the installed library with pkg-config. Python finds the installed package through
// PYTHONPATH, or because the prefix is a virtual environment
TEST(Install, TheInstalledTreeWorksFromCAndPython) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "a library with the address sanitizer needs a program with the address sanitizer";
#endif
  const std::string prefix = example().folder + "/prefix", program = example().folder + "/plain_c";
  const Outcome built =
      run("PKG_CONFIG_PATH=" + prefix + "/lib/pkgconfig cc -o " + program +
          " " FREEFLEX_SOURCE_DIR "/tests/c/plain_c.c $(PKG_CONFIG_PATH=" + prefix +
          "/lib/pkgconfig pkg-config --cflags --libs freeflex) -Wl,-rpath," + prefix + "/lib");
  ASSERT_EQ(built.exit_code, 0) << built.err;
  const std::string scene = prefix + "/share/freeflex/scenes/boom.yaml";
  const Outcome from_c = run(program + " " + scene + " tip 1000");
  ASSERT_EQ(from_c.exit_code, 0) << from_c.err;
  EXPECT_TRUE(contains(from_c.out, "1000 ")) << from_c.out;
  const Outcome from_python =
      run("PYTHONPATH=" + prefix +
          "/lib/python3/dist-packages PYTHONDONTWRITEBYTECODE=1 python3 -m freeflex step " + scene + " 1");
  ASSERT_EQ(from_python.exit_code, 0) << from_python.err;
  EXPECT_TRUE(contains(from_python.out, "boom: tick 1000")) << from_python.out;
  // the prefix is used as a virtual environment
  const Outcome from_environment =
      run("python3 -m venv --without-pip " + prefix + " && cd / && env -u PYTHONPATH " + prefix +
          "/bin/python3 -m freeflex step " + scene + " 1");
  ASSERT_EQ(from_environment.exit_code, 0) << from_environment.err;
  EXPECT_EQ(from_environment.out, from_python.out);
}

// The examples in C and Python step the scene of the strut themselves. The C++ example is built and flown
// above.
TEST(Install, TheStrutsInCAndPythonDampTheVibration) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "a library with the address sanitizer needs a program with the address sanitizer";
#endif
  const std::string prefix = example().folder + "/prefix",
                    strut = prefix + "/share/freeflex/examples/controller/",
                    program = example().folder + "/strut_c";
  const std::string find = "PKG_CONFIG_PATH=" + prefix + "/lib/pkgconfig ";
  const Outcome built = run(find + "cc -std=c99 -pedantic -Wall -Wextra -Werror -o " + program + " " + strut +
                            "controller.c $(" + find +
                            "pkg-config --cflags --libs freeflex) -lm -Wl,-rpath," + prefix + "/lib");
  ASSERT_EQ(built.exit_code, 0) << built.err;
  const std::string python = "PYTHONPATH=" + prefix +
                             "/lib/python3/dist-packages PYTHONDONTWRITEBYTECODE=1 python3 " + strut +
                             "controller.py ";
  // 0.32 of critical damping at 1 Hz: the speed falls to 1 % within ln(100) / (0.32 * 2 pi) = 2.3 s, and the
  // whole second in which it does so ends at 4 s
  for (const std::string& command : {program + " ", python}) {
    const Outcome damped = run(command + strut + "swing.yaml a b 4");
    EXPECT_EQ(damped.exit_code, 0) << damped.err;
    EXPECT_TRUE(contains(damped.out, "after 4.0 s")) << damped.out;
    EXPECT_NE(run(command + strut + "swing.yaml a x 4").exit_code, 0);
  }
}

/// Returns an #include of every installed header, so that a header that includes a missing header fails to
/// compile.
std::string every_header() {
  const std::filesystem::path top = example().folder + "/prefix/include/freeflex";
  std::set<std::string> lines;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(top))
    if (entry.path().extension() == ".hpp")
      lines.insert("#include \"" + entry.path().lexically_relative(top).string() + "\"\n");
  EXPECT_GT(lines.size(), 60u);
  return std::accumulate(lines.begin(), lines.end(), std::string());
}

TEST(Install, AProgramBuiltAgainstTheInstalledTreeStepsAPlan) {
  const TemporaryFolder folder;
  write_text(folder / "CMakeLists.txt",
             "cmake_minimum_required(VERSION 3.25)\nproject(steps CXX)\nfind_package(freeflex "
             "REQUIRED)\nadd_executable(steps steps.cpp)\n"
             "target_link_libraries(steps PRIVATE freeflex::messages freeflex::client freeflex::io "
             "freeflex::core)\n");
  write_text(
      folder / "steps.cpp",
      "#include <cstdio>\n" + every_header() +
          "int main(int, char** argv) {\n  const auto result = freeflex::io::load_plan(argv[1]);\n  if "
          "(!result.plan) return 1;\n"
          "  freeflex::State state = freeflex::make_state(*result.plan);\n"
          "  freeflex::Workspace workspace = freeflex::make_workspace(*result.plan);\n  "
          "freeflex::StepReport report;\n"
          "  for (int i = 0; i < 100; ++i) freeflex::step(*result.plan, state, {}, workspace, report);\n"
          "  std::printf(\"tick %lld\\n\", static_cast<long long>(state.tick));\n}\n");
  const Outcome build =
      run("cd " + folder.path() + " && cmake -G Ninja -S . -B build -DCMAKE_PREFIX_PATH=" + example().folder +
          "/prefix" + kFlags + " && cmake --build build");
  ASSERT_EQ(build.exit_code, 0) << build.out << build.err;
  const Outcome stepped = run(folder / "build/steps " + kScenes + "boom.yaml");
  EXPECT_EQ(stepped.exit_code, 0) << stepped.err;
  EXPECT_EQ(stepped.out, "tick 100\n");
}

}  // namespace
}  // namespace freeflex::testing

int main(int argc, char** argv) { return freeflex::testing::run_network_tests(argc, argv); }
