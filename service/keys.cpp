#include "service/keys.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>

#include "freeflex_msgs/control_t.hpp"
#include "service/io/scene/fields.hpp"
#include "service/io/scene/input.hpp"
#include "service/io/wire/codec.hpp"
#include "service/io/wire/operator_address.hpp"

namespace freeflex::service {
namespace {

namespace reader = io::reader;
using freeflex_msgs::control_t;

constexpr const char* kEnding = ".key";                                 // extension of key files in a folder
constexpr std::size_t kDigits = std::size_t{2} * crypto_auth_KEYBYTES;  // hexadecimal digits of a secret

/// Owns an open file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }
  int release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

int open_private(int folder, const char* name) {
  // this call does not wait for a named pipe, and refuses a symbolic link, because somebody else might change
  // its target
  return openat(folder, name, O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK);
}

std::string explain_open(const std::string& path) {
  if (errno == ELOOP) return path + ": error: this is a symbolic link; give the file itself";
  return path + ": error: the file cannot be read: " + std::strerror(errno);
}

/// Returns the reason why an open file or folder is not private, or an empty string. A folder is private if
/// nobody else can write to it.
std::string find_exposure(const struct stat& status, const std::string& path) {
  const bool is_folder = S_ISDIR(status.st_mode);
  const bool has_owner = status.st_uid == geteuid() || (is_folder && status.st_uid == 0);
  if (!has_owner)
    return fmt::format(
        "{}: error: the owner is user {}, but must be user {}, who runs this program; run chown {} '{}'",
        path, status.st_uid, geteuid(), geteuid(), path);
  const unsigned mode = status.st_mode & 07777U;
  if (is_folder && (mode & 022U) != 0)
    return fmt::format(
        "{}: error: the folder has mode {:04o}, so others may put keys into it; run chmod go-w '{}'", path,
        mode, path);
  if (!is_folder && (mode & 077U) != 0)
    return fmt::format("{}: error: the file has mode {:04o}, so other users have access; run chmod 600 '{}'",
                       path, mode, path);
  return {};
}

/// Returns the text with "..." in place of every run of hexadecimal digits that is long enough to be part of
/// a secret.
std::string without_secret(const std::string& text) {
  constexpr std::size_t kSuspect = 12;  // digits
  std::string cleared;
  std::size_t start = 0;
  const auto is_digit = [](char c) { return std::isxdigit(static_cast<unsigned char>(c)) != 0; };
  while (start < text.size()) {
    const auto first = text.begin() + static_cast<std::ptrdiff_t>(start);
    const auto run = static_cast<std::size_t>(std::find_if_not(first, text.end(), is_digit) - first);
    cleared += run >= kSuspect ? "..." : text.substr(start, std::max<std::size_t>(run, 1));
    start += std::max<std::size_t>(run, 1);
  }
  return cleared;
}

/// The YAML keys that a key file may contain.
const reader::Section kKeySection = [] {
  using reader::Bound;
  using reader::Form;
  const auto limit = [](std::string_view name, std::string_view unit, std::string_view about) {
    return reader::Key{name, Form::kNumber, about, {unit, Bound::kPositive}};
  };
  return reader::Section{
      "key",
      {{"id", Form::kText, "Sender of the commands."},
       {"secret", Form::kText, "64 hexadecimal digits."},
       {.name = "channels",
        .form = Form::kWords,
        .about = "Channels of the commands.",
        .words = {"FORCE", "CONTROL"}},
       {.name = "controls",
        .form = Form::kWords,
        .about = "Controls that the key may send; the first is bit 1.",
        .words = {"run", "hold", "step", "reset", "stop", "shapes", "scene", "clear"}},
       {"points", Form::kSelection, "Points that the key may push."},
       {"groups", Form::kSelection, "Groups that the key may push."},
       limit("largest_force", "N", "Limit for each entry of a command."),
       limit("largest_torque", "N m", "Limit for each entry of a command."),
       {"slots", Form::kWhole, "Number of slots that the key may use, counted from slot 0."},
       limit("commands_per_second", "1/s", "Largest number of commands a second.")}};
}();

/// Reads one key from the YAML tree of its file.
class KeyReader {
 public:
  /// \param plan  contains the points and groups that allow-lists may name; nullptr: allow-lists are not read
  KeyReader(reader::Report& report, const Plan* plan) : report_(report), plan_(plan) {}

