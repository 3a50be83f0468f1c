// freeflex-study: the subcommands that analyse a structure or compare the methods.
#include "tools/cli/commands.hpp"
#include "tools/cli/program.hpp"

namespace freeflex::tools {
namespace {

void add_studies(CLI::App& app, int& exit_code) {
  add_inspect(app, exit_code);
  add_report(app, exit_code);
  add_stability(app, exit_code);
}

}  // namespace
}  // namespace freeflex::tools

int main(int argc, char** argv) {
  return freeflex::tools::run_program(argc, argv, freeflex::tools::add_studies);
}
