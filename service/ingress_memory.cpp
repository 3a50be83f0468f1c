#include "service/ingress_memory.hpp"

#include <fcntl.h>
#include <sys/ipc.h>
#include <sys/mman.h>
#include <sys/shm.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "service/descriptors.hpp"

namespace freeflex::service {

namespace {

constexpr int kOwnerOnly = 0600;
constexpr char kSegmentMark = '#';  // precedes the id of a segment in argument()

void* const kNotAttached = reinterpret_cast<void*>(-1);  // result of shmat after an error

constexpr const char* kNoMemory = "there is no memory to share with the ingress process";

/// Makes a file of this size in memory, filled with zeros. Returns -1 and sets errno on failure.
int make_file(std::size_t size) {
  const int fd = move_up(memfd_create("freeflexd", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (fd < 0 || ftruncate(fd, static_cast<off_t>(size)) == 0) return fd;
  const int error = errno;
  close(fd);
  errno = error;
  return -1;
}

bool write_all(int fd, std::span<const std::byte> bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t size = pwrite(fd, bytes.data() + done, bytes.size() - done, static_cast<off_t>(done));
    if (size <= 0) return false;
    done += index(size);
  }
  return true;
}

}  // namespace

SharedMemory::~SharedMemory() {
  if (address_ != nullptr) fd_ >= 0 ? munmap(address_, size_) : shmdt(address_);
  if (fd_ >= 0) close(fd_);
}

std::string SharedMemory::make(std::size_t size) {
  size_ = size;
  fd_ = make_file(size);
  if (fd_ < 0) return make_segment(size, {});
  // the size is sealed, because a process that could shrink the file would kill the daemon with SIGBUS
  if (fcntl(fd_, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0)
    return call_fault(kNoMemory, "seals");
  void* const memory = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, 0);
  if (memory == MAP_FAILED) return call_fault(kNoMemory, "mmap");
  address_ = memory;
  return {};
}

std::string SharedMemory::make_sealed(std::span<const std::byte> bytes) {
  size_ = bytes.size();
  fd_ = make_file(bytes.size());
  if (fd_ < 0) return make_segment(bytes.size(), bytes);
  const int seals = F_SEAL_WRITE | F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;
  if (!write_all(fd_, bytes) || fcntl(fd_, F_ADD_SEALS, seals) != 0) return call_fault(kNoMemory, "seals");
  return {};
}

std::string SharedMemory::make_segment(std::size_t size, std::span<const std::byte> bytes) {
  segment_ = shmget(IPC_PRIVATE, size, kOwnerOnly);
  if (segment_ < 0) return call_fault(kNoMemory, "shmget");
  void* const memory = shmat(segment_, nullptr, 0);
  const int error = errno;
  // the system removes the segment when the last process detaches, but until then Linux lets others attach to
  // the segment
  shmctl(segment_, IPC_RMID, nullptr);
  errno = error;
  if (memory == kNotAttached) return call_fault(kNoMemory, "shmat");
  address_ = memory;
  if (!bytes.empty()) std::memcpy(memory, bytes.data(), bytes.size());
  return {};
}

std::string SharedMemory::argument(int number) const {
  return fd_ >= 0 ? std::to_string(number) : kSegmentMark + std::to_string(segment_);
}

void* attach_memory(const char* argument, std::size_t size, bool is_writable) {
  if (argument[0] == kSegmentMark) {
    void* const memory = shmat(std::atoi(argument + 1), nullptr, is_writable ? 0 : SHM_RDONLY);
    return memory == kNotAttached ? nullptr : memory;
  }
  const int fd = std::atoi(argument);
  void* const memory =
      mmap(nullptr, size, is_writable ? PROT_READ | PROT_WRITE : PROT_READ, MAP_SHARED, fd, 0);
  close(fd);
  return memory == MAP_FAILED ? nullptr : memory;
}

}  // namespace freeflex::service
