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

/// The longest name in an archive, in bytes, and how many files one may have.
inline constexpr std::size_t kTarNameBytesMax = 99;
inline constexpr std::size_t kTarFilesMax = 4096;

/// One regular file of an archive; its bytes are the archive's.
struct TarFile {
  std::string name;
  std::string_view bytes;
};

/// Tells whether a file may have this name in an archive of ours: parts of letters, digits, '.', '-' and '_' with '/'
/// between them. No part begins with '.'. Such a name stays below the folder that it is unpacked into.
[[nodiscard]] bool plain_tar_name(std::string_view name);

/// Writes a tar archive (POSIX ustar) of regular files.
/// @thread thread-bound
class TarWriter {
 public:
  explicit TarWriter(std::chrono::system_clock::time_point time) : time_(time) {}

  /// @param name  plain_tar_name(), told once
  void add(std::string_view name, std::string_view bytes);
  [[nodiscard]] std::size_t bytes() const { return archive_.size(); }
  [[nodiscard]] std::string finish() &&;

 private:
  std::chrono::system_clock::time_point time_;
  std::string archive_;
};

/// Reads what TarWriter wrote, and refuses all that it would not have: links, devices, folders, names that are not
/// plain_tar_name() or come twice, other dialects, and whatever is cut, damaged or goes on behind its end.
/// @return  in the archive's order; it has to outlive them
/// @errors kMalformed: cut, damaged, or no tar; kUnsupported: what we would not have written
/// @thread reentrant
[[nodiscard]] Result<std::vector<TarFile>> read_tar(std::string_view archive);

}  // namespace slsd