  Key read(const reader::Node& root) {
    const reader::Fields fields(report_, root, "key", kKeySection);
    if (!fields.is_mapping()) return {};
    Key key;
    read_id(fields, key.sealing.id);
    read_secret(fields, key.sealing.secret);
    if (plan_ != nullptr) read_grants(fields, key.grants);
    return key;
  }

 private:
  void read_id(const reader::Fields& fields, std::string& id) {
    const reader::Node* node = fields.require("id", std::string("must be ") + kKeyIdAllowed);
    if (node == nullptr) return;
    const auto text = reader::read_text(report_, *node, "key: id");
    if (!text) return;
    id = *text;
    if (!is_key_id(id))
      report_.error(node->origin, "key: id is " + reader::quote(id) + ", but must be " + kKeyIdAllowed);
  }

  /// Reads the secret. The error messages of this function never show the text of the secret.
  void read_secret(const reader::Fields& fields, std::array<unsigned char, crypto_auth_KEYBYTES>& secret) {
    const reader::Node* node = fields.require("secret", "must be 64 hexadecimal digits");
    if (node == nullptr) return;
    std::size_t size = 0;
    const bool is_read = node->kind == reader::Node::Kind::kText && node->text.size() == kDigits &&
                         sodium_hex2bin(secret.data(), secret.size(), node->text.data(), node->text.size(),
                                        nullptr, &size, nullptr) == 0;
    if (is_read && sodium_is_zero(secret.data(), secret.size()) != 0)
      report_.error(node->origin,
                    "key: secret is zero, which is easy to guess; make one with freeflex keygen");
    if (!is_read || size != secret.size())
      report_.error(node->origin,
                    "key: secret must be 64 hexadecimal digits, as freeflex keygen writes them");
  }

  /// Returns a list of words as bits: bit i is set if the list contains word i. Returns nullopt if the YAML
  /// key is missing or its value is not a list.
  std::optional<std::uint32_t> read_words(const reader::Fields& fields, const char* name) {
    const std::vector<std::string_view>& words = fields.key(name).words;
    const reader::Node* node = fields.find(name);
    if (node == nullptr) return std::nullopt;
    const std::string label = std::string("key: ") + name;
    if (node->kind != reader::Node::Kind::kList) {
      report_.error(node->origin, label + " is " + reader::describe(*node) + ", but must be a list of " +
                                      reader::join(words) + "; [] for none");
      return std::nullopt;
    }
    std::uint32_t bits = 0;
    for (const reader::Node* item : node->items)
      if (const auto word = reader::read_word(report_, *item, label, words)) bits |= 1U << *word;
    return bits;
  }

  template <class Item>
  void read_items(const reader::Fields& fields, const char* name, const char* noun,
                  const std::vector<Item>& items, std::vector<bool>& may) {
    const reader::Node* node = fields.find(name);
    if (node == nullptr) return;
    reader::Names names(noun);
    for (const Item& item : items) names.add(report_, item.name, {});
    const auto selected = reader::read_selection(report_, *node, std::string("key: ") + name, names);
    // the vector is never empty, because an empty one means all
    may.assign(std::max<std::size_t>(items.size(), 1), false);
    if (!selected) return;
    for (const int index : *selected) may[static_cast<std::size_t>(index)] = true;
  }

