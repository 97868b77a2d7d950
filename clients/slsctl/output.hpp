// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "clients/slsctl/ask.hpp"
#include "clients/slsctl/client_options.hpp"

namespace slsd {

/// Tells whether a file to write is "-".
[[nodiscard]] bool is_standard_output(const std::filesystem::path& file);

/// The files that a command line names to be written.
[[nodiscard]] std::vector<std::filesystem::path> outputs_of(const ClientOptions& options);

/// The stream for words: standard output, or standard error if the result itself goes to standard output.
[[nodiscard]] std::ostream& words(const ClientOptions& options);

/// The format of a scan's cloud, by --format or the end of the file's name: "ply", "pcd" or "tiff"; "ply" for standard
/// output, and if there is no file. Empty: the name ends in none of them.
[[nodiscard]] std::string cloud_format(const ClientOptions& options);

/// The fault in the names of the files to write, before anything is done; empty: none.
[[nodiscard]] std::string wrong_outputs(const ClientOptions& options, const std::string& command);

/// Checks that the files could be written now; a scan that cannot be kept is not begun.
[[nodiscard]] tl::expected<void, Failure> check_outputs(const ClientOptions& options);

/// Writes a file, whole or not at all, or to standard output. If that fails the request failed; it never means that
/// there is no service.
[[nodiscard]] tl::expected<void, Failure> write_output(const std::filesystem::path& file, std::string_view bytes);

/// Flushes what a command printed. @return its exit status; kRequestFailed if standard output took not all of it
[[nodiscard]] int finish(const ClientOptions& options, int exit_status);

}  // namespace slsd
