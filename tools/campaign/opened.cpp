#include "tools/campaign/opened.hpp"

#include <sys/stat.h>
#include <xxhash.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "service/campaign/case.hpp"
#include "service/campaign/measures.hpp"
#include "service/io/scene/text.hpp"
#include "tools/campaign/recorded_commands.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::campaign {
namespace {

/// Combines a hash with the bytes of a file. Returns false if the file cannot be read.
bool add_file(const std::string& path, std::uint64_t& hash) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  hash = XXH3_64bits_withSeed(bytes.data(), bytes.size(), hash);
  return file.is_open();
}

Origin origin_of_first_fault(const Campaign& campaign, const std::string& error) {
  for (const Measure& measure : campaign.measures)
    if (error.find("'" + measure.name + "'") != std::string::npos) return measure.origin;
  return {};
}

/// Returns why no case could run, or an empty text.
std::string find_controller_fault(const Campaign& campaign, const Plan& plan) {
  const ControllerFile& controller = campaign.controller;
  if (controller.every > 0.0) {
    int ticks = 0;
    return find_ticks(controller, plan.period, ticks);
  }
  if (campaign.commands.empty()) return {};
  const RecordedCommander recorded(campaign.commands);
  if (recorded.error().empty() && recorded.is_foreign_to(plan))
    tools::print_warning("the commands of '" + campaign.commands +
                         "' were recorded with another plan, so they act on the points, groups and wheels "
                         "that have the same numbers in this scene");
  return recorded.error();
}

/// Checks the campaign on the scene with nominal values.
bool check_on_scene(const CampaignResult& read) {
  const Campaign& campaign = *read.campaign;
  const Case nominal = make_case(campaign, 0, nominal_values(campaign));
  io::PlanResult loaded;
  {
    tools::Progress progress("check");
    loaded = io::load_plan(campaign.scene, 0.0, progress.of_setup(), nominal.settings);
  }
  tools::print_faults(loaded.faults, loaded.sources);
  if (!loaded.plan) return tools::print_error("the scene has no plan with the nominal values"), false;
  if (const std::string fault = find_controller_fault(campaign, *loaded.plan); !fault.empty())
    return tools::print_error(fault), false;
  const Measuring measuring(*loaded.plan, campaign.measures,
                            std::llround(campaign.until / loaded.plan->period));
  if (measuring.error().empty()) return true;
  const Fault fault{Fault::Severity::kError, origin_of_first_fault(campaign, measuring.error()),
                    measuring.error()};
  return tools::print_faults({fault}, read.sources), false;
}

std::string default_folder(const std::string& path) {
  return std::filesystem::path(path).replace_extension(".results").string();
}

/// Returns true if a text has a word.
bool has_word(const std::string& text, const std::string& word) {
  const auto is_of_word = [&](std::size_t k) {
    return k < text.size() && (std::isalnum(static_cast<unsigned char>(text[k])) != 0 || text[k] == '_');
  };
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1))
    if (!(at > 0 && is_of_word(at - 1)) && !is_of_word(at + word.size())) return true;
  return false;
}

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// Adds the modules that the Python files of a list may import: those files beside them whose names are
/// words of one of the files, whatever the word is for.
void add_modules(std::vector<std::string>& files) {
  namespace fs = std::filesystem;
  for (std::size_t k = 0; k < files.size(); ++k) {
    const fs::path of = files[k];
    if (of.extension() != ".py") continue;
    const std::string text = bytes_of(files[k]);
    std::vector<std::string> found;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(of.has_parent_path() ? of.parent_path() : ".", ignored)) {
      const fs::path module = entry.path().lexically_normal();
      const bool is_package = entry.is_directory(ignored) && fs::exists(module / "__init__.py", ignored);
      if (module.extension() == ".py" && has_word(text, module.stem().string()))
        found.push_back(module.string());
      else if (is_package && has_word(text, module.filename().string()))
        for (const auto& inner : fs::recursive_directory_iterator(module, ignored))
          if (inner.path().extension() == ".py") found.push_back(inner.path().string());
    }
    std::sort(found.begin(), found.end());
    for (const std::string& each : found)
      if (std::find(files.begin(), files.end(), each) == files.end()) files.push_back(each);
  }
}

/// Returns the files of a campaign, beside the campaign file and those of the scene.
std::vector<std::string> files_of(const Campaign& campaign) {
  using Kind = ControllerFile::Kind;
  namespace fs = std::filesystem;
  std::vector<std::string> files;
  if (!campaign.commands.empty()) files.push_back(campaign.commands);
  std::error_code ignored;
  for (const std::string& word : campaign.controller.files) {
    // of a program, words may also be options, and the first may be searched for in PATH
    const bool is_first = &word == &campaign.controller.files.front();
    const fs::path path = is_first ? fs::path(word) : fs::path(campaign.folder) / word;
    if (campaign.controller.kind != Kind::kProgram || fs::is_regular_file(path, ignored))
      files.push_back(path.lexically_normal().string());
  }
  add_modules(files);
  return files;
}

/// Combines a hash with a scene in which these values are set, and lists its files.
/// Returns false if it cannot be read.
bool add_scene(const Campaign& campaign, const std::vector<std::string>& values, Opened& opened,
               std::uint64_t& hash, bool prints_faults) {
  const io::SceneResult scene = io::read_scene(campaign.scene, make_case(campaign, 0, values).settings);
  // other sources are the texts of settings
  for (const std::string& source : scene.sources)
    if (std::error_code none; std::filesystem::is_regular_file(source, none)) {
      const std::string file = std::filesystem::path(source).lexically_normal().string();
      if (std::find(opened.files.begin(), opened.files.end(), file) == opened.files.end())
        opened.files.push_back(file);
    }
  if (!scene.scene) {
    if (prints_faults) tools::print_faults(scene.faults, scene.sources);
    return false;
  }
  hash = XXH3_64bits_withSeed(&scene.scene->hash, sizeof scene.scene->hash, hash);
  return true;
}