  void read_grants(const reader::Fields& fields, Grants& grants) {
    if (const auto channels = read_words(fields, "channels")) {
      grants.has_force = (*channels & 1U) != 0;
      grants.has_control = (*channels & 2U) != 0;
    }
    // in the list of words RUN is bit 0, but in control_t RUN is 1
    static_assert(control_t::RUN == 1 && control_t::CLEAR == 8);
    if (const auto words = read_words(fields, "controls")) grants.controls = *words << 1U;
    read_items(fields, "points", "point", plan_->points, grants.points);
    refuse_unpushable(fields, grants.points);
    if (!grants.points.empty())
      for (const PlanWheel& wheel : plan_->wheels) {
        const std::int32_t point =
            plan_->particles.attitude_points[static_cast<std::size_t>(wheel.attitude_index)];
        grants.wheels.push_back(grants.points[static_cast<std::size_t>(point)]);
      }
    read_items(fields, "groups", "group", plan_->groups, grants.groups);
    fields.read("largest_force", grants.largest_force);
    fields.read("largest_torque", grants.largest_torque);
    fields.read("commands_per_second", grants.commands_per_second);
    if (const reader::Node* slots = fields.find("slots")) {
      const auto number = reader::parse_integer(slots->text, 1, kMaxSlotNumber + 1);
      grants.num_slots = static_cast<int>(number.value_or(1));
      if (!number)
        report_.error(slots->origin, "key: slots is " + reader::describe(*slots) +
                                         ", but must be a whole number from 1 to 64");
    }
    for (const char* name : {"points", "groups", "largest_force", "largest_torque", "slots"})
      refuse_idle(fields, name, "FORCE", grants.has_force);
    refuse_idle(fields, "controls", "CONTROL", grants.has_control);
  }

  void refuse_unpushable(const reader::Fields& fields, const std::vector<bool>& may) {
    const reader::Node* node = fields.find("points");
    if (node == nullptr || node->text == "all") return;
    for (std::size_t i = 0; i < plan_->points.size(); ++i)
      if (may[i] && !plan_->points[i].pushable)
        report_.error(node->origin, "key: points: " + plan_->points[i].name +
                                        " is not among 'commands: points' of the scene, so no command may "
                                        "push it; remove it from the key or add it to the scene");
  }

  void refuse_idle(const reader::Fields& fields, const char* name, const char* channel, bool has_channel) {
    const reader::Node* node = fields.find(name);
    if (node != nullptr && !has_channel)
      report_.error(node->origin, std::string("key: ") + name + " has no effect, because " + channel +
                                      " is not among its channels; remove one of the two");
  }

  reader::Report& report_;
  const Plan* plan_;
};

/// Appends the key in an open file to the result, or the faults of the file.
void read_key(int fd, const std::string& path, const Plan* plan, KeysResult& result) {
  struct stat status {};
  std::string fault;
  if (fstat(fd, &status) != 0) fault = explain_open(path);
  if (fault.empty() && !S_ISREG(status.st_mode)) fault = path + ": error: this is not a regular file";
  if (fault.empty()) fault = find_exposure(status, path);
  if (fault.empty() && status.st_size == 0)
    fault = path + ": error: the file is empty; write a key with 'freeflex keygen ID --out FILE'";
  if (fault.empty()) {
    reader::Report report;
    reader::YamlTree tree;
    // reads the file that was checked, even if its name now refers to another file
    const auto source = report.open("/proc/self/fd/" + std::to_string(fd), {});
    const reader::Node* root = source ? tree.parse(report, *source) : nullptr;
    if (root != nullptr) result.keys.push_back(KeyReader(report, plan).read(*root));
    if (root != nullptr) result.keys.back().file = path;
    // omits the source line, which may contain the secret
    for (Fault& found : report.take_faults()) {
      found.message = without_secret(found.message);
      fault += (fault.empty() ? "" : "\n") + io::format_fault(found, {path}, false);
    }
  }
  if (!fault.empty()) result.faults += (result.faults.empty() ? "" : "\n") + fault;
}

void read_folder(int fd, const std::string& path, const Plan& plan, KeysResult& result) {
  struct Close {
    void operator()(DIR* folder) const { closedir(folder); }
  };
  const std::unique_ptr<DIR, Close> folder(fdopendir(fd));
  if (!folder) {
    result.faults = explain_open(path);
    return;
  }
  std::vector<std::string> names;
  while (const dirent* entry = readdir(folder.get())) {
    const std::string name = entry->d_name;
    if (name.ends_with(kEnding)) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  for (const std::string& name : names) {
    std::string file = path;
    file.append("/").append(name);
    const Descriptor key(open_private(fd, name.c_str()));
    if (key.get() < 0)
      result.faults += (result.faults.empty() ? "" : "\n") + explain_open(file);
    else
      read_key(key.get(), file, &plan, result);
  }
  if (names.empty())
    result.faults = path + ": error: the folder holds no file *.key; make one with freeflex keygen";
}

/// Reports keys that share an id or a secret.
void check_distinct(KeysResult& result) {
  std::vector<Key>& keys = result.keys;
  const auto add = [&result](const Key& a, const Key& b, const std::string& what) {
    result.faults += (result.faults.empty() ? "" : "\n") + b.file + ": error: this key has the " + what +
                     " of " + a.file + "; make another key with freeflex keygen";
  };
  std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) { return a.sealing.id < b.sealing.id; });
  for (std::size_t i = 0; i < keys.size(); ++i) {
    for (std::size_t j = i + 1; j < keys.size(); ++j) {
      if (keys[i].sealing.id == keys[j].sealing.id)
        add(keys[i], keys[j], "id");
      else if (keys[i].sealing.secret == keys[j].sealing.secret)
        add(keys[i], keys[j], "secret");
    }
  }
}

}  // namespace

