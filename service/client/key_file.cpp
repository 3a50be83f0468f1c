#include "service/client/key_file.hpp"

#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string_view>

#include "service/io/wire/codec.hpp"

namespace freeflex::client {
namespace {

/// Returns the value after "NAME:" in a line, without surrounding blanks and quotes, or an empty text for any
/// other line.
std::string_view value_of(std::string_view line, std::string_view name) {
  constexpr std::string_view kBlanks = " \t\r\"'";
  if (!line.starts_with(name) || line.size() <= name.size() || line[name.size()] != ':') return {};
  line.remove_prefix(name.size() + 1);
  const std::size_t begin = line.find_first_not_of(kBlanks);
  if (begin == line.npos) return {};
  return line.substr(begin, line.find_first_of(kBlanks, begin) - begin);
}

}  // namespace

std::string read_key_file(const std::string& path, SealingKey& key) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return "key file '" + path + "': " + std::strerror(errno);
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    return "key file '" + path + "' is open to other users; run chmod 600 '" + path + "'";
  std::size_t size = 0;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (const std::string_view id = value_of(line, "id"); !id.empty()) key.id = id;
    const std::string_view secret = value_of(line, "secret");
    if (secret.empty()) continue;
    const char* end = nullptr;
    if (sodium_hex2bin(key.secret.data(), key.secret.size(), secret.data(), secret.size(), nullptr, &size,
                       &end) != 0 ||
        end != secret.data() + secret.size())
      size = 0;
  }
  if (!io::is_valid_sender(key.id) || size != key.secret.size())
    return "key file '" + path +
           "' contains no key; it needs the lines 'id: NAME' and 'secret: 64 hexadecimal digits', as "
           "freeflex keygen writes them";
  return {};
}

}  // namespace freeflex::client
