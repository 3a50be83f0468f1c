// Memory that the daemon shares with the ingress.
#pragma once

#include <cassert>
#include <cstddef>
#include <span>
#include <string>

namespace freeflex::service {

/// One block of memory that this process shares with the processes that it starts. The block is a file in
/// memory without a name, whose size is sealed. If `ulimit -f` forbids a file of this size, the block is a
/// System V segment, to which other processes of the same user could attach.
class SharedMemory {
 public:
  SharedMemory() = default;
  ~SharedMemory();
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  /// Makes memory that is filled with zeros, mapped in this process and writable by both sides. Returns an
  /// empty string, or the error.
  std::string make(std::size_t size);
  /// Makes a read-only copy of the bytes. If the copy is a file, this process cannot write to it either.
  /// Returns an empty string, or the error.
  std::string make_sealed(std::span<const std::byte> bytes);

  /// \pre make() succeeded
  void* address() const {
    assert(address_ != nullptr);
    return address_;
  }
  /// The descriptor of the file, or -1 for a segment.
  int fd() const { return fd_; }
  bool is_private() const { return fd_ >= 0; }
  /// Returns the command-line argument that tells a started process where this memory is. A file is inherited
  /// as descriptor `number`.
  std::string argument(int number) const;

 private:
  std::string make_segment(std::size_t size, std::span<const std::byte> bytes);

  int fd_ = -1;
  int segment_ = -1;
  void* address_ = nullptr;  // address of the memory in this process
  std::size_t size_ = 0;
};

/// The started process calls this function. Maps the memory that argument() describes and closes the
/// descriptor. Returns nullptr on failure.
void* attach_memory(const char* argument, std::size_t size, bool is_writable);

}  // namespace freeflex::service