bool is_key_id(const std::string& id) { return io::is_valid_sender(id) && !id.starts_with(kOperatorSender); }

KeysResult load_keys(const std::string& named, const Plan& plan) {
  KeysResult result;
  // a trailing slash would make open() follow a symbolic link, so trailing slashes are removed
  const std::string path = named.substr(0, std::max<std::size_t>(1, named.find_last_not_of('/') + 1));
  Descriptor file(open_private(AT_FDCWD, path.c_str()));
  struct stat status {};
  if (file.get() < 0 || fstat(file.get(), &status) != 0) {
    result.faults = explain_open(path);
  } else if (!S_ISDIR(status.st_mode)) {
    read_key(file.get(), path, &plan, result);
  } else {
    result.faults = find_exposure(status, path);
    if (result.faults.empty()) read_folder(file.release(), path, plan, result);
  }
  if (result.faults.empty()) check_distinct(result);
  if (!result.faults.empty()) result.keys.clear();
  return result;
}

KeysResult load_key(const std::string& path) {
  KeysResult result;
  const Descriptor file(open_private(AT_FDCWD, path.c_str()));
  if (file.get() < 0)
    result.faults = explain_open(path);
  else
    read_key(file.get(), path, nullptr, result);
  if (!result.faults.empty()) result.keys.clear();
  return result;
}

std::string make_key(const std::string& path, const std::string& id) {
  if (!is_key_id(id)) return "name '" + id + "' must be " + kKeyIdAllowed;
  if (sodium_init() < 0) return "libsodium does not start, because there is no source of random numbers";
  std::array<unsigned char, crypto_auth_KEYBYTES> secret{};
  std::array<char, kDigits + 1> digits{};
  crypto_auth_keygen(secret.data());
  sodium_bin2hex(digits.data(), digits.size(), secret.data(), secret.size());
  const std::string text = fmt::format(
      R"(# A key for freeflexd --keys and freeflex push --key: whoever can read it can command in its name.
id: {}
secret: {}
# What the key may do. For each missing line the limits of the scene apply.
# channels: [FORCE, CONTROL]
# controls: [run, hold, step, reset, stop, shapes, scene]   # clear, which ends the pushes of others, must be listed
# points: [tip, hub]          # names and ranges a..b of the scene; [] for none
# groups: []
# largest_force: 10           # [N] of each entry of a command
# largest_torque: 1           # [N m]
# slots: 4                    # slots 0 to 3: forces in several slots add
# commands_per_second: 200
)",
      id, digits.data());
  // creates the file with mode 0600, and only if it does not exist
  const Descriptor file(open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
  if (file.get() < 0)
    return path + ": " +
           (errno == EEXIST ? "the file exists already, and a key is never overwritten; name another file"
                            : std::string("the file cannot be written: ") + std::strerror(errno));
  const bool is_whole = write(file.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
                        fsync(file.get()) == 0;
  if (is_whole) return {};
  std::string fault = path + ": the file cannot be written: " + std::strerror(errno);
  unlink(path.c_str());
  return fault;
}

}  // namespace freeflex::service
