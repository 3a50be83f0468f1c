// Memory that the daemon shares with the ingress.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace freeflex::service {

/// One block of memory for this process and those that it starts. A file in memory without a name, sealed in
/// its size. Where `ulimit -f` refuses so large a file: a System V segment, which other processes of the same
/// user could attach.
class SharedMemory {
 public:
  SharedMemory() = default;
  ~SharedMemory();
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  /// Zeroed and mapped here, to be written by both sides. Empty, or why not.
  std::string make(std::size_t size);
  /// A copy of the bytes that nobody can write to, not even this process. Empty, or why not.
  std::string make_sealed(std::span<const std::byte> bytes);

  /// \pre make
  void* address() const { return address_; }
  /// -1 for a segment.
  int fd() const { return fd_; }
  bool is_private() const { return fd_ >= 0; }
  /// How a process that is started with this memory as descriptor number finds it.
  std::string argument(int number) const;

 private:
  std::string make_segment(std::size_t size, std::span<const std::byte> bytes);

  int fd_ = -1;
  int segment_ = -1;
  void* address_ = nullptr;  // mapped here
  std::size_t size_ = 0;
};

/// The other side: maps what argument() said. Null when it cannot. Closes the descriptor.
void* attach_memory(const char* argument, std::size_t size, bool is_writable);

}  // namespace freeflex::service
