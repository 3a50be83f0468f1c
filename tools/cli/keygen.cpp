// freeflex keygen makes a key file. A key file is needed to send commands to a daemon that requires keys.
#include <CLI/App.hpp>
#include <cstdio>
#include <memory>
#include <string>

#include "service/keys.hpp"
#include "tools/cli/commands.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

struct KeygenOptions {
  std::string name;
  std::string file;  // key file, empty for NAME.key
};

constexpr const char* kKeygenFooter = R"(Example:
  mkdir -m 700 keys && freeflex keygen operator --out keys/operator.key
  freeflexd service/scenes/rotor.yaml --keys keys &
  freeflex push --control hold --key keys/operator.key
The file has mode 0600. Lines in it set what the key may do. An existing file is never overwritten.
Exit codes: 0 written, 1 not written, 2 wrong arguments.)";

int keygen(const KeygenOptions& options) {
  const std::string file = options.file.empty() ? options.name + ".key" : options.file;
  if (const std::string fault = service::make_key(file, options.name); !fault.empty())
    return print_error(fault), kExitDiffers;
  std::printf("%s: key %s, for freeflexd --keys and freeflex push --key\n", file.c_str(),
              options.name.c_str());
  return kExitOk;
}

}  // namespace

void add_keygen(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<KeygenOptions>();
  CLI::App* command = app.add_subcommand("keygen", "a new key, for a daemon that requires keys");
  command->add_option("NAME", options->name, "id of the key, which is the sender name of its commands")
      ->required()
      ->check([](const std::string& name) {
        return service::is_key_id(name) ? std::string() : found(name, service::kKeyIdAllowed);
      });
  command->add_option("-o,--out", options->file, "file to write, default NAME.key")
      ->check(file_name())
      ->type_name("FILE");
  command->footer(kKeygenFooter);
  command->callback([options, &exit_code] { exit_code = keygen(*options); });
}

}  // namespace freeflex::tools
