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

/// Writes a file so that a reader always sees the whole old one or the whole new one. Writes a temporary file beside
/// it, synchronises it, then renames it. On failure, no new file remains. Follows a symbolic link.
/// @errors kNotFound (no such folder), kPermissionDenied, kNoSpace, kInvalidArgument (a folder, not a regular file),
///         kIo
/// @thread reentrant
[[nodiscard]] Result<> write_file_atomically(const std::filesystem::path& path, std::string_view bytes);

/// Checks that write_file_atomically() would succeed now, for callers that work long before they write. Writes a
/// temporary file of 64 KiB. Leaves an existing file unchanged.
/// @errors as write_file_atomically(); a longer file may still not fit on the disk
[[nodiscard]] Result<> check_writable(const std::filesystem::path& path);

/// Makes a folder, and those above it, unless it is there. @errors kPermissionDenied, kNoSpace, kIo
[[nodiscard]] Result<> make_folder(const std::filesystem::path& folder);

/// Makes a folder in which nothing lies yet. @errors kAlreadyExists: something lies there; as make_folder()
[[nodiscard]] Result<> make_empty_folder(const std::filesystem::path& folder);

}  // namespace slsd
