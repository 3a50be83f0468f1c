// freeflex: the command line beside the daemon.
#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <exception>
#include <string>

#include "tools/commands.hpp"
#include "tools/console.hpp"

int main(int argc, char** argv) {
  using namespace freeflex::tools;
  CLI::App app{"freeflex: scenes, plans, runs and recordings of free flexible structures"};
  app.set_version_flag("--version", std::string("freeflex ") + FREEFLEX_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done, 1 the answer is no (differs, rejected, not written), 2 wrong arguments, scene or "
      "plan,\n"
      "3 log damaged or incomplete, 130 interrupted. 'freeflex COMMAND --help' shows examples.");

  int exit_code = kExitOk;
  add_check(app, exit_code);
  add_modes(app, exit_code);
  add_compile(app, exit_code);
  add_run(app, exit_code);
  add_push(app, exit_code);
  add_monitor(app, exit_code);
  add_replay(app, exit_code);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitOk : kExitUsage;
  } catch (const std::exception& error) {
    print_error(error.what());
    return kExitUsage;
  }
  return exit_code;
}