/// Combines a hash with all files of a campaign, and lists them. Prints an error, and returns false, if one
/// cannot be read.
bool add_files(Opened& opened, std::uint64_t& hash) {
  const Campaign& campaign = opened.campaign;
  if (io::is_plan_file(campaign.scene)) {
    opened.files = {campaign.scene};
    if (!add_file(campaign.scene, hash))
      return tools::print_error("'" + campaign.scene + "' cannot be read"), false;
  } else {
    const std::vector<std::string> nominal = nominal_values(campaign);
    if (!add_scene(campaign, nominal, opened, hash, true)) return false;
    // texts of lists may name files; a value that is refused gives a row that says so
    for (std::size_t k = 0; k < campaign.variables.size(); ++k)
      if (const auto* const choice = std::get_if<Choice>(&campaign.sampling.variables[k]))
        for (const std::string& text : choice->values)
          if (!io::reader::parse_number(text, {"-"}).value) {
            std::vector<std::string> values = nominal;
            values[k] = text;
            static_cast<void>(add_scene(campaign, values, opened, hash, false));
          }
  }
  for (const std::string& file : files_of(campaign)) {
    if (!add_file(file, hash))
      return tools::print_error("'" + file + "', which the campaign names, cannot be read"), false;
    opened.files.push_back(file);
  }
  opened.files.push_back(campaign.path);
  return true;
}

/// Returns the size and the time of the last change of each file.
std::vector<FileState> states_of(const std::vector<std::string>& files) {
  std::vector<FileState> states;
  for (const std::string& file : files) {
    struct stat found {};
    if (::stat(file.c_str(), &found) != 0) found = {};
    states.push_back({found.st_size, found.st_mtim.tv_sec, found.st_mtim.tv_nsec});
  }
  return states;
}

}  // namespace

std::string find_change(const Opened& opened) {
  const std::vector<FileState> now = states_of(opened.files);
  for (std::size_t k = 0; k < now.size(); ++k)
    if (now[k] != opened.states[k])
      return "'" + opened.files[k] +
             "' has changed while the campaign ran; run it again, in another folder (--out)";
  return {};
}

std::string shell_word(const std::string& text) {
  const bool is_plain = !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 ||
           std::string_view("._/+-=:,@%").find(static_cast<char>(c)) != std::string_view::npos;
  });
  if (is_plain) return text;
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

std::string words_of_campaign(const Opened& opened) {
  const std::string words = shell_word(opened.campaign.path);
  return opened.folder == default_folder(opened.campaign.path)
             ? words
             : words + " --out " + shell_word(opened.folder);
}

std::vector<std::string> nominal_values(const Campaign& campaign) {
  std::vector<std::string> values;
  for (const Variable& variable : campaign.variables) values.push_back(variable.nominal);
  return values;
}

std::vector<std::string> worker_command(const Campaign& campaign) {
  namespace fs = std::filesystem;
  // absolute, because a controller may go to another folder
  const std::string path_of_campaign = fs::absolute(campaign.path).lexically_normal().string();
  const fs::path self = fs::read_symlink("/proc/self/exe");
  if (campaign.controller.kind != ControllerFile::Kind::kPython)
    return {self.string(), "campaign", "worker", path_of_campaign};
  // The Python package that was built or installed with this program comes after those that the user names.
  // Python finds that of Debian by itself, and its folder has other packages too.
  const std::filesystem::path prefix = self.parent_path().parent_path();
  const char* const given = std::getenv("PYTHONPATH");
  std::string path = given != nullptr ? given : "";
  for (const char* folder : {"python", "lib/python3/dist-packages"})
    if (std::error_code none; prefix != "/usr" && std::filesystem::exists(prefix / folder / "freeflex", none))
      path += (path.empty() ? "" : ":") + (prefix / folder).string();
  // compiled modules may be older than their sources, if these were written within a second
  return {"env",
          "PYTHONDONTWRITEBYTECODE=1",
          "PYTHONPATH=" + path,
          "python3",
          "-m",
          "freeflex.worker",
          path_of_campaign,
          fs::absolute(campaign.controller.files[0]).lexically_normal().string()};
}

std::optional<Opened> open_campaign(const std::string& path, const std::string& out, Check check) {
  CampaignResult read = read_campaign(path);
  tools::print_faults(read.faults, read.sources);
  if (!read.campaign) return std::nullopt;
  Opened opened{.campaign = *read.campaign, .stamp = {}, .folder = out, .files = {}, .states = {}};
  std::uint64_t hash = read.campaign->hash;
  if (check == Check::kScene && !check_on_scene(read)) return std::nullopt;
  if (!add_files(opened, hash)) return std::nullopt;
  opened.states = states_of(opened.files);
  // the check may have taken long
  if (const CampaignResult again = read_campaign(path);
      !again.campaign || again.campaign->hash != read.campaign->hash)
    return tools::print_error("'" + path + "' has changed while it was read; run again"), std::nullopt;
  opened.stamp = std::string("# freeflex ") + FREEFLEX_VERSION + " campaign " + tools::fingerprint_text(hash);
  if (opened.folder.empty()) opened.folder = default_folder(path);
  return opened;
}

}  // namespace freeflex::campaign
