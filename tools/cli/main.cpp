// freeflex: the command line program.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>

#include "tools/cli/commands.hpp"
#include "tools/cli/program.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

/// Subcommands of freeflex-study. Only these subcommands need the libraries of the paper's bases, the
/// reference and the rival methods, so freeflex itself is built without these libraries.
constexpr std::array kStudies{kInspect, kReport, kStability};

void add_commands(CLI::App& app, int& exit_code) {
  const auto name = [&app](const Description& study) { app.add_subcommand(study.name, study.meaning); };
  add_check(app, exit_code);
  add_schema(app, exit_code);
  add_modes(app, exit_code);
  add_loads(app, exit_code);
  name(kInspect);
  add_plan(app, exit_code);
  name(kReport);
  name(kStability);
  add_compile(app, exit_code);
  add_run(app, exit_code);
  add_keygen(app, exit_code);
  add_push(app, exit_code);
  add_monitor(app, exit_code);
  add_view(app, exit_code);
  add_replay(app, exit_code);
  add_compare(app, exit_code);
  add_export(app, exit_code);
  add_campaign(app, exit_code);
}

/// Returns the first argument that is not an option, or an empty text if there is none. Thus `freeflex --help
/// inspect` also reaches inspect.
const char* find_command(int argc, char** argv) {
  const auto is_word = [](const char* argument) { return argument[0] != '-'; };
  const auto found = std::find_if(argv + 1, argv + argc, is_word);
  return found != argv + argc ? *found : "";
}

/// Replaces this process by freeflex-study, which is in the folder of this program. Returns only if
/// freeflex-study cannot be started. The result is then the exit code.
int become_study(const char* command, char** argv) {
  std::error_code ignored;
  const std::string study =
      (std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path() / "freeflex-study").string();
  execv(study.c_str(), argv);
  print_error(std::string(command) + " needs " + study + ", which cannot be started (" +
              std::strerror(errno) +
              "); it is a separate program, so build it with tools/build, or install it with cmake "
              "--install");
  return kExitDiffers;
}

}  // namespace
}  // namespace freeflex::tools

int main(int argc, char** argv) {
  using namespace freeflex::tools;
  const char* const command = argc > 1 ? find_command(argc, argv) : "";
  const auto is_named = [&](const Description& study) { return std::strcmp(study.name, command) == 0; };
  if (std::any_of(kStudies.begin(), kStudies.end(), is_named)) return become_study(command, argv);
  return run_program(argc, argv, add_commands);
}
