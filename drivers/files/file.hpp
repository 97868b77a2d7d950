// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace slsd {

/// The extension of a file's name, in lower case: ".ply" of "CLOUD.PLY".
/// @thread reentrant
[[nodiscard]] std::string lower_extension(const std::filesystem::path& file);

/// Reads a whole regular file.
/// @param limit_bytes  a longer file is refused before it is read
/// @errors kNotFound, kPermissionDenied, kInvalidArgument (a folder, a device, too long), kIo
/// @thread reentrant
[[nodiscard]] Result<std::string> read_file(const std::filesystem::path& path, std::size_t limit_bytes);

/// Writes a file so that a reader sees the old one or the new one, whole, whatever happens in between: a temporary file
/// beside it, synchronised, then renamed. Where the write fails nothing new is left behind. A symbolic link is
/// followed.
/// @errors kNotFound (its folder), kPermissionDenied, kNoSpace, kInvalidArgument (a folder, not a regular file), kIo
/// @thread reentrant
[[nodiscard]] Result<> write_file_atomically(const std::filesystem::path& path, std::string_view bytes);

/// Checks that write_file_atomically() would find a place there now, for those who work long before they write. It
/// writes a temporary file of 64 KiB. What is there stays as it is.
/// @errors as write_file_atomically(); a disk may still be too full for what is longer
[[nodiscard]] Result<> check_writable(const std::filesystem::path& path);

}  // namespace slsd
