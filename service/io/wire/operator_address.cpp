#include "service/io/wire/operator_address.hpp"

#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace freeflex::service {
namespace {

struct Folder {
  std::string path;   // empty if not set
  std::string begin;  // first part of the name of a socket in the folder
  bool is_of_system = false;
  bool is_anybodys = false;  // true if any user may create a folder of this name
};

std::vector<Folder> folders(const OperatorRoots& roots) {
  const std::string uid = std::to_string(geteuid());
  return {{roots.runtime, "freeflexd-"},
          {roots.users + "/" + uid, "freeflexd-"},
          {.path = roots.system, .begin = "freeflexd-", .is_of_system = true},
          {.path = roots.temporary + "/freeflexd-" + uid, .begin = "", .is_anybodys = true}};
}

std::string socket_path(const Folder& folder, const std::string& prefix) {
  return folder.path + "/" + folder.begin + prefix + ".sock";
}

/// Returns an empty string if only this user can create a socket in the folder, else the fault.
/// \param takes_service  true: if this user is root, the system's folder may have any owner
std::string find_fault(const Folder& folder, bool takes_service) {
  if (folder.path.empty()) return "XDG_RUNTIME_DIR is not set";
  if (folder.path[0] != '/') return "XDG_RUNTIME_DIR '" + folder.path + "' does not begin with /";
  struct stat found {};
  // in a folder where anybody may create files, a symbolic link is refused, because the owner of the link
  // could redirect it
  const int result =
      folder.is_anybodys ? lstat(folder.path.c_str(), &found) : stat(folder.path.c_str(), &found);
  if (result != 0) return folder.path + ": " + std::strerror(errno);
  if (!S_ISDIR(found.st_mode)) return folder.path + " is not a folder";
  const bool is_of_service = takes_service && folder.is_of_system && geteuid() == 0;
  if (found.st_uid != geteuid() && !is_of_service)
    return folder.path + " belongs to user " + std::to_string(found.st_uid);
  if ((found.st_mode & 022) != 0) return "others may write to " + folder.path;
  return {};
}

}  // namespace

OperatorRoots operator_roots() {
  const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
  OperatorRoots roots;
  if (runtime != nullptr) roots.runtime = runtime;
  return roots;
}

OperatorPlace choose_operator_place(const std::string& prefix, const OperatorRoots& roots) {
  std::string faults;
  for (const Folder& folder : folders(roots)) {
    // if mkdir fails, find_fault() reports why
    if (folder.is_anybodys) mkdir(folder.path.c_str(), 0700);
    std::string fault = find_fault(folder, false);
    const std::string path = socket_path(folder, prefix);
    if (fault.empty() && unix_address(path)) return {path, ""};
    if (fault.empty()) fault = path + " has more than 107 characters";
    faults += (faults.empty() ? "" : "; ") + fault;
  }
  return {"", "no folder is suitable for the operator's socket: " + faults +
                  ". Set XDG_RUNTIME_DIR to a folder of this user with mode 700, or give --socket PATH "
                  "or --socket none"};
}

OperatorPlaces operator_places(const std::string& prefix, const OperatorRoots& roots) {
  OperatorPlaces places;
  for (const Folder& folder : folders(roots)) {
    const std::string fault = find_fault(folder, true);
    if (fault.empty())
      places.paths.push_back(socket_path(folder, prefix));
    else
      places.faults += (places.faults.empty() ? "" : "; ") + fault;
  }
  return places;
}

std::optional<sockaddr_un> unix_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) return {};
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  return address;
}

}  // namespace freeflex::service
