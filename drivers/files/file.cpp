// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/files/file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <system_error>
#include <utility>

#include "drivers/system/file_descriptor.hpp"
#include "drivers/system/system_error.hpp"

namespace slsd {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kProbeBytes = 64 << 10;  // more than file systems store inside their own records

tl::unexpected<Error> fail_call(std::string_view doing, const fs::path& path) {
  return fail_system(errno, doing, path);
}

Result<> check_readable(const FileDescriptor& file, const fs::path& path, std::size_t limit_bytes) {
  struct stat status {};
  if (::fstat(file.number(), &status) != 0) return fail_call("cannot read", path);
  if (S_ISDIR(status.st_mode))
    return fail(ErrorCode::kInvalidArgument, "is a folder; name a file in it", path.string());
  if (!S_ISREG(status.st_mode)) return fail(ErrorCode::kInvalidArgument, "is not a regular file", path.string());
  if (static_cast<std::size_t>(status.st_size) > limit_bytes)
    return fail(ErrorCode::kInvalidArgument,
                "is " + std::to_string(status.st_size) + " bytes long, more than the limit of " +
                    std::to_string(limit_bytes) + " bytes",
                path.string());
  return {};
}

Result<std::string> read_to_end(const FileDescriptor& file, const fs::path& path, std::size_t limit_bytes) {
  struct stat status {};
  if (::fstat(file.number(), &status) != 0) return fail_call("cannot read", path);
  std::string bytes(static_cast<std::size_t>(status.st_size) + 1, '\0');
  std::size_t size = 0;
  while (true) {
    const ssize_t count = ::read(file.number(), bytes.data() + size, bytes.size() - size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return fail_call("cannot read", path);
    if (count == 0) break;
    size += static_cast<std::size_t>(count);
    if (size > limit_bytes) return fail(ErrorCode::kInvalidArgument, "grew beyond the size limit", path.string());
    if (size == bytes.size()) bytes.resize(2 * size);
  }
  bytes.resize(size);
  return bytes;
}

Result<> write_all(const FileDescriptor& file, std::string_view bytes, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(file.number(), bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return fail_call("cannot write", path);
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return {};
}

/// The type and the permissions of the file at the path now. A missing file counts as a regular one with the usual
/// permissions.
mode_t mode_of(const fs::path& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 ? status.st_mode : S_IFREG;
}

/// A name for a temporary file. Its length does not depend on the file's name, which may have the maximum length.
fs::path temporary_beside(const fs::path& path) {
  static std::atomic<unsigned> count{0};
  return path.parent_path() / (".slsd-" + std::to_string(::getpid()) + "-" + std::to_string(count++) + ".part");
}

Result<> write_temporary(const fs::path& temporary, const fs::path& path, mode_t mode, std::string_view bytes) {
  FileDescriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (!file) return fail_call("cannot write", path);
  const mode_t permissions = mode & 07777;
  if (permissions != 0 && ::fchmod(file.number(), permissions) != 0) return fail_call("cannot write", path);
  if (auto written = write_all(file, bytes, path); !written) return written;
  if (::fsync(file.number()) != 0) return fail_call("cannot write", path);
  if (const int error = file.close(); error != 0) return fail_system(error, "cannot write", path);
  return {};
}

/// Makes the new name survive a power cut. Not every file system can, so a failure is not an error.
void synchronise_folder_of(const fs::path& path) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  const FileDescriptor file(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (file) static_cast<void>(::fsync(file.number()));
}

Result<> replace_file(const fs::path& path, mode_t mode, std::string_view bytes) {
  const fs::path temporary = temporary_beside(path);
  Result<> done = write_temporary(temporary, path, mode, bytes);
  if (done && ::rename(temporary.c_str(), path.c_str()) != 0) done = fail_call("cannot write", path);
  if (!done) {
    ::unlink(temporary.c_str());
    return done;
  }
  synchronise_folder_of(path);
  return {};
}

/// The target of the links, whether it exists or not; for a cycle, one of the links.
fs::path follow_links(fs::path path) {
  constexpr int kLinksMax = 40;
  for (int i = 0; i < kLinksMax; ++i) {
    std::error_code no_link;
    const fs::path target = fs::read_symlink(path, no_link);
    if (no_link) break;
    path = path.parent_path() / target;
  }
  return path;
}

Result<> check_place(const fs::path& path, mode_t mode) {
  if (path.empty()) return fail(ErrorCode::kInvalidArgument, "the path of the file to write is empty");
  if (S_ISDIR(mode)) return fail(ErrorCode::kInvalidArgument, "is a folder; name a file in it", path.string());
  // Renaming would bypass the file's own write protection.
  const bool is_there = ::access(path.c_str(), F_OK) == 0;
  if (is_there && ::access(path.c_str(), W_OK) != 0) return fail_call("cannot write", path);
  return {};
}

Result<> write_in_place(const fs::path& path, std::string_view bytes) {
  const FileDescriptor file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
  if (!file) return fail_call("cannot write", path);
  return write_all(file, bytes, path);
}

}  // namespace

std::string lower_extension(const fs::path& file) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

Result<std::string> read_file(const fs::path& path, std::size_t limit_bytes) {
  // Without O_NONBLOCK, opening a pipe without a writer would block.
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file) return fail_call("cannot read", path);
  if (auto readable = check_readable(file, path, limit_bytes); !readable) return tl::unexpected(readable.error());
  return read_to_end(file, path, limit_bytes);
}

Result<> write_file_atomically(const fs::path& path, std::string_view bytes) {
  const mode_t mode = mode_of(path);
  if (auto place = check_place(path, mode); !place) return place;
  return S_ISREG(mode) ? replace_file(follow_links(path), mode, bytes) : write_in_place(path, bytes);
}

Result<> check_writable(const fs::path& path) {
  const mode_t mode = mode_of(path);
  if (auto place = check_place(path, mode); !place || !S_ISREG(mode)) return place;
  const fs::path target = follow_links(path), temporary = temporary_beside(target);
  Result<> done = write_temporary(temporary, target, mode, std::string(kProbeBytes, '\0'));
  ::unlink(temporary.c_str());
  return done;
}

Result<> make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return fail_system(error.value(), "cannot create the folder", folder);
  return {};
}

Result<> make_empty_folder(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder, error)) {
    const bool empty = fs::is_directory(folder, error) && fs::is_empty(folder, error);
    if (error) return fail_system(error.value(), "cannot read the folder", folder);
    if (!empty)
      return fail(ErrorCode::kAlreadyExists, "exists and is not an empty folder: name a new one", folder.string());
  }
  return make_folder(folder);
}

}  // namespace slsd
