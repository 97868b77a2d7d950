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

/// The output files of a command line.
[[nodiscard]] std::vector<std::filesystem::path> outputs_of(const ClientOptions& options);

/// The stream for messages: standard output, or standard error if the result itself goes to standard output.
[[nodiscard]] std::ostream& words(const ClientOptions& options);

/// The format of a scan's cloud from --format or the file's extension: "ply", "pcd", "tiff", "stl", "obj" or "glb";
/// "ply" for standard output, and without a file. Empty: an unknown extension.
[[nodiscard]] std::string cloud_format(const ClientOptions& options);

/// Tells whether the scan's points are joined to triangles: by --mesh, or because the format knows nothing else.
[[nodiscard]] bool is_mesh(const ClientOptions& options);

/// The error in the names of the output files, found before any work; empty: none.
[[nodiscard]] std::string wrong_outputs(const ClientOptions& options, const std::string& command);

/// Checks that the files could be written now, so that no scan is taken in vain.
[[nodiscard]] tl::expected<void, Failure> check_outputs(const ClientOptions& options);

/// Writes a file, whole or not at all, or standard output. A failure means that the request failed, never that the
/// service is missing.
[[nodiscard]] tl::expected<void, Failure> write_output(const std::filesystem::path& file, std::string_view bytes);

/// Flushes the output of a command. @return its exit status; kRequestFailed if standard output did not accept all
[[nodiscard]] int finish(const ClientOptions& options, int exit_status);

}  // namespace slsd
