// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace slsd {

/// The longest name in an archive, in bytes, and the greatest number of files.
inline constexpr std::size_t kTarNameBytesMax = 99;
inline constexpr std::size_t kTarFilesMax = 4096;

/// One regular file of an archive; its bytes belong to the archive.
struct TarFile {
  std::string name;
  std::string_view bytes;
};

/// Tells whether one of our archives may contain a file of this name. It has parts of letters, digits, '.', '-' and
/// '_', separated by '/'; no part begins with '.'. So unpacking never leaves the target folder.
[[nodiscard]] bool plain_tar_name(std::string_view name);

/// Writes a tar archive (POSIX ustar) of regular files.
/// @thread thread-bound
class TarWriter {
 public:
  explicit TarWriter(std::chrono::system_clock::time_point time) : time_(time) {}

  /// @param name  a plain_tar_name(), used only once
  void add(std::string_view name, std::string_view bytes);
  [[nodiscard]] std::size_t bytes() const { return archive_.size(); }
  [[nodiscard]] std::string finish() &&;

 private:
  std::chrono::system_clock::time_point time_;
  std::string archive_;
};

/// Reads archives of TarWriter, and refuses everything that it would not write: links, devices, folders, other
/// dialects, names that repeat or are not plain_tar_name(), and files that are cut, damaged or too long.
/// @return  in the archive's order; the archive must outlive them
/// @errors kMalformed: cut, damaged, or no tar; kUnsupported: not written by TarWriter
/// @thread reentrant
[[nodiscard]] Result<std::vector<TarFile>> read_tar(std::string_view archive);

}  // namespace slsd
