// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// Decodes an untrusted picture in a separate process without rights (slsd-picture, by confine()). Trusts only the size
/// that it counted itself in the answer. Kills the process when the time is over.
/// @param png      a PNG file of 8 bits per channel, of exactly this size
/// @param until    the end of the time
/// @param program  slsd-picture
/// @errors kMalformed: damaged, or its decoder died; kUnsupported: not a PNG file; kMismatch: another size, or 16 bits;
///         kInvalidArgument: declares too many pixels; kTimeout; kNotFound: not installed; kIo
/// @thread reentrant
[[nodiscard]] Result<Grey8> decode_in_process(std::string_view png, int width_px, int height_px,
                                              std::chrono::steady_clock::time_point until,
                                              const std::filesystem::path& program);

/// Decodes the file; slsd-picture calls this. @errors as decode_in_process() @thread reentrant
[[nodiscard]] Result<Grey8> decode_projected(std::string_view png, int width_px, int height_px);

// The messages between the two: a line with "ok", or with an error's code and message; then the pixels, row by row.

[[nodiscard]] std::string answer_text(const Result<Grey8>& decoded);
/// @errors those that were written; kMalformed for an incomplete answer @thread reentrant
[[nodiscard]] Result<Grey8> read_answer(std::string_view answer, int width_px, int height_px);

}  // namespace slsd
