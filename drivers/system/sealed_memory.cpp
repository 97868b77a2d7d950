// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/system/sealed_memory.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <string>

#include "drivers/system/system_error.hpp"

namespace slsd {
namespace {

FileDescriptor open_to_read(const FileDescriptor& memory) {
  const std::string path = "/proc/self/fd/" + std::to_string(memory.number());
  return FileDescriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
}

// Fills a memfd. After an error it takes no more.
class MemorySink final : public ByteSink {
 public:
  explicit MemorySink(const FileDescriptor& memory) : memory_(memory) {}
  void expect(std::size_t) override {}
  void take(std::string_view piece) override {
    while (error_ == 0 && !piece.empty()) {
      const ssize_t written = ::write(memory_.number(), piece.data(), piece.size());
      if (written < 0 && errno != EINTR) error_ = errno;
      if (written < 0) continue;
      piece.remove_prefix(static_cast<std::size_t>(written));
      bytes_ += static_cast<std::size_t>(written);
    }
  }
  [[nodiscard]] int error() const { return error_; }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  const FileDescriptor& memory_;
  int error_ = 0;
  std::size_t bytes_ = 0;
};

}  // namespace

Result<SealedMemory> sealed_memory(const std::function<void(ByteSink&)>& write) {
  const FileDescriptor memory(::memfd_create("slsd-cloud", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!memory) return fail_system(errno, "cannot create a memfd");
  MemorySink sink(memory);
  write(sink);
  if (sink.error() != 0) return fail_system(sink.error(), "cannot fill a memfd");
  if (::fcntl(memory.number(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE | F_SEAL_SEAL) != 0) {
    return fail_system(errno, "cannot seal a memfd");
  }
  // Opens the file twice more, because the first descriptor, open for writing, would prevent the lease.
  SealedMemory sealed{open_to_read(memory), open_to_read(memory), sink.bytes()};
  if (!sealed.given || !sealed.kept) return fail_system(errno, "cannot open a memfd for reading");
  return sealed;
}

Result<SealedMemory> sealed_memory(std::string_view bytes) {
  return sealed_memory([bytes](ByteSink& sink) { sink.take(bytes); });
}

// The kernel grants a write lease only to the sole opener of a file, and a mapping counts as an opening.
bool is_held_by_others(const FileDescriptor& kept) {
  if (::fcntl(kept.number(), F_SETLEASE, F_WRLCK) != 0) return errno == EAGAIN;
  ::fcntl(kept.number(), F_SETLEASE, F_UNLCK);
  return false;
}

}  // namespace slsd
