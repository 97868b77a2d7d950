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

/// Decodes a stranger's picture in a process of its own without rights (slsd-picture, by confine()), and believes of
/// its answer only what it has counted. It is killed at the end of the time.
/// @param png      a PNG file of 8 bits a channel, of exactly this size
/// @param until    the end of the time
/// @param program  slsd-picture
/// @errors kMalformed: damaged, or what decoded it died of it; kUnsupported: no PNG file; kMismatch: of another size,
/// or
///         of 16 bits; kInvalidArgument: declares too many pixels; kTimeout; kNotFound: not installed; kIo
/// @thread reentrant
[[nodiscard]] Result<Grey8> decode_apart(std::string_view png, int width_px, int height_px,
                                         std::chrono::steady_clock::time_point until,
                                         const std::filesystem::path& program);

/// Decodes the file as slsd-picture does. @errors as decode_apart() @thread reentrant
[[nodiscard]] Result<Grey8> decode_projected(std::string_view png, int width_px, int height_px);

// What the two say to one another: a line that is "ok", or an error's code and message; then the pixels, row by row.

[[nodiscard]] std::string answer_text(const Result<Grey8>& decoded);
/// @errors as they were written; kMalformed for what is no whole answer @thread reentrant
[[nodiscard]] Result<Grey8> read_answer(std::string_view answer, int width_px, int height_px);

}  // namespace slsd
