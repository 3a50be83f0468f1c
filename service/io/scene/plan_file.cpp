// Reads and writes plan files, and distinguishes plans from scenes.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <new>
#include <utility>

#include "core/faults.hpp"
#include "core/plan/file/plan_bytes.hpp"
#include "core/plan/make_plan.hpp"
#include "core/plan/rungs/automatic.hpp"
#include "core/plan/rungs/rates.hpp"
#include "core/plan/rungs/rungs.hpp"
#include "core/structure/structure.hpp"
#include "service/io/scene/input.hpp"
#include "service/io/scene/report.hpp"
#include "service/io/scene/text.hpp"

namespace freeflex::io {
namespace {

constexpr std::size_t kMaxPlanBytes = std::size_t{2}
                                      << 30;  // 30 times the 72 MB of rows of 1000 points with 3000 modes

PlanResult load_plan_file(const std::string& path) {
  PlanResult result;
  result.sources = {path};
  std::string text;
  std::string problem;
  try {
    problem = reader::read_whole_file(path, kMaxPlanBytes, text);
    if (problem.empty()) result.plan = plan_from_bytes(std::as_bytes(std::span(text)), problem);
  } catch (const std::bad_alloc&) {
    std::error_code ignored;
    problem = "memory ran out while the plan file of " +
              std::to_string(std::filesystem::file_size(path, ignored)) + " bytes was read" + kMoreMemory;
  }
  if (!result.plan) result.faults.push_back({Fault::Severity::kError, {0, 0, 0}, problem});
  return result;
}

void change_rate(double rate, PlanResult& result) {
  if (const std::string untried = find_untried_rate(*result.plan, rate); !untried.empty())
    result.faults.push_back({Fault::Severity::kWarning, {0, 0, 0}, untried});
  set_rate(*result.plan, rate);
  const std::string fault = find_inconsistency(*result.plan);
  if (fault.empty()) return;
  result.faults.push_back({Fault::Severity::kError,
                           {0, 0, 0},
                           "--rate " + reader::format_number(rate) +
                               " is not possible for the scene, because " + fault + "; use a higher rate"});
  result.plan.reset();
}

PlanResult compile_scene(SceneResult scene, double rate, const SetupProgress& progress) {
  PlanResult result;
  result.faults = std::move(scene.faults);
  result.sources = std::move(scene.sources);
  if (!scene.scene) return result;
  const std::optional<Structure> structure = build_structure(*scene.scene, result.faults, progress);
  if (structure) result.plan = make_plan(*scene.scene, *structure, result.faults, rate);
  if (result.plan && rate > 0.0) change_rate(rate, result);
  if (!result.plan) return result;
  if (const std::string fast = find_fast_modes(*result.plan); !fast.empty())
    result.faults.push_back({Fault::Severity::kWarning, {0, 0, 0}, fast});
  return result;
}

PlanResult refuse_settings(const std::string& path, const Settings& settings) {
  PlanResult result;
  result.sources = {settings.front().source};
  result.faults.push_back({Fault::Severity::kError,
                           {0, 0, 0},
                           "'" + path +
                               "' is a plan, but values can be set only in a scene, before its set-up; name "
                               "the scene that the plan was made from"});
  return result;
}

// a temporary file, which the destructor removes unless it was renamed
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& path_template) : path_(path_template) {
    file_ = ::mkostemp(path_.data(), O_CLOEXEC);
    exists_ = file_ >= 0;
  }
  ~TemporaryFile() {
    close();
    if (exists_) ::unlink(path_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  bool is_open() const { return file_ >= 0; }
  bool write(std::span<const std::byte> bytes, const std::function<bool()>& is_ended) {
    constexpr std::size_t kAtOnce = std::size_t{1} << 20;  // [B] written between calls of is_ended
    while (!bytes.empty()) {
      if (is_ended && is_ended()) return false;
      const ssize_t written = ::write(file_, bytes.data(), std::min(bytes.size(), kAtOnce));
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return false;
      bytes = bytes.subspan(index(written));
    }
    return true;
  }
  // gives others the rights that the umask allows, because mkostemp makes a file that only its owner can read
  bool open_to_others() {
    const mode_t mask = ::umask(0);
    ::umask(mask);
    return ::fchmod(file_, 0666 & ~mask) == 0;
  }
  bool sync() { return ::fsync(file_) == 0; }
  bool close() { return file_ < 0 || ::close(std::exchange(file_, -1)) == 0; }
  bool rename_to(const std::string& path) {
    if (::rename(path_.c_str(), path.c_str()) != 0) return false;
    exists_ = false;
    return true;
  }

 private:
  std::string path_;
  int file_ = -1;
  bool exists_ = false;
};

// syncs the folder, because a power cut may otherwise lose the new name. Ignores a failure, because some file
// systems cannot sync folders.
void sync_folder(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  static_cast<void>(::fsync(descriptor));
  ::close(descriptor);
}

}  // namespace

bool is_plan_file(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return false;
  struct stat status {};
  char start[kPlanMark.size()];
  const bool is_plan = ::fstat(file, &status) == 0 && S_ISREG(status.st_mode) &&
                       ::pread(file, start, sizeof start, 0) == static_cast<ssize_t>(sizeof start) &&
                       std::string_view(start, sizeof start) == kPlanMark;
  ::close(file);
  return is_plan;
}

PlanResult load_plan(const std::string& path, double rate, const SetupProgress& progress,
                     const Settings& settings) {
  if (!is_plan_file(path)) return compile_scene(read_scene(path, settings), rate, progress);
  if (!settings.empty()) return refuse_settings(path, settings);
  PlanResult result = load_plan_file(path);
  if (result.plan && rate > 0.0) change_rate(rate, result);
  if (!result.plan) return result;
  if (const std::string damping = find_unresolved_damping(*result.plan); !damping.empty())
    result.faults.push_back({Fault::Severity::kWarning, {0, 0, 0}, damping});
  return result;
}

PlanResult load_plan_text(const SceneText& scene, double rate, const SetupProgress& progress,
                          const Settings& settings) {
  return compile_scene(read_scene_text(scene, settings), rate, progress);
}

std::string save_plan(const Plan& plan, const std::string& path, const std::function<bool()>& is_ended) {
  const auto fail = [&](const std::string& why) { return "cannot write '" + path + "': " + why; };
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode))
    return fail(S_ISDIR(status.st_mode) ? "it is a directory" : "it is not a regular file");
  std::vector<std::byte> bytes;
  try {
    bytes = plan_to_bytes(plan);
  } catch (const std::bad_alloc&) {
    return fail(std::string("memory ran out") + kMoreMemory);
  }
  if (bytes.size() > kMaxPlanBytes)
    return fail("the plan has " + std::to_string(bytes.size()) + " bytes, but at most " +
                std::to_string(kMaxPlanBytes) + " are read back; publish fewer points and links");
  TemporaryFile file(path + ".XXXXXX");
  if (!file.is_open() || !file.open_to_others() || !file.write(bytes, is_ended) || !file.sync() ||
      (is_ended && is_ended()) || !file.close() || !file.rename_to(path))
    return fail(is_ended && is_ended() ? "interrupted; nothing was written" : std::strerror(errno));
  sync_folder(path);
  return {};
}

}  // namespace freeflex::io
