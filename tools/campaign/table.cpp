#include "tools/campaign/table.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "service/io/wire/log.hpp"

namespace freeflex::campaign {
namespace {

/// Writes a file as a whole. Returns an empty text or the error.
template <class Write>
std::string write_whole(const std::string& path, const Write& write) {
  io::PartialFile file(path);
  std::ofstream stream(file.working_path(), std::ios::binary);
  write(stream);
  stream.flush();
  if (!stream) return "cannot write '" + path + "': " + std::strerror(errno);
  stream.close();
  return file.commit();
}

}  // namespace

std::string write_table(const Opened& opened, const Results& results, const std::string& path) {
  return write_whole(path, [&](std::ostream& stream) {
    stream << table_header(opened.campaign) << '\n';
    for (const auto& [number, stored] : results.rows) stream << stored.row << '\n';
  });
}

std::string write_case_scene(const Case& of, std::string& path) {
  if (io::is_plan_file(of.scene)) return path = of.scene, std::string();
  std::error_code ignored;
  const auto text = [](const std::string& value) { return nlohmann::json(value).dump(); };
  return write_whole(path, [&](std::ostream& stream) {
    stream << "# case " << of.number << " of a campaign\n"
           << "base: " << text(std::filesystem::absolute(of.scene, ignored).lexically_normal().string())
           << "\n";
    if (of.settings.empty()) return;
    stream << "set:\n";
    for (const io::Setting& setting : of.settings)
      stream << "  - " << text(setting.path) << ": " << setting.value << "\n";
  });
}

}  // namespace freeflex::campaign
