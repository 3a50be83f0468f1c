#include "service/ingress_confinement.hpp"

#include <grp.h>
#include <linux/capability.h>
#include <pwd.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>

namespace freeflex::service {

namespace {

constexpr rlim_t kMostMemory = rlim_t{64} << 20;  // [B] largest private memory; one command takes about 30 kB

// a program with a sanitizer needs more memory and other system calls, so confine() then omits the limit of
// memory and the filter
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kIsInstrumented = true;
#elif defined(__has_feature)
constexpr bool kIsInstrumented = __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
constexpr bool kIsInstrumented = false;
#endif

using Capabilities = std::array<__user_cap_data_struct, 2>;
__user_cap_header_struct own_capabilities() { return {_LINUX_CAPABILITY_VERSION_3, 0}; }

bool has_rights_over_users() {
  __user_cap_header_struct header = own_capabilities();
  Capabilities data{};
  if (syscall(SYS_capget, &header, data.data()) != 0) return false;
  const auto has = [&data](unsigned number) { return (data[0].effective & (1u << number)) != 0; };
  return has(CAP_SETUID) && has(CAP_SETGID) && has(CAP_KILL);
}

bool become(const IngressUser& user) {
  if (user.uid == IngressUser::kSame) return true;
  const auto uid = static_cast<uid_t>(user.uid);
  const auto gid = static_cast<gid_t>(user.gid);
  // these calls fail if the user is not mapped in the user namespace
  return setgroups(0, nullptr) == 0 && setresgid(gid, gid, gid) == 0 && setresuid(uid, uid, uid) == 0;
}

void drop_capabilities() {
  __user_cap_header_struct header = own_capabilities();
  Capabilities none{};
  syscall(SYS_capset, &header, none.data());
}

void set_limit(__rlimit_resource resource, rlim_t most) {
  const rlimit limit{most, most};
  setrlimit(resource, &limit);
}

bool filter_calls() {
  const scmp_filter_ctx filter = seccomp_init(SCMP_ACT_KILL_PROCESS);
  if (filter == nullptr) return false;
  bool is_good = true;
  for (const int call :
       {SCMP_SYS(recvmsg), SCMP_SYS(poll), SCMP_SYS(clock_gettime), SCMP_SYS(getppid), SCMP_SYS(brk),
        SCMP_SYS(munmap), SCMP_SYS(mremap), SCMP_SYS(madvise), SCMP_SYS(futex), SCMP_SYS(restart_syscall),
        SCMP_SYS(rt_sigreturn), SCMP_SYS(exit), SCMP_SYS(exit_group)})
    is_good = is_good && seccomp_rule_add(filter, SCMP_ACT_ALLOW, call, 0) == 0;
  const scmp_arg_cmp is_not_executable{2, SCMP_CMP_MASKED_EQ, PROT_EXEC, 0};
  is_good = is_good &&
            seccomp_rule_add_array(filter, SCMP_ACT_ALLOW, SCMP_SYS(mmap), 1, &is_not_executable) == 0 &&
            seccomp_load(filter) == 0;
  seccomp_release(filter);
  return is_good;
}

}  // namespace

std::string find_ingress_user(const std::string& name, IngressUser& user) {
  user = {};
  const bool may_change = has_rights_over_users();
  if (name.empty() && !may_change) return {};
  const passwd* const found = getpwnam(name.empty() ? "nobody" : name.c_str());
  if (found == nullptr) return name.empty() ? "" : "--ingress-user " + name + ": there is no such user";
  if (!may_change) return "--ingress-user " + name + " needs root, or CAP_SETUID, CAP_SETGID and CAP_KILL";
  user = {found->pw_uid, found->pw_gid};
  return {};
}

std::string describe_lacks(std::uint32_t lacks) {
  std::string text;
  if ((lacks & kLacksUser) != 0) text = "could not change its user";
  if ((lacks & kLacksFilter) != 0)
    text += (text.empty() ? "" : " and ") + std::string("has no filter of system calls (seccomp)");
  return text;
}

std::uint32_t confine(const IngressUser& user) {
  std::uint32_t lacks = become(user) ? 0 : kLacksUser;
  drop_capabilities();
  // a change of user clears this setting, so the setting is made again
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  for (const __rlimit_resource none : {RLIMIT_CORE, RLIMIT_FSIZE, RLIMIT_NPROC, RLIMIT_MEMLOCK})
    set_limit(none, 0);
  set_limit(RLIMIT_NOFILE, 1);  // poll() fails if it is given more descriptors than this limit
  if constexpr (!kIsInstrumented) {
    set_limit(RLIMIT_DATA, kMostMemory);
    if (!filter_calls()) lacks |= kLacksFilter;
  }
  return lacks;
}

}  // namespace freeflex::service
