// freeflex schema prints the JSON Schema with which editors complete and check scenes.
#include "service/io/scene/schema.hpp"

#include <CLI/App.hpp>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>

#include "service/io/wire/log.hpp"
#include "tools/cli/commands.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

constexpr const char* kSchemaFooter = R"(Example:
  freeflex schema --out scene.schema.json
An editor with a YAML language server completes and checks a scene that begins with the line
  # yaml-language-server: $schema=scene.schema.json
The schema covers keys, types, units and ranges; freeflex check covers everything else as well. Its field x-paths lists
the paths of values that --set takes.
Exit codes: 0 written, 1 not written, 2 wrong arguments.)";

int write_schema(const std::string& path) {
  const std::string text = io::scene_schema();
  if (path.empty()) {
    std::fputs(text.c_str(), stdout);
    return kExitOk;
  }
  io::PartialFile file(path);
  errno = 0;
  std::ofstream stream(file.working_path(), std::ios::binary);
  const bool is_whole = stream.write(text.data(), static_cast<std::streamsize>(text.size())).flush().good();
  const std::string fault = is_whole ? file.commit() : path + ": cannot be written: " + std::strerror(errno);
  if (fault.empty()) return kExitOk;
  print_error(fault);
  return kExitDiffers;
}

}  // namespace

void add_schema(CLI::App& app, int& exit_code) {
  auto path = std::make_shared<std::string>();
  CLI::App* command =
      app.add_subcommand("schema", "JSON Schema of scenes, with which editors complete and check them");
  command->add_option("-o,--out", *path, "file to write, default standard output")
      ->check(file_name(".json"))
      ->type_name("FILE");
  command->footer(kSchemaFooter);
  command->callback([path, &exit_code] { exit_code = write_schema(*path); });
}

}  // namespace freeflex::tools
