// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <filesystem>
#include <string_view>

#include "core/result.hpp"
#include "drivers/files/bayer.hpp"
#include "drivers/files/grey_image.hpp"

namespace slsd {

/// The options for reading an image file, and the limits of its cost.
struct ReadImageOptions {
  BayerPattern bayer = BayerPattern::kNone;    ///< meaning of a grey image's pixels; colour images ignore it
  std::size_t limit_file_bytes = 1u << 28;     ///< 256 MiB
  std::size_t limit_decoded_bytes = 1u << 28;  ///< 256 MiB of pixels, as the file's header declares them
};

/// Turns the bytes of a PNG, TIFF, PGM, PPM, BMP or JPEG file into grey. Colour becomes 0.299 R + 0.587 G + 0.114 B
/// (ITU-R BT.601), transparency is ignored. Values are kept, so that 10 bits in a 16-bit file stay below 1024; PGM and
/// PPM name their greatest value, and are scaled to the whole range. A file that ends early is an error and never a
/// half-grey image.
/// @param name  what the error calls the bytes
/// @errors kMalformed (empty, cut short, damaged), kUnsupported (another format, or a rare variant of one of these),
///         kInvalidArgument (larger than the limits)
/// @thread reentrant
[[nodiscard]] Result<GreyImage> decode_image(std::string_view bytes, std::string_view name,
                                             const ReadImageOptions& options = {});

/// Reads an image file. @errors as read_file() and decode_image() @thread reentrant
[[nodiscard]] Result<GreyImage> read_image(const std::filesystem::path& path, const ReadImageOptions& options = {});

}  // namespace slsd
